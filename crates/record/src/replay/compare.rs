//! The run, made once more.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use slate_blackboard::channel::Tap;
use slate_blackboard::{Property, Stamp, Taps};
use slate_runtime::Agent;
use slate_runtime::configuration::Record;
use slate_runtime::recording::{Change, Recording};
use slate_runtime::snapshot::PluginMark;

use super::difference::{self, Difference};
use super::expected::Expected;
use super::file::{ReadError, Source};
use super::run::Run;
use crate::recorder::{Channel, Drain, Hub, Sink};

/// A recorded run that is made once more, value by value.
pub struct Comparison {
    run: Run,
    hub: Arc<Hub>,
    expected: Expected,
}

impl std::fmt::Debug for Comparison {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Comparison").field("run", &self.run).finish_non_exhaustive()
    }
}

/// What came of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Every value is the same.
    Identical {
        /// How many there are.
        values: u64,
        /// How many cycles.
        cycles: u64,
        /// Whether that is the whole run; else the recording ends before it did.
        whole: bool,
    },
    /// A value is another one.
    Different(Difference),
    /// It can't be said.
    NotCovered(String),
}

impl Comparison {
    /// Opens a recording.
    ///
    /// # Errors
    /// When it can't be read, or is damaged.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let run = Run::read(path)?;
        let expected = Expected::new(Source::open(path)?);
        let hub = Hub::new(Record::default().buffer);
        hub.want(0, Box::new(|_| true));
        Ok(Self { run, hub, expected })
    }

    /// What the recording says of its run.
    pub fn run(&self) -> &Run {
        &self.run
    }

    /// What an agent is loaded with ([`Options::recording`](slate_runtime::Options::recording)) that is to make the run
    /// once more, with the [configuration](Run::configuration) that is recorded.
    pub fn recording(&self) -> Arc<dyn Recording> {
        Arc::new(Tape(Arc::clone(&self.hub)))
    }

    /// Makes the run with an agent that was loaded for it and did nothing yet, and compares each value with the recorded
    /// one until the first that differs.
    ///
    /// # Errors
    /// When the recording can't be read to its end.
    pub fn compare(self, mut agent: Agent) -> Result<Verdict, ReadError> {
        if let Some(obstacle) = self.run.obstacle().or_else(|| other_code(&self.run, &agent)) {
            return Ok(Verdict::NotCovered(obstacle));
        }
        let Self { run, hub, expected } = self;
        let mut drain = Drain::default();
        let mut comparer = Comparer::new(expected, run.cycles().is_some());
        let mut changes = run.changes.iter().peekable();
        let mut cycle = 0;
        loop {
            let mut settings = Vec::new();
            while let Some((_, change)) = changes.next_if(|(after, _)| *after <= cycle) {
                if let Change::Setting { path, value: Some(value) } = change
                    && switched(path).is_none()
                {
                    settings.push((path.clone(), value.clone()));
                    // What was changed at once is changed at once.
                    if matches!(changes.peek(), Some((after, Change::Setting { value: Some(_), .. })) if *after <= cycle)
                    {
                        continue;
                    }
                }
                let made = make(&agent, change, std::mem::take(&mut settings));
                if let Err(error) = made {
                    let text = format!("a change after cycle {cycle} can't be made again: {error}");
                    return Ok(Verdict::NotCovered(text));
                }
            }
            while drain.turn(&hub, &mut comparer) {}
            if let Some(verdict) = comparer.verdict(agent.now())? {
                return Ok(verdict);
            }
            if run.cycles().map_or_else(|| comparer.expected.is_done(), |cycles| cycle >= cycles) {
                break;
            }
            if !agent.step() {
                return Ok(Verdict::NotCovered("a module does not return from its tick".into()));
            }
            cycle += 1;
        }
        comparer.end(&run, &mut agent, cycle)
    }
}

/// Sees what the agent writes.
struct Tape(Arc<Hub>);

impl Taps for Tape {
    fn tap(&self, property: &Property) -> Option<Arc<dyn Tap>> {
        self.0.tap(property)
    }
}

impl Recording for Tape {
    fn changed(&self, _: u64, _: u64, _: &Change) {}
}

