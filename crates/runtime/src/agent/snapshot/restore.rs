//! Restoring of a snapshot.
//! All is prepared beside the running modules, and exchanged between two cycles.

use std::sync::Arc;

use super::apply::{Ready, Restoration};
use super::capture::{HeldCells, LIMIT, SnapshotSubject, SnapshotSubjects};
use super::fit::{self, DifferentSetting};
use crate::agent::assembly::Relinking;
use crate::agent::composition::{Composition, Fitting};
use crate::agent::handle::AgentHandle;
use crate::aspects::TimePlace;
use crate::snapshot::{ModuleSnapshot, Snapshot, SnapshotError};
use slate_configuration::{Configuration, Database, Variant};
use slate_engine::log::Levels;
use slate_engine::runner::Retired;
use slate_sorted::SortedMap;

/// Restores an agent from snapshots.
pub(in crate::agent) struct SnapshotRestorer<'c> {
    agent: &'c AgentHandle,
}

impl<'c> SnapshotRestorer<'c> {
    pub fn new(agent: &'c AgentHandle) -> Self {
        Self { agent }
    }

    /// Restores a snapshot between two cycles.
    pub fn restore(&self, snapshot: &Snapshot, database: Option<&Database>) -> Result<(), SnapshotError> {
        let Some(database) = database else {
            return self.go_on(snapshot, &[], None);
        };
        self.is_of(snapshot)?;
        loop {
            let here = database.current().with_loaded_of(&self.agent.composition().configuration);
            let there = settings_of(snapshot)?;
            let different = DifferentSetting::between(&here, &there);
            // Settings that can't change at run time are checked first.
            let is_fixed = |own: &&DifferentSetting| own.property().is_none() && !own.is_link();
            let fixed = different.iter().filter(is_fixed).map(DifferentSetting::describe);
            let fixed: Vec<_> = fixed.chain(other_variants(&here, &there)).collect();
            if !fixed.is_empty() {
                return Err(unfit(snapshot, self.problems(snapshot)?.into_iter().chain(fixed).collect()));
            }
            if different.is_empty() {
                return self.go_on(snapshot, &[], None);
            }
            let unset = different.iter().filter(|own| own.there.is_none());
            let unset = unset.filter_map(|own| Some((own.path.clone(), self.unset(&own.path)?)));
            // An inferred link is written where the files say otherwise.
            let inferred = different.iter().filter(|own| own.is_link() && there.value(&own.path).is_none());
            let inferred = inferred.filter_map(|own| Some((own.path.clone(), own.there.clone()?)));
            let unset = unset.chain(inferred).collect();
            let written = |own: DifferentSetting| match own.is_link() {
                true => (there.value(&own.path).map(|value| value.value.to_string()), own.path),
                false => (own.there, own.path),
            };
            let settings: Vec<_> =
                different.into_iter().map(written).map(|(value, path)| (path, value)).collect();
            let proposal = database.replace(&settings, &unset)?;
            // All is judged with the settings of the snapshot, and they hold when the agent continues from it.
            let restored =
                proposal.apply_after(|settings| self.go_on(snapshot, &[], Some((settings, &unset))));
            if let Some(restored) = restored {
                return restored.map(drop);
            }
        }
    }

    /// Restores as [`restore`](SnapshotRestorer::restore), under own settings.
    /// Parameters, switches and values of inputs keep the values with which the agent was loaded, where the snapshot's
    /// configuration has others.
    pub fn restore_under_own_settings(&self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.is_of(snapshot)?;
        let here = Arc::clone(&self.agent.composition().configuration);
        let different = DifferentSetting::between(&here, &*settings_of(snapshot)?);
        self.go_on(
            snapshot,
            &different.iter().filter_map(DifferentSetting::property).collect::<Vec<_>>(),
            None,
        )
    }

    /// Checks that a snapshot is of this agent.
    /// For a snapshot of another agent no further mismatch is reported.
    fn is_of(&self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let own = self.agent.shared.board.agent();
        if own == snapshot.agent() {
            return Ok(());
        }
        Err(unfit(snapshot, vec![format!("this is agent `{own}`")]))
    }

    fn problems(&self, snapshot: &Snapshot) -> Result<Vec<String>, SnapshotError> {
        let composition = self.agent.composition();
        let subjects = SnapshotSubjects::of(&composition, &self.agent.shared)?.modules;
        Ok(fit::problems(&composition, &subjects, snapshot, &self.agent.shared))
    }

    /// Returns the default of a setting, which holds without a value.
    fn unset(&self, path: &str) -> Option<String> {
        let keys = toml_edit::Key::parse(path).ok()?;
        let names: Vec<&str> = keys.iter().map(toml_edit::Key::get).collect();
        match names[..] {
            ["modules", _, "enabled"] => Some("true".into()),
            ["modules", module, "params", name] => {
                serde_json::to_string(&self.agent.composition().assembly.default_of(module, name)?).ok()
            }
            _ => None,
        }
    }

