//! The settings of an agent that runs: which of them may change, and how a change reaches the modules.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::sync::Arc;

use slate_blackboard::interface::{Value, View};
use slate_blackboard::{BoardError, is_within};
use slate_module::Level;

use super::composer::{Composer, WeakComposer};
use super::composition::Composition;
use super::consent::{Question, ask};
use crate::configuration::{Change, Configuration, Database, Diagnostic, Edit, Report, Subscription, Watch};
use crate::recording::Change as Recorded;
use slate_composition::{Complaints, Surveyed, survey};

/// An agent follows a database as long as this lives.
pub(super) struct Settings {
    pub database: Database,
    _subscription: Subscription,
    _watch: Option<Watch>,
}

impl Settings {
    pub fn follow(database: &Database, composer: &Composer, files: bool) -> Result<Self, Report> {
        // The database may outlive the agent, and then judges nothing by it.
        let judge = composer.downgrade();
        database.validate_with(Box::new(move |configuration, changes| match judge.upgrade() {
            Some(composer) => {
                let questions = composer.composition().may_change(configuration, changes)?;
                // Foreign code answers, so nobody is kept waiting for it.
                ask(questions, configuration)
            }
            None => Ok(()),
        }));
        let judge = composer.downgrade();
        database.wait_with(move |configuration, changes| match judge.upgrade() {
            Some(composer) => composer.composition().waiting(configuration, changes),
            None => BTreeSet::new(),
        });
        composer.composition().database = Some(database.clone());
        let follower = composer.downgrade();
        let subscription = database.subscribe("", move |database, changes| {
            if let Some(composer) = follower.upgrade() {
                composer.apply(&database.current(), changes);
            }
        })?;
        let reporter = composer.downgrade();
        let watch = files.then(|| database.watch(move |edit| report(&reporter, edit))).transpose()?;
        Ok(Self { database: database.clone(), _subscription: subscription, _watch: watch })
    }
}

/// Says what became of an edited file; of a refused one line by line, as a line of the log is short.
fn report(reporter: &WeakComposer, edit: Result<Edit, Report>) {
    let Some(composer) = reporter.upgrade() else { return };
    let say = |level, what: &str, changes: &[Change]| {
        if !changes.is_empty() {
            composer.log(level, &format!("{what}: {}", some_of(changes)));
        }
    };
    match edit {
        Ok(Edit { changes, waiting, covered }) => {
            if changes.is_empty() && waiting.is_empty() && covered.is_empty() {
                composer.say("the edited configuration says what holds");
            }
            say(Level::Info, "the edited configuration holds now", &changes);
            say(Level::Warn, "the edited configuration holds from the next start", &waiting);
            let what = "the edited configuration is covered by what was set at run time, until that is taken back \
                        (`slate config revert PATH`)";
            say(Level::Warn, what, &covered);
        }
        Err(report) => {
            composer.log(Level::Error, "the edited configuration is refused; what held before goes on");
            report.render(false).lines().for_each(|line| composer.log(Level::Error, line));
        }
    }
}

/// The first paths; a line of the log is short.
fn some_of(changes: &[Change]) -> String {
    const MOST: usize = 6;
    let paths: Vec<_> = changes.iter().take(MOST).map(|change| change.path.as_str()).collect();
    let more = changes.len().saturating_sub(MOST);
    let more = if more > 0 { format!(", and {more} more: see `slate config diff`") } else { String::new() };
    format!("{}{more}", paths.join(", "))
}

/// A setting that may change while the agent runs.
enum Live<'a> {
    Parameter { module: &'a str, name: &'a str },
    Enabled { module: &'a str },
    Input { module: &'a str, port: &'a str },
    Link,
    LogLevel,
}

impl<'a> Live<'a> {
    fn of(change: &'a Change) -> Option<Self> {
        let names: Vec<&str> = change.names().iter().map(String::as_str).collect();
        match names[..] {
            ["modules", module, "params", name, ..] => Some(Self::Parameter { module, name }),
            ["modules", module, "enabled"] => Some(Self::Enabled { module }),
            ["modules", module, "inputs", port, ..] => Some(Self::Input { module, port }),
            ["links", _, ..] => Some(Self::Link),
            ["log", "level"] | ["log", "levels", _] => Some(Self::LogLevel),
            _ => None,
        }
    }
}

const LATER: &str = "it takes effect at the next start: write it into the file, and start the agent again";

