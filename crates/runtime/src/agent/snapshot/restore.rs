//! Going on from a snapshot: everything is made ready beside what runs, and exchanged between two cycles.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::apply::{Ready, Thaw};
use super::capture::{Held, Subjects};
use super::fit::{self, Different};
use crate::agent::Composer;
use crate::agent::composition::{Composition, Fitting};
use crate::aspects::TimePlace;
use crate::configuration::{Database, Report};
use crate::log::Levels;
use crate::runner::Retired;
use crate::snapshot::{FrozenModule, Snapshot, SnapshotError};

impl Composer {
    /// Goes on from a snapshot: between two cycles all is as it was then. Real actuators are disarmed; those that arm
    /// themselves are as they were, unless they are stopped now. Settings that are another in the snapshot are changed in
    /// the `database`, if there is one.
    ///
    /// Services of the host that a module uses begin afresh, as with new code: what it has opened itself, it opens again.
    ///
    /// # Errors
    /// What does not fit; the agent goes on as it was.
    pub fn restore(&self, snapshot: &Snapshot, database: Option<&Database>) -> Result<(), SnapshotError> {
        let different = self.differences(snapshot)?;
        let changes = |value: fn(&Different) -> Option<&String>| -> Vec<(String, String)> {
            let mut changes = Vec::new();
            for own in &different {
                if own.is_link() {
                    // First it is taken away, so that nothing is left of what was said of it besides.
                    changes.push((own.path.clone(), "false".into()));
                }
                changes.extend(value(own).map(|value| (own.path.clone(), value.clone())));
            }
            changes
        };
        let Some(database) = database else {
            return self.go_on(snapshot, &[]);
        };
        // What can't be here is found out before anything is changed, but for what depends on that.
        let absent: Vec<_> = different.iter().filter(|own| own.there.is_none()).collect();
        if let Some(own) = absent.iter().find(|own| own.property().is_none() && !own.is_link()) {
            return Err(unfit(snapshot, vec![own.tell()]));
        }
        let (before, after) = (changes(|own| own.here.as_ref()), changes(|own| own.there.as_ref()));
        if !after.is_empty() {
            database.set(&after)?;
        }
        let restored = self.go_on(snapshot, &[]);
        if restored.is_err() && !before.is_empty() {
            // It held a moment ago.
            let _: Result<_, Report> = database.set(&before);
        }
        restored
    }

    /// As [`restore`](Composer::restore), but parameters, switches and values of inputs stay those that the agent was
    /// loaded with where the snapshot's configuration has others.
    ///
    /// # Errors
    /// What does not fit; the agent goes on as it was.
    pub fn restore_under_own_settings(&self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let different = self.differences(snapshot)?;
        self.go_on(snapshot, &different.iter().filter_map(Different::property).collect::<Vec<_>>())
    }

    fn differences(&self, snapshot: &Snapshot) -> Result<Vec<Different>, SnapshotError> {
        let there = snapshot.configuration(Vec::new())?.current();
        let here = Arc::clone(&self.composition().configuration);
        Ok(Different::between(&here, &there))
    }

