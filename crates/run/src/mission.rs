//! Run of an application from start to verdict.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use slate_blackboard::interface::Value;
use slate_module::Level;
use slate_record::{RecordError, Recorded, Recorder};
use slate_report::{Outcome, Scene, Summary, Trajectory, TrajectoryStream};
use slate_runtime::configuration::Subscription;
use slate_runtime::log::LogTarget;
use slate_runtime::memory::MemoryError;
use slate_runtime::snapshot::Snapshot;
use slate_runtime::{Agent, Control, Cycle, End, Options, Rate};
use slate_share::agent::AgentSharing;
use slate_sorted::SortedMap;

use crate::Application;
use crate::RunError;
use crate::causes;
use crate::observation::{JudgeMetrics, Observation};
use crate::options::ModeName;
use crate::run_history::{self, RunHistory};
use crate::scene;
use crate::unfed::UnfedInputs;
use crate::warnings::Warnings;

/// Figures of every judge, which are fields of the summary.
const STANDARD_FIGURES: [&str; 6] =
    ["time_to_goal", "path_length", "shortest_path", "minimum_clearance", "collisions", "collisions_caused"];

/// Time at one place after which a failed run reports that a robot stood, ns.
const MIN_STANDSTILL: u64 = 10_000_000_000;

/// Result of a run.
pub struct Finished {
    /// Agent, which makes no more cycles.
    pub agent: Agent,
    /// Outcome and figures.
    pub summary: Summary,
    /// World at the start.
    pub scene: Scene,
    /// Poses of the robots over time.
    pub trajectory: Trajectory,
    /// Result of writing the modules' memories of the run.
    pub remembered: Result<(), MemoryError>,
    /// Recording, if any.
    pub recorded: Option<Result<Recorded, RecordError>>,
}

/// Returns fingerprints of the modules' memory files.
/// They are conditions of the run.
fn memories(agent: &Agent) -> SortedMap<String, String> {
    let text = |began: Option<u64>| began.map_or_else(|| "none".into(), |hash| format!("{hash:016x}"));
    agent.memories().map(|(module, began)| (format!("memory of {module}"), text(began))).collect()
}

/// Options of a mission.
pub struct MissionOptions {
    /// Scheduling mode of the modules.
    pub mode: ModeName,
    /// Speed of simulated time.
    pub rate: Rate,
    /// Number of worker threads.
    pub workers: usize,
    /// Targets of the log beside those of the configuration.
    pub log: Vec<Box<dyn LogTarget>>,
    /// Recording of every robot's trajectory for the report, instead of figures only.
    pub trajectory: bool,
    /// Reachability for tools and other agents, and reload of edited files.
    pub follows: bool,
    /// Disarmed start even in a simulator, until a person arms the actuators.
    pub disarmed: bool,
}

/// Returns the file with the state of libraries when they were last loaded.
/// It is in the folder for state files of this user's programs.
fn known_libraries() -> Option<PathBuf> {
    let folder = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let kept = folder("XDG_STATE_HOME").or_else(|| Some(folder("HOME")?.join(".local/state")))?;
    Some(kept.join("slate/libraries.json"))
}

/// Run that is ready to start.
pub struct MissionRun {
    /// Agent, which is loaded.
    pub agent: Agent,
    /// Data of the run that the report follows.
    pub observation: Arc<Observation>,
    application: Application,
    scene: Scene,
    course: RunHistory,
    mode: ModeName,
    wants_trajectory: bool,
    recorder: Option<Recorder>,
    /// Writes the trajectory while the run goes.
    stream: Option<TrajectoryStream>,
    warnings: Warnings,
}

