//! Settings of a running agent: permitted changes, and their way to the modules.

mod consent;
mod live;

use std::convert::Infallible;
use std::sync::Arc;

use slate_blackboard::interface::{Value, View};
use slate_blackboard::{BoardError, is_within};
use slate_module::Level;
use slate_sorted::{SortedMap, SortedSet};

use super::composition::Composition;
use super::handle::{AgentHandle, WeakHandle, by_module};
use super::links::{LinkEditor, new_loose_ends};
use super::remote_links::RemoteLinks;
use crate::recording::Change as Recorded;
use consent::{ConsentQuestion, check_consent, check_dormant};
use live::{LiveSetting, OtherModules};
use slate_composition::{DiagnosticCollector, Surveyed, survey};
use slate_configuration::{Change, Configuration, Database, Edit, Report, Subscription, Watch};
use toml_edit::Key;

/// Subscription of an agent to its database, until this is dropped.
pub(super) struct FollowedSettings {
    pub database: Database,
    _subscription: Subscription,
    _watch: Option<Watch>,
}

impl FollowedSettings {
    pub fn follow(database: &Database, agent: &AgentHandle, files: bool) -> Result<Self, Report> {
        // The database may outlive the agent, and then judges nothing by it.
        let judge = agent.downgrade();
        database.validate_with(Box::new(move |configuration, changes| match judge.upgrade() {
            Some(agent) => {
                let questions = SettingsChanger::new(&agent).may_change(configuration, changes)?;
                // Foreign code answers, so no lock is held meanwhile.
                check_consent(questions, configuration)
            }
            None => Ok(()),
        }));
        let judge = agent.downgrade();
        database.wait_with(move |configuration, changes| match judge.upgrade() {
            Some(agent) => SettingsChanger::new(&agent).waiting(configuration, changes),
            None => SortedSet::new(),
        });
        agent.composition().database = Some(database.clone());
        let follower = agent.downgrade();
        let subscription = database.subscribe("", move |database, changes| {
            if let Some(agent) = follower.upgrade() {
                SettingsChanger::new(&agent).apply(&database.current(), changes);
            }
        })?;
        let reporter = agent.downgrade();
        let watch = files.then(|| database.watch(move |edit| report(&reporter, edit))).transpose()?;
        Ok(Self { database: database.clone(), _subscription: subscription, _watch: watch })
    }
}

/// Logs the result of an edited file.
/// A refusal is logged line by line, as a line of the log is short.
fn report(reporter: &WeakHandle, edit: Result<Edit, Report>) {
    let Some(agent) = reporter.upgrade() else { return };
    let say = |level, what: &str, changes: &[Change]| {
        if !changes.is_empty() {
            agent.log(level, &format!("{what}: {}", some_of(changes)));
        }
    };
    match edit {
        Ok(Edit { changes, waiting, covered }) => {
            if changes.is_empty() && waiting.is_empty() && covered.is_empty() {
                agent.say("the edited configuration changes nothing: all its settings are in effect");
            }
            say(Level::Info, "settings of the edited configuration are in effect", &changes);
            say(
                Level::Warn,
                "settings of the edited configuration that take effect at the next start",
                &waiting,
            );
            let what = "settings of the edited configuration without effect, as they were changed at run time \
                        (`slate config revert PATH` takes such a change back)";
            say(Level::Warn, what, &covered);
        }
        Err(report) => {
            agent.log(Level::Error, "the edited configuration is refused; the previous one stays in effect");
            report.render(false).lines().for_each(|line| agent.log(Level::Error, line));
        }
    }
}

/// Returns the first paths of the changes, as a line of the log is short.
fn some_of(changes: &[Change]) -> String {
    const MAX_PATHS: usize = 6;
    let paths: Vec<_> = changes.iter().take(MAX_PATHS).map(|change| change.path.as_str()).collect();
    let more = changes.len().saturating_sub(MAX_PATHS);
    let more = if more > 0 { format!(", and {more} more: see `slate config diff`") } else { String::new() };
    format!("{}{more}", paths.join(", "))
}

/// Returns the default of a setting, as TOML.
/// It is the default of a parameter, or `true` for a module's switch.
fn default_text(composition: &Composition, names: &[String]) -> Option<String> {
    match names {
        [section, _, switch] if section == "modules" && switch == "enabled" => Some("true".into()),
        [section, module, part, name] if section == "modules" && part == "params" => {
            toml_text(&composition.assembly.default_of(module, name)?)
        }
        _ => None,
    }
}

/// Converts a value into TOML; `None` for values that TOML lacks.
fn toml_text(value: &Value) -> Option<String> {
    Some(match value {
        Value::Null => return None,
        Value::Bool(value) => value.to_string(),
        Value::Integer(value) => value.to_string(),
        Value::Float(value) => toml_edit::Value::from(*value).to_string(),
        Value::Text(value) => toml_edit::Value::from(value).to_string(),
        Value::List(items) => {
            let items: Option<Vec<_>> = items.iter().map(toml_text).collect();
            format!("[{}]", items?.join(", "))
        }
        Value::Table(fields) => {
            let field = |(name, value): &(String, Value)| {
                Some(format!("{} = {}", toml_edit::Value::from(name), toml_text(value)?))
            };
            let fields: Option<Vec<_>> = fields.iter().map(field).collect();
            format!("{{ {} }}", fields?.join(", "))
        }
    })
}

