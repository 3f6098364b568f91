//! PNML as the editors of Petri Net Plans write it.

use std::borrow::Cow;
use std::fmt::Write;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use roxmltree::{Document, Node, NodeId};
use slate_sorted::SortedMap;

use crate::builder::{MOST_PARTS, NetBuilder, NodeLabel};
use crate::error::NetError;
use crate::net::PetriNet;

/// Greatest size of a file, bytes.
const MOST_BYTES: u64 = 16 << 20;

/// Reads a net from a file.
/// Its name is that of the file up to the first dot, or that of a comment `PLAN NAME: x`.
pub fn read_pnml(file: &Path) -> Result<PetriNet, NetError> {
    let unreadable = |error: std::io::Error| NetError::new(format!("can't be read: {error}")).of_file(file);
    let refused = |reason: String| Err(NetError::new(reason).of_file(file));
    if !std::fs::metadata(file).map_err(unreadable)?.is_file() {
        return refused("expected a file".into());
    }
    let mut bytes = Vec::new();
    let opened = File::open(file).map_err(unreadable)?;
    opened.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > MOST_BYTES {
        return refused(format!("expected a file of at most {MOST_BYTES} bytes"));
    }
    let name = file.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    parse_pnml(name.split('.').next().unwrap_or(name), &bytes).map_err(|error| error.of_file(file))
}

/// Reads a net from the bytes of a file.
/// They are in UTF-8 or, where the file declares it, ISO-8859-1.
pub fn parse_pnml(name: &str, bytes: &[u8]) -> Result<PetriNet, NetError> {
    let text = decode(bytes)?;
    let document = Document::parse(&text).map_err(|error| {
        let line = error.pos().row as usize;
        NetError::at(line, format!("expected XML: {error}"))
    })?;
    let lines = text.match_indices('\n').map(|(at, _)| at).collect();
    let mut reader =
        PnmlReader { document: &document, lines, nodes: SortedMap::new(), builder: NetBuilder::new(name) };
    reader.read()?;
    reader.builder.finish()
}

fn decode(bytes: &[u8]) -> Result<Cow<'_, str>, NetError> {
    let head: String = bytes.iter().take(200).map(|byte| byte.to_ascii_lowercase() as char).collect();
    let head = head.split("?>").next().unwrap_or_default();
    if head.starts_with("<?xml") && (head.contains("iso-8859-1") || head.contains("latin1")) {
        return Ok(bytes.iter().map(|byte| *byte as char).collect::<String>().into());
    }
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let line = bytes[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n').count() + 1;
        NetError::at(
            line,
            "expected UTF-8, or a declaration such as encoding=\"ISO-8859-1\" in the first line",
        )
    })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text).into())
}

/// Node of the net by its identifier.
#[derive(Clone, Copy)]
enum NetNode {
    Place(usize),
    Transition(usize),
}

struct PnmlReader<'a, 'input> {
    document: &'a Document<'input>,
    /// Positions of line ends.
    lines: Vec<usize>,
    nodes: SortedMap<&'a str, NetNode>,
    builder: NetBuilder,
}