impl Composition {
    /// Whether a running agent can have that configuration.
    fn may_change(
        &mut self,
        configuration: &Configuration,
        changes: &[Change],
    ) -> Result<Vec<Question>, Report> {
        let configuration = configuration.with_loaded_of(&self.configuration);
        let mut diagnostics = self.refusals(&configuration, changes);
        let mut complaints = Complaints::new(&configuration);
        let survey = survey(&configuration, &self.catalogue, &mut complaints);
        self.check_dormant(&configuration, &mut complaints);
        diagnostics.append(&mut complaints.diagnostics);
        if diagnostics.is_empty()
            && let Err(mut refused) = self.try_links(&configuration, &survey)
        {
            diagnostics.append(&mut refused);
        }
        if !diagnostics.is_empty() {
            return Err(Report::from(diagnostics));
        }
        let modules: BTreeSet<&str> = changes
            .iter()
            .filter_map(|change| match Live::of(change) {
                Some(Live::Parameter { module, .. }) => Some(module),
                _ => None,
            })
            .collect();
        Ok(self.questions(survey, &modules))
    }

    /// The changes that a running agent can't make.
    fn refusals(&self, configuration: &Configuration, changes: &[Change]) -> Vec<Diagnostic> {
        let place = |path: &str, message: String, help: &str| match configuration.value(path) {
            Some(value) => configuration.diagnostic(value.span, message, Some(help.into())),
            None => Diagnostic::without_place(message, Some(help.into())),
        };
        let others = Others::of(&self.configuration, configuration);
        let of_modules = others.modules.iter().map(|module| {
            let is_new = configuration.modules().iter().any(|own| own.name.value == **module);
            let what = if is_new { "added" } else { "taken out" };
            let message = format!("module `{module}` can't be {what} while the agent runs");
            let help = format!("{LATER}; or load and unload the plugin that brings it");
            place(&format!("modules.\"{module}\""), message, &help)
        });
        let of_others = changes.iter().filter(|change| !others.have(change)).filter_map(|change| {
            let (message, help) = others.obstacle(change)?;
            Some(place(&change.path, message, &help))
        });
        of_modules.chain(of_others).collect()
    }

    /// The places of those of an edit's changes that only the next start can make.
    fn waiting(&self, configuration: &Configuration, changes: &[Change]) -> BTreeSet<usize> {
        let configuration = configuration.with_loaded_of(&self.configuration);
        let others = Others::of(&self.configuration, &configuration);
        let waits = |change: &Change| {
            others.have(change) || others.touches(change) || others.obstacle(change).is_some()
        };
        changes.iter().enumerate().filter(|(_, change)| waits(change)).map(|(place, _)| place).collect()
    }
}

/// Two configurations, and the modules that only one of them has.
struct Others<'a> {
    before: &'a Configuration,
    after: &'a Configuration,
    modules: BTreeSet<&'a str>,
}

impl<'a> Others<'a> {
    fn of(before: &'a Configuration, after: &'a Configuration) -> Self {
        let names = |configuration: &'a Configuration| -> BTreeSet<&'a str> {
            configuration.modules().iter().map(|module| module.name.value.as_str()).collect()
        };
        let modules = names(before).symmetric_difference(&names(after)).copied().collect();
        Self { before, after, modules }
    }

    /// Whether a change belongs to such a module.
    fn have(&self, change: &Change) -> bool {
        matches!(change.names(), [section, module, ..] if section == "modules" && self.modules.contains(module.as_str()))
    }

    /// Whether a change is one of a link from or to such a module.
    fn touches(&self, change: &Change) -> bool {
        let [section, port, ..] = change.names() else { return false };
        let of_module = |end: &str| {
            self.modules
                .iter()
                .any(|module| end.strip_prefix(module).is_some_and(|rest| rest.starts_with('/')))
        };
        let links = self.before.links().iter().chain(self.after.links());
        let mut ends = links.map(|link| [link.from.value.path_in(""), link.to.value.clone()]);
        section == "links" && ends.any(|ends| ends.contains(port) && ends.iter().any(|end| of_module(end)))
    }

