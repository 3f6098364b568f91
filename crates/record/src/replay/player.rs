//! Plays a recording in an agent.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};

use slate_module::Plugin;
use slate_runtime::configuration::{Configuration, Database, Report};
use slate_runtime::playback::{
    LoopSection, Order, Playback, PlaybackControl, PlaybackStatus, excerpt, interfaces,
};
use slate_runtime::plugin::load;
use slate_runtime::recording::{Change, Recording, configuration};
use slate_runtime::{Agent, Rate};

use super::orders::{Answer, Counter, Orders, orders};
use super::recompute::{Both, Recomputation, Witness};
use super::reel::{Reel, SharedReel};
use super::run::Run;
use super::timeline::{Choice, Timeline};
use crate::bag::Error;

/// How a recording is played. Times are nanoseconds after its first value.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// Which part of it, and where.
    pub choice: Choice,
    /// Where it begins; at the first value unless said.
    pub start: Option<u64>,
    /// Where it ends; at the last value unless said.
    pub end: Option<u64>,
    /// Whether it begins again at its end.
    pub repeats: bool,
    /// Whether it stands still until somebody lets it go on.
    pub is_paused: bool,
    /// How many times as fast as it was recorded; nothing for as fast as it can.
    pub rate: Option<f64>,
    /// The modules that run on what is played; what is recorded of them is not.
    pub modules: BTreeSet<String>,
    /// Settings that go over those of the recording.
    pub sets: Vec<String>,
}

/// Why a recording can't be played.
#[derive(Debug, thiserror::Error)]
pub enum PlayError {
    /// The file can't be read, or not be played as is wanted.
    #[error(transparent)]
    Bag(#[from] Error),
    /// The configuration is none any more, or a setting is wrong.
    #[error(transparent)]
    Configuration(#[from] Report),
    /// What is wanted does not fit the recording.
    #[error("`{}`: {what}", slate_runtime::printable(path))]
    Unfit {
        /// The recording.
        path: PathBuf,
        /// What does not fit, and what to do.
        what: String,
    },
    /// A module does not return from its tick.
    #[error("a module does not return from its tick")]
    Hung,
}

/// A recording that is played in an agent, which is loaded with its [`configuration`](Player::configuration) and
/// [`playback`](Player::playback).
pub struct Player {
    file: PathBuf,
    run: Option<Run>,
    plan: Plan,
    text: String,
    misses: Vec<String>,
    reel: SharedReel,
    counter: Arc<Counter>,
    orders: Orders,
    /// The first and the last time of the file, and those between which it is played.
    span: (u64, u64),
    bounds: (u64, u64),
    line: usize,
    /// The time of the last cycle.
    reached: u64,
    /// What was changed in the modules that run, while it was recorded.
    changes: VecDeque<(u64, Change)>,
    witness: Option<Witness>,
}

impl std::fmt::Debug for Player {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Player").field("file", &self.file).finish_non_exhaustive()
    }
}

/// What was played.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlayedRun {
    /// How many values.
    pub values: u64,
    /// In how many cycles.
    pub cycles: u64,
    /// From the first value of the recording to where it ended, nanoseconds.
    pub time: u64,
    /// Whether it went to its end.
    pub is_whole: bool,
}

