//! Parameters of modules on the master, below the name of the node.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use serde_json::{Value as Json, json};
use slate_control::ControlSurface;
use slate_module::Level;
use slate_sorted::SortedMap;
use slate_topics::{AgentOperations, NodeAccess, NodeParameter, ParameterTable};
use tokio::runtime::Handle;

use crate::settings::{Ros1Settings, SCHEME};
use crate::wire::{CallError, NodeContext, XmlValue};
use slate_topics::RosError;

/// Period of the check whether a parameter was set here.
const IDLE_PERIOD: Duration = Duration::from_millis(100);

/// Keeps the parameters of modules and those on the master the same.
pub struct ParameterSync {
    node: Arc<NodeContext>,
    surface: Arc<ControlSurface>,
    operations: AgentOperations,
    is_settable: bool,
    /// Values on the master, by key.
    known: SortedMap<String, XmlValue>,
    /// Numbers of parameter changes on the master, and of the node's registrations.
    changes: (u64, u64),
    /// Number of settings on the board; `None` when the master lacks some.
    settings: Option<u64>,
}

impl ParameterSync {
    /// Parameters of the modules of an agent, if settings let nodes read them.
    ///
    /// # Errors
    /// When the system has no resources for waiting.
    pub fn new(
        surface: &Arc<ControlSurface>,
        settings: &Ros1Settings,
        node: &Arc<NodeContext>,
    ) -> Result<Option<Self>, RosError> {
        if settings.options.parameters == NodeAccess::None {
            return Ok(None);
        }
        Ok(Some(Self {
            node: Arc::clone(node),
            surface: Arc::clone(surface),
            operations: AgentOperations::new(surface, SCHEME)?,
            is_settable: settings.options.parameters == NodeAccess::Set,
            known: SortedMap::new(),
            changes: node.parameter_changes(),
            settings: None,
        }))
    }

    /// Synchronizes changes both ways until the end.
    /// Then it removes the parameters from the master.
    pub fn run(mut self, network: &Handle, ended: &AtomicBool) {
        while !ended.load(Ordering::Acquire) {
            let changes = self.node.parameter_changes();
            let (is_changed, is_new) = (changes.0 != self.changes.0, changes.1 != self.changes.1);
            self.changes = changes;
            if is_new {
                self.known.clear();
                self.settings = None;
            } else if is_changed {
                self.take(network);
            }
            let count = self.surface.board().settings().count();
            if self.settings != Some(count) {
                self.settings = self.publish(network).then_some(count);
            }
            self.node.parameter_wake.wait_timeout(IDLE_PERIOD);
        }
        for key in self.known.keys() {
            let call = self.node.master.call("deleteParam", vec![key.as_str().into()]);
            if let Err(CallError::Unreachable(_)) = network.block_on(call) {
                return;
            }
        }
    }

    /// Tells the master values that it does not have; whether it has all then.
    fn publish(&mut self, network: &Handle) -> bool {
        let mut is_done = true;
        for (key, _, value) in self.parameters() {
            if self.known.get(&key) == Some(&value) {
                continue;
            }
            let call = self.node.master.call("setParam", vec![key.as_str().into(), value.clone()]);
            match network.block_on(call) {
                Ok(_) => drop(self.known.insert(key, value)),
                Err(_) => is_done = false,
            }
        }
        is_done
    }

    /// Sets parameters that nodes have set on the master.
    /// Refused ones are restored there.
    fn take(&mut self, network: &Handle) {
        let call = self.node.master.call("getParam", vec![self.node.name().into()]);
        let mut there = SortedMap::new();
        match network.block_on(call) {
            Ok(all) => flatten(self.node.name(), all, &mut there),
            Err(CallError::Refused(_)) => {}
            Err(CallError::Unreachable(_)) => return,
        }
        for (key, own, value) in self.parameters() {
            let Some(known) = self.known.get(&key) else { continue };
            let found = there.remove(&key);
            if found.as_ref() == Some(known) {
                continue;
            }
            // A node has changed it: the next comparison sets the master again, unless both values agree by then.
            self.known.remove(&key);
            self.settings = None;
            let Some(found) = found.filter(|found| *found != value) else { continue };
            if let Err(reason) = self.set(&own, &found) {
                self.node.log_once(Level::Warn, &format!("{key} can't be set: {reason}"));
            }
        }
    }

    /// Sets a parameter, with the checks that tools' settings have.
    fn set(&self, own: &NodeParameter, value: &XmlValue) -> Result<(), String> {
        if !self.is_settable {
            let text = "nodes of ROS may only read parameters here: parameters = \"set\" in [ros1] lets them";
            return Err(text.into());
        }
        self.operations.carry_out("write", &[("path", &own.path())], json_of(value)).map(drop)
    }

    /// Parameters that ROS has a type for, by key, and their values.
    fn parameters(&self) -> Vec<(String, NodeParameter, XmlValue)> {
        let table = ParameterTable::new(self.surface.agent.composer());
        let keyed = table.0.into_iter().filter_map(|own| {
            let value = xml_of(&serde_json::to_value(&own.value).ok()?, own.is_floating())?;
            Some((key(self.node.name(), &own), own, value))
        });
        keyed.collect()
    }
}

/// Returns the key of a parameter on the master.
fn key(node: &str, own: &NodeParameter) -> String {
    format!("{node}/{}/{}", own.module, own.fields.join("/"))
}

fn flatten(path: &str, value: XmlValue, all: &mut SortedMap<String, XmlValue>) {
    match value {
        XmlValue::Structure(members) => {
            members.into_iter().for_each(|(name, value)| flatten(&format!("{path}/{name}"), value, all));
        }
        value => drop(all.insert(path.to_owned(), value)),
    }
}

/// Converts a value to the master's format; `None` if it has no equivalent.
/// Whole numbers beyond 32 bits have no type that differs from all others.
fn xml_of(value: &Json, is_floating: bool) -> Option<XmlValue> {
    Some(match value {
        Json::Null | Json::Object(_) => return None,
        Json::Bool(truth) => XmlValue::Bool(*truth),
        Json::String(text) => XmlValue::Text(text.clone()),
        Json::Array(items) => {
            XmlValue::List(items.iter().map(|item| xml_of(item, is_floating)).collect::<Option<_>>()?)
        }
        Json::Number(number) => {
            let whole = number.as_i64().and_then(|number| i32::try_from(number).ok());
            match whole.filter(|_| !is_floating) {
                Some(whole) => XmlValue::Integer(whole),
                None => XmlValue::Double(number.as_f64()?),
            }
        }
    })
}

fn json_of(value: &XmlValue) -> Json {
    match value {
        XmlValue::Integer(number) => json!(number),
        XmlValue::Bool(truth) => json!(truth),
        XmlValue::Double(number) => json!(number),
        XmlValue::Text(text) => json!(text),
        XmlValue::List(items) => items.iter().map(json_of).collect(),
        XmlValue::Structure(members) => {
            members.iter().map(|(name, value)| (name.clone(), json_of(value))).collect()
        }
    }
}
