//! Trees from the XML of BehaviorTree.CPP 4.

mod attributes;
mod boards;
mod document;
mod files;
mod loops;
mod operations;

use std::path::Path;

use attributes::{Attributes, pointer};
use boards::{Boards, TreeBoard};
use document::{TreeDocument, TreeSource};
use files::{TreeText, parsed};
use operations::{OPERATIONS, operation};
use roxmltree::Node;
use slate_blackboard::nearest_names;

use crate::error::TreeError;
use crate::model::{LeafKind, LeafModels};
use crate::ports::PortBinding;
use crate::tree::{BehaviorNode, BehaviorTree, LoopQueue, NodeOperation, TreeLeaf, TreeLoop};
use crate::value::BoardValue;

/// Maximum number of nodes of a tree, those of sub-trees included.
const MOST_NODES: usize = 10_000;
/// Maximum number of bytes of paths, attributes and defaults.
/// Those of sub-trees are included.
const MOST_TEXT: usize = 16 << 20;
/// Deepest nesting of nodes, those of sub-trees included.
const DEPTH: usize = 64;

impl BehaviorTree {
    /// Reads a tree from a file, and from those that it includes.
    ///
    /// `models` has the actions and conditions that their own models lack.
    pub fn read(file: &Path, models: &LeafModels) -> Result<Self, TreeError> {
        build(&TreeText::read(file)?, true, models).map_err(|error| error.of_file(file))
    }

    /// Reads a tree from the bytes of a file in UTF-8, which includes no other.
    pub fn parse(bytes: &[u8], models: &LeafModels) -> Result<Self, TreeError> {
        build(&[TreeText::parse(bytes)?], false, models)
    }
}

fn build(texts: &[TreeText], is_file: bool, models: &LeafModels) -> Result<BehaviorTree, TreeError> {
    let mut sources = Vec::with_capacity(texts.len());
    for TreeText { included, text } in texts {
        let document = parsed(text).map_err(|error| match included {
            Some(file) => error.of_file(file),
            None => error,
        })?;
        sources.push(TreeSource::new(included.as_deref(), text, document));
    }
    let read = TreeDocument::read(&sources, is_file, models)?;
    let mut builder = TreeBuilder {
        document: &read,
        boards: Boards::default(),
        nodes: Vec::new(),
        leaves: Vec::new(),
        text: 0,
    };
    let board = builder.boards.add(TreeBoard::default());
    let place = NodePlace { board, path: read.main.to_owned(), depth: 0 };
    builder.tree(read.main, &place, &mut Vec::new())?;
    let tree = BehaviorTree {
        name: read.main.into(),
        fingerprint: fingerprint(texts),
        monitor_xml: Err(0),
        nodes: builder.nodes,
        leaves: builder.leaves,
        entries: builder.boards.entries,
        entry_names: builder.boards.names,
        initial: builder.boards.initial,
        enumerations: models.enumerations().clone(),
    };
    Ok(tree.with_monitor_xml())
}