    /// Why a running agent can't make a change, and what to do about it.
    fn obstacle(&self, change: &Change) -> Option<(String, String)> {
        let path = &change.path;
        let linked = |configuration: &Configuration, input: &str| {
            configuration.links().iter().any(|link| link.to.value == input)
        };
        match Live::of(change) {
            Some(Live::Parameter { module, name }) => {
                let parameter = format!("{module}/params/{name}");
                let mut links = self.after.links().iter();
                let link = links.find(|link| is_within(&link.to.value, &parameter));
                // One that is linked by the same change is not read any more.
                let link = link.filter(|link| linked(self.before, &link.to.value));
                link.map(|link| {
                    let message = format!("`{path}` follows `{}`, so it can't be set", link.from.value);
                    (message, format!("take the link away first: slate unlink {}", link.to.value))
                })
            }
            Some(Live::LogLevel | Live::Link) => None,
            Some(Live::Enabled { module }) => [self.before, self.after]
                .iter()
                .all(|configuration| linked(configuration, &format!("{module}/enabled")))
                .then(|| {
                    let message = format!("`{path}` has no effect, as a link switches the module");
                    (message, format!("take the link away first: slate unlink {module}/enabled"))
                }),
            Some(Live::Input { module, port }) => {
                let input = format!("{module}/{port}");
                let value = self.after.modules().iter().find(|own| own.name.value == module);
                let has_value = value.is_some_and(|module| module.inputs.get(port).is_some());
                (!has_value && !linked(self.before, &input) && !linked(self.after, &input))
                    .then(|| format!("the value of `{input}` can't be taken back while the agent runs"))
                    .map(|message| (message, LATER.into()))
            }
            None => Some((format!("`{path}` can't change while the agent runs"), LATER.into())),
        }
    }
}

/// What changes of a module.
#[derive(Default)]
struct ModuleChange<'a> {
    parameters: BTreeSet<&'a str>,
    enabled: bool,
    inputs: BTreeSet<&'a str>,
}

impl Composer {
    /// Brings changes to the modules; they were found to fit.
    fn apply(&self, configuration: &Configuration, changes: &[Change]) {
        let mut composition = self.composition();
        let mut of_modules: BTreeMap<&str, ModuleChange<'_>> = BTreeMap::new();
        let (mut of_log, mut of_links) = (false, false);
        // An agent that goes on from a snapshot has the settings of that already.
        let is_new =
            |change: &&Change| !configuration.agrees_with(&composition.configuration, change.names());
        for change in changes.iter().filter(is_new) {
            match Live::of(change) {
                Some(Live::Parameter { module, name }) => {
                    of_modules.entry(module).or_default().parameters.insert(name);
                }
                Some(Live::Enabled { module }) => of_modules.entry(module).or_default().enabled = true,
                Some(Live::Input { module, port }) => {
                    of_modules.entry(module).or_default().inputs.insert(port);
                }
                Some(Live::LogLevel) => of_log = true,
                Some(Live::Link) => of_links = true,
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
            self.set_log_levels(configuration.log().levels());
        }
        let Ok(()) = self.make_recorded(changes.iter().map(Recorded::from).collect(), || {
            let configuration = Arc::new(configuration.with_loaded_of(&composition.configuration));
            if of_links || composition.unlinked.is_some() {
                let modules = composition.settle_links(&configuration, &self.shared);
                self.tell_links(&modules);
            }
            let mut complaints = Complaints::new(&configuration);
            let survey = survey(&configuration, &composition.catalogue, &mut complaints);
            for surveyed in &survey.modules {
                let Some(change) = of_modules.get(surveyed.module.name.value.as_str()) else { continue };
                if let Err(error) = self.apply_to(&configuration, surveyed, change) {
                    self.log(Level::Error, &format!("a change of the configuration is lost: {error}"));
                }
            }
            // A plugin that was exchanged since it was judged may see it otherwise.
            complaints
                .diagnostics
                .iter()
                .for_each(|complaint| self.log(Level::Error, &complaint.to_string()));
            drop(survey);
            composition.configuration = configuration;
            Ok::<(), Infallible>(())
        });
        drop(composition);
        if let Err(error) = self.share() {
            self.log(Level::Error, &format!("links to other agents bring nothing: {error}"));
        }
    }

    /// Logs whose links are other ones.
    pub(super) fn tell_links(&self, modules: &[String]) {
        if !modules.is_empty() {
            self.log(Level::Info, &format!("other links hold for {}", modules.join(", ")));
        }
    }

    fn apply_to(
        &self,
        configuration: &Configuration,
        surveyed: &Surveyed<'_>,
        change: &ModuleChange<'_>,
    ) -> Result<(), BoardError> {
        let (name, now) = (&surveyed.module.name.value, self.now());
        let own = |port: &str| {
            let path = format!("{name}/{port}");
            // Not what a link leads to.
            self.board().find(&path).map(|(property, _)| Some(property).filter(|own| own.path() == path))
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
}
