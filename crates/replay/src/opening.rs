//! Opening of a recording for playback.
//! It selects the played part, the inputs of its modules, and the inputs that they would lack.

use std::collections::VecDeque;
use std::path::Path;

use slate_blackboard::interface::Descriptor;
use slate_module::Plugin;
use slate_runtime::configuration::{Configuration, Report};
use slate_runtime::playback::{Excerpt, excerpt, interfaces};
use slate_runtime::plugin::load;
use slate_runtime::recording::{Change, configuration};
use slate_sorted::{SortedMap, SortedSet};

use super::changes::{PastChange, concerns, of_readers, played};
use super::coverage::abbreviated_list;
use super::external::{ExternalSelection, ExternalValues};
use super::gap_check::GapCheck;
use super::plan::{Plan, PlayError};
use super::playback_reader::PlaybackReader;
use super::run::{Run, Written};
use super::timeline::Timeline;

/// Maximum number of reported reasons.
const MAX_REASONS: usize = 5;

/// A recording that is being opened.
pub(super) struct Opening<'a> {
    pub path: &'a Path,
    pub plan: &'a Plan,
    /// The recorded run, if it is one of an agent.
    pub run: Option<&'a Run>,
    /// The recorded configuration, with the settings of the plan.
    pub configuration: &'a Configuration,
    /// The plugins of the agent, and the libraries of the configuration.
    pub plugins: &'a [Plugin],
}

/// Outputs of the modules that run, which replace the recorded ones.
pub(super) struct ReplacedModules {
    /// The paths that they write, each with its writers.
    pub written: Written,
    /// The mailboxes among these whose senders all run.
    pub mailboxes: Written,
    /// The mailboxes of modules that do not run, whose messages are compared.
    pub sender_only: SortedMap<String, &'static Descriptor>,
}

/// Changes made while a run was recorded.
#[derive(Default)]
pub(super) struct PastChanges {
    /// Changes in the modules that run, each with its cycle.
    /// On the wall clock each has its time instead.
    pub changes: VecDeque<PastChange>,
    /// Changes that can't be repeated, in words.
    pub unrepeated: Vec<String>,
}

