//! Answers of the services of parameters.

use serde_json::{Map, Value as Json, json};
use slate_runtime::Composer;
use slate_sorted::SortedSet;
use slate_topics::{AgentOperations, ParameterTable, value_of};

use super::definitions::{ParameterService, SERVICES};
use crate::services::ServiceHandler;

/// Separates parts of names.
const DOT: char = '.';

/// Answers for all six services.
pub struct ParameterHandler {
    pub operations: AgentOperations,
    pub composer: Composer,
    pub is_settable: bool,
}

impl ServiceHandler for ParameterHandler {
    fn answer(&mut self, service: usize, request: &Json) -> Json {
        let table = ParameterTable::new(&self.composer);
        let names = || request["names"].as_array().into_iter().flatten().filter_map(Json::as_str);
        let Some((_, _, service)) = SERVICES.get(service) else { return Json::Object(Map::new()) };
        match service {
            ParameterService::Get => {
                let value = |name| table.get(name).map_or_else(|| json!({}), |own| own.message());
                json!({ "values": names().map(value).collect::<Vec<_>>() })
            }
            ParameterService::Types => {
                let kind = |name| table.get(name).map_or(0, |own| own.kind);
                json!({ "types": names().map(kind).collect::<Vec<_>>() })
            }
            ParameterService::Describe => {
                let describe = |name: &str| {
                    table
                        .get(name)
                        .map_or_else(|| json!({ "name": name }), |own| own.describe(self.is_settable))
                };
                json!({ "descriptors": names().map(describe).collect::<Vec<_>>() })
            }
            ParameterService::List => json!({ "result": list(&table, request) }),
            ParameterService::Set => {
                let results: Vec<_> = parameters(request).map(|own| self.result(&table, &[own])).collect();
                json!({ "results": results })
            }
            ParameterService::SetAtomically => {
                let all: Vec<_> = parameters(request).collect();
                json!({ "result": self.result(&table, &all) })
            }
        }
    }
}

fn parameters(request: &Json) -> impl Iterator<Item = &Json> {
    request["parameters"].as_array().into_iter().flatten()
}

impl ParameterHandler {
    fn result(&self, table: &ParameterTable, parameters: &[&Json]) -> Json {
        match self.set(table, parameters) {
            Ok(()) => json!({ "successful": true }),
            Err(reason) => json!({ "successful": false, "reason": reason }),
        }
    }

    /// Sets all or none, with the checks that tools' settings have.
    fn set(&self, table: &ParameterTable, parameters: &[&Json]) -> Result<(), String> {
        if !self.is_settable {
            return Err(
                "nodes of ROS may only read parameters here: parameters = \"set\" in [ros2] lets them".into(),
            );
        }
        let mut changes = Map::new();
        let mut last = None;
        for parameter in parameters {
            let name = parameter["name"].as_str().unwrap_or_default();
            let own = table.get(name).ok_or_else(|| format!("no module has a parameter `{name}`"))?;
            let value = value_of(&parameter["value"])?;
            changes.insert(own.setting(), value.clone());
            last = Some((own.path(), value));
        }
        match last {
            None => Ok(()),
            Some((path, value)) if parameters.len() == 1 => {
                self.operations.carry_out("write", &[("path", &path)], value).map(drop)
            }
            Some(_) => self.operations.carry_out("set", &[], Json::Object(changes)).map(drop),
        }
    }
}

/// Returns the names that begin with the prefixes, and the prefixes in them.
/// The names are no deeper than wanted.
fn list(table: &ParameterTable, request: &Json) -> Json {
    let prefixes: Vec<_> =
        request["prefixes"].as_array().into_iter().flatten().filter_map(Json::as_str).collect();
    let depth = request["depth"].as_u64().unwrap_or(0);
    let is_shallow = |rest: &str| depth == 0 || (rest.matches(DOT).count() as u64) < depth;
    let is_meant = |name: &str| {
        let rest = |prefix: &&str| name.strip_prefix(*prefix);
        let below = |rest: &str| rest.is_empty() || rest.strip_prefix(DOT).is_some_and(is_shallow);
        prefixes.is_empty() && is_shallow(name) || prefixes.iter().filter_map(rest).any(below)
    };
    let names: Vec<_> = table.0.iter().map(|own| own.name.as_str()).filter(|name| is_meant(name)).collect();
    let prefixes: SortedSet<_> =
        names.iter().filter_map(|name| name.rsplit_once(DOT)).map(|(prefix, _)| prefix).collect();
    json!({ "names": names, "prefixes": prefixes })
}
