//! Causes of standing robots.
//! Sensors that stopped or never measured, blocks that are switched off or fail, Plans that send nothing.

use std::sync::Arc;

use slate_blackboard::interface::{Descriptor, Interface, Kind, Value};
use slate_blackboard::{Access, Board, Property};
use slate_interfaces::SensorAccuracy;
use slate_mapek::{ExecuteStatus, RobotModel};
use slate_runtime::{Composer, LinkStatus};
use slate_sorted::{SortedMap, SortedSet};

use crate::observation::value;
use crate::warnings::{RunWarning, Warnings};

/// Age from which a RobotModel counts as not updated, ns.
/// Its robot does not know its pose.
const MAX_AGE: u64 = 1_000_000_000;

/// Describes the silent sensors of all robots at the end of a run.
/// Such as "r2: the sensor `sonar` stopped at 2.48 s"; for a failed run also the other causes that keep the robots from
/// their mission, with their newest warnings. `None` without any.
pub fn describe(composer: &Composer, board: &Board, now: u64, failure: Option<&Warnings>) -> Option<String> {
    let end = EndOfRun::new(composer, board, failure);
    let (mut causes, mut lost) = (Vec::new(), SortedSet::new());
    let properties = board.properties();
    for property in &properties {
        if let Some(field) = robot_model_of(property.descriptor())
            && !end.add_sensors(property, field, now, &mut causes)
        {
            lost.insert(robot_of(property.path()));
        }
    }
    for property in &properties {
        if property.descriptor().hash == ExecuteStatus::DESCRIPTOR.hash
            && property.access() == Access::Output
            && failure.is_some()
        {
            end.add_blocks(property, &lost, &mut causes);
        }
    }
    causes.sort();
    causes.dedup();
    if let Some(warnings) = failure {
        end.add_warnings(warnings, &mut causes);
    }
    (!causes.is_empty()).then(|| causes.join("; "))
}

/// Modules and links of an agent at the end of its run.
struct EndOfRun<'a> {
    board: &'a Board,
    links: Vec<LinkStatus>,
    /// Condition of each module, and the dependency that it waits for.
    modules: SortedMap<String, (&'static str, Option<String>)>,
    /// Warnings of a run that has failed.
    failure: Option<&'a Warnings>,
}

impl<'a> EndOfRun<'a> {
    fn new(composer: &Composer, board: &'a Board, failure: Option<&'a Warnings>) -> Self {
        let modules = composer.modules().into_iter();
        let modules = modules.map(|module| (module.name, (module.condition, module.waiting_for))).collect();
        Self { board, links: composer.links(), modules, failure }
    }

    fn is_off(&self, module: &str) -> bool {
        self.modules.get(module).is_some_and(|(condition, _)| *condition == "INACTIVE")
    }

    /// Returns the module that a property is of.
    fn module_of(&self, path: &str) -> Option<&str> {
        let path = path.trim_start_matches('/');
        let of_module =
            |module: &&String| path.strip_prefix(module.as_str()).is_some_and(|rest| rest.starts_with('/'));
        self.modules.keys().filter(of_module).max_by_key(|module| module.len()).map(String::as_str)
    }