impl<'a> PnmlReader<'a, '_> {
    fn read(&mut self) -> Result<(), NetError> {
        let document = self.document;
        let root = document.root_element();
        if root.tag_name().name() != "pnml" {
            let reason = format!("expected the root element `pnml`, found `{}`", root.tag_name().name());
            return Err(self.error(root, reason));
        }
        let mut nets = root.children().filter(|child| child.has_tag_name_any("net"));
        let net = nets.next().ok_or_else(|| self.error(root, "expected an element `net` in `pnml`"))?;
        if let Some(second) = nets.next() {
            return Err(self.error(second, "expected one `net`, found a second one"));
        }
        for comment in document.root().descendants().filter(Node::is_comment) {
            let name = comment.text().and_then(|text| text.trim().strip_prefix("PLAN NAME:"));
            if let Some(name) = name.map(str::trim).filter(|name| !name.is_empty()) {
                self.builder.name = name.into();
            }
        }
        if net.children().count() > 8 * MOST_PARTS {
            return Err(self.error(net, format!("expected at most {MOST_PARTS} places and transitions")));
        }
        for place in net.children().filter(|child| child.has_tag_name_any("place")) {
            self.place(place)?;
        }
        for transition in net.children().filter(|child| child.has_tag_name_any("transition")) {
            let part = self.part(transition)?;
            let index = self.builder.transitions.len();
            self.enter(transition, NetNode::Transition(index))?;
            self.builder.transitions.push((part, Vec::new(), Vec::new()));
        }
        for arc in net.children().filter(|child| child.has_tag_name_any("arc")) {
            self.arc(arc)?;
        }
        Ok(())
    }

    fn place(&mut self, node: Node<'a, '_>) -> Result<(), NetError> {
        let tokens = self.count(node, "initialMarking", 0)?;
        let part = self.part(node)?;
        self.enter(node, NetNode::Place(self.builder.places.len()))?;
        self.builder.places.push((part, tokens));
        Ok(())
    }

    fn part(&self, node: Node<'a, '_>) -> Result<NodeLabel, NetError> {
        let id = self.attribute(node, "id")?.to_owned();
        let name = value(node, "name").map(|(_, text)| text).unwrap_or_default();
        Ok(NodeLabel { id, name: name.into_owned(), line: Some(self.line(node.id())) })
    }

    fn enter(&mut self, node: Node<'a, '_>, entry: NetNode) -> Result<(), NetError> {
        let id = self.attribute(node, "id")?;
        match self.nodes.insert(id, entry) {
            None => Ok(()),
            Some(_) => Err(self.error(node, format!("expected a new id, found `{id}` a second time"))),
        }
    }

    fn arc(&mut self, node: Node<'a, '_>) -> Result<(), NetError> {
        let weight = self.count(node, "inscription", 1)?;
        if weight == 0 {
            return Err(self.error(node, "expected an arc's weight of at least 1, found 0"));
        }
        let end = |name: &str| {
            let id = self.attribute(node, name)?;
            let found = self.nodes.get(id).copied();
            found.ok_or_else(|| {
                let expected = "expected the id of a place or a transition";
                self.error(node, format!("the arc's {name} is `{id}`, {expected}"))
            })
        };
        match (end("source")?, end("target")?) {
            (NetNode::Place(place), NetNode::Transition(transition)) => {
                self.builder.transitions[transition].1.push((place, weight));
            }
            (NetNode::Transition(transition), NetNode::Place(place)) => {
                self.builder.transitions[transition].2.push((place, weight));
            }
            (NetNode::Place(_), NetNode::Place(_)) => {
                return Err(
                    self.error(node, "expected an arc between a place and a transition, found two places")
                );
            }
            (NetNode::Transition(_), NetNode::Transition(_)) => {
                let reason = "expected an arc between a place and a transition, found two transitions";
                return Err(self.error(node, reason));
            }
        }
        Ok(())
    }

    /// Returns a number such as `1` or `Default,1` of an element.
    fn count(&self, node: Node<'a, '_>, name: &str, missing: u32) -> Result<u32, NetError> {
        let Some((element, text)) = value(node, name) else { return Ok(missing) };
        let number = text.trim();
        let number = number.strip_prefix("Default,").unwrap_or(number).trim();
        number.parse().map_err(|_| {
            let reason =
                format!("expected a number of tokens in `{name}`, such as `1`, found `{}`", text.trim());
            self.error(element, reason)
        })
    }

    fn attribute(&self, node: Node<'a, '_>, name: &str) -> Result<&'a str, NetError> {
        node.attribute(name).ok_or_else(|| {
            self.error(node, format!("expected the attribute `{name}` of `{}`", node.tag_name().name()))
        })
    }

    fn line(&self, node: NodeId) -> usize {
        let start = self.document.get_node(node).map_or(0, |node| node.range().start);
        self.lines.partition_point(|end| *end < start) + 1
    }

    fn error(&self, node: Node<'_, '_>, reason: impl Into<String>) -> NetError {
        NetError::at(self.line(node.id()), reason)
    }
}

trait AnyNamespace {
    /// Returns true if it is an element of this name, in any namespace.
    fn has_tag_name_any(&self, name: &str) -> bool;
}

impl AnyNamespace for Node<'_, '_> {
    fn has_tag_name_any(&self, name: &str) -> bool {
        self.is_element() && self.tag_name().name() == name
    }
}

/// Returns the text of `name/value`, which other dialects call `name/text`.
fn value<'a, 'input>(node: Node<'a, 'input>, name: &str) -> Option<(Node<'a, 'input>, Cow<'a, str>)> {
    let outer = node.children().find(|child| child.has_tag_name_any(name))?;
    let inner =
        outer.children().find(|child| child.has_tag_name_any("value") || child.has_tag_name_any("text"))?;
    let mut texts = inner.children().filter(Node::is_text).filter_map(|text| text.text());
    let first = texts.next().unwrap_or_default();
    let rest: String = texts.collect();
    Some((inner, if rest.is_empty() { first.into() } else { format!("{first}{rest}").into() }))
}

/// Writes a net, such that [`parse_pnml`] reads the same.
pub fn write_pnml(net: &PetriNet) -> String {
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<pnml>\n<!-- PLAN NAME: {} -->\n<net id=\"n1\" type=\"PTNet\">\n",
        // A comment ends at two hyphens.
        net.name().replace("--", "- -").replace("--", "- -")
    );
    // Writing into a string can't fail.
    for place in net.places() {
        let _ = writeln!(
            text,
            "<place id=\"{}\"><name><value>{}</value></name><initialMarking><value>{}</value></initialMarking></place>",
            escaped(&place.id),
            escaped(&place.name),
            place.initial
        );
    }
    for transition in net.transitions() {
        let (id, name) = (escaped(&transition.id), escaped(&transition.name));
        let _ = writeln!(text, "<transition id=\"{id}\"><name><value>{name}</value></name></transition>");
    }
    let mut number = 0;
    let mut arc = |source: &str, target: &str, weight: u32| {
        number += 1;
        let (source, target) = (escaped(source), escaped(target));
        let _ = writeln!(
            text,
            "<arc id=\"a{number}\" source=\"{source}\" target=\"{target}\"><inscription><value>{weight}</value>\
             </inscription></arc>"
        );
    };
    for transition in net.transitions() {
        for (place, weight) in &transition.inputs {
            arc(&net.places()[*place].id, &transition.id, *weight);
        }
        for (place, weight) in &transition.outputs {
            arc(&transition.id, &net.places()[*place].id, *weight);
        }
    }
    text.push_str("</net>\n</pnml>\n");
    text
}

fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;");
    text.replace('\n', "&#10;").replace('\r', "&#13;").replace('\t', "&#9;")
}
