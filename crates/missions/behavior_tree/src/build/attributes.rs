//! Attributes of a node as ports and scripts.

use roxmltree::Node;
use slate_blackboard::nearest_names;
use slate_sorted::SortedMap;

use super::boards::Boards;
use super::document::TreeDocument;
use crate::error::TreeError;
use crate::model::{LeafModel, PortDirection, PortModel};
use crate::ports::{BoundPort, PortBinding};
use crate::script::{Expression, TreeScript, parse_script};
use crate::tree::{NodeScripts, NodeStatus};
use crate::value::BoardValue;

/// Attributes with a script before or after a node.
const SCRIPTS: [&str; 8] =
    ["_failureIf", "_successIf", "_skipIf", "_while", "_onHalted", "_onFailure", "_onSuccess", "_post"];
/// Attributes of sub-trees and notes of editors.
const NOTES: [&str; 4] = ["_autoremap", "_description", "_uid", "_fullpath"];

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
    ports: SortedMap<&'a str, &'a str>,
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

    /// Ports that were not taken, in the order of the file.
    pub fn rest(&mut self) -> Vec<(&'a str, &'a str)> {
        let names = self.node.attributes().map(|attribute| attribute.name());
        let mut left = std::mem::take(&mut self.ports);
        names.filter_map(|name| left.remove_entry(name)).collect()
    }

    pub fn required(&mut self, name: &str) -> Result<&'a str, TreeError> {
        self.take(name).ok_or_else(|| self.error(format!("expected the port `{name}` of `{}`", self.title())))
    }

    /// Returns the binding of a port with a text.
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

    /// Returns a port with a status in the file.
    pub fn status(&mut self, name: &str, default: NodeStatus) -> Result<NodeStatus, TreeError> {
        let Some(word) = self.take(name) else { return Ok(default) };
        NodeStatus::parse(word).ok_or_else(|| {
            self.error(format!(
                "expected SUCCESS, FAILURE, RUNNING or SKIPPED in the port `{name}`, found `{word}`"
            ))
        })
    }

    /// Returns the entry of a name.
    pub fn entry_named(&mut self, name: &str) -> usize {
        self.boards.entry(self.board, name)
    }

    /// Returns a port with a script.
    pub fn script_port(&mut self, name: &str) -> Result<TreeScript, TreeError> {
        let text = self.required(name)?;
        self.script(text)
    }

    fn script(&mut self, text: &str) -> Result<TreeScript, TreeError> {
        let (boards, board) = (&mut *self.boards, self.board);
        let enumerations = self.document.models.enumerations();
        let mut names = |name: &str| match enumerations.get(name) {
            Some(number) => Expression::Number(*number),
            None => Expression::Entry(boards.entry(board, name)),
        };
        parse_script(text, &mut names).map_err(|reason| self.error(reason))
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
                name if NOTES.contains(&name) => continue,
                name => return Err(self.unknown_script(name)),
            };
            *place = Some(self.script(attribute.value())?);
            has_any = true;
        }
        Ok(has_any.then(|| Box::new(scripts)))
    }

    fn unknown_script(&self, name: &str) -> TreeError {
        self.error(match nearest_names(name, SCRIPTS.into_iter().chain(NOTES)).first() {
            Some(near) => format!("unknown attribute `{name}`: did you mean `{near}`?"),
            None => format!("unknown attribute `{name}`: those with `_` are {}", SCRIPTS.join(", ")),
        })
    }

    /// Returns the ports of an action or a condition, in the order of its model.
    ///
    /// Without a model, in the order of the file.
    pub fn leaf_ports(&mut self, model: Option<&LeafModel>) -> Result<Vec<BoundPort>, TreeError> {
        let Some(known) = model.and_then(|model| model.ports.as_ref()) else {
            let given = self.rest();
            let port = |(name, text): (&str, &str)| {
                let binding = self.bind(name, text);
                BoundPort { name: name.into(), direction: PortDirection::InOut, binding }
            };
            return Ok(given.into_iter().map(port).collect());
        };
        let mut ports = Vec::with_capacity(known.len());
        for PortModel { name, direction, default } in known {
            let given = self.take(name);
            let is_output = *direction != PortDirection::Input;
            let binding = match (given, default) {
                (Some(text), _) => self.bind(name, text),
                (None, Some(default)) => self.bind(name, default),
                (None, None) if *direction == PortDirection::Output => continue,
                (None, None) => {
                    return Err(self.error(format!("expected the port `{name}` of `{}`", self.title())));
                }
            };
            match (given, &binding) {
                (Some(text), PortBinding::Literal(_)) if is_output => {
                    return Err(self.error(format!(
                        "expected an entry such as `{{{name}}}` in the output port `{name}`, found `{text}`"
                    )));
                }
                // The default of an output, such as an empty one, which is no entry.
                (None, PortBinding::Literal(_)) if *direction == PortDirection::Output => continue,
                _ => ports.push(BoundPort { name: name.clone(), direction: *direction, binding }),
            }
        }
        match self.rest()[..] {
            [] => Ok(ports),
            [(name, _), ..] => {
                let names = known.iter().map(|port| port.name.as_str()).collect::<Vec<_>>();
                Err(self.error(format!(
                    "`{}` has no port `{name}`; its model has: {}",
                    self.title(),
                    if names.is_empty() { "none".into() } else { names.join(", ") }
                )))
            }
        }
    }

    pub fn title(&self) -> &'a str {
        self.node.attribute("ID").unwrap_or(self.node.tag_name().name())
    }

    pub fn error(&self, reason: impl Into<String>) -> TreeError {
        self.document.error(self.node, reason)
    }
}
