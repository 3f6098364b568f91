//! Attributes of a node as ports and scripts.

use std::collections::BTreeMap;

use roxmltree::Node;

use super::boards::Boards;
use super::document::TreeDocument;
use crate::error::TreeError;
use crate::model::{LeafModel, PortDirection};
use crate::ports::PortBinding;
use crate::script::{TreeScript, parse_script};
use crate::tree::NodeScripts;
use crate::value::BoardValue;

/// Returns the name in `{name}`; `{=}` is the port's own.
pub(super) fn pointer<'a>(port: &'a str, text: &'a str) -> Option<&'a str> {
    let inner = text.trim_matches(' ').strip_prefix('{')?.strip_suffix('}')?;
    match inner {
        "" => None,
        "=" => Some(port),
        name => Some(name),
    }
}

/// Attributes of a node that are ports, taken one after the other.
pub(super) struct Attributes<'a, 'b> {
    pub document: &'b TreeDocument<'a>,
    pub boards: &'b mut Boards,
    pub board: usize,
    pub node: Node<'a, 'a>,
    ports: BTreeMap<&'a str, &'a str>,
}

impl<'a, 'b> Attributes<'a, 'b> {
    pub fn new(
        document: &'b TreeDocument<'a>,
        boards: &'b mut Boards,
        board: usize,
        node: Node<'a, 'a>,
    ) -> Self {
        let ports = node.attributes().map(|attribute| (attribute.name(), attribute.value()));
        let ports = ports.filter(|(name, _)| !name.starts_with('_') && !matches!(*name, "ID" | "name"));
        Self { document, boards, board, node, ports: ports.collect() }
    }

    pub fn take(&mut self, name: &str) -> Option<&'a str> {
        self.ports.remove(name)
    }

    /// What is left of the ports, in the order of the file.
    pub fn rest(&mut self) -> Vec<(&'a str, &'a str)> {
        let names = self.node.attributes().map(|attribute| attribute.name());
        let mut left = std::mem::take(&mut self.ports);
        names.filter_map(|name| left.remove_entry(name)).collect()
    }

    pub fn required(&mut self, name: &str) -> Result<&'a str, TreeError> {
        self.take(name).ok_or_else(|| self.error(format!("expected the port `{name}` of `{}`", self.title())))
    }

    /// Returns what a port with a text leads to.
    pub fn bind(&mut self, name: &str, text: &str) -> PortBinding {
        match pointer(name, text) {
            Some(entry) => PortBinding::Entry(self.boards.entry(self.board, entry)),
            None => PortBinding::Literal(BoardValue::Text(text.into())),
        }
    }

    /// Returns a port with an integer, which is at least `least`.
    pub fn integer(
        &mut self,
        name: &str,
        default: Option<i64>,
        least: i64,
    ) -> Result<PortBinding, TreeError> {
        let text = match (self.take(name), default) {
            (None, Some(default)) => return Ok(PortBinding::Literal(BoardValue::Number(default as f64))),
            (Some(text), _) => text,
            (None, None) => self.required(name)?,
        };
        match self.bind(name, text) {
            PortBinding::Literal(_) => match text.trim().parse::<i32>() {
                Ok(number) if i64::from(number) >= least => {
                    Ok(PortBinding::Literal(BoardValue::Number(number.into())))
                }
                _ => Err(self.error(format!(
                    "expected an integer of at least {least} or an entry such as `{{n}}` in the port `{name}`, \
                     found `{text}`"
                ))),
            },
            entry => Ok(entry),
        }
    }

    /// Returns the entry whose name a port has.
    pub fn entry(&mut self, name: &str) -> Result<usize, TreeError> {
        let text = self.required(name)?;
        match pointer(name, text) {
            None if !text.is_empty() => Ok(self.boards.entry(self.board, text)),
            _ => Err(self.error(format!(
                "expected the name of an entry, without braces, in the port `{name}`, found `{text}`"
            ))),
        }
    }

    /// Returns a port with a script.
    pub fn script_port(&mut self, name: &str) -> Result<TreeScript, TreeError> {
        let text = self.required(name)?;
        self.script(text)
    }

    fn script(&mut self, text: &str) -> Result<TreeScript, TreeError> {
        let (boards, board) = (&mut *self.boards, self.board);
        let mut entry = |name: &str| Ok(boards.entry(board, name));
        parse_script(text, &mut entry).map_err(|reason| self.error(reason))
    }

    /// Returns the scripts before and after the node.
    pub fn scripts(&mut self) -> Result<Option<Box<NodeScripts>>, TreeError> {
        let mut scripts = NodeScripts::default();
        let mut has_any = false;
        for attribute in self.node.attributes().filter(|attribute| attribute.name().starts_with('_')) {
            let place = match attribute.name() {
                "_failureIf" => &mut scripts.failure_if,
                "_successIf" => &mut scripts.success_if,
                "_skipIf" => &mut scripts.skip_if,
                "_while" => &mut scripts.only_while,
                "_onHalted" => &mut scripts.on_halted,
                "_onFailure" => &mut scripts.on_failure,
                "_onSuccess" => &mut scripts.on_success,
                "_post" => &mut scripts.post,
                // Notes of editors, such as `_description`.
                _ => continue,
            };
            *place = Some(self.script(attribute.value())?);
            has_any = true;
        }
        Ok(has_any.then(|| Box::new(scripts)))
    }

    /// Returns the ports of an action or a condition.
    pub fn leaf_ports(&mut self, model: Option<&LeafModel>) -> Result<Vec<(String, PortBinding)>, TreeError> {
        let given = self.rest();
        let known = model.and_then(|model| model.ports.as_ref());
        let mut ports = Vec::new();
        for (name, text) in &given {
            let port = known.map(|known| known.iter().find(|port| port.name == *name));
            if port == Some(None) {
                let names = known.into_iter().flatten().map(|port| port.name.as_str()).collect::<Vec<_>>();
                return Err(self.error(format!(
                    "`{}` has no port `{name}`; its model has: {}",
                    self.title(),
                    if names.is_empty() { "none".into() } else { names.join(", ") }
                )));
            }
            let binding = self.bind(name, text);
            let is_output = port.flatten().is_some_and(|port| port.direction != PortDirection::Input);
            if is_output && matches!(binding, PortBinding::Literal(_)) {
                return Err(self.error(format!(
                    "expected an entry such as `{{{name}}}` in the output port `{name}`, found `{text}`"
                )));
            }
            ports.push(((*name).to_owned(), binding));
        }
        for port in known.into_iter().flatten() {
            if given.iter().any(|(name, _)| *name == port.name) {
                continue;
            }
            match &port.default {
                Some(default) => ports.push((port.name.clone(), self.bind(&port.name, default))),
                None if port.direction == PortDirection::Output => {}
                None => {
                    return Err(self.error(format!(
                        "expected the port `{}` of `{}`",
                        port.name,
                        self.title()
                    )));
                }
            }
        }
        Ok(ports)
    }

    pub fn title(&self) -> &'a str {
        self.node.attribute("ID").unwrap_or(self.node.tag_name().name())
    }

    pub fn error(&self, reason: impl Into<String>) -> TreeError {
        self.document.error(self.node, reason)
    }
}