/// Changes of one module.
#[derive(Default)]
struct ModuleChange<'a> {
    parameters: SortedSet<&'a str>,
    enabled: bool,
    inputs: SortedSet<&'a str>,
}

/// Changes of a running agent's settings.
pub(super) struct SettingsChanger<'c> {
    agent: &'c AgentHandle,
}

impl<'c> SettingsChanger<'c> {
    pub fn new(agent: &'c AgentHandle) -> Self {
        Self { agent }
    }

    /// Checks that a running agent can take a configuration.
    fn may_change(
        &self,
        configuration: &Configuration,
        changes: &[Change],
    ) -> Result<Vec<ConsentQuestion>, Report> {
        let mut composition = self.agent.composition();
        let linked = composition.with_inferred_links(configuration);
        let configuration = &**linked.configuration();
        let Composition { configuration: current, catalogue, assembly, .. } = &mut *composition;
        let later = OtherModules::of(current, configuration).refusals(changes);
        let mut diagnostics = linked.collector();
        let survey = survey(configuration, catalogue, &mut diagnostics);
        check_dormant(configuration, catalogue, &assembly.last_known, &mut diagnostics);
        let mut diagnostics = std::mem::take(&mut diagnostics.diagnostics);
        diagnostics.extend(linked.ambiguous().iter().cloned());
        // A restart does not mend what is wrong in itself, so it is no help then.
        if diagnostics.is_empty() {
            diagnostics = later;
        }
        if diagnostics.is_empty()
            && let Err(mut refused) = assembly.try_links(configuration, &survey)
        {
            diagnostics.append(&mut refused);
        }
        if !diagnostics.is_empty() {
            return Err(Report::from(diagnostics));
        }
        let modules: SortedSet<&str> = changes
            .iter()
            .filter_map(|change| match LiveSetting::of(change) {
                Some(LiveSetting::Parameter { module, .. }) => Some(module),
                _ => None,
            })
            .collect();
        let changed = survey.modules.into_iter();
        let changed = changed.filter(|surveyed| modules.contains(surveyed.module.name.value.as_str()));
        Ok(changed.map(|surveyed| ConsentQuestion::of(surveyed, assembly)).collect())
    }

    /// Returns the indices of an edit's changes that only the next start can make.
    fn waiting(&self, configuration: &Configuration, changes: &[Change]) -> SortedSet<usize> {
        let composition = self.agent.composition();
        let configuration = configuration.with_loaded_of(&composition.configuration);
        OtherModules::of(&composition.configuration, &configuration).waiting(changes)
    }

    /// Applies checked changes to the modules.
    fn apply(&self, configuration: &Configuration, changes: &[Change]) {
        let mut composition = self.agent.composition();
        let mut of_modules: SortedMap<&str, ModuleChange<'_>> = SortedMap::new();
        let (mut of_log, mut of_links) = (false, false);
        // An agent that continues from a snapshot has the settings of that already.
        let is_new =
            |change: &&Change| !configuration.agrees_with(&composition.configuration, change.names());
        for change in changes.iter().filter(is_new) {
            match LiveSetting::of(change) {
                Some(LiveSetting::Parameter { module, name }) => {
                    of_modules.entry(module).or_default().parameters.insert(name);
                }
                Some(LiveSetting::Enabled { module }) => of_modules.entry(module).or_default().enabled = true,
                Some(LiveSetting::Input { module, port }) => {
                    of_modules.entry(module).or_default().inputs.insert(port);
                }
                Some(LiveSetting::LogLevel) => of_log = true,
                Some(LiveSetting::Link) => of_links = true,
                None => {}
            }
        }
        // A parameter without its link has the value that is set for it, as an input has.
        let before = Arc::clone(&composition.configuration);
        for (module, parameter) in before.linked_parameters() {
            if !configuration.linked_parameters().any(|own| own == (module, parameter)) {
                of_modules.entry(module).or_default().parameters.insert(parameter);
            }
        }
        if of_log {
            self.agent.shared.logger.set_levels(configuration.log().levels());
        }
        let configuration = Arc::clone(composition.with_inferred_links(configuration).configuration());
        // A recording has inferred links as if they were written.
        let recorded = |change: &Change| {
            let mut change = change.clone();
            if change.after.is_none() {
                change.after = configuration.inferred_value(change.names());
            }
            let mut recorded = Recorded::from(&change);
            // The configuration that a recording began with may set it: by a variant, or by a file that was edited since.
            if let Recorded::Setting { value: value @ None, .. } = &mut recorded {
                *value = default_text(&composition, change.names());
            }
            recorded
        };
        let Ok(()) = self.agent.recorder.make(changes.iter().map(recorded).collect(), || {
            if of_links || composition.waiting.unlinked.is_some() {
                let modules = composition.settle_links(&configuration, &self.agent.shared);
                self.agent.record_links(&modules);
            }
            let mut diagnostics = DiagnosticCollector::new(&configuration);
            let survey = survey(&configuration, &composition.catalogue, &mut diagnostics);
            for surveyed in &survey.modules {
                let Some(change) = of_modules.get(surveyed.module.name.value.as_str()) else { continue };
                if let Err(error) = self.apply_to(&configuration, surveyed, change) {
                    self.agent.log(Level::Error, &format!("a change of the configuration is lost: {error}"));
                }
            }
            // A plugin that was exchanged since it was judged may see it otherwise.
            diagnostics
                .diagnostics
                .iter()
                .for_each(|complaint| self.agent.log(Level::Error, &complaint.to_string()));
            drop(survey);
            if of_links || of_modules.values().any(|change| !change.inputs.is_empty()) {
                let new = new_loose_ends(&before, &configuration, &composition.catalogue);
                new.iter().for_each(|end| self.agent.log(Level::Warn, &end.to_string()));
            }
            composition.configuration = configuration;
            Ok::<(), Infallible>(())
        });
        drop(composition);
        if let Err(error) = RemoteLinks::new(self.agent).share() {
            self.agent.log(Level::Error, &format!("links to other agents bring nothing: {error}"));
        }
    }