impl MissionRun {
    /// Loads an application; on an error nothing is started.
    pub fn load(application: Application, mission: MissionOptions) -> Result<Self, RunError> {
        let configuration = &application.configuration;
        let recorder = mission.follows.then(|| Recorder::on_demand(configuration.record()));
        let warnings = Warnings::default();
        let kept: Box<dyn LogTarget> = Box::new(warnings.clone());
        let log = mission.log.into_iter().chain(recorder.as_ref().map(Recorder::log_target)).chain([kept]);
        let is_simulated = configuration.time_source().is_some() || configuration.is_clock_elsewhere();
        let options = Options {
            mode: mission.mode.mode(),
            rate: mission.rate,
            workers: mission.workers,
            log: log.collect(),
            recording: recorder.clone().map(|recorder| Arc::new(recorder) as _),
            // Many runs at once would be several agents of one name.
            sharing: mission.follows.then(|| Box::new(AgentSharing::default()) as _),
            // Many runs at once would all begin with the same memory, and only one could write it.
            keeps_memory: mission.follows,
            follows_files: mission.follows,
            known_libraries: known_libraries(),
            // Robots in the embedded simulator arm themselves; real ones wait for a person.
            armed: !mission.disarmed && is_simulated,
            ..Options::default()
        };
        let agent = Agent::load_with(&application.database, &application.plugins, options)?;
        let observation = Arc::new(Observation::new(&application.configuration, &**agent.board())?);
        let scene = scene::of(&application.configuration)?;
        let course = RunHistory::new(&application.name, memories(&agent));
        course.note_variants(&application.configuration, 0);
        agent.composer().add_application_state(run_history::SNAPSHOT_KEY, Arc::new(course.clone()));
        if let Some(recorder) = &recorder {
            recorder.note_content(&agent);
        }
        Ok(Self {
            agent,
            observation,
            application,
            scene,
            course,
            mode: mission.mode,
            wants_trajectory: mission.trajectory,
            recorder,
            stream: None,
            warnings,
        })
    }

    /// Begins to record, if the configuration requests it, and lets tools record.
    /// Recordings without a file of their own go into that folder.
    pub fn record(&self, folder: &Path) {
        if let Some(recorder) = &self.recorder {
            recorder.attach_files(scene::files(&self.application.configuration));
            recorder.attach(&self.agent, folder);
        }
    }

    /// Writes the trajectory into a folder during the run.
    /// So a run that is killed leaves it too.
    pub fn stream_trajectory(&mut self, folder: &Path) {
        match self.course.stream_into(folder) {
            Ok(stream) => self.stream = Some(stream),
            Err(error) => {
                let text = format!(
                    "the trajectory is written at the end of the run only, as a thread can't be started: {error}"
                );
                self.agent.logger().log(self.agent.now(), Level::Warn, &text);
            }
        }
    }

    /// Returns true if the run has a mission, to whose goal a path has a length.
    fn has_mission(&self) -> bool {
        self.application.configuration.mission().is_some()
    }

    /// Returns whether the run leaves a report even if no tool records.
    /// It does with a mission, robots to follow or a recording.
    pub fn keeps_report(&self) -> bool {
        let configuration = &self.application.configuration;
        let record = configuration.record();
        self.has_mission() || !self.observation.robots.is_empty() || record.enabled
    }

    /// Returns whether the agent may stay when its run is over.
    /// The drivers of real actuators end with the run.
    pub fn can_stay(&self) -> bool {
        let configuration = &self.application.configuration;
        let is_simulated = configuration.time_source().is_some() || configuration.is_clock_elsewhere();
        is_simulated || configuration.actuators().is_empty()
    }

    /// Returns the actuators that pass no command before a person arms them.
    pub fn disarmed(&self) -> Vec<&str> {
        if self.agent.begins_armed() {
            return Vec::new();
        }
        let actuators = self.application.configuration.actuators().iter();
        actuators.map(|actuator| actuator.name.value.as_str()).collect()
    }

    /// Returns the world at the start.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Resumes from a snapshot, with the settings that the application was loaded with.
    pub fn resume(&self, snapshot: &Snapshot) -> Result<(), RunError> {
        self.agent.restore_under_own_settings(snapshot)?;
        if let Some(recorder) = &self.recorder {
            recorder.note_content(&self.agent);
        }
        Ok(())
    }

