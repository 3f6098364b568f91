//! Playback of a recording in an agent.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use slate_module::Plugin;
use slate_runtime::Rate;
use slate_runtime::configuration::{Database, Report};
use slate_runtime::playback::{Playback, PlaybackControl};
use slate_runtime::recording::{Recording, configuration};
use slate_sorted::SortedMap;

use super::changes::PastChange;
use super::external::ExternalValues;
use super::opening::{Opening, PastChanges, ReplacedModules, with_libraries};
use super::orders::{OrderReceiver, OrderSender, orders};
use super::output_comparer::{BothRecordings, OutputComparer};
use super::plan::{Plan, PlayError};
use super::playback_reader::{PlaybackReader, SharedPlaybackReader};
use super::recomputed::Recomputation;
use super::run::{Run, Written};
use slate_bag::Error;
use slate_record::CONFIGURATION;

/// Playback of a recording in an agent.
/// The agent is loaded with its [`configuration`](Player::configuration) and [`playback`](Player::playback).
pub struct Player {
    pub(super) file: PathBuf,
    run: Option<Run>,
    /// Reason why the configuration can't be read, if there is one.
    foreign: Option<String>,
    pub(super) plan: Plan,
    text: String,
    pub(super) misses: Vec<String>,
    pub(super) playback: SharedPlaybackReader,
    order_sender: Arc<OrderSender>,
    pub(super) orders: OrderReceiver,
    /// The first and the last time of the file, and those between which it is played.
    pub(super) span: (u64, u64),
    pub(super) bounds: (u64, u64),
    /// The next line of the log.
    pub(super) line: usize,
    /// The time of the last cycle.
    pub(super) reached: u64,
    /// Changes in the modules that run, made while the run was recorded.
    /// Each has the cycle after which it was made, or on the wall clock its time.
    pub(super) changes: VecDeque<PastChange>,
    /// Values that came from outside to inputs of the modules that run.
    pub(super) external: ExternalValues,
    /// Cycle period of a run on the wall clock, nanoseconds.
    pub(super) period: Option<u64>,
    pub(super) output_comparer: Option<OutputComparer>,
    /// Recorded outputs of the modules that run.
    written: Written,
    /// Set if every written value is recorded and played.
    is_whole: bool,
    /// Changes that can't be repeated, in words.
    unrepeated: Vec<String>,
    /// Outboxes whose messages are not compared, each with its mailbox.
    unheard: SortedMap<String, String>,
    /// Number of cycles of the recorded run before the beginning.
    pub(super) skipped: u64,
}

impl std::fmt::Debug for Player {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Player").field("file", &self.file).finish_non_exhaustive()
    }
}

impl Player {
    /// Opens a recording; all of it is read and checked.
    /// `plugins` are those with which the agent will be loaded.
    ///
    /// # Errors
    /// When it can't be read, is damaged, or can't be played as the plan says.
    pub fn open(path: &Path, plugins: &[Plugin], plan: Plan) -> Result<Self, PlayError> {
        let run = Run::of(path)?;
        let foreign = run.as_ref().and_then(Run::foreign_configuration);
        let database = match &run {
            Some(run) if foreign.is_some() => run.bare_configuration(plan.sets.clone())?,
            Some(run) => run.configuration(plan.sets.clone())?,
            None => configuration("the command line", "agent.name = \"replay\"\n", plan.sets.clone())?,
        };
        let full = database.current();
        let plugins = &with_libraries(plugins, &full);
        let opening = Opening { path, plan: &plan, run: run.as_ref(), configuration: &full, plugins };
        opening.check_version(foreign.as_deref())?;
        let is_lockstep = opening.is_lockstep();
        let (timeline, span) = opening.timeline()?;
        let bounds = opening.bounds(&timeline, span)?;
        let cycles = run.as_ref().filter(|_| is_lockstep).map(Run::cycles);
        let mut playback = PlaybackReader::new(timeline, cycles, bounds.0);
        let has_all = |run: &Run| run.has_all_of(&playback.timeline.coverage);
        let is_whole = run.as_ref().is_some_and(has_all) && plan.choice.is_all();
        let excerpt = opening.excerpt(&playback, is_whole)?;
        let PastChanges { mut changes, unrepeated } = opening.changes(&mut playback, &excerpt, bounds.0)?;
        // Cycles are counted from the beginning of the run.
        let before = run.as_ref().map_or(0, |run| run.cycles_before(span.0, full.period().value));
        let skipped = before + playback.timeline.times.partition_point(|time| *time < bounds.0) as u64;
        let is_each_known = !is_lockstep || bounds.0 == span.0 || playback.is_each_known;
        let misses = opening.misses(&playback, &excerpt, !is_each_known && !changes.is_empty())?;
        if !is_each_known {
            changes.clear();
        }
        let incomplete = opening.incomplete(&playback);
        let ReplacedModules { written, mailboxes, sender_only } = opening.replace(&mut playback, &excerpt);
        let mut unheard = excerpt.outboxes.clone();
        unheard.retain(|_, to| !mailboxes.contains_key(to) && !sender_only.contains_key(to));
        let external = opening.external()?;
        let playback = SharedPlaybackReader::new(playback);
        let output_comparer = (!plan.modules.is_empty()).then(|| {
            OutputComparer::new(&playback, is_whole, incomplete, mailboxes.into_keys(), sender_only, &excerpt)
        });
        let (order_sender, orders) = orders(&playback);
        Ok(Self {
            file: path.into(),
            run,
            foreign,
            plan,
            text: excerpt.text,
            misses,
            playback,
            order_sender: Arc::new(order_sender),
            orders,
            span,
            bounds,
            line: 0,
            reached: bounds.0,
            changes,
            external,
            period: (!is_lockstep).then(|| full.period().value),
            output_comparer,
            written,
            is_whole,
            unrepeated,
            unheard,
            skipped,
        })
    }