    /// Restores a snapshot, except for the values of the `kept` settings.
    /// If another configuration is given, it is restored too; it must have the settings of the snapshot, or these
    /// values where the snapshot has none.
    fn go_on(
        &self,
        snapshot: &Snapshot,
        kept: &[String],
        other: Option<(&Configuration, &SortedMap<String, String>)>,
    ) -> Result<(), SnapshotError> {
        self.is_of(snapshot)?;
        let mut composition = self.agent.composition();
        let here = &composition.configuration;
        let configuration = match other {
            Some((other, _)) => Arc::new(other.with_loaded_of(here)),
            None => Arc::clone(here),
        };
        let configuration = with_links_of(snapshot, &configuration);
        let subjects = SnapshotSubjects::of(&composition, &self.agent.shared)?.modules;
        let mut problems = fit::problems(&composition, &subjects, snapshot, &self.agent.shared);
        let different = DifferentSetting::between(&configuration, &*settings_of(snapshot)?);
        let matters = |own: &&DifferentSetting| match other {
            Some((_, unset)) => own.there.is_some() || !unset.contains_key(&own.path),
            None => own.property().is_none(),
        };
        let line = |own: &DifferentSetting| match (&own.there, other) {
            // It is about to start, so it may start with that.
            (Some(there), None) => format!("{}: give it --set '{}={there}'", own.describe(), own.path),
            _ => own.describe(),
        };
        problems.extend(different.iter().filter(matters).map(line));
        if !problems.is_empty() {
            return Err(unfit(snapshot, problems));
        }
        let mark = composition.assembly.resources.mark();
        let Composition { assembly, catalogue, .. } = &mut *composition;
        let links = Relinking::prepare(assembly, &configuration, catalogue, &self.agent.shared);
        let links = links.map_err(|unlinked| unlinked.report)?;
        let exchanged = self.exchange_all(&composition, &configuration, snapshot, (subjects, kept), links);
        let (old, links) = exchanged.inspect_err(|_| composition.assembly.resources.undo(&mark, []))?;
        let relinked = links.note(&mut composition.assembly);
        composition.configuration = configuration;
        composition.waiting.unlinked = None;
        composition.assembly.resources.index = snapshot.image.outputs;
        self.agent.shared.logger.set_levels(levels(snapshot));
        if let Some(watch) = composition.snapshots.automatic.as_ref() {
            watch.begin(&self.agent.shared);
        }
        // The old instances end here, and not on the loop.
        drop(old);
        self.agent.record_links(&relinked);
        let seconds = snapshot.time() as f64 * 1e-9;
        self.agent
            .say(&format!("resumed from the snapshot of {seconds:.3} s, after cycle {}", snapshot.cycle()));
        for plugin in fit::other_code(&composition, snapshot) {
            let text = format!(
                "plugin `{plugin}` has other code than in the snapshot, so the run may differ from the one that was saved"
            );
            self.agent.log(slate_module::Level::Warn, &text);
        }
        Ok(())
    }

    /// Makes the new state, and exchanges it together with the links.
    /// Returns the old instances.
    fn exchange_all(
        &self,
        composition: &Composition,
        configuration: &Arc<Configuration>,
        snapshot: &Snapshot,
        (subjects, kept): (Vec<SnapshotSubject>, &[String]),
        links: Relinking,
    ) -> Result<(Vec<Retired>, Relinking), SnapshotError> {
        let problems = fit::properties(&self.agent.shared.board, &links, &snapshot.image);
        if !problems.is_empty() {
            return Err(unfit(snapshot, problems));
        }
        let names: Vec<_> = subjects.iter().map(|subject| subject.name.clone()).collect();
        let lingering = |lingering: crate::aspects::AbandonedThread| SnapshotError::Thread {
            module: lingering.module.to_string(),
            thread: lingering.thread.to_string(),
            limit: lingering.limit,
        };
        let _closed =
            composition.assembly.resources.service_context.threads.close(&names).map_err(lingering)?;
        let fresh = self.instances(composition, configuration, snapshot)?;
        let settings = composition.assembly.resources.settings(&names);
        let application_states = snapshot.image.application_states.iter().filter_map(|(name, saved)| {
            // It was found to fit.
            composition.snapshots.application_states.get(name)?.restore(&saved.0).ok()
        });
        let ready = Ready {
            image: snapshot.image.clone(),
            fresh,
            kept: kept
                .iter()
                .filter_map(|path| Some((path.clone(), settings.get(path)?.bytes.clone())))
                .collect(),
            application_states: application_states.collect(),
            time: Arc::<TimePlace>::clone(&composition.assembly.resources.service_context.time),
            rearm: composition.armed,
        };
        let held = HeldCells::of(&subjects)?;
        let cells: Vec<_> = subjects.iter().map(|subject| Arc::clone(&subject.cell)).collect();
        let restoration = Restoration { subjects, ready };
        let recorder = self.agent.recorder.clone();
        let done = links.exchange_with(
            &composition.assembly,
            &self.agent.shared,
            move |shared| {
                let restoration = restoration.check(shared)?;
                // Of a load that is refused before, what records the agent has nothing to tell.
                recorder.record_unrepeatable("a restore from a snapshot");
                Ok(restoration)
            },
            |shared, restoration| restoration.apply(shared),
        );
        drop(held);
        done.unwrap_or_else(|| {
            let late = cells.iter().zip(names).find(|(cell, _)| !cell.is_idle());
            Err(SnapshotError::Busy { module: late.map(|(_, name)| name).unwrap_or_default(), limit: LIMIT })
        })
    }

