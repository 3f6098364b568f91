//! XML of trees and models.

use std::path::Path;

use roxmltree::{Document, Node};
use slate_sorted::SortedMap;

use crate::error::TreeError;
use crate::model::{LeafKind, LeafModel, LeafModels, PortDirection, PortModel};

/// ID of a tree without one.
const UNNAMED: &str = "BehaviorTree";

/// Ports of sub-trees by their IDs, with their values where a tree has none.
pub(super) type SubTreeModels = SortedMap<String, Vec<(String, Option<String>)>>;

/// Parsed file.
pub(super) struct TreeSource<'a> {
    /// Included file; `None` for the first one.
    included: Option<&'a Path>,
    /// Positions of line ends.
    lines: Vec<usize>,
    document: Document<'a>,
}

impl<'a> TreeSource<'a> {
    pub fn new(included: Option<&'a Path>, text: &str, document: Document<'a>) -> Self {
        let lines = text.match_indices('\n').map(|(at, _)| at).collect();
        Self { included, lines, document }
    }
}

/// Trees of all files by their IDs, and their models.
pub(super) struct TreeDocument<'a> {
    sources: &'a [TreeSource<'a>],
    is_file: bool,
    pub main: &'a str,
    pub trees: SortedMap<&'a str, Node<'a, 'a>>,
    pub models: LeafModels,
    pub sub_trees: SubTreeModels,
}

impl<'a> TreeDocument<'a> {
    /// Reads the elements below the `root` of each file.
    pub fn read(
        sources: &'a [TreeSource<'a>],
        is_file: bool,
        models: &LeafModels,
    ) -> Result<Self, TreeError> {
        let mut read = Self {
            sources,
            is_file,
            main: "",
            trees: SortedMap::new(),
            models: models.clone(),
            sub_trees: SortedMap::new(),
        };
        sources.iter().try_for_each(|source| read.read_source(source))?;
        // The main tree is one of the first file.
        if let Some(first) = sources.first() {
            read.main = read.main_tree(first.document.root_element())?;
        }
        Ok(read)
    }

    fn read_source(&mut self, source: &'a TreeSource<'a>) -> Result<(), TreeError> {
        let root = source.document.root_element();
        if root.tag_name().name() != "root" {
            return Err(
                self.error(root, format!("expected the element `root`, found `{}`", root.tag_name().name()))
            );
        }
        if root.attribute("BTCPP_format") != Some("4") {
            return Err(self.error(root, "expected `BTCPP_format=\"4\"` in `root`; convert older trees"));
        }
        for element in root.children().filter(Node::is_element) {
            match element.tag_name().name() {
                "BehaviorTree" => self.tree(element)?,
                "TreeNodesModel" => self.read_models(element)?,
                "include" if self.is_file => {}
                "include" => {
                    let reason = "expected no `include` in a text that is not a file";
                    return Err(self.error(element, reason));
                }
                other => {
                    let reason = format!("expected `BehaviorTree` or `TreeNodesModel`, found `{other}`");
                    return Err(self.error(element, reason));
                }
            }
        }
        Ok(())
    }

    /// Returns the ID of the main tree, by the root of the first file.
    fn main_tree(&self, root: Node<'a, 'a>) -> Result<&'a str, TreeError> {
        let own = root.children().filter(|child| child.has_tag_name("BehaviorTree"));
        let own: Vec<Node<'a, 'a>> = own.collect();
        let main = match (root.attribute("main_tree_to_execute"), &own[..]) {
            (Some(main), _) => main,
            (None, [own]) => own.attribute("ID").unwrap_or(UNNAMED),
            (None, []) => return Err(self.error(root, "expected an element `BehaviorTree` in `root`")),
            (None, _) => {
                let reason = "expected `main_tree_to_execute` in `root`, as the file has several trees";
                return Err(self.error(root, reason));
            }
        };
        if self.trees.contains_key(main) {
            return Ok(main);
        }
        let known = self.trees.keys().copied().collect::<Vec<_>>().join(", ");
        let reason = format!("no tree has the ID `{main}` of the main tree; the file has: {known}");
        Err(self.error(root, reason))
    }

    fn tree(&mut self, element: Node<'a, 'a>) -> Result<(), TreeError> {
        let id = element.attribute("ID").unwrap_or(UNNAMED);
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

    fn source(&self, node: Node<'_, '_>) -> Option<&'a TreeSource<'a>> {
        self.sources.iter().find(|source| std::ptr::eq(&source.document, node.document()))
    }

    /// Returns the file of a node, if another one includes it.
    pub fn file(&self, node: Node<'_, '_>) -> Option<&'a Path> {
        self.source(node)?.included
    }

    pub fn line(&self, node: Node<'_, '_>) -> usize {
        let start = node.range().start;
        self.source(node).map_or(0, |source| source.lines.partition_point(|end| *end < start)) + 1
    }

    pub fn error(&self, node: Node<'_, '_>, reason: impl Into<String>) -> TreeError {
        let error = TreeError::at(self.line(node), reason);
        match self.file(node) {
            Some(file) => error.of_file(file),
            None => error,
        }
    }
}