    fn go_on(&self, snapshot: &Snapshot, kept: &[String]) -> Result<(), SnapshotError> {
        let mut composition = self.composition();
        let subjects = Subjects::of(&composition, &self.shared)?.modules;
        let mut problems = fit::problems(&composition, &subjects, snapshot, &self.shared);
        let there = snapshot.configuration(Vec::new())?.current();
        let different = Different::between(&composition.configuration, &there);
        problems.extend(different.iter().filter(|own| own.property().is_none()).map(Different::tell));
        if !problems.is_empty() {
            return Err(unfit(snapshot, problems));
        }
        let names: Vec<_> = subjects.iter().map(|subject| subject.name.clone()).collect();
        let lingering = |lingering: crate::aspects::Lingering| SnapshotError::Thread {
            module: lingering.module.to_string(),
            thread: lingering.thread.to_string(),
            limit: lingering.limit,
        };
        let _closed = composition.ground.means.threads.close(&names).map_err(lingering)?;
        let fresh = self.instances(&composition, snapshot)?;
        let settings = composition.settings(&names);
        let keepsakes = snapshot.image.keepsakes.iter().filter_map(|(name, saved)| {
            // It was found to fit.
            composition.keepsakes.get(name)?.restore(&saved.0).ok()
        });
        let ready = Ready {
            image: snapshot.image.clone(),
            fresh,
            kept: kept
                .iter()
                .filter_map(|path| Some((path.clone(), settings.get(path)?.bytes.clone())))
                .collect(),
            keepsakes: keepsakes.collect(),
            time: Arc::<TimePlace>::clone(&composition.ground.means.time),
            rearm: composition.armed,
        };
        let held = Held::of(&subjects)?;
        let seats: Vec<_> = subjects.iter().map(|subject| Arc::clone(&subject.seat)).collect();
        let thaw = Thaw { subjects, ready };
        let done = self.shared.between_cycles(&seats, move |shared| Some(thaw.apply(shared)));
        drop(held);
        let old = match done {
            Ok(done) => done?,
            Err(_) => {
                return Err(unfit(snapshot, vec!["a module has not returned from its last call".into()]));
            }
        };
        composition.ground.index = snapshot.image.outputs;
        self.shared.logger.set_levels(levels(snapshot));
        if let Some(watch) = composition.watch.as_ref() {
            watch.begin(&self.shared);
        }
        // The old instances end here, and not on the loop.
        drop(old);
        let seconds = snapshot.time() as f64 * 1e-9;
        self.log(
            slate_module::Level::Info,
            &format!("it goes on from a snapshot of {seconds:.3} s, after cycle {}", snapshot.cycle()),
        );
        for plugin in fit::other_code(&composition, snapshot) {
            let text = format!(
                "plugin `{plugin}` has other code than when the snapshot was taken: what follows may be different"
            );
            self.log(slate_module::Level::Warn, &text);
        }
        Ok(())
    }

    /// An instance for each module with the state that it had; none where there was none.
    fn instances(
        &self,
        composition: &Composition,
        snapshot: &Snapshot,
    ) -> Result<BTreeMap<String, Option<Retired>>, SnapshotError> {
        let described = composition.check(&composition.target(|_| {}))?;
        let mut fresh = BTreeMap::new();
        for (name, fitting) in &described {
            let Some(frozen) = snapshot.image.modules.get(name) else { continue };
            let instance = match &frozen.state {
                Some(state) => Some(instance(composition, (name, fitting), frozen, &state.0, snapshot)?),
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
    frozen: &FrozenModule,
    state: &[u8],
    snapshot: &Snapshot,
) -> Result<Retired, SnapshotError> {
    let refused = |what: &str, reason: String| {
        unfit(snapshot, vec![format!("module `{name}` ({}) {what}: {reason}", frozen.kind)])
    };
    let set = snapshot.image.properties.get(&format!("{name}/params"));
    let newest = set.and_then(|set| set.values.values.last());
    let params = newest.map_or(fitting.params.as_slice(), |value| &value.bytes);
    let present = composition.present.get(name);
    let kind = present.map_or_else(|| fitting.kind.clone(), |present| present.placed(&fitting.kind));
    let made = fitting.setup.with(|setup| kind.create(setup, params));
    let made = made.map_err(|refusal| refused("can't be set up", refusal.0))?;
    let is_isolated = present.is_some_and(|present| present.isolation.is_some());
    let retired =
        Retired::new(kind, made, composition.ground.patience(&Arc::from(name.as_str()), is_isolated));
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

fn unfit(snapshot: &Snapshot, problems: Vec<String>) -> SnapshotError {
    SnapshotError::Unfit { agent: snapshot.agent().into(), problems }
}
