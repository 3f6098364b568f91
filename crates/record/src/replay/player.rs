//! A recording that is played in an agent.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use slate_module::Plugin;
use slate_runtime::Rate;
use slate_runtime::configuration::{Configuration, Database, Report};
use slate_runtime::playback::{Playback, PlaybackControl, excerpt, interfaces};
use slate_runtime::plugin::load;
use slate_runtime::recording::{Change, Recording, configuration};

use super::changes::{concerns, played};
use super::coverage::some;
use super::lacks::Lacks;
use super::orders::{Counter, Orders, orders};
use super::plan::{Plan, PlayError};
use super::recompute::{Both, Recomputation, Witness};
use super::reel::{Reel, SharedReel};
use super::run::{Run, Written};
use super::timeline::Timeline;
use crate::bag::Error;

/// A recording that is played in an agent, which is loaded with its [`configuration`](Player::configuration) and
/// [`playback`](Player::playback).
pub struct Player {
    pub(super) file: PathBuf,
    run: Option<Run>,
    pub(super) plan: Plan,
    text: String,
    pub(super) misses: Vec<String>,
    pub(super) reel: SharedReel,
    counter: Arc<Counter>,
    pub(super) orders: Orders,
    /// The first and the last time of the file, and those between which it is played.
    pub(super) span: (u64, u64),
    pub(super) bounds: (u64, u64),
    /// The next line of the log.
    pub(super) line: usize,
    /// The time of the last cycle.
    pub(super) reached: u64,
    /// What was changed in the modules that run, while it was recorded: after which cycle of a run in lockstep, and on the wall
    /// clock at which time.
    pub(super) changes: VecDeque<(u64, Change)>,
    /// From cycle to cycle, nanoseconds, of a run that was on the wall clock.
    pub(super) period: Option<u64>,
    pub(super) witness: Option<Witness>,
    /// What is recorded of the modules that run.
    written: Written,
    /// Whether everything that was written is recorded and played.
    is_whole: bool,
    /// What was done then and can't be made again, in words.
    unrepeated: Vec<String>,
    /// By what they send messages that are not compared, and where to.
    unheard: BTreeMap<String, String>,
    /// How many cycles the recorded run had made where it begins.
    pub(super) skipped: u64,
}