impl Player {
    /// Opens a recording; all of it is read and checked. `plugins` are those that the agent will be loaded with.
    ///
    /// # Errors
    /// When it can't be read, is damaged, or can't be played as the plan says.
    pub fn open(path: &Path, plugins: &[Plugin], plan: Plan) -> Result<Self, PlayError> {
        let unfit = |what: String| PlayError::Unfit { path: path.into(), what };
        let run = Run::of(path)?;
        let database = match &run {
            Some(run) => run.configuration(plan.sets.clone())?,
            None => configuration("the command line", "agent.name = \"replay\"\n", plan.sets.clone())?,
        };
        let full = database.current();
        let plugins = &with_libraries(plugins, &full);
        let known = interfaces(plugins, Some(&*full));
        let first = Timeline::first_time(path)?;
        let epoch = run.as_ref().map_or(first, Run::epoch);
        let timeline = Timeline::read(path, epoch, &plan.choice, &known)?;
        let Some(span) = timeline.span() else {
            let mut why: Vec<_> =
                timeline.left_out.iter().map(|(topic, why)| format!("{topic}: {why}")).collect();
            why.truncate(SHOWN);
            let why =
                if why.is_empty() { "it has no values that are asked for".into() } else { why.join("; ") };
            return Err(unfit(format!("there is nothing to play: {why}")));
        };
        let at = |time: u64| span.0.saturating_add(time);
        let mut bounds = (plan.start.map_or(span.0, at), plan.end.map_or(span.1, at).min(span.1));
        if bounds.0 > bounds.1 {
            let seconds = (span.1 - span.0) as f64 * 1e-9;
            return Err(unfit(format!(
                "its values are within {seconds:.3} s, and there is none from --start to --end"
            )));
        }
        let lockstep = run.as_ref().filter(|run| run.is_lockstep());
        let is_lockstep = lockstep.is_some();
        if is_lockstep {
            // In the middle of nothing there is no cycle.
            let before = timeline.times.partition_point(|time| *time <= bounds.0);
            bounds.0 = before.checked_sub(1).map_or(bounds.0, |before| timeline.times[before]);
        }
        let mut reel = Reel::new(timeline, lockstep.map(Run::cycles), bounds.0);
        if run.is_none() && full.modules().is_empty() && !plan.modules.is_empty() {
            let what = "it has no configuration, so no module of it can run: it is no recording of an agent";
            return Err(unfit(what.into()));
        }
        let recorded = reel.timeline.tracks.iter().map(|track| track.path.clone()).collect();
        let excerpt = excerpt(&full, plugins, &plan.modules, &recorded).map_err(unfit)?;
        reel.silent = excerpt.silent;
        let (text, misses) = (excerpt.text, excerpt.misses);
        if let Some(run) = &run {
            run.replace(&mut reel, &full, &plan.modules);
        }
        let mut changes = VecDeque::new();
        // Cycles are counted from the beginning.
        if is_lockstep && bounds.0 == span.0 {
            let of_modules = |(_, change): &(u64, Change)| concerns(change, &plan.modules);
            changes.extend(reel.timeline.changes.drain(..).filter(of_modules));
        }
        let reel = SharedReel::new(reel);
        let is_whole = run.as_ref().is_some_and(Run::is_whole) && plan.choice.is_all();
        let witness = (!plan.modules.is_empty()).then(|| Witness::new(&reel, is_whole));
        let (counter, orders) = orders();
        Ok(Self {
            file: path.into(),
            run,
            plan,
            text,
            misses,
            reel,
            counter: Arc::new(counter),
            orders,
            span,
            bounds,
            line: 0,
            reached: bounds.0,
            changes,
            witness,
        })
    }

    /// What the agent is loaded with: of the recorded configuration, the modules that run.
    ///
    /// # Errors
    /// When it is none any more, or a setting is wrong.
    pub fn configuration(&self) -> Result<Database, Report> {
        configuration(
            &format!("the recording {}", slate_runtime::printable(&self.file)),
            &self.text,
            Vec::new(),
        )
    }

    /// What the agent is loaded with that plays, as [`Options::playback`](slate_runtime::Options::playback).
    pub fn playback(&self) -> Box<dyn Playback> {
        Box::new(self.reel.clone())
    }

    /// What the agent is loaded with that sees what modules write, as
    /// [`Options::recording`](slate_runtime::Options::recording), beside what else records it; nothing when no module runs.
    pub fn recording(&self, other: Option<Arc<dyn Recording>>) -> Option<Arc<dyn Recording>> {
        match (self.witness.as_ref().map(Witness::recording), other) {
            (Some(own), Some(other)) => Some(Arc::new(Both(own, other))),
            (own, other) => own.or(other),
        }
    }

