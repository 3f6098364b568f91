//! The XML of trees and models.

use std::collections::BTreeMap;

use roxmltree::{Document, Node};

use crate::error::TreeError;
use crate::model::{LeafKind, LeafModel, LeafModels, PortDirection, PortModel};

/// Ports of sub-trees by their IDs, with their values where a tree has none.
pub(super) type SubTreeModels = BTreeMap<String, Vec<(String, Option<String>)>>;

/// A file's trees by their IDs, and its models.
pub(super) struct TreeDocument<'a> {
    /// Where lines end.
    lines: Vec<usize>,
    pub main: &'a str,
    pub trees: BTreeMap<&'a str, Node<'a, 'a>>,
    pub models: LeafModels,
    pub sub_trees: SubTreeModels,
}

impl<'a> TreeDocument<'a> {
    /// Reads the elements below `root`.
    pub fn read(text: &str, document: &'a Document<'a>, models: &LeafModels) -> Result<Self, TreeError> {
        let lines = text.match_indices('\n').map(|(at, _)| at).collect();
        let mut read = Self {
            lines,
            main: "",
            trees: BTreeMap::new(),
            models: models.clone(),
            sub_trees: BTreeMap::new(),
        };
        let root = document.root_element();
        if root.tag_name().name() != "root" {
            return Err(
                read.error(root, format!("expected the element `root`, found `{}`", root.tag_name().name()))
            );
        }
        if root.attribute("BTCPP_format") != Some("4") {
            return Err(read.error(root, "expected `BTCPP_format=\"4\"` in `root`; convert older trees"));
        }
        for element in root.children().filter(Node::is_element) {
            match element.tag_name().name() {
                "BehaviorTree" => read.tree(element)?,
                "TreeNodesModel" => read.read_models(element)?,
                "include" => {
                    let reason = "expected no `include`: put the trees of both files into one";
                    return Err(read.error(element, reason));
                }
                other => {
                    let reason = format!("expected `BehaviorTree` or `TreeNodesModel`, found `{other}`");
                    return Err(read.error(element, reason));
                }
            }
        }
        read.main = match (root.attribute("main_tree_to_execute"), read.trees.len()) {
            (Some(main), _) => main,
            (None, 1) => read.trees.keys().next().copied().unwrap_or_default(),
            (None, 0) => return Err(read.error(root, "expected an element `BehaviorTree` in `root`")),
            (None, _) => {
                let reason = "expected `main_tree_to_execute` in `root`, as the file has several trees";
                return Err(read.error(root, reason));
            }
        };
        if !read.trees.contains_key(read.main) {
            let known = read.trees.keys().copied().collect::<Vec<_>>().join(", ");
            let reason =
                format!("no tree has the ID `{}` of the main tree; the file has: {known}", read.main);
            return Err(read.error(root, reason));
        }
        Ok(read)
    }

    fn tree(&mut self, element: Node<'a, 'a>) -> Result<(), TreeError> {
        let id = element.attribute("ID").unwrap_or("BehaviorTree");
        let count = element.children().filter(Node::is_element).count();
        if count != 1 {
            let reason =
                format!("expected one node in the tree `{id}`, found {count}; put them below a `Sequence`");
            return Err(self.error(element, reason));
        }
        match self.trees.insert(id, element) {
            None => Ok(()),
            Some(_) => Err(self.error(element, format!("expected another ID, found a second tree `{id}`"))),
        }
    }

    fn read_models(&mut self, element: Node<'a, 'a>) -> Result<(), TreeError> {
        for model in element.children().filter(Node::is_element) {
            let id = self.attribute(model, "ID")?;
            let ports = self.ports(model)?;
            let kind = match model.tag_name().name() {
                "Action" => LeafKind::Action,
                "Condition" => LeafKind::Condition,
                "SubTree" => {
                    let ports = ports.into_iter().map(|port| (port.name, port.default)).collect();
                    self.sub_trees.insert(id.into(), ports);
                    continue;
                }
                // Those that this crate knows have their models; others are refused where a tree has them.
                _ => continue,
            };
            self.models.insert(id, LeafModel { kind, ports: Some(ports) });
        }
        Ok(())
    }

    fn ports(&self, model: Node<'a, 'a>) -> Result<Vec<PortModel>, TreeError> {
        let mut ports = Vec::new();
        for port in model.children().filter(Node::is_element) {
            let direction = match port.tag_name().name() {
                "input_port" => PortDirection::Input,
                "output_port" => PortDirection::Output,
                "inout_port" => PortDirection::InOut,
                // Descriptions of editors.
                _ => continue,
            };
            let name = self.attribute(port, "name")?.to_owned();
            ports.push(PortModel { name, direction, default: port.attribute("default").map(str::to_owned) });
        }
        Ok(ports)
    }

    pub fn attribute(&self, node: Node<'a, 'a>, name: &str) -> Result<&'a str, TreeError> {
        node.attribute(name).ok_or_else(|| {
            self.error(node, format!("expected the attribute `{name}` of `{}`", node.tag_name().name()))
        })
    }

    pub fn line(&self, node: Node<'_, '_>) -> usize {
        let start = node.range().start;
        self.lines.partition_point(|end| *end < start) + 1
    }

    pub fn error(&self, node: Node<'_, '_>, reason: impl Into<String>) -> TreeError {
        TreeError::at(self.line(node), reason)
    }
}