impl Opening<'_> {
    fn unfit(&self, what: impl Into<String>) -> PlayError {
        PlayError::Unfit { path: self.path.into(), what: what.into() }
    }

    /// Refuses to run modules by a configuration that can't be read for that reason.
    pub fn check_version(&self, foreign: Option<&str>) -> Result<(), PlayError> {
        match foreign {
            Some(reason) if !self.plan.modules.is_empty() => Err(self.unfit(format!(
                "no module of it can run, as another version of Slate has written its configuration ({reason}); play its values \
                 without modules (`slate replay FILE`), or use the version that recorded it"
            ))),
            _ => Ok(()),
        }
    }

    /// Returns true if the recorded run was in lockstep.
    pub fn is_lockstep(&self) -> bool {
        self.run.is_some_and(Run::is_lockstep)
    }

    /// Returns the values that are played, and the times of the first and the last.
    pub fn timeline(&self) -> Result<(Timeline, (u64, u64)), PlayError> {
        let known = interfaces(self.plugins, Some(self.configuration));
        let epoch = self.run.map_or_else(|| Timeline::first_time(self.path), |run| Ok(run.epoch()))?;
        let is_on_loop = |path: &str| self.run.is_some_and(|run| run.is_on_loop(path));
        let timeline = Timeline::read(self.path, epoch, &self.plan.choice, &known, is_on_loop)?;
        if let Some(span) = timeline.span() {
            return Ok((timeline, span));
        }
        let left_out = timeline.left_out.iter().take(MAX_REASONS);
        let why: Vec<_> = left_out.map(|(topic, why)| format!("{topic}: {why}")).collect();
        let why = if why.is_empty() { "it has no requested values".into() } else { why.join("; ") };
        Err(self.unfit(format!("nothing to play: {why}")))
    }

    /// Returns the times between which the recording is played.
    /// A run in lockstep begins at one of its cycles.
    pub fn bounds(&self, timeline: &Timeline, span: (u64, u64)) -> Result<(u64, u64), PlayError> {
        let at = |time: u64| span.0.saturating_add(time);
        let mut bounds = (self.plan.start.map_or(span.0, at), self.plan.end.map_or(span.1, at).min(span.1));
        if bounds.0 > bounds.1 {
            let seconds = (span.1 - span.0) as f64 * 1e-9;
            return Err(
                self.unfit(format!("its values span {seconds:.3} s, and none is between --start and --end"))
            );
        }
        if self.is_lockstep() {
            // In the middle of nothing there is no cycle.
            let before = timeline.times.partition_point(|time| *time <= bounds.0);
            bounds.0 = before.checked_sub(1).map_or(bounds.0, |before| timeline.times[before]);
        }
        Ok(bounds)
    }

    /// Returns the part of the recorded configuration that runs.
    pub fn excerpt(&self, playback: &PlaybackReader, is_whole: bool) -> Result<Excerpt, PlayError> {
        let Self { plan, run, configuration, .. } = self;
        if run.is_none() && configuration.modules().is_empty() && !plan.modules.is_empty() {
            let what =
                "it has no configuration, so no module of it can run: it is not a recording of an agent";
            return Err(self.unfit(what));
        }
        let recorded = playback.timeline.tracks.iter().map(|track| track.path.clone()).collect();
        // Where all of what is recorded is there, an inbox without messages took none.
        let knows = run.is_some_and(Run::has_messages);
        let mailboxes = &playback.timeline.mailboxes;
        let has_messages =
            |path: &str| knows && (is_whole || mailboxes.iter().any(|mailbox| mailbox.path == path));
        let knows_senders = |path: &str| {
            let own = mailboxes.iter().filter(|mailbox| mailbox.path == path);
            own.flat_map(|own| (0..own.senders).map(|sender| own.from.contains_key(&sender))).all(|is| is)
        };
        excerpt(configuration, self.plugins, &plan.modules, &recorded, has_messages, knows_senders)
            .map_err(|what| self.unfit(what))
    }

    /// Returns the changes made while it was recorded.
    /// Requests of modules go to the playback reader.
    pub fn changes(
        &self,
        playback: &mut PlaybackReader,
        excerpt: &Excerpt,
        begin: u64,
    ) -> Result<PastChanges, PlayError> {
        let modules = &self.plan.modules;
        let (codes, gates) = (self.codes(), gates(&excerpt.text)?);
        let mut past = PastChanges::default();
        for (time, PastChange { after: cycle, number, change }) in
            std::mem::take(&mut playback.timeline.changes)
        {
            match played(change) {
                Change::Asked { module, lines, answer } if modules.contains(&module) && time >= begin => {
                    playback.requests.add(time, module, lines, answer);
                }
                // Before the first cycle is said how a recording came about, such as from a playback.
                Change::Other { what } if cycle > 0 => {
                    past.unrepeated.push(format!("at {:.3} s there was {what}", time as f64 * 1e-9));
                }
                change => {
                    let own = match concerns(&change, modules, &codes, &gates, excerpt) {
                        true => vec![change],
                        false => of_readers(&change, excerpt),
                    };
                    let after = if self.is_lockstep() { cycle } else { time };
                    past.changes.extend(own.into_iter().map(|change| PastChange { after, number, change }));
                }
            }
        }
        Ok(past)
    }

    /// Returns the values that programs outside of the agent sent to inputs.
    /// These are inputs of the modules that run.
    pub fn external(&self) -> Result<ExternalValues, PlayError> {
        let find = |epoch, inputs| ExternalValues::find(self.path, epoch, inputs, ExternalSelection::Values);
        let Some(run) = self.run else { return Ok(find(0, Vec::new())?) };
        let runs = |input: &&String| run.owner(input).is_some_and(|owner| self.plan.modules.contains(owner));
        let inputs = run.external.keys().filter(runs).cloned();
        Ok(find(run.epoch(), inputs.collect())?)
    }

    /// Returns the inputs that the modules that run would lack, in words.
    /// It is an error if there are any, unless the plan permits that.
    pub fn misses(
        &self,
        playback: &PlaybackReader,
        excerpt: &Excerpt,
        lacks_changes: bool,
    ) -> Result<Vec<String>, PlayError> {
        let mut misses = excerpt.misses.clone();
        if lacks_changes {
            misses
                .push("changes in them can't be repeated, as not every cycle before --start is known".into());
        }
        if let Some(run) = self.run {
            let gap_check = GapCheck::new(run, &playback.timeline);
            misses.extend(gap_check.missing_inputs(&excerpt.reads, &excerpt.watched, &excerpt.inboxes));
        }
        if !misses.is_empty() && !self.plan.modules.is_empty() && !self.plan.is_partial {
            let what = abbreviated_list(&misses);
            return Err(self.unfit(format!(
                "inputs are incomplete: {what}; record all inputs of the modules, or run them nevertheless with --partial"
            )));
        }
        Ok(misses)
    }

    /// Returns the properties of which not every value is recorded.
    pub fn incomplete(&self, playback: &PlaybackReader) -> SortedSet<String> {
        self.run.map(|run| GapCheck::new(run, &playback.timeline).incomplete()).unwrap_or_default()
    }

    /// Replaces recorded outputs by the modules that run.
    pub fn replace(&self, playback: &mut PlaybackReader, excerpt: &Excerpt) -> ReplacedModules {
        (playback.silent, playback.inboxes, playback.sender_only) =
            (excerpt.silent.clone(), excerpt.inboxes.clone(), excerpt.deaf.clone());
        let mut sender_only = excerpt.deaf.clone();
        if !self.is_lockstep() {
            // Modules on threads of their own answer each other many times in what is one cycle here, so that a sender alone sends
            // something else.
            sender_only.clear();
        }
        let (mut written, mut mailboxes) = (Written::new(), Written::new());
        if let Some(run) = self.run {
            written = playback.replace(run, self.configuration, &self.plan.modules);
            mailboxes = run.closed_mailboxes(&playback.timeline, &self.plan.modules);
            let gap_check = GapCheck::new(run, &playback.timeline);
            mailboxes.retain(|path, _| !gap_check.is_ruled(path));
            sender_only.retain(|path, _| !gap_check.is_ruled(path));
            written.extend(mailboxes.clone());
            for (from, to) in excerpt.outboxes.iter().filter(|(_, to)| sender_only.contains_key(*to)) {
                written.entry(to.clone()).or_default().extend(run.owner(from).cloned());
            }
        }
        ReplacedModules { written, mailboxes, sender_only }
    }

    /// Returns the plugins whose recorded code the modules that run use.
    /// Plugins whose code the plan names are left out.
    fn codes(&self) -> SortedSet<String> {
        let is_meant = |name: &String| self.plan.modules.contains(name);
        let modules = self.configuration.modules().iter().filter(|module| is_meant(&module.name.value));
        let kinds: SortedSet<&str> = modules.map(|module| module.kind.value.as_str()).collect();
        let has = |plugin: &&Plugin| plugin.kinds().iter().any(|kind| kinds.contains(kind.name()));
        let is_given = |name: &str| {
            let places = [format!("plugins.{name}."), format!("plugins.\"{name}\".")];
            self.plan.sets.iter().any(|set| places.iter().any(|place| set.starts_with(place.as_str())))
        };
        let names = self.plugins.iter().filter(has).map(|plugin| plugin.name().to_owned());
        names.filter(|name| !is_given(name)).collect()
    }
}

/// Returns the plugins, and the libraries of a configuration that can be loaded.
/// A library that modules need and that can't be loaded is reported when the agent is loaded.
pub(super) fn with_libraries(plugins: &[Plugin], configuration: &Configuration) -> Vec<Plugin> {
    let files = configuration.plugins().iter().filter_map(|entry| entry.file.as_ref());
    let libraries = files.filter_map(|file| Some(load(&file.value).ok()?.0));
    plugins.iter().cloned().chain(libraries).collect()
}

/// Returns the actuators that a configuration has.
fn gates(text: &str) -> Result<SortedSet<String>, Report> {
    let database = configuration("the recording", text, Vec::new())?;
    Ok(database.current().actuators().iter().map(|gate| gate.name.value.clone()).collect())
}