    /// Adds the use of the routes to the figures of the `first` and other robots.
    fn add_routes(
        &self,
        first: &str,
        figures: &mut SortedMap<String, f64>,
        robots: &mut SortedMap<String, SortedMap<String, f64>>,
    ) {
        for (robot, routes) in self.course.routes() {
            let of_first = robot == first || first.is_empty();
            let own = if of_first { Some(&mut *figures) } else { robots.get_mut(&robot) };
            let Some(own) = own else { continue };
            own.insert("lasting_route_changes".into(), routes.lasting_changes() as f64);
            own.extend(routes.reactive_share().map(|share| ("reactive_share".to_owned(), share)));
        }
    }

    /// Describes the robots that have stood for a while at the end of a run.
    /// Such as "r2 stood at (-2.10, 2.24) m since 34.12 s, on the reactive route (AvoidObstacle)".
    fn robots_that_stood(&self, now: u64) -> Option<String> {
        let stood = self.course.routes().into_iter().filter_map(|(robot, routes)| {
            let ([x, y], since) =
                routes.stays().filter(|(_, since)| now.saturating_sub(*since) >= MIN_STANDSTILL)?;
            let route = routes.route().map_or_else(String::new, |route| {
                let observed = self.observation.robots.iter().find(|observed| observed.name == robot);
                let action = observed.and_then(|observed| observed.now()).map(|now| now.action);
                let action = action.filter(|action| !action.is_empty() && action != "none");
                let action = action.map_or_else(String::new, |action| format!(" ({action})"));
                format!(", on the {} route{action}", route.name())
            });
            Some(format!("{robot} stood at ({x:.2}, {y:.2}) m since {:.2} s{route}", since as f64 * 1e-9))
        });
        stood.reduce(|all, one| format!("{all}; {one}"))
    }

    /// Records in each cycle the variants that changed configurations choose.
    /// Each has the time of the cycle.
    fn follow_variants(&self) -> Result<(Subscription, impl FnMut(u64) + Send + 'static), RunError> {
        let changes = Arc::new(AtomicBool::new(false));
        let (noted, database, course) =
            (Arc::clone(&changes), self.application.database.clone(), self.course.clone());
        let subscription = database.subscribe("", move |_, _| noted.store(true, Ordering::Release))?;
        let note = move |now| {
            if changes.swap(false, Ordering::AcqRel) {
                course.note_variants(&database.current(), now);
            }
        };
        Ok((subscription, note))
    }