/// Returns the FNV-1a hash of all files.
fn fingerprint(texts: &[TreeText]) -> u64 {
    let bytes = texts.iter().flat_map(|own| own.text.bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// Position in the tree at which nodes are added.
struct NodePlace {
    board: usize,
    /// Names of the sub-trees that lead here.
    path: String,
    depth: usize,
}

struct TreeBuilder<'a, 'b> {
    document: &'b TreeDocument<'a>,
    boards: Boards,
    nodes: Vec<BehaviorNode>,
    leaves: Vec<TreeLeaf>,
    /// Number of text bytes of the nodes so far.
    text: usize,
}

impl<'a> TreeBuilder<'a, '_> {
    /// Adds the nodes of a tree that the file has; returns the first one.
    fn tree(&mut self, id: &'a str, place: &NodePlace, above: &mut Vec<&'a str>) -> Result<usize, TreeError> {
        let document = self.document;
        let root = document.trees.get(id).and_then(Node::first_element_child);
        // The document has checked both.
        let root = root.ok_or_else(|| TreeError::new(format!("no tree has the ID `{id}`")))?;
        above.push(id);
        let mut number = 0;
        let node = self.node(root, place, &mut number, above);
        above.pop();
        node
    }

    /// Adds a node and those below; returns its index.
    fn node(
        &mut self,
        element: Node<'a, 'a>,
        place: &NodePlace,
        number: &mut usize,
        above: &mut Vec<&'a str>,
    ) -> Result<usize, TreeError> {
        let document = self.document;
        if place.depth >= DEPTH {
            return Err(document.error(element, format!("expected at most {DEPTH} levels of nodes")));
        }
        if self.nodes.len() >= MOST_NODES {
            return Err(
                document.error(element, format!("expected at most {MOST_NODES} nodes with all sub-trees"))
            );
        }
        // Attributes are kept as ports and for monitors.
        let text = element.attributes().map(|attribute| attribute.value().len() + attribute.name().len());
        self.charge(element, place.path.len() + 2 * text.sum::<usize>())?;
        let index = self.nodes.len();
        let (tag, mut operation) = self.operation(element, place, index)?;
        let mut attributes = Attributes::new(document, &mut self.boards, place.board, element);
        let scripts = attributes.scripts()?;
        let name = element.attribute("name").unwrap_or(tag);
        let path = format!("{}/{number} {name}", place.path);
        *number += 1;
        if let NodeOperation::Loop(TreeLoop { queue: LoopQueue::Entry { kept, .. }, .. }) = &mut operation {
            *kept = self.boards.own_entry(&path, "queue");
        }
        let is_sub_tree = operation == NodeOperation::SubTree;
        self.nodes.push(BehaviorNode {
            tag: tag.into(),
            name: name.into(),
            path,
            line: document.line(element),
            file: document.file(element).map(Into::into),
            depth: place.depth,
            operation,
            children: Vec::new(),
            attributes: shown_attributes(element),
            scripts,
        });
        let inner = NodePlace { board: place.board, path: place.path.clone(), depth: place.depth + 1 };
        if is_sub_tree {
            let child = self.sub_tree(element, tag, place, index, above)?;
            self.nodes[index].children.push(child);
            return Ok(index);
        }
        for child in element.children().filter(Node::is_element) {
            let child = self.node(child, &inner, number, above)?;
            self.nodes[index].children.push(child);
        }
        self.check_children(element, index)?;
        Ok(index)
    }

    /// Checks the number of children of a node, and what its ports say of it.
    fn check_children(&self, element: Node<'a, 'a>, index: usize) -> Result<(), TreeError> {
        let BehaviorNode { operation, children, tag, .. } = &self.nodes[index];
        let (expected, count) = (operation.children(), children.len());
        if expected.contains(&count) {
            let mut literals = operation.literal_counts().into_iter().flatten();
            return match literals.find(|(_, number)| *number > count as f64) {
                None => Ok(()),
                Some((port, number)) => {
                    Err(self.document.error(element, too_many_children(count, port, number)))
                }
            };
        }
        let expected = match (*expected.start(), *expected.end()) {
            (0, 0) => "no child".into(),
            (1, 1) => "one child".into(),
            (least, usize::MAX) => format!("at least {least} child"),
            (least, most) if least == most => {
                format!("{least} children (one for each case, and the default)")
            }
            (least, most) => format!("{least} or {most} children"),
        };
        Err(self.document.error(element, format!("expected {expected} of `{tag}`, found {count}")))
    }

    /// Counts text, which sub-trees repeat.
    fn charge(&mut self, element: Node<'a, 'a>, bytes: usize) -> Result<(), TreeError> {
        self.text += bytes;
        match self.text <= MOST_TEXT {
            true => Ok(()),
            false => Err(self.document.error(
                element,
                format!("expected at most {MOST_TEXT} bytes of names and attributes with all sub-trees"),
            )),
        }
    }

    /// Returns what an element is called, and does.
    fn operation(
        &mut self,
        element: Node<'a, 'a>,
        place: &NodePlace,
        index: usize,
    ) -> Result<(&'a str, NodeOperation), TreeError> {
        let document = self.document;
        let element_tag = element.tag_name().name();
        let explicit = match element_tag {
            "Action" => Some(LeafKind::Action),
            "Condition" => Some(LeafKind::Condition),
            _ => None,
        };
        let has_id = matches!(element_tag, "Action" | "Condition" | "Control" | "Decorator" | "SubTree");
        let tag = if has_id { document.attribute(element, "ID")? } else { element_tag };
        if element_tag == "SubTree" {
            return Ok((tag, NodeOperation::SubTree));
        }
        let mut attributes = Attributes::new(document, &mut self.boards, place.board, element);
        if let Some(operation) = operation(tag, &mut attributes)? {
            if let [(port, _), ..] = attributes.rest()[..] {
                return Err(document.error(element, format!("`{tag}` has no port `{port}`")));
            }
            return Ok((tag, operation));
        }
        let model = document.models.get(tag);
        let kind = match (explicit, model) {
            (Some(kind), Some(model)) if kind != model.kind => {
                let expected = if model.kind == LeafKind::Action { "an action" } else { "a condition" };
                return Err(
                    document.error(element, format!("expected `{tag}` as {expected}, as its model says"))
                );
            }
            (Some(kind), _) => kind,
            (None, Some(model)) => model.kind,
            (None, None) => {
                let known = OPERATIONS.into_iter().chain(document.models.names());
                let near = nearest_names(tag, known).first().map(|near| format!("did you mean `{near}`? "));
                return Err(document.error(
                    element,
                    format!(
                        "unknown node `{tag}`: {}expected a node of BehaviorTree.CPP, or one of `TreeNodesModel`; \
                         write `<Action ID=\"{tag}\"/>` for an action without a model",
                        near.unwrap_or_default()
                    ),
                ));
            }
        };
        let ports = attributes.leaf_ports(model)?;
        let defaults = model.and_then(|model| model.ports.as_ref()).into_iter().flatten();
        let text = defaults.map(|port| port.name.len() + port.default.as_ref().map_or(0, String::len));
        self.charge(element, text.sum())?;
        self.leaves.push(TreeLeaf { kind, id: tag.into(), node: index, ports });
        Ok((tag, NodeOperation::Leaf(self.leaves.len() - 1)))
    }

    /// Adds the nodes of a sub-tree below its node; returns the first one.
    fn sub_tree(
        &mut self,
        element: Node<'a, 'a>,
        id: &'a str,
        place: &NodePlace,
        index: usize,
        above: &mut Vec<&'a str>,
    ) -> Result<usize, TreeError> {
        let document = self.document;
        if !document.trees.contains_key(id) {
            let known = document.trees.keys().copied().collect::<Vec<_>>().join(", ");
            return Err(document.error(element, format!("unknown sub-tree `{id}`; the file has: {known}")));
        }
        if above.contains(&id) {
            let path = above.join(" > ");
            let reason = format!("a sub-tree can't be a part of itself: {path} leads back to `{id}`");
            return Err(document.error(element, reason));
        }
        if element.has_children() && element.children().any(|child| child.is_element()) {
            return Err(document.error(element, format!("expected no child of the sub-tree `{id}`")));
        }
        let path = self.nodes[index].path.clone();
        let mut board = TreeBoard { parent: Some(place.board), path: path.clone(), ..TreeBoard::default() };
        let open = element.attribute("_autoremap").unwrap_or("false");
        board.is_open = match BoardValue::Text(open.into()).truth() {
            Some(open) => open,
            None => {
                let reason = format!("expected `true` or `false` in `_autoremap`, found `{open}`");
                return Err(document.error(element, reason));
            }
        };
        let mut attributes = Attributes::new(document, &mut self.boards, place.board, element);
        let mut ports: Vec<(&str, String)> =
            attributes.rest().into_iter().map(|(name, text)| (name, text.to_owned())).collect();
        for (name, default) in document.sub_trees.get(id).into_iter().flatten() {
            if board.is_open || ports.iter().any(|(own, _)| own == name) {
                continue;
            }
            match default {
                Some(default) => ports.push((name, default.clone())),
                None => {
                    return Err(
                        document.error(element, format!("expected the port `{name}` of the sub-tree `{id}`"))
                    );
                }
            }
        }
        self.charge(element, ports.iter().map(|(name, text)| name.len() + text.len()).sum())?;
        for (name, text) in ports {
            match pointer(name, &text) {
                Some(outer) => {
                    board.remapped.insert(name.into(), outer.into());
                }
                None => {
                    board.own.insert(name.into(), BoardValue::parse(&text));
                }
            }
        }
        let board = self.boards.add(board);
        self.tree(id, &NodePlace { board, path, depth: place.depth + 1 }, above)
    }
}

/// Attributes that monitors show.
fn shown_attributes(element: Node<'_, '_>) -> Vec<(String, String)> {
    let hidden = ["ID", "name", "_uid", "_fullpath"];
    let shown = element.attributes().filter(|attribute| !hidden.contains(&attribute.name()));
    shown.map(|attribute| (attribute.name().into(), attribute.value().into())).collect()
}

/// Returns the error of a count of children that a parallel node doesn't have.
pub(crate) fn too_many_children(count: usize, port: &str, number: f64) -> String {
    format!("expected at most the number of children, {count}, in the port `{port}`, found {number}")
}

/// Returns a literal for computation: a number if it is valid as one.
fn computable(binding: PortBinding) -> PortBinding {
    match binding {
        PortBinding::Literal(BoardValue::Text(text)) => PortBinding::Literal(BoardValue::parse(&text)),
        other => other,
    }
}
