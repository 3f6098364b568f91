//! Repeats a run.

use std::io::{Read, Seek};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use slate_blackboard::channel::Tap;
use slate_blackboard::{Property, Taps};
use slate_runtime::Agent;
use slate_runtime::configuration::Record;
use slate_runtime::recording::{Change, Recording};
use slate_runtime::snapshot::PluginMark;
use slate_sorted::{SortedMap, SortedSet};

use super::changes::CycleChanges;
use super::comparer::{Comparer, ComparisonProgress, mark_cycle_end};
use super::expected::Expected;
use super::external::{ExternalSelection, ExternalValues};
use super::run::Run;
use super::verdict::Verdict;
use slate_bag::{Error, Reader};
use slate_record::capture::Hub;

/// Repeats a recorded run, and compares it value by value.
pub struct Comparison {
    run: Run,
    hub: Arc<Hub>,
    expected: Expected,
    external: ExternalValues,
}

impl std::fmt::Debug for Comparison {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Comparison").field("run", &self.run).finish_non_exhaustive()
    }
}

impl Comparison {
    /// Opens a recording. One of a killed run is compared as far as it goes.
    ///
    /// # Errors
    /// When it can't be read, is damaged, or is not a recording of an agent.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let mut reader = Reader::open_unfinished(path)?;
        let run = Run::read_all(&mut reader)?;
        let inputs = run.external.keys().cloned().chain(ordered_inboxes(&reader)).collect::<SortedSet<_>>();
        reader.rewind();
        let expected = Expected::new(reader);
        let inputs = inputs.into_iter().collect();
        let external = ExternalValues::find(path, run.epoch(), inputs, ExternalSelection::ValuesAndMessages)?;
        let hub = Hub::new(Record::default().buffer);
        hub.add_recording(0, Box::new(|_| true));
        Ok(Self { run, hub, expected, external })
    }

    /// Returns the recorded run.
    pub fn run(&self) -> &Run {
        &self.run
    }

    /// Returns the recording of the agent that repeats the run.
    /// It is for [`Options::recording`](slate_runtime::Options::recording); the agent is loaded with the recorded
    /// [configuration](Run::configuration).
    pub fn recording(&self) -> Arc<dyn Recording> {
        Arc::new(RunTaps(Arc::clone(&self.hub)))
    }

    /// Repeats the run with a freshly loaded agent, up to the first different value.
    /// Each value is compared with the recorded one, meanwhile in another thread.
    ///
    /// # Errors
    /// When the recording can't be read to its end.
    pub fn compare(self, mut agent: Agent) -> Result<Verdict, Error> {
        if let Some(obstacle) = self.run.obstacle().or_else(|| other_code(&self.run, &agent)) {
            return Ok(Verdict::NotCovered(obstacle));
        }
        if self.run.is_empty() {
            return Ok(Verdict::Nothing);
        }
        let Self { run, hub, expected, mut external } = self;
        let comparer = Comparer::new(expected, Arc::clone(&hub), &run);
        let course = ComparisonProgress::default();
        let (mut comparer, driven) = std::thread::scope(|scope| {
            let worker = scope.spawn(|| comparer.follow(&course));
            hub.begin(true, worker.thread().clone());
            let driven = drive(&run, &mut agent, &hub, &course, &mut external);
            course.is_over.store(true, Ordering::Release);
            hub.wake();
            let comparer = worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            (comparer, driven)
        });
        let verdict = match comparer.found.take().transpose()? {
            Some(verdict) => verdict,
            None => match driven {
                Err(obstacle) if !comparer.is_done() => Verdict::NotCovered(obstacle),
                _ => comparer.end(&run, &mut agent)?,
            },
        };
        Ok(weaken_verdict(verdict, run.unchecked()))
    }
}