    /// Adds the causes in a property's RobotModel: its silent or unlisted sensors.
    /// `field` is the field with the model. Returns whether the robot knows its pose.
    fn add_sensors(&self, property: &Property, field: &str, now: u64, causes: &mut Vec<String>) -> bool {
        // A model in an input is set by hand, for a module of a robot without Knowledge.
        if property.access() == Access::Setting {
            return true;
        }
        let robot = robot_of(property.path());
        let (Ok(newest), Some(knowledge)) =
            (self.board.read(property.path()), self.module_of(property.path()))
        else {
            return true;
        };
        let mut listed = SortedSet::new();
        let pose = match newest {
            None if property.access() != Access::Output || !property.has_writer() => return true,
            None => Some("never a pose".to_owned()),
            Some((whole, stamp)) => {
                let model = if field.is_empty() { Some(&whole) } else { whole.get(field) };
                let Some(Value::List(sensors)) = model.and_then(|model| model.get("sensors")) else {
                    return true;
                };
                let is_old = now.saturating_sub(stamp.time) > MAX_AGE;
                let pose = model.and_then(|model| model.get("pose"));
                let is_nan = |field: &str| {
                    pose.and_then(|pose| pose.get(field)).and_then(Value::as_f64).is_some_and(f64::is_nan)
                };
                let is_lost = ["x", "y", "theta"].into_iter().any(is_nan);
                for sensor in sensors {
                    let name = sensor.get("name").and_then(Value::as_str).unwrap_or_default();
                    listed.insert(name.to_owned());
                    // An old model says nothing of the present, and a lost robot's sensors are listed below.
                    if let Some(condition) = self.condition_of(robot, sensor).filter(|_| !is_old && !is_lost)
                    {
                        let source = self.sensors_of(knowledge).find(|(input, _)| *input == name);
                        let off = source.map_or_else(String::new, |(_, source)| self.off_text(source));
                        causes.push(format!("{robot}: the sensor `{name}` {condition}{off}"));
                    }
                }
                let old = is_old.then(|| format!("no pose since {:.2} s", stamp.time as f64 * 1e-9));
                old.or(is_lost.then(|| "no pose".to_owned()))
            }
        };
        let mut unheard = Vec::new();
        for (name, source) in self.sensors_of(knowledge) {
            let since = if pose.is_none() { None } else { self.silent_since(source, now) };
            let off = self.off_text(source);
            match self.board.read(source) {
                Ok(None) => unheard.push((name, format!("the sensor `{name}` never measured{off}"))),
                Ok(Some(_)) if since.is_some() => {
                    let since = since.unwrap_or_default();
                    unheard.push((name, format!("the sensor `{name}` stopped at {since:.2} s{off}")));
                }
                _ => {}
            }
        }
        let has_pose = pose.is_none();
        match pose {
            Some(pose) => {
                let reasons: Vec<_> = unheard.into_iter().map(|(_, reason)| reason).collect();
                let reasons = if reasons.is_empty() { self.degraded_modules(robot) } else { reasons };
                let reasons =
                    if reasons.is_empty() { String::new() } else { format!(" ({})", reasons.join(", ")) };
                causes.push(format!("{robot}: {pose}{reasons}"));
            }
            None => {
                let unlisted = unheard.into_iter().filter(|(name, _)| !listed.contains(*name));
                causes.extend(unlisted.map(|(_, reason)| format!("{robot}: {reason}")));
            }
        }
        has_pose
    }

    /// Returns the text that a property's module is switched off; empty if it is on.
    fn off_text(&self, path: &str) -> String {
        let off = self.module_of(path).filter(|module| self.is_off(module));
        off.map_or_else(String::new, |module| format!(", as `{module}` is switched off"))
    }

    /// Returns the condition of a RobotModel's sensor; `None` if it measures.
    /// A late sensor counts only in a failed run.
    fn condition_of(&self, robot: &str, sensor: &Value) -> Option<String> {
        let newest = || sensor.get("measured").and_then(Value::as_f64).unwrap_or_default() * 1e-9;
        Some(match sensor.get("health").and_then(Value::as_str).unwrap_or_default() {
            "SILENT" => format!("stopped at {:.2} s", newest()),
            "LATE" if let Some(warnings) = self.failure => {
                let name = sensor.get("name").and_then(Value::as_str).unwrap_or_default();
                let since = late_since(warnings, robot, name);
                let since = since.map_or_else(String::new, |since| format!(" since {since:.2} s"));
                format!("is late{since}: its newest value came at {:.2} s", newest())
            }
            "UNKNOWN" => "never measured".into(),
            _ => return None,
        })
    }

    /// Returns the time of the last write, s, if that is long ago.
    fn silent_since(&self, path: &str, now: u64) -> Option<f64> {
        let (_, stamp) = self.board.read(path).ok().flatten()?;
        (now.saturating_sub(stamp.time) > MAX_AGE).then_some(stamp.time as f64 * 1e-9)
    }