impl std::fmt::Debug for Player {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Player").field("file", &self.file).finish_non_exhaustive()
    }
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
        let is_on_loop = |path: &str| run.as_ref().is_some_and(|run| run.is_on_loop(path));
        let timeline = Timeline::read(path, epoch, &plan.choice, &known, is_on_loop)?;
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
        let has_all = |run: &Run| run.has_all_of(&reel.timeline.coverage);
        let is_whole = run.as_ref().is_some_and(has_all) && plan.choice.is_all();
        let excerpt = {
            // Where all of what is recorded is there, an inbox without messages took none.
            let knows = run.as_ref().is_some_and(Run::has_messages);
            let mailboxes = &reel.timeline.mailboxes;
            let has_messages =
                |path: &str| knows && (is_whole || mailboxes.iter().any(|mailbox| mailbox.path == path));
            let knows_senders = |path: &str| {
                let own = mailboxes.iter().filter(|mailbox| mailbox.path == path);
                own.flat_map(|own| (0..own.senders).map(|sender| own.from.contains_key(&sender))).all(|is| is)
            };
            excerpt(&full, plugins, &plan.modules, &recorded, has_messages, knows_senders).map_err(unfit)?
        };
        let mut misses = excerpt.misses.clone();
        let begins = bounds.0 == span.0;
        let codes = codes(plugins, &full, &plan);
        let gates = gates(&excerpt.text)?;
        let (mut changes, mut unrepeated) = (VecDeque::new(), Vec::new());
        for (cycle, time, change) in std::mem::take(&mut reel.timeline.changes) {
            match played(change) {
                Change::Asked { module, lines, answer }
                    if plan.modules.contains(&module) && time >= bounds.0 =>
                {
                    reel.requests.add(time, module, lines, answer);
                }
                // Before the first cycle is said how a recording came about, such as from a playback.
                Change::Other { what } if cycle > 0 => {
                    unrepeated.push(format!("at {:.3} s there was {what}", time as f64 * 1e-9));
                }
                change if concerns(&change, &plan.modules, &codes, &gates, &excerpt) => {
                    changes.push_back((if is_lockstep { cycle } else { time }, change));
                }
                _ => {}
            }
        }
        // Cycles are counted from the beginning of the run.
        let before = run.as_ref().map_or(0, |run| run.cycles_before(span.0, full.period().value));
        let skipped = before + reel.timeline.times.partition_point(|time| *time < bounds.0) as u64;
        if is_lockstep && !begins && !reel.is_each_known && !changes.is_empty() {
            misses.push(
                "what was changed in them can't be made again, as not every cycle before --start is known"
                    .into(),
            );
        }
        let mut thin = BTreeSet::new();
        if let Some(run) = &run {
            let lacks = Lacks::new(run, &reel.timeline);
            misses.extend(lacks.told(&excerpt.reads, &excerpt.watched, &excerpt.inboxes));
            thin = lacks.thin();
        }
        if !misses.is_empty() && !plan.modules.is_empty() && !plan.is_partial {
            let what = some(&misses);
            return Err(unfit(format!(
                "the modules would not have all that they had then: {what}; record all that they read, or let them run all the \
                 same with --partial"
            )));
        }
        (reel.silent, reel.inboxes, reel.deaf) =
            (excerpt.silent.clone(), excerpt.inboxes.clone(), excerpt.deaf.clone());
        let mut deaf = excerpt.deaf.clone();
        if !is_lockstep {
            // Modules on threads of their own answer each other many times in what is one cycle here, so that a sender alone sends
            // something else.
            deaf.clear();
        }
        let text = excerpt.text.clone();
        let (mut written, mut mailboxes) = (Written::new(), Written::new());
        if let Some(run) = &run {
            written = run.replace(&mut reel, &full, &plan.modules);
            mailboxes = run.closed_mailboxes(&reel.timeline, &plan.modules);
            let lacks = Lacks::new(run, &reel.timeline);
            mailboxes.retain(|path, _| !lacks.is_ruled(path));
            deaf.retain(|path, _| !lacks.is_ruled(path));
            written.extend(mailboxes.clone());
            for (from, to) in excerpt.outboxes.iter().filter(|(_, to)| deaf.contains_key(*to)) {
                written.entry(to.clone()).or_default().extend(run.owner(from).cloned());
            }
        }
        let is_known = !is_lockstep || begins || reel.is_each_known;
        let changes = if is_known { changes } else { VecDeque::new() };
        let mut unheard = excerpt.outboxes.clone();
        unheard.retain(|_, to| !mailboxes.contains_key(to) && !deaf.contains_key(to));
        let reel = SharedReel::new(reel);
        let witness = (!plan.modules.is_empty())
            .then(|| Witness::new(&reel, is_whole, thin, mailboxes.into_keys(), deaf, &excerpt));
        let (counter, orders) = orders(&reel);
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
            period: (!is_lockstep).then(|| full.period().value),
            witness,
            written,
            is_whole,
            unrepeated,
            unheard,
            skipped,
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
        let mut outcome = self.witness.as_mut().map(|witness| witness.outcome(end)).transpose()?;
        if let Some(outcome) = &mut outcome {
            let mut reel = self.reel.get();
            if let Some((requests, first)) = reel.requests.outcome(end) {
                self.written.insert(requests.url[1..].to_owned(), reel.requests.askers.clone());
                outcome.add(requests, first);
            }
            drop(reel);
            outcome.unheard = self.unheard.clone();
            outcome.unrepeated = self.unrepeated.clone();
            outcome.has_threads = self.run.as_ref().is_some_and(Run::has_threads);
            outcome.note_unseen(&self.plan.modules, &self.written, self.is_whole);
            let begin = self.bounds.0 - self.span.0;
            outcome.fresh_from = (begin > 0).then_some(begin);
        }
        Ok(outcome)
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

    /// Topics whose times go back, and how often: such a value is played at the time of the one before it. In a recording of an
    /// agent several may write a property, such as all who command an actuator, each with the time of its own tick, so that there
    /// nothing is to be said of it.
    pub fn backwards(&self) -> Vec<(String, u64)> {
        if self.run.is_some() {
            return Vec::new();
        }
        let reel = self.reel.get();
        let back = reel.timeline.tracks.iter().filter(|track| track.backwards > 0);
        back.map(|track| (track.topic.clone(), track.backwards)).collect()
    }

    /// How many properties are played, and how long that takes in nanoseconds of the recording.
    pub fn extent(&self) -> (usize, u64) {
        (self.reel.properties().len(), self.bounds.1 - self.bounds.0)
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

/// The plugins whose recorded code the modules that run have. Whoever says where a plugin's code is wants no other one.
fn codes(plugins: &[Plugin], configuration: &Configuration, plan: &Plan) -> BTreeSet<String> {
    let modules = configuration.modules().iter().filter(|module| plan.modules.contains(&module.name.value));
    let kinds: BTreeSet<&str> = modules.map(|module| module.kind.value.as_str()).collect();
    let has = |plugin: &&Plugin| plugin.kinds().iter().any(|kind| kinds.contains(kind.name()));
    let is_given = |name: &str| {
        let places = [format!("plugins.{name}."), format!("plugins.\"{name}\".")];
        plan.sets.iter().any(|set| places.iter().any(|place| set.starts_with(place.as_str())))
    };
    let names = plugins.iter().filter(has).map(|plugin| plugin.name().to_owned());
    names.filter(|name| !is_given(name)).collect()
}

/// The actuators that a configuration has.
fn gates(text: &str) -> Result<BTreeSet<String>, Report> {
    let database = configuration("the recording", text, Vec::new())?;
    Ok(database.current().actuators().iter().map(|gate| gate.name.value.clone()).collect())
}

/// How many reasons are told.
const SHOWN: usize = 5;

/// What goes at a factor of real time; as fast as it can without one.
pub(super) fn rate(factor: Option<f64>) -> Rate {
    factor.map_or(Rate::Max, Rate::Times)
}