    /// Makes an instance for each module, with its state in the snapshot.
    /// `None` for a module that had no instance.
    fn instances(
        &self,
        composition: &Composition,
        configuration: &Arc<Configuration>,
        snapshot: &Snapshot,
    ) -> Result<SortedMap<String, Option<Retired>>, SnapshotError> {
        let mut target = composition.target(|_| {});
        target.configuration = Arc::clone(configuration);
        let described = composition.check(&target)?;
        let mut fresh = SortedMap::new();
        for (name, fitting) in &described {
            let Some(saved) = snapshot.image.modules.get(name) else { continue };
            let instance = match &saved.state {
                Some(state) => Some(instance(composition, (name, fitting), saved, &state.0, snapshot)?),
                None => None,
            };
            fresh.insert(name.clone(), instance);
        }
        Ok(fresh)
    }
}

fn instance(
    composition: &Composition,
    (name, fitting): (&String, &Fitting),
    saved: &ModuleSnapshot,
    state: &[u8],
    snapshot: &Snapshot,
) -> Result<Retired, SnapshotError> {
    let refused = |what: &str, reason: String| {
        unfit(snapshot, vec![format!("module `{name}` ({}) {what}: {reason}", saved.kind)])
    };
    let set = snapshot.image.properties.get(&format!("{name}/params"));
    let newest = set.and_then(|set| set.values.values.last());
    let params = newest.map_or(fitting.params.as_slice(), |value| &value.bytes);
    let loaded = composition.assembly.modules.get(name);
    let kind = loaded.map_or_else(|| fitting.kind.clone(), |loaded| loaded.placed(&fitting.kind));
    let made = fitting.setup.with(|setup| kind.create(setup, params));
    let made = made.map_err(|refusal| refused("can't be set up", refusal.0))?;
    let is_isolated = loaded.is_some_and(|loaded| loaded.isolation.is_some());
    let retired = Retired::new(
        kind,
        made,
        composition.assembly.resources.timeout(&Arc::from(name.as_str()), is_isolated),
    );
    let (retired, fits) = retired.restored(state.to_vec());
    fits.map_err(|reason| refused("does not take its state", reason))?;
    Ok(retired)
}

fn levels(snapshot: &Snapshot) -> Levels {
    let level = |number: &u32| slate_module::Level::from_number(*number);
    let all = &snapshot.image.log_levels;
    let mut levels = Levels::new(all.get("").map_or(slate_module::Level::Info, level));
    for (name, number) in all.iter().filter(|(name, _)| !name.is_empty()) {
        levels.set(Some(name), level(number));
    }
    levels
}

/// Returns the snapshot's configuration.
fn settings_of(snapshot: &Snapshot) -> Result<Arc<Configuration>, SnapshotError> {
    Ok(with_links_of(snapshot, &snapshot.configuration(Vec::new())?.current()))
}

/// Returns the configuration with a snapshot's inferred links, if separate.
fn with_links_of(snapshot: &Snapshot, configuration: &Arc<Configuration>) -> Arc<Configuration> {
    match &snapshot.image.inferred {
        Some(links) => Arc::new(configuration.with_inferred_links(links)),
        None => Arc::clone(configuration),
    }
}

fn unfit(snapshot: &Snapshot, problems: Vec<String>) -> SnapshotError {
    SnapshotError::Unfit { agent: snapshot.agent().into(), problems }
}

/// Returns the variants of a snapshot that differ from the agent's.
/// With the snapshot's settings alone, the agent would have the settings of one variant and the name of another.
fn other_variants(here: &Configuration, there: &Configuration) -> Vec<String> {
    let own: SortedMap<_, _> = Variant::chosen(here).map(|variant| (variant.choice, variant.name)).collect();
    let others = Variant::chosen(there).filter_map(|Variant { choice, name, .. }| {
        let own = own.get(choice).filter(|own| **own != name)?;
        Some(format!("`{choice}` is `{own}` here and `{name}` in it: slate config set {choice}={name}"))
    });
    others.collect()
}