/// Weakens a negative verdict if messages of the recording are unchecked.
/// A difference proves nothing about the run if the recording may be wrong.
fn weaken_verdict(verdict: Verdict, unchecked: u64) -> Verdict {
    let doubt = |found: &dyn std::fmt::Display| {
        Verdict::NotCovered(format!(
            "the recording was repaired, and {unchecked} of its messages have no checksum: {found}"
        ))
    };
    match verdict {
        Verdict::Different(difference) if unchecked > 0 => doubt(&difference),
        Verdict::NotCovered(obstacle) if unchecked > 0 => doubt(&obstacle),
        verdict => verdict,
    }
}

/// Repeats the cycles of the run, until it is over or everything is compared.
/// The recorded changes and values from outside are made between the cycles.
///
/// # Errors
/// Why the run can't be made again.
fn drive(
    run: &Run,
    agent: &mut Agent,
    hub: &Hub,
    course: &ComparisonProgress,
    external: &mut ExternalValues,
) -> Result<(), String> {
    let mut changes = run.changes.iter().cloned().collect();
    CycleChanges::new(&mut changes, 0).make_rest(agent)?;
    mark_cycle_end(hub, 0, agent.now());
    let mut cycle = 0;
    while !course.is_enough.load(Ordering::Acquire) && run.cycles().is_none_or(|cycles| cycle < cycles) {
        cycle += 1;
        let mut made = Ok(());
        let mut due = CycleChanges::new(&mut changes, cycle);
        let has_returned = agent.step_with(|agent| {
            if made.is_ok() {
                made = due.make_before_request(agent);
            }
        });
        if !has_returned {
            return Err("a module does not return from its tick".into());
        }
        made?;
        due.make_rest(agent)?;
        // None is taken before the first cycle.
        external.set_until(agent, agent.now())?;
        mark_cycle_end(hub, cycle, agent.now());
    }
    Ok(())
}

/// Inboxes with messages that no module sent, such as those of a person.
fn ordered_inboxes<R: Read + Seek>(reader: &Reader<R>) -> Vec<String> {
    let is_ordered = |metadata: &SortedMap<String, String>| {
        metadata.get("access").is_some_and(|access| access == "messages") && !metadata.contains_key("from")
    };
    // A file that was not read to its end has a summary.
    let said = reader.channel_counts().into_iter().flatten().map(|(channel, _)| channel);
    let channels = reader.channels().chain(said).filter(|channel| is_ordered(&channel.metadata));
    channels.map(|channel| channel.topic.trim_start_matches('/').to_owned()).collect()
}

/// Observer of the agent's outputs.
struct RunTaps(Arc<Hub>);

impl Taps for RunTaps {
    fn tap(&self, property: &Property) -> Option<Arc<dyn Tap>> {
        self.0.tap(property)
    }
}

impl Recording for RunTaps {
    fn changed(&self, _: u64, _: u64, _: &[Change]) {}
}

/// Returns the reason why an agent is not the recorded one, if there is one.
fn other_code(run: &Run, agent: &Agent) -> Option<String> {
    let mark_cycle_end =
        |plugin: PluginMark| (plugin.name, format!("{} {:016x}", plugin.version, plugin.hash));
    let plugins: SortedMap<_, _> = agent.composer().plugin_marks().into_iter().map(mark_cycle_end).collect();
    let names = run.plugins.keys().chain(plugins.keys());
    if let Some(name) = names.into_iter().find(|name| run.plugins.get(*name) != plugins.get(*name)) {
        return Some(format!("plugin `{name}` is another one than that of the recording"));
    }
    let text = |began: Option<u64>| began.map_or_else(|| "none".into(), |hash| format!("{hash:016x}"));
    let mut memories = agent.memories().map(|(module, began)| (module, text(began)));
    let other = memories.find(|(module, began)| run.memories.get(*module) != Some(began));
    let other = other.map(|(module, _)| format!("`{module}` remembers something else than it did then"));
    other.or_else(|| (!agent.is_lockstep()).then(|| "the agent is not in lockstep".into()))
}