    fn apply_to(
        &self,
        configuration: &Configuration,
        surveyed: &Surveyed<'_>,
        change: &ModuleChange<'_>,
    ) -> Result<(), BoardError> {
        let (name, now) = (&surveyed.module.name.value, self.agent.now());
        let own = |port: &str| {
            let path = format!("{name}/{port}");
            // Not what a link leads to.
            self.agent
                .board()
                .find(&path)
                .map(|(property, _)| Some(property).filter(|own| own.path() == path))
        };
        if !change.parameters.is_empty()
            && let Some(property) = own("params")?
        {
            // One write, so that a tick sees all or nothing of it; what else was set on the blackboard stays.
            let view = View::new(property.descriptor(), &surveyed.params, 0);
            let Some(Value::Table(mut fields)) = view.map(|view| view.value()) else { return Ok(()) };
            let is_linked = |field: &str| {
                let parameter = format!("{name}/params/{field}");
                configuration.links().iter().any(|link| is_within(&link.to.value, &parameter))
            };
            fields.retain(|(field, _)| change.parameters.contains(field.as_str()) && !is_linked(field));
            property.set("", &Value::Table(fields), now)?;
        }
        for (index, bytes) in &surveyed.inputs {
            let port = surveyed.description.ports[*index].name.as_str();
            if change.inputs.contains(port)
                && let Some(property) = own(port)?
            {
                property.set_bytes(bytes, now)?;
            }
        }
        // Last, so that a module that is switched on sees the rest.
        if change.enabled
            && let Some(property) = own("enabled")?
        {
            property.set("value", &Value::Bool(surveyed.module.enabled.value), now)?;
        }
        Ok(())
    }

    /// Makes the changes that a module requests, and returns their description.
    /// Each line is one of them: `path=value`, or a path alone, which reverts its changes.
    ///
    /// # Errors
    /// The mismatches; nothing is changed then.
    pub fn change_for(&self, module: &str, lines: &str) -> Result<String, Report> {
        let database = self.agent.composition().database()?;
        let lines = lines.lines().filter(|line| !line.trim().is_empty());
        let (set, taken_back): (Vec<&str>, Vec<&str>) = lines.partition(|line| line.contains('='));
        let mut changes = Vec::new();
        for line in set {
            changes.push(slate_configuration::parse_change(line)?);
        }
        let changes = by_module(module, || {
            LinkEditor::new(self.agent).commit(|| database.propose_instead(&taken_back, &changes))
        })?;
        self.say_changes(&format!("{module} has changed"), &changes);
        let changed: Vec<_> = changes.iter().map(|change| self.describe(change)).collect();
        Ok(changed.join(", "))
    }

    /// Logs changes of the configuration, with the values before and after.
    pub fn say_changes(&self, what: &str, changes: &[Change]) {
        changes.iter().for_each(|change| self.agent.say(&format!("{what} {}", self.describe(change))));
    }

    /// Returns a change with the defaults of missing values.
    fn describe(&self, Change { path, before, after, .. }: &Change) -> String {
        let default =
            || self.default_at(path).map_or("none".into(), |default| format!("{default} (default)"));
        let value = |value: &Option<slate_configuration::Value>| {
            value.as_ref().map_or_else(default, slate_configuration::Value::to_string)
        };
        format!("{path}: {} -> {}", value(before), value(after))
    }

    /// Value of a module's setting without any in the configuration.
    pub fn default_at(&self, path: &str) -> Option<String> {
        let names = Key::parse(path).ok()?;
        let names: Vec<&str> = names.iter().map(Key::get).collect();
        let [section, module, part, name] = names[..] else { return None };
        let value = self
            .agent
            .composition()
            .assembly
            .default_of(module, name)
            .filter(|_| (section, part) == ("modules", "params"))?;
        serde_json::to_string(&value).ok()
    }
}