    /// How what the modules wrote compares with what is recorded of them, after the run; nothing when no module runs.
    ///
    /// # Errors
    /// When the file has become another one.
    pub fn outcome(&mut self) -> Result<Option<Recomputation>, PlayError> {
        let end = self.reached;
        Ok(self.witness.as_mut().map(|witness| witness.outcome(end)).transpose()?)
    }

    /// What controls it from other threads.
    pub fn control(&self) -> Arc<dyn PlaybackControl> {
        Arc::clone(&self.counter) as _
    }

    /// How fast it goes at the start.
    pub fn rate(&self) -> Rate {
        rate(self.plan.rate)
    }

    /// Whether the actuators of the recorded agent were armed from the start.
    pub fn is_armed(&self) -> bool {
        self.run.as_ref().is_some_and(Run::is_armed)
    }

    /// The date of the agent's time 0, if the recording says it.
    pub fn date(&self) -> Option<SystemTime> {
        let epoch = self.run.as_ref().map_or(0, Run::epoch);
        (epoch > 0).then(|| SystemTime::UNIX_EPOCH + Duration::from_nanos(epoch))
    }

    /// Topics that are not played, and why.
    pub fn left_out(&self) -> Vec<(String, String)> {
        self.reel.get().timeline.left_out.clone()
    }

    /// What the modules that run miss that they had when it was recorded, in words.
    pub fn misses(&self) -> &[String] {
        &self.misses
    }

    /// What is to be known of topics: each with what it is.
    pub fn remarks(&self) -> Vec<(String, String)> {
        let reel = self.reel.get();
        let remarks = reel.timeline.tracks.iter().map(|track| (&track.topic, &track.form.remark));
        remarks.filter_map(|(topic, remark)| Some((topic.clone(), remark.clone()?))).collect()
    }

    /// Topics whose times go back, and how often: such a value is played at the time of the one before it.
    pub fn backwards(&self) -> Vec<(String, u64)> {
        let reel = self.reel.get();
        let back = reel.timeline.tracks.iter().filter(|track| track.backwards > 0);
        back.map(|track| (track.topic.clone(), track.backwards)).collect()
    }

    /// How many properties are played, and how long that takes in nanoseconds of the recording.
    pub fn extent(&self) -> (usize, u64) {
        (self.reel.properties().len(), self.bounds.1 - self.bounds.0)
    }

    /// Plays in an agent that was loaded for it, until the end or until `stop` is set.
    ///
    /// # Errors
    /// When the file has become another one, or a module does not return.
    pub fn run(&mut self, agent: &mut Agent, stop: &AtomicBool) -> Result<PlayedRun, PlayError> {
        self.run_with(agent, stop, |_| {})
    }

    /// As [`run`](Player::run); `look` is called after each cycle.
    ///
    /// # Errors
    /// As [`run`](Player::run).
    #[allow(clippy::disallowed_methods, reason = "what is measured is shown on the wall clock")]
    pub fn run_with(
        &mut self,
        agent: &mut Agent,
        stop: &AtomicBool,
        mut look: impl FnMut(&mut Agent),
    ) -> Result<PlayedRun, PlayError> {
        let mut turn = Turn {
            time: self.bounds.0,
            cycles: 0,
            is_paused: self.plan.is_paused,
            rate: self.plan.rate,
            section: self.plan.repeats.then_some(LoopSection { from: self.bounds.0, to: self.bounds.1 }),
            is_whole: false,
        };
        if self.bounds.0 > self.span.0 {
            self.reel.get().jump(self.bounds.0)?;
        }
        let mut shown = Instant::now();
        while !stop.load(Ordering::Relaxed) {
            if let Some((order, answer)) =
                self.orders.next(if turn.is_paused { LOOK } else { Duration::ZERO })
            {
                let done = self.obey(order, agent, &mut turn, &mut look, stop)?;
                // Who asked may be gone.
                let _ = answer.send(done);
                continue;
            }
            if turn.is_paused {
                continue;
            }
            if self.is_over(&turn) {
                let Some(section) = turn.section else {
                    turn.is_whole = true;
                    break;
                };
                self.jump(section.from, agent, &mut turn)?;
            }
            self.cycle(agent, &mut turn, &mut look)?;
            if shown.elapsed() > SHOW {
                shown = Instant::now();
                agent.publish_timing();
            }
        }
        let values = self.reel.get().values;
        let time = turn.time.saturating_sub(self.span.0);
        Ok(PlayedRun { values, cycles: turn.cycles, time, is_whole: turn.is_whole })
    }