    /// Returns the configuration of the agent that plays.
    /// It has the modules that run, of the recorded configuration.
    ///
    /// # Errors
    /// When it is invalid, or a setting is.
    pub fn configuration(&self) -> Result<Database, Report> {
        configuration(
            &format!("the recording {}", slate_runtime::printable(&self.file)),
            &self.text,
            Vec::new(),
        )
    }

    /// Returns the playback of the agent.
    /// It is for [`Options::playback`](slate_runtime::Options::playback).
    pub fn playback(&self) -> Box<dyn Playback> {
        Box::new(self.playback.clone())
    }

    /// Returns the recording of the agent, which observes the outputs of modules.
    /// It is for [`Options::recording`](slate_runtime::Options::recording), and passes everything on to another one;
    /// `None` if no module runs.
    pub fn recording(&self, other: Option<Arc<dyn Recording>>) -> Option<Arc<dyn Recording>> {
        match (self.output_comparer.as_ref().map(OutputComparer::recording), other) {
            (Some(own), Some(other)) => Some(Arc::new(BothRecordings(own, other))),
            (own, other) => own.or(other),
        }
    }

    /// Compares the outputs of modules with the recorded ones, after the run.
    /// `None` if no module runs.
    ///
    /// # Errors
    /// When the file has changed.
    pub fn outcome(&mut self) -> Result<Option<Recomputation>, PlayError> {
        let end = self.reached;
        let mut outcome =
            self.output_comparer.as_mut().map(|output_comparer| output_comparer.outcome(end)).transpose()?;
        if let Some(outcome) = &mut outcome {
            let mut playback = self.playback.get();
            if let Some((requests, first)) = playback.requests.outcome(end) {
                self.written.insert(requests.url[1..].to_owned(), playback.requests.askers.clone());
                outcome.add(requests, first);
            }
            drop(playback);
            outcome.unheard = self.unheard.clone();
            outcome.unrepeated = self.unrepeated.clone();
            outcome.has_threads = self.run.as_ref().is_some_and(Run::has_threads);
            outcome.note_unseen(&self.plan.modules, &self.written, self.is_whole);
            let begin = self.bounds.0 - self.span.0;
            outcome.fresh_from = (begin > 0).then_some(begin);
        }
        Ok(outcome)
    }

    /// Returns a handle that controls the playback from other threads.
    pub fn control(&self) -> Arc<dyn PlaybackControl> {
        Arc::clone(&self.order_sender) as _
    }

    /// Returns the initial rate.
    pub fn rate(&self) -> Rate {
        rate(self.plan.rate)
    }

    /// Returns true if the actuators of the recorded agent were armed from the start.
    pub fn is_armed(&self) -> bool {
        self.run.as_ref().is_some_and(Run::is_armed)
    }

    /// Returns the date of the agent's time 0, if the recording says it.
    pub fn date(&self) -> Option<SystemTime> {
        let epoch = self.run.as_ref().map_or(0, Run::epoch);
        (epoch > 0).then(|| SystemTime::UNIX_EPOCH + Duration::from_nanos(epoch))
    }

    /// Topics that are not played, and why.
    pub fn left_out(&self) -> Vec<(String, String)> {
        self.playback.get().timeline.left_out.clone()
    }

    /// Inputs of the modules that run that are not recorded, in words.
    pub fn misses(&self) -> &[String] {
        &self.misses
    }

    /// Remarks for the user, each with its topic.
    pub fn remarks(&self) -> Vec<(String, String)> {
        let playback = self.playback.get();
        let remarks = playback.timeline.tracks.iter().map(|track| (&track.topic, &track.form.remark));
        let remarks = remarks.filter_map(|(topic, remark)| Some((topic.clone(), remark.clone()?)));
        let configuration = self.foreign.iter().map(|reason| {
            let remark =
                format!("another version of Slate has written it, so values are played without it: {reason}");
            (CONFIGURATION.to_owned(), remark)
        });
        configuration.chain(remarks).collect()
    }

    /// Returns the topics whose times go back, with the number of such values.
    /// Such a value is played at the time of the one before it. Empty for a recording of an agent, in which several
    /// modules may command one actuator, each with the time of its own tick.
    pub fn backwards(&self) -> Vec<(String, u64)> {
        if self.run.is_some() {
            return Vec::new();
        }
        let playback = self.playback.get();
        let back = playback.timeline.tracks.iter().filter(|track| track.backwards > 0);
        back.map(|track| (track.topic.clone(), track.backwards)).collect()
    }

    /// Returns the number of played properties, and the recording's duration, ns.
    pub fn extent(&self) -> (usize, u64) {
        (self.playback.properties().len(), self.bounds.1 - self.bounds.0)
    }
}

/// Returns the modules of an agent's recording with their kinds.
/// Empty for another recording.
///
/// # Errors
/// When it can't be read, or is damaged.
pub fn recorded_modules(path: &Path) -> Result<SortedMap<String, String>, Error> {
    Ok(Run::of(path)?.map(|run| run.modules).unwrap_or_default())
}

/// Returns the rate for a factor of real time; unlimited without one.
pub(super) fn rate(factor: Option<f64>) -> Rate {
    factor.map_or(Rate::Max, Rate::Times)
}