    /// Runs until the verdict.
    #[allow(clippy::disallowed_methods, reason = "a summary has the duration on the wall clock")]
    pub fn run(mut self) -> Result<Finished, RunError> {
        let start = Instant::now();
        let (subscription, mut note_variants) = self.follow_variants()?;
        let observer = {
            let (observation, course) = (Arc::clone(&self.observation), self.course.clone());
            let wanted = self.wants_trajectory;
            let mut unfed = UnfedInputs::new(&self.agent);
            move |cycle: &Cycle<'_>| {
                unfed.note(cycle.now);
                note_variants(cycle.now);
                let running = observation.is_running();
                course.note(cycle, &observation, (running, wanted));
                if running { Control::Continue } else { Control::Stop }
            }
        };
        let end = self.agent.run(Box::new(observer))?;
        let wall_time = start.elapsed();
        drop(subscription);
        let (cycles, now) = self.course.cycles();
        let recorded = self.recorder.as_ref().and_then(|recorder| recorder.finish(&mut self.agent));
        let digest = self.agent.digest().map_or_else(|| "none".into(), |digest| format!("{digest:016x}"));
        let judged = self.observation.metrics();
        let (outcome, verdict, message) = self.judge(&end, &judged);
        let failure = (!outcome.is_success()).then_some(&self.warnings);
        let stopped = causes::describe(&self.agent.composer(), self.agent.board(), self.agent.now(), failure);
        let stood = failure.and_then(|_| self.robots_that_stood(now));
        let message = [message, stopped, stood]
            .into_iter()
            .flatten()
            .reduce(|message, cause| format!("{message}; {cause}"));
        let mut judged = judged.into_iter();
        let JudgeMetrics { robot: first, mut figures, mut units } = judged.next().unwrap_or_default();
        let standard = STANDARD_FIGURES.map(|name| figures.remove(name));
        let [time_to_goal, path_length, shortest_path, minimum_clearance, collisions, collisions_caused] =
            standard;
        let count = |figure: Option<f64>| figure.map_or(0, |figure| figure as u64);
        let mut robots: SortedMap<_, SortedMap<_, _>> = SortedMap::new();
        for metrics in judged {
            // Another referee's measurement of the same robot is a further figure.
            match metrics.robot == first {
                true => figures.extend(metrics.figures),
                false => robots.entry(metrics.robot).or_default().extend(metrics.figures),
            }
            units.extend(metrics.units);
        }
        self.add_routes(&first, &mut figures, &mut robots);
        let is_shown =
            |name: &String| figures.contains_key(name) || robots.values().any(|own| own.contains_key(name));
        units.retain(|name, _| is_shown(name));
        let status = self.status_counts();
        let conditions = self.conditions(now);
        let summary = Summary {
            example: self.application.name.clone(),
            seed: self.application.configuration.seed().value,
            mode: self.mode.name().into(),
            conditions,
            outcome,
            verdict,
            message,
            sim_time_s: now as f64 * 1e-9,
            wall_time_s: wall_time.as_secs_f64(),
            time_to_goal_s: time_to_goal,
            path_length_m: path_length.filter(|_| self.has_mission()),
            shortest_path_m: shortest_path,
            collisions: count(collisions),
            collisions_caused: count(collisions_caused),
            min_clearance_m: minimum_clearance,
            route_switches: status.0,
            reflexes: status.1,
            figures,
            robots,
            units,
            ticks: cycles,
            digest,
        };
        drop(self.stream.take());
        let trajectory = self.course.take_trajectory();
        let remembered = self.agent.remember();
        Ok(Finished { agent: self.agent, summary, scene: self.scene, trajectory, remembered, recorded })
    }

    /// Returns the conditions of the figures of a run that has ended at a time.
    fn conditions(&self, now: u64) -> SortedMap<String, String> {
        let mut conditions = scene::conditions(&self.application.configuration);
        conditions.extend(self.observation.speed().map(|speed| ("speed".into(), speed)));
        conditions.extend(self.course.memories());
        // A change behind the last cycle counts too.
        self.course.note_variants(&self.application.database.current(), now);
        conditions.extend(self.course.changed_variants());
        conditions
    }

    /// Returns the outcome, the judge's own word for it, and the reason.
    fn judge(&self, end: &End, judged: &[JudgeMetrics]) -> (Outcome, Option<String>, Option<String>) {
        let failed = |reason| (Outcome::Failed, None, Some(reason));
        match end {
            End::Hung { module } => return failed(format!("{module} hangs in its tick")),
            End::TooManyHung { modules } => {
                return failed(format!("hang in their ticks: {}", modules.join(", ")));
            }
            End::Unanswered { reason } => return failed(reason.clone()),
            End::Stopped => {}
        }
        let Some(verdict) = self.observation.verdict().filter(|verdict| verdict.state != "RUNNING") else {
            return (Outcome::Stopped, None, None);
        };
        let has_collided = |metrics: &JudgeMetrics| {
            metrics.figures.get("collisions_caused").is_some_and(|collisions| *collisions > 0.0)
        };
        let outcome = verdict.outcome();
        // A judge of one's own may leave collisions to the figures.
        if outcome.is_success() && judged.first().is_some_and(has_collided) {
            return (Outcome::Collided, None, Some(verdict.reason));
        }
        (outcome, verdict.own_word().map(str::to_owned), Some(verdict.reason))
    }

    /// Returns the numbers of route switches and reflexes of all robots.
    fn status_counts(&self) -> (u64, u64) {
        let mut counts = (0, 0);
        for robot in &self.observation.robots {
            let Some(status) = robot.status() else { continue };
            let count = |name: &str| status.get(name).and_then(Value::as_integer).unwrap_or(0) as u64;
            counts.0 += count("route_switches");
            counts.1 += count("reflexes");
        }
        counts
    }
}
