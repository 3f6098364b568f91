//! Trees as monitors such as Groot2 show them.

use slate_sorted::SortedSet;

use crate::model::{LeafKind, PortDirection};
use crate::tree::{BehaviorTree, NodeOperation};

/// Maximum length of the XML for monitors, bytes.
/// Sub-trees repeat parts that a file has once.
const MOST_XML: usize = 1 << 20;

impl BehaviorTree {
    /// Returns the XML of the tree with the numbers of its nodes.
    /// BehaviorTree.CPP gives it to monitors in this form.
    ///
    /// A node has the number of its index in [`nodes`](Self::nodes) plus 1 as `_uid`. Each use of a sub-tree has an
    /// element `BehaviorTree` of its own, whose `_fullpath` is the path of the node.
    ///
    /// # Errors
    /// The number of its bytes, if it has more than 1 MiB.
    pub fn monitor_xml(&self) -> Result<&str, usize> {
        self.monitor_xml.as_deref().map_err(|size| *size)
    }

    /// Writes the XML once, as a caller may be in a cycle of control.
    pub(crate) fn with_monitor_xml(mut self) -> Self {
        let mut xml = XmlText::default();
        xml.push("<root BTCPP_format=\"4\"");
        xml.attribute("main_tree_to_execute", &self.name);
        xml.push(">\n");
        self.write_tree(&mut xml, &self.name, "", 0);
        let uses = self.nodes.iter().filter(|node| node.operation == NodeOperation::SubTree);
        uses.for_each(|node| self.write_tree(&mut xml, &node.tag, &node.path, node.children[0]));
        self.write_models(&mut xml);
        xml.push("</root>\n");
        self.monitor_xml = if xml.size <= MOST_XML { Ok(xml.text) } else { Err(xml.size) };
        self
    }

    fn write_tree(&self, xml: &mut XmlText, id: &str, path: &str, root: usize) {
        xml.push("<BehaviorTree");
        xml.attribute("ID", id);
        xml.attribute("_fullpath", path);
        xml.push(">\n");
        self.write_node(xml, root);
        xml.push("</BehaviorTree>\n");
    }

    /// Writes a node and those below; as deep as the tree is nested.
    fn write_node(&self, xml: &mut XmlText, index: usize) {
        let node = &self.nodes[index];
        let is_sub_tree = node.operation == NodeOperation::SubTree;
        let (element, has_id) = match &node.operation {
            NodeOperation::SubTree => ("SubTree", true),
            NodeOperation::Leaf(leaf) if !is_xml_name(&node.tag) => {
                (kind_name(self.leaves[*leaf].kind), true)
            }
            _ => (node.tag.as_str(), false),
        };
        ["<", element].into_iter().for_each(|part| xml.push(part));
        if has_id {
            xml.attribute("ID", &node.tag);
        }
        xml.attribute("name", &node.name);
        if is_sub_tree {
            xml.attribute("_fullpath", &node.path);
        }
        xml.attribute("_uid", &(index + 1).to_string());
        node.attributes.iter().for_each(|(name, value)| xml.attribute(name, value));
        if is_sub_tree || node.children.is_empty() {
            xml.push("/>\n");
            return;
        }
        xml.push(">\n");
        node.children.iter().for_each(|child| self.write_node(xml, *child));
        ["</", element, ">\n"].into_iter().for_each(|part| xml.push(part));
    }

    /// Writes the actions and conditions; monitors know all other nodes.
    fn write_models(&self, xml: &mut XmlText) {
        xml.push("<TreeNodesModel>\n");
        let mut known = SortedSet::new();
        for leaf in self.leaves.iter().filter(|leaf| known.insert(leaf.id.as_str())) {
            ["<", kind_name(leaf.kind)].into_iter().for_each(|part| xml.push(part));
            xml.attribute("ID", &leaf.id);
            xml.push(">");
            for port in &leaf.ports {
                xml.push(match port.direction {
                    PortDirection::Input => "<input_port",
                    PortDirection::Output => "<output_port",
                    PortDirection::InOut => "<inout_port",
                });
                xml.attribute("name", &port.name);
                xml.push("/>");
            }
            ["</", kind_name(leaf.kind), ">\n"].into_iter().for_each(|part| xml.push(part));
        }
        xml.push("</TreeNodesModel>\n");
    }
}

/// Text that stops to grow where it becomes too long.
#[derive(Default)]
struct XmlText {
    text: String,
    /// Bytes of the whole text.
    size: usize,
}

impl XmlText {
    fn push(&mut self, part: &str) {
        self.size += part.len();
        if self.size <= MOST_XML {
            self.text.push_str(part);
        }
    }

    fn attribute(&mut self, name: &str, value: &str) {
        [" ", name, "=\""].into_iter().for_each(|part| self.push(part));
        let mut bytes = [0; 4];
        for sign in value.chars() {
            self.push(match sign {
                '&' => "&amp;",
                '<' => "&lt;",
                '>' => "&gt;",
                '"' => "&quot;",
                // Readers make blanks of them.
                '\n' => "&#10;",
                '\r' => "&#13;",
                '\t' => "&#9;",
                sign => sign.encode_utf8(&mut bytes),
            });
        }
        self.push("\"");
    }
}

fn kind_name(kind: LeafKind) -> &'static str {
    match kind {
        LeafKind::Action => "Action",
        LeafKind::Condition => "Condition",
    }
}

fn is_xml_name(name: &str) -> bool {
    let is_sign = |sign: char| sign.is_alphanumeric() || matches!(sign, '_' | '-' | '.');
    name.starts_with(|sign: char| sign.is_alphabetic() || sign == '_') && name.chars().all(is_sign)
}