    /// Whether nothing is left before the end.
    fn is_over(&self, turn: &Turn) -> bool {
        let end = turn.section.map_or(self.bounds.1, |section| section.to);
        turn.cycles > 0 && self.reel.get().following(turn.time).is_none_or(|next| next > end)
    }

    fn cycle(
        &mut self,
        agent: &mut Agent,
        turn: &mut Turn,
        look: &mut impl FnMut(&mut Agent),
    ) -> Result<(), PlayError> {
        while self.changes.front().is_some_and(|(after, _)| *after <= turn.cycles) {
            if let Some((_, change)) = self.changes.pop_front()
                && let Err(reason) = make(agent, &change)
            {
                self.misses
                    .push(format!("a change after cycle {} can't be made again: {reason}", turn.cycles));
            }
        }
        if !agent.step() {
            return Err(PlayError::Hung);
        }
        turn.cycles += 1;
        turn.time = agent.now();
        self.reached = turn.time;
        if let Some(witness) = &mut self.witness {
            witness.look()?;
        }
        let mut reel = self.reel.get();
        reel.check()?;
        while let Some(line) = reel.timeline.lines.get(self.line).filter(|line| line.time <= turn.time) {
            agent.logger().log_recorded(&line.module, line.time, line.level, &line.text);
            self.line += 1;
        }
        drop(reel);
        look(agent);
        Ok(())
    }

    fn jump(&mut self, time: u64, agent: &mut Agent, turn: &mut Turn) -> Result<bool, PlayError> {
        if turn.cycles == 0 {
            // The first cycle is that of the beginning.
            self.reel.get().begin = time;
        } else if !agent.jump(time) {
            return Ok(false);
        }
        let mut reel = self.reel.get();
        reel.jump(time)?;
        self.line = reel.timeline.lines.partition_point(|line| line.time <= time);
        turn.time = time;
        Ok(true)
    }

    fn obey(
        &mut self,
        order: Order,
        agent: &mut Agent,
        turn: &mut Turn,
        look: &mut impl FnMut(&mut Agent),
        stop: &AtomicBool,
    ) -> Result<Answer, PlayError> {
        let at = |time: u64| self.span.0.saturating_add(time);
        let refused = |message: String, help: &str| Ok(Err((message, help.to_owned())));
        let has_modules = !self.plan.modules.is_empty();
        match order {
            Order::Status => {}
            Order::Pause => turn.is_paused = true,
            Order::Resume => {
                turn.is_paused = false;
                agent.set_rate(rate(turn.rate));
            }
            Order::Rate(Some(factor)) if !(factor.is_finite() && factor > 0.0) => {
                return refused(format!("{factor} is no rate"), "a positive factor such as 0.5, or max");
            }
            Order::Rate(factor) => {
                turn.rate = factor;
                agent.set_rate(rate(factor));
            }
            Order::Step(count) => {
                turn.is_paused = true;
                agent.set_rate(Rate::Max);
                for _ in 0..count {
                    if stop.load(Ordering::Relaxed) || self.is_over(turn) {
                        break;
                    }
                    self.cycle(agent, turn, look)?;
                }
                agent.set_rate(rate(turn.rate));
                agent.publish_timing();
            }
            Order::Seek(_) | Order::Loop(Some(_)) if has_modules => {
                return refused(
                    "modules run on what is played, and to them time never goes back".into(),
                    "play it anew with --start, or without --recompute",
                );
            }
            Order::Seek(time) if at(time) > self.span.1 => return refused(self.beyond(time), INSIDE),
            Order::Seek(time) => drop(self.jump(at(time), agent, turn)?),
            Order::Loop(None) => turn.section = None,
            Order::Loop(Some(LoopSection { from, to })) if from >= to || at(from) > self.span.1 => {
                let message =
                    if from >= to { "a part ends after it begins".into() } else { self.beyond(from) };
                return refused(message, INSIDE);
            }
            Order::Loop(Some(LoopSection { from, to })) => {
                let section = LoopSection { from: at(from), to: at(to).min(self.span.1) };
                turn.section = Some(section);
                if !(section.from..=section.to).contains(&turn.time) {
                    self.jump(section.from, agent, turn)?;
                }
            }
        }
        Ok(Ok(self.status(turn)))
    }

