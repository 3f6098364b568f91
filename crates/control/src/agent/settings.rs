//! Configuration, as tools query and change it.

use slate_blackboard::{interface, nearest_paths};

use super::refusal::{Done, refusal, result};
use crate::entries::{Refusal, SavedSettings, SettingChange, SettingDifference, SettingEntry};
use slate_runtime::configuration::{Change, Database, Proposal, SaveTo, Value};
use slate_runtime::{Composer, ErrorCode};

/// Configuration of an agent, which may change while it runs.
#[derive(Clone)]
pub(crate) struct ConfigurationControl {
    composer: Composer,
    /// Database; `None` when the agent was loaded without one.
    pub database: Option<Database>,
}

impl ConfigurationControl {
    /// Creates the settings of an agent.
    pub fn new(composer: &Composer, database: Option<Database>) -> Self {
        Self { composer: composer.clone(), database }
    }

    /// Applies changes of settings if `holds` still succeeds right before.
    /// `holds` is evaluated again when another change came first.
    ///
    /// # Errors
    /// The error of `holds`, or that the changes don't fit.
    pub fn set_if<E: From<Refusal>>(
        &self,
        changes: &[(String, String)],
        holds: impl Fn() -> Result<(), E>,
    ) -> Result<Vec<SettingChange>, E> {
        loop {
            let proposal = self.proposal(changes).map_err(E::from)?;
            holds()?;
            if let Some(changed) = proposal.apply() {
                self.composer.say_changes("a tool has changed", &changed);
                self.composer.settle_changes();
                return Ok(self.changed(changed));
            }
        }
    }

    fn database(&self) -> Result<&Database, Refusal> {
        self.database.as_ref().ok_or_else(|| {
            refusal("the configuration of this agent can't change while it runs", "load it with a database")
        })
    }

    /// Returns the settings at a path and below it.
    pub fn at(&self, path: &str) -> Done {
        let entry = |setting: slate_runtime::configuration::Setting| {
            let value = serde_json::to_value(interface::Value::from(&setting.value)).unwrap_or_default();
            let (text, origin) = (setting.value.to_string(), setting.origin.to_string());
            SettingEntry { path: setting.path, value, text, origin }
        };
        let settings: Vec<_> = self.database()?.get(path)?.into_iter().map(entry).collect();
        if settings.is_empty() && !path.trim().is_empty() {
            return Err(no_setting(self.database()?, path));
        }
        result(settings)
    }

    /// Makes changes, all or none, or only finds out whether they fit.
    pub fn set(&self, changes: &[(String, String)], dry_run: bool) -> Done {
        if dry_run {
            return result(self.changed(self.proposal(changes)?.changes().to_vec()));
        }
        result(self.set_if(changes, || Ok::<(), Refusal>(()))?)
    }

    /// Changes that can be made.
    fn proposal(&self, changes: &[(String, String)]) -> Result<Proposal, Refusal> {
        let database = self.database()?;
        let proposal = database.propose(changes).and_then(|proposal| self.composer.checked(proposal));
        proposal.map_err(|report| match self.loaded_by_hand(database, changes) {
            Some(module) => refusal(
                format!(
                    "module `{module}` came with a plugin that was loaded by hand, so it has no settings"
                ),
                "add the module to [modules], and its plugin with its `file` to [plugins], and start again",
            ),
            None => report.into(),
        })
    }

    /// Reverts the changes made at run time, at a path and below it.
    pub fn revert(&self, path: &str) -> Done {
        let database = self.database()?;
        let is_known = !database.get(path)?.is_empty();
        let changed = self.composer.commit(|| database.revert(path))?;
        if changed.is_empty() && !is_known && !path.trim().is_empty() {
            return Err(no_setting(database, path));
        }
        self.composer.say_changes("a tool has taken back", &changed);
        result(self.changed(changed))
    }

    /// Converts changes for tools.
    pub fn changed(&self, changes: Vec<Change>) -> Vec<SettingChange> {
        let changed = |change: Change| SettingChange {
            default: self.composer.default_at(&change.path),
            path: change.path,
            before: text(change.before),
            after: text(change.after),
            conversion: None,
            needs_reload: None,
        };
        changes.into_iter().map(changed).collect()
    }

    /// Returns a module to change that the agent has, but not its configuration.
    fn loaded_by_hand(&self, database: &Database, changes: &[(String, String)]) -> Option<String> {
        let configuration = database.current();
        let is_known = |name: &str| configuration.modules().iter().any(|module| module.name.value == name);
        let modules = self.composer.modules().into_iter().map(|module| module.name);
        let named: Vec<_> = changes.iter().filter_map(|(path, _)| toml_edit::Key::parse(path).ok()).collect();
        let is_named = |module: &String| {
            named.iter().any(|names| matches!(&names[..], [section, name, ..] if section == "modules" && name == module.as_str()))
        };
        modules.filter(|module| !is_known(module)).find(is_named)
    }

    /// Returns the errors in files that were edited and are refused.
    pub fn refused_edit(&self) -> Done {
        result(self.database()?.refused_edit().map(Refusal::from))
    }

    /// Lists the settings that differ from the files.
    /// The same value in another notation, such as a module's default, is no difference.
    pub fn differences(&self) -> Done {
        let different = self.database()?.diff().into_iter().map(|difference| SettingDifference {
            default: self.composer.default_at(&difference.path),
            path: difference.path,
            file: text(difference.file),
            present: text(difference.present),
            origin: difference.origin.map(|origin| origin.to_string()),
        });
        let differs = |one: &SettingDifference| {
            let effective = |text: &Option<String>| text.clone().or_else(|| one.default.clone());
            !is_same(effective(&one.file), effective(&one.present))
        };
        result(different.filter(differs).collect::<Vec<_>>())
    }

    /// Writes the changes made at run time into the files.
    pub fn save(&self, to: SaveTo, dry_run: bool) -> Done {
        if dry_run {
            return result(SavedSettings { files: self.database()?.saved_files(to)? });
        }
        let files = self.database()?.save(to)?;
        for file in &files {
            self.composer
                .say(&format!("a tool has saved the changes into {}", slate_runtime::printable(file)));
        }
        result(SavedSettings { files })
    }
}

fn text(value: Option<Value>) -> Option<String> {
    value.map(|value| value.to_string())
}

/// Returns whether two texts denote the same value, as 1 and 1.0 do.
fn is_same(a: Option<String>, b: Option<String>) -> bool {
    let number = |text: &Option<String>| text.as_deref()?.parse::<f64>().ok();
    a == b || number(&a).zip(number(&b)).is_some_and(|(a, b)| a == b)
}

/// Creates the refusal of a path without a setting.
fn no_setting(database: &Database, path: &str) -> Refusal {
    let settings = database.get("").unwrap_or_default();
    let near = nearest_paths(path.trim(), '.', settings.iter().map(|setting| setting.path.as_str()));
    let help = match near.is_empty() {
        true => "`config get` without a path lists all".into(),
        false => format!("did you mean {}?", near.join(" or ")),
    };
    refusal(ErrorCode::Name.of(format!("no setting at `{path}` or below it")), &help)
}
