//! History of a run.
//! Snapshots contain it, so that the report of a resumed run is complete.

use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};
use slate_report::{RouteTally, ThinnedTrajectory, Trajectory, TrajectoryPosition, TrajectoryStream};
use slate_runtime::Cycle;
use slate_runtime::configuration::{Configuration, Variant};
use slate_runtime::snapshot::{ApplicationState, Snapshot};
use slate_sorted::SortedMap;

use crate::observation::Observation;

/// Key of the history in a snapshot.
pub const SNAPSHOT_KEY: &str = "run";

/// Clones are handles of the same.
#[derive(Clone, Debug)]
pub struct RunHistory(Arc<Mutex<RunState>>);

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct RunState {
    /// Name of the run.
    name: String,
    /// Memories that the modules began with; a resumed run keeps those of the first.
    #[serde(default)]
    memories: SortedMap<String, String>,
    /// Cycles made, and the time of the last one.
    cycles: u64,
    now: u64,
    /// Chosen variants, by choice: those at the start, and changes since.
    #[serde(default)]
    variants: SortedMap<String, Vec<ChosenVariant>>,
    /// Use of the routes by robots that have them.
    #[serde(default)]
    routes: SortedMap<String, RouteTally>,
    #[serde(flatten)]
    trajectory: ThinnedTrajectory,
}

/// Variant chosen at a time of the run, ns.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct ChosenVariant {
    name: String,
    since: u64,
}

impl RunHistory {
    /// Creates the history at the start of a run.
    /// `memories` are the memories of its modules.
    pub fn new(name: &str, memories: SortedMap<String, String>) -> Self {
        let state = RunState { name: name.into(), memories, ..RunState::default() };
        Self(Arc::new(Mutex::new(state)))
    }

    /// Returns the memories that the modules began with.
    pub fn memories(&self) -> SortedMap<String, String> {
        self.state().memories.clone()
    }

    /// Notes the variants that a configuration chooses now.
    pub fn note_variants(&self, configuration: &Configuration, now: u64) {
        let mut state = self.state();
        for Variant { choice, name, .. } in Variant::chosen(configuration) {
            let chosen = state.variants.entry(choice.into()).or_default();
            if chosen.last().is_none_or(|last| last.name != name) {
                chosen.push(ChosenVariant { name: name.into(), since: now });
            }
        }
    }

    /// Returns the choices whose variant has changed during the run.
    /// Each has the variant of the start, and each later one with its time.
    pub fn changed_variants(&self) -> SortedMap<String, String> {
        let state = self.state();
        let changed = state.variants.iter().filter(|(_, chosen)| chosen.len() > 1);
        let text = |chosen: &[ChosenVariant]| {
            let later = |one: &ChosenVariant| format!("{} from {:.3} s", one.name, one.since as f64 * 1e-9);
            let first = chosen.iter().take(1).map(|one| one.name.clone());
            first.chain(chosen.iter().skip(1).map(later)).collect::<Vec<_>>().join(", ")
        };
        changed.map(|(choice, chosen)| (choice.clone(), text(chosen))).collect()
    }

    /// Returns the name of the run in a snapshot.
    pub fn name_in(snapshot: &Snapshot) -> Option<String> {
        serde_json::from_slice::<RunState>(snapshot.kept(SNAPSHOT_KEY)?).ok().map(|state| state.name)
    }

    fn state(&self) -> MutexGuard<'_, RunState> {
        // The data stays valid after a panic in another thread that held the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Records the end of a cycle, with rows for the trajectory if wanted.
    pub fn note(&self, cycle: &Cycle<'_>, observation: &Observation, (running, wanted): (bool, bool)) {
        let mut state = self.state();
        (state.cycles, state.now) = (cycle.number, cycle.now);
        for robot in &observation.robots {
            let Some((place, route)) = robot.place_and_route() else { continue };
            match state.routes.get_mut(&robot.name) {
                Some(routes) => routes.add(cycle.now, place, route),
                None => state.routes.entry(robot.name.clone()).or_default().add(cycle.now, place, route),
            }
        }
        if wanted {
            let samples = observation.robots.iter().filter_map(|robot| robot.sample(cycle.now));
            state.trajectory.add(cycle.now, !running, samples);
        }
    }

    /// Cycles made, and the time of the last one in nanoseconds.
    pub fn cycles(&self) -> (u64, u64) {
        let state = self.state();
        (state.cycles, state.now)
    }

    /// Returns the use of the routes, by robot.
    pub fn routes(&self) -> SortedMap<String, RouteTally> {
        self.state().routes.clone()
    }

    /// Takes the trajectory out.
    pub fn take_trajectory(&self) -> Trajectory {
        Trajectory { samples: self.state().trajectory.take() }
    }

    /// Streams the trajectory into a folder while it grows.
    /// The file is `trajectory.csv.partial`, which the report replaces at the end of the run.
    pub fn stream_into(&self, folder: &Path) -> std::io::Result<TrajectoryStream> {
        let own = self.clone();
        let read = move |position: &mut TrajectoryPosition| own.state().trajectory.read(position).to_vec();
        TrajectoryStream::start(&folder.join("trajectory.csv.partial"), read)
    }
}

impl ApplicationState for RunHistory {
    fn save(&self) -> Vec<u8> {
        // Numbers and text can be written.
        serde_json::to_vec(&*self.state()).unwrap_or_default()
    }

    fn restore(&self, saved: &[u8]) -> Result<Box<dyn FnOnce() + Send>, String> {
        let state: RunState = serde_json::from_slice(saved).map_err(|error| error.to_string())?;
        let own = self.clone();
        Ok(Box::new(move || {
            let mut own = own.state();
            let mut trajectory = std::mem::take(&mut own.trajectory);
            trajectory.replace(state.trajectory);
            *own = RunState { trajectory, ..state };
        }))
    }
}