    fn beyond(&self, time: u64) -> String {
        let seconds = |time: u64| time as f64 * 1e-9;
        let end = seconds(self.span.1 - self.span.0);
        format!("the recording has {end:.3} s, and {:.3} s is behind its end", seconds(time))
    }

    fn status(&self, turn: &Turn) -> PlaybackStatus {
        let after = |time: u64| time.saturating_sub(self.span.0);
        PlaybackStatus {
            file: self.file.clone(),
            time: after(turn.time),
            from: after(self.bounds.0),
            to: after(self.bounds.1),
            is_paused: turn.is_paused,
            rate: turn.rate,
            section: turn.section.map(|own| LoopSection { from: after(own.from), to: after(own.to) }),
            values: self.reel.get().values,
            modules: self.plan.modules.iter().cloned().collect(),
        }
    }
}

/// The modules of a recording of an agent, each with its type; none of another one.
///
/// # Errors
/// When it can't be read, or is damaged.
pub fn recorded_modules(path: &Path) -> Result<BTreeMap<String, String>, Error> {
    Ok(Run::of(path)?.map(|run| run.modules).unwrap_or_default())
}

/// Those plugins, and the libraries that a configuration names as far as they can be loaded: what of them modules need and can't
/// be is said when the agent is loaded.
fn with_libraries(plugins: &[Plugin], configuration: &Configuration) -> Vec<Plugin> {
    let files = configuration.plugins().iter().filter_map(|entry| entry.file.as_ref());
    let libraries = files.filter_map(|file| Some(load(&file.value).ok()?.0));
    plugins.iter().cloned().chain(libraries).collect()
}

/// Whether a change was one of these modules.
fn concerns(change: &Change, modules: &BTreeSet<String>) -> bool {
    let Change::Setting { path, .. } = change else { return false };
    let names = |module: &String| {
        let quoted = format!("\"{module}\"");
        let own = [format!("modules.{quoted}."), format!("modules.{module}."), format!("links.\"{module}/")];
        own.iter().any(|own| path.starts_with(own.as_str())) || *path == format!("{module}/enabled")
    };
    modules.iter().any(names)
}

/// Makes a change once more.
fn make(agent: &Agent, change: &Change) -> Result<(), String> {
    let Change::Setting { path, value } = change else { return Ok(()) };
    let database = agent.database().ok_or("the agent was loaded without a database")?;
    let done = match value {
        Some(value) => match path.strip_suffix("/enabled").filter(|module| !module.contains('.')) {
            Some(module) => {
                let switched = agent.composer().enable(module, value == "true");
                return switched.map_err(|error| error.to_string());
            }
            None => database.set(&[(path, value)]).map(drop),
        },
        None => database.take_back(path).map(drop),
    };
    done.map_err(|report| report.to_string())
}

/// Where a playback is.
struct Turn {
    time: u64,
    cycles: u64,
    is_paused: bool,
    rate: Option<f64>,
    section: Option<LoopSection>,
    is_whole: bool,
}

const INSIDE: &str =
    "give seconds after the first value, such as 1.5; `slate replay status` says how many there are";

/// How often a playback that stands still looks whether it is to end.
const LOOK: Duration = Duration::from_millis(50);

/// How often what was measured is shown.
const SHOW: Duration = Duration::from_millis(100);

/// How many reasons are told.
const SHOWN: usize = 5;

fn rate(factor: Option<f64>) -> Rate {
    factor.map_or(Rate::Max, Rate::Times)
}