/// Why an agent is not the recorded one, if it is not.
fn other_code(run: &Run, agent: &Agent) -> Option<String> {
    let mark = |plugin: PluginMark| (plugin.name, format!("{} {:016x}", plugin.version, plugin.hash));
    let plugins: BTreeMap<_, _> = agent.composer().plugin_marks().into_iter().map(mark).collect();
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

/// The module that a change switches on or off, past the configuration.
fn switched(path: &str) -> Option<&str> {
    path.strip_suffix("/enabled").filter(|module| !module.contains('.'))
}

/// Makes a change, and the settings before it, once more.
fn make(agent: &Agent, change: &Change, settings: Vec<(String, String)>) -> Result<(), String> {
    let database = agent.database().ok_or("the agent was loaded without a database")?;
    if !settings.is_empty() {
        return database.set(&settings).map(drop).map_err(|report| report.to_string());
    }
    let composer = agent.composer();
    match change {
        Change::Setting { path, value: Some(value) } => {
            let module = switched(path).unwrap_or_default();
            composer.enable(module, value == "true").map_err(|error| error.to_string())
        }
        Change::Setting { path, value: None } if path.starts_with("links.") => {
            database.set(&[(path, "false")]).map(drop).map_err(|report| report.to_string())
        }
        Change::Setting { path, value: None } => {
            database.take_back(path).map(drop).map_err(|report| report.to_string())
        }
        Change::Reload { plugin, file, hash } => {
            composer.reload(plugin, Some(file)).map_err(|error| error.to_string())?;
            let marks = composer.plugin_marks();
            let is_same = marks.iter().any(|mark| mark.name == *plugin && mark.hash == *hash);
            let file = slate_runtime::printable(file);
            if is_same { Ok(()) } else { Err(format!("{file} is another library than it was then")) }
        }
        Change::Load { name, file, hash } => {
            let loaded = match file {
                Some(file) => composer.load_library(file),
                None => composer.load(name),
            };
            let loaded = loaded.map_err(|error| error.to_string())?;
            let marks = composer.plugin_marks().into_iter();
            let came = |name: &str| loaded.plugins.iter().any(|(own, file)| own == name && file.is_some());
            let codes = marks.filter(|mark| came(&mark.name)).map(|mark| mark.hash);
            let is_same = codes.fold(0, u64::wrapping_add) == *hash;
            if is_same { Ok(()) } else { Err("a library is another one than it was then".into()) }
        }
        Change::Unload { name } => composer.unload(name).map(drop).map_err(|error| error.to_string()),
        Change::Stop { reason } => {
            composer.stop_actuators(reason);
            Ok(())
        }
        Change::Reset => {
            composer.reset();
            Ok(())
        }
        // Whether they were all armed is seen from what they get.
        Change::Arm { actuator: None } => {
            composer.arm();
            Ok(())
        }
        Change::Arm { actuator: Some(name) } => {
            composer.arm_one(name).map(drop).ok_or_else(|| format!("no actuator is called `{name}`"))
        }
        Change::Other { what } => Err(what.clone()),
    }
}

/// Compares what the second run writes.
struct Comparer {
    expected: Expected,
    /// Whether the recording has all.
    is_whole: bool,
    values: u64,
    found: Option<Result<Verdict, ReadError>>,
    scratch: Vec<u8>,
}

impl Comparer {
    fn new(expected: Expected, is_whole: bool) -> Self {
        Self { expected, is_whole, values: 0, found: None, scratch: Vec::new() }
    }

    /// What was found until that time, if anything was.
    fn verdict(&mut self, time: u64) -> Result<Option<Verdict>, ReadError> {
        if let Some(found) = self.found.take() {
            return found.map(Some);
        }
        self.expected.read_to(time)?;
        // What was written at that very time may still come.
        Ok(self.expected.missed(time).map(|(path, wanted)| {
            Verdict::Different(Difference {
                time: wanted.time,
                url: format!("/{path}"),
                field: String::new(),
                recorded: format!("value {}", wanted.sequence),
                replayed: "no such value".into(),
            })
        }))
    }

    fn end(self, run: &Run, agent: &mut Agent, cycles: u64) -> Result<Verdict, ReadError> {
        if let Some((path, wanted)) = self.expected.missed(u64::MAX) {
            return Ok(Verdict::Different(Difference {
                time: wanted.time,
                url: format!("/{path}"),
                field: String::new(),
                recorded: format!("value {}", wanted.sequence),
                replayed: "no such value".into(),
            }));
        }
        let digest = agent.digest().map(|digest| format!("{digest:016x}")).unwrap_or_default();
        match run.end("digest") {
            Some(recorded) if recorded != digest => Ok(Verdict::Different(Difference {
                time: agent.now(),
                url: "the digest, which messages are part of too".into(),
                field: String::new(),
                recorded: recorded.into(),
                replayed: digest,
            })),
            _ => Ok(Verdict::Identical { values: self.values, cycles, whole: self.is_whole }),
        }
    }

    fn look(&mut self, channel: &Channel, stamp: Stamp) -> Result<Option<Verdict>, ReadError> {
        let path = channel.path.as_str();
        let different = |field: String, recorded: String, replayed: String| {
            let url = format!("/{path}");
            Some(Verdict::Different(Difference { time: stamp.time, url, field, recorded, replayed }))
        };
        let own = || format!("value {} at {:.3} s", stamp.sequence, stamp.time as f64 * 1e-9);
        let Some(wanted) = self.expected.next(path, stamp.time, stamp.sequence as u32)? else {
            // A recording that was cut off may lack anything at its end.
            let is_extra = self.is_whole;
            return Ok(if is_extra { different(String::new(), "no such value".into(), own()) } else { None });
        };
        if self.expected.hash(path) != Some(channel.descriptor.hash) {
            let text = format!("the interface of /{path} is another one than that of the recording");
            return Ok(Some(Verdict::NotCovered(text)));
        }
        if wanted.sequence != stamp.sequence as u32 || wanted.time != stamp.time {
            let recorded = format!("value {} at {:.3} s", wanted.sequence, wanted.time as f64 * 1e-9);
            return Ok(different(String::new(), recorded, own()));
        }
        if wanted.message != self.scratch {
            let [field, recorded, replayed] =
                difference::field(channel.descriptor, &wanted.message, &self.scratch);
            return Ok(different(field, recorded, replayed));
        }
        self.values += 1;
        Ok(None)
    }
}

impl Sink for Comparer {
    fn value(&mut self, channel: Option<&Channel>, _: u32, items: usize, stamp: Stamp, bytes: &[u8]) {
        let Some(channel) = channel.filter(|channel| channel.repeats()) else { return };
        if self.found.is_some() {
            return;
        }
        self.scratch.clear();
        let found = match channel.encode(items, bytes, &mut self.scratch) {
            Ok(()) => self.look(channel, stamp),
            Err(error) => Ok(Some(Verdict::NotCovered(error.to_string()))),
        };
        self.found = found.transpose();
    }
}