    /// Returns the inputs of a Knowledge that read Sensors, with their sources.
    fn sensors_of<'s>(&'s self, knowledge: &'s str) -> impl Iterator<Item = (&'s str, &'s str)> {
        self.links.iter().filter_map(move |link| {
            let input = link.to.strip_prefix(knowledge)?.strip_prefix('/')?;
            let source = link.from.trim_start_matches('/');
            let (property, _) = self.board.find(source).ok()?;
            // A data sheet is not a measurement, and exact sensors have none.
            let is_measured = property.descriptor().hash != SensorAccuracy::DESCRIPTOR.hash;
            (property.part() == "sensor" && is_measured).then_some((input, source))
        })
    }

    /// Adds the causes that keep the robot of an Execute from acting.
    /// `status` is that of the Execute; blocks of the robots in `lost` wait for a pose.
    fn add_blocks(&self, status: &Arc<Property>, lost: &SortedSet<&str>, causes: &mut Vec<String>) {
        let Some(execute) = self.module_of(status.path()) else { return };
        let robot = robot_of(execute);
        let inbox = format!("{execute}/plan");
        let plans = self.links.iter().filter(|link| link.to == inbox);
        let plans: Vec<_> = plans.filter_map(|link| self.module_of(&link.from)).collect();
        let gate = |link: &&LinkStatus| {
            let source = link.from.trim_start_matches('/');
            let found = self.board.find(source).is_ok_and(|(property, _)| property.part() == "gate");
            found && robot_of(source) == robot
        };
        let actuators = self.links.iter().filter(gate).filter_map(|link| self.module_of(&link.to));
        let knows = self.modules.keys().map(String::as_str).filter(|module| {
            let models = format!("{module}/");
            let mut own = self.board.properties().into_iter();
            robot_of(module) == robot
                && own.any(|own| {
                    own.path().starts_with(&models) && matches!(&*own.part(), "knowledge" | "rule")
                })
        });
        let blocks = std::iter::once(execute).chain(plans.iter().copied()).chain(actuators).chain(knows);
        let mut is_off = false;
        for module in blocks.filter(|module| self.is_off(module)) {
            is_off = true;
            causes.push(format!("{robot}: `{module}` is switched off"));
        }
        let sent = value(status).and_then(|status| status.get("ticket").and_then(Value::as_integer));
        if sent == Some(0) && !plans.is_empty() && !is_off {
            causes.push(format!("{robot}: its Plan `{}` has sent no action", plans.join("`, `")));
        }
        for (module, (condition, waits_for)) in
            self.modules.iter().filter(|(name, _)| robot_of(name) == robot)
        {
            match (*condition, waits_for) {
                ("WAITING", Some(port)) if !lost.contains(robot) => {
                    causes.push(format!("{robot}: `{module}` waits for `{port}`"))
                }
                ("FAILED" | "FAULTED" | "LATE" | "UNLOADED", _) => {
                    causes.push(format!("{robot}: `{module}` is {}", condition.to_lowercase()));
                }
                _ => {}
            }
        }
    }

    /// Modules of a robot that are degraded.
    fn degraded_modules(&self, robot: &str) -> Vec<String> {
        let own = self.modules.iter().filter(|(name, _)| robot_of(name) == robot);
        let degraded = own.filter(|(_, (condition, _))| *condition == "DEGRADED");
        degraded.map(|(module, _)| format!("{module} is degraded")).collect()
    }

    /// Adds the newest warnings of robots' blocks.
    /// Warnings of stopped sensors are left out, as they are known.
    fn add_warnings(&self, warnings: &Warnings, causes: &mut Vec<String>) {
        for RunWarning { module, time, text } in warnings.newest() {
            let is_block = module.contains('/') && self.modules.contains_key(&*module);
            if is_block && !(text.starts_with("the sensor `") && text.contains("` has stopped")) {
                causes.push(format!("{module} at {:.2} s: {text}", time as f64 * 1e-9));
            }
        }
    }
}

/// Returns the time of the last warning that a sensor is late, s.
/// The Knowledge of a robot warns when a sensor begins to be late.
fn late_since(warnings: &Warnings, robot: &str, sensor: &str) -> Option<f64> {
    let begins = format!("the sensor `{sensor}` is late:");
    let newest = warnings.newest().into_iter();
    let of_sensor = newest.filter(|one| robot_of(&one.module) == robot && one.text.starts_with(&begins));
    of_sensor.map(|one| one.time as f64 * 1e-9).last()
}

/// Returns the robot that a property or a module is of.
fn robot_of(path: &str) -> &str {
    path.trim_start_matches('/').split('/').next().unwrap_or_default()
}

/// Returns the RobotModel field of an interface; empty for a RobotModel itself.
fn robot_model_of(descriptor: &Descriptor) -> Option<&'static str> {
    let model = RobotModel::DESCRIPTOR.hash;
    if descriptor.hash == model {
        return Some("");
    }
    let is_model = |kind: &Kind| matches!(kind, Kind::Nested(nested) if nested.hash == model);
    descriptor.fields.iter().find(|field| is_model(&field.kind)).map(|field| field.name)
}
