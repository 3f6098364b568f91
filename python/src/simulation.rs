//! Agents that run in this process, one cycle at a time.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use pyo3::buffer::PyBuffer;
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyKeyError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::{Value as Json, json};
use slate_blackboard::interface::{Value, View, find};
use slate_blackboard::{BoardError, Property, Url};
use slate_control::operations::carry_out;
use slate_control::{Caller, Connections, ControlSurface, OperationAnswer, Problem, Role};
use slate_record::{RecordError, Recorder};
use slate_robotics_cli::examples::{self, ExampleError};
use slate_run::{Application, Observation, RunError};
use slate_runtime::configuration::Report;
use slate_runtime::{Agent, ExternalPorts, Mode, Options, Rate};

use crate::connection::refusal;
use crate::driven_input::DrivenInput;
use crate::probe::{self, Probe};

create_exception!(
    slate,
    ConfigurationError,
    PyException,
    "Example or configuration that can't run; `help` says what to do."
);

/// Period at which a call that makes many cycles checks for signals.
const SIGNALS: Duration = Duration::from_millis(20);

/// Default settings of a simulation.
/// The lines of its log are no part of a program's output.
const DEFAULTS: [&str; 1] = ["log.targets.console=false"];

/// Agent in lockstep that runs in this process, one cycle at a time.
#[pyclass(frozen, module = "slate._slate")]
pub struct SteppedAgent {
    /// Process that made it; a forked one has none of its threads.
    process: u32,
    /// None once it is closed.
    stepped: Mutex<Option<Stepped>>,
}

/// Operations on the agent, as those of tools.
struct ControlledAgent {
    surface: Arc<ControlSurface>,
    caller: Caller,
}

impl ControlledAgent {
    fn new(agent: &Agent) -> std::io::Result<Self> {
        let caller = Caller {
            role: Role::Developer,
            who: "Python".into(),
            local: None,
            is_told: false,
            connection: Arc::new(Arc::new(Connections::default()).admit()),
        };
        Ok(Self { surface: Arc::new(ControlSurface::new(agent)?), caller })
    }

    fn carry_out(&self, name: &str, parts: &[(&str, &str)], body: Json) -> Result<String, Problem> {
        let answer = carry_out(&self.surface, &self.caller, name, parts, body)?;
        Ok(match answer {
            OperationAnswer::Json(_, answer, _) => answer.to_string(),
            _ => "null".into(),
        })
    }
}

/// Recording of a simulation.
/// It begins with the first cycle, as inputs that are set from outside must be known before.
struct SimulationRecording {
    recorder: Recorder,
    file: PathBuf,
    has_begun: bool,
}

/// Loaded agent with what judges it.
struct Stepped {
    agent: Agent,
    observation: Observation,
    control: ControlledAgent,
    recording: Option<SimulationRecording>,
    /// Number of the last cycle.
    cycle: u64,
    is_running: bool,
}

#[pymethods]
impl SteppedAgent {
    /// Loads an example or a configuration.
    /// `program` runs isolated modules, `examples` is the folder of examples that are files.
    #[new]
    #[pyo3(signature = (name, sets, program=None, examples=None, recording=None))]
    fn new(
        py: Python<'_>,
        name: &str,
        sets: Vec<String>,
        program: Option<PathBuf>,
        examples: Option<PathBuf>,
        recording: Option<PathBuf>,
    ) -> PyResult<Self> {
        if let Some(folder) = examples {
            examples::set_folder(folder);
        }
        let stepped = py.detach(|| Stepped::load(name, sets, program, recording));
        let process = std::process::id();
        Ok(Self { process, stepped: Mutex::new(Some(stepped.map_err(|problem| problem.exception(py))?)) })
    }

    /// Makes cycles until the mission has ended; returns their number.
    fn step(&self, py: Python<'_>, cycles: u64) -> PyResult<u64> {
        let mut made = 0;
        while made < cycles {
            let (count, is_over) = self.with(py, |stepped| stepped.advance(cycles - made))??;
            made += count;
            py.check_signals()?;
            if is_over {
                break;
            }
        }
        Ok(made)
    }

    /// Sets an input, makes one cycle, and reads numbers.
    /// Returns whether the mission is in progress.
    fn drive(
        &self,
        py: Python<'_>,
        input: &DrivenInput,
        values: Vec<f64>,
        probe: &Probe,
        target: PyBuffer<f64>,
    ) -> PyResult<bool> {
        let mut numbers = probe.scratch();
        check_target(&target, numbers.len())?;
        let is_running = self.with(py, |stepped| {
            input.set(&values, stepped.agent.now())?;
            stepped.cycle()?;
            probe.read(&mut numbers);
            Ok::<_, PyErr>(stepped.is_running)
        })??;
        target.copy_from_slice(py, &numbers)?;
        Ok(is_running)
    }

    /// Numbers of properties that are read at once.
    /// Each field has a URL and its number of sectors, or None for all.
    fn probe(&self, py: Python<'_>, fields: Vec<(String, Option<usize>)>) -> PyResult<Probe> {
        self.with(py, |stepped| Probe::new(stepped.agent.board(), fields))?.map_err(PyKeyError::new_err)
    }

    /// Newest numbers of a probe.
    fn sample(&self, py: Python<'_>, probe: &Probe, target: PyBuffer<f64>) -> PyResult<()> {
        let mut numbers = probe.scratch();
        check_target(&target, numbers.len())?;
        self.with(py, |_| probe.read(&mut numbers))?;
        target.copy_from_slice(py, &numbers)
    }

    /// Input that `drive` sets in each cycle, all of whose fields are numbers.
    fn input(&self, py: Python<'_>, url: &str) -> PyResult<DrivenInput> {
        self.with(py, |stepped| stepped.input(url))?.map_err(PyValueError::new_err)
    }

    /// Newest value as JSON, its time in ns, and its number.
    /// None before the first write.
    fn read(&self, py: Python<'_>, url: &str) -> PyResult<Option<(String, u64, u64)>> {
        self.with(py, |stepped| {
            let (property, field) = stepped.find(url)?;
            let Some((bytes, items, stamp)) = property.newest().map_err(|error| unknown(&error))? else {
                return Ok(None);
            };
            let view = View::new(property.descriptor(), &bytes, items);
            let value = view.and_then(|view| match field.as_str() {
                "" => Some(view.value()),
                field => view.at(&find(property.descriptor(), field).ok()?),
            });
            let text = serde_json::to_string(&value.unwrap_or(Value::Null));
            Ok(Some((text.unwrap_or_else(|_| "null".into()), stamp.time, stamp.sequence)))
        })?
    }

    /// Newest numbers of a field or list: their type and their bytes.
    /// The type has the name of numpy. None before the first write.
    fn numbers<'py>(
        &self,
        py: Python<'py>,
        url: &str,
    ) -> PyResult<Option<(&'static str, Bound<'py, PyBytes>)>> {
        let numbers = self.with(py, |stepped| probe::numbers(stepped.agent.board(), url))?;
        let numbers = numbers.map_err(PyKeyError::new_err)?;
        Ok(numbers.map(|(dtype, bytes)| (dtype, PyBytes::new(py, &bytes))))
    }

    /// Carries out an operation such as `write`, with the parts of its path by name.
    /// Body and answer are JSON.
    fn operate(
        &self,
        py: Python<'_>,
        name: &str,
        parts: Vec<(String, String)>,
        body: &str,
    ) -> PyResult<String> {
        let parts: Vec<_> = parts.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect();
        let body = serde_json::from_str(body)
            .map_err(|error| PyValueError::new_err(format!("the value is no JSON: {error}")))?;
        let answer = self.with(py, |stepped| stepped.control.carry_out(name, &parts, body))?;
        answer.map_err(|problem| problem_exception(py, &problem))
    }

    /// Paths of the properties, each with the name of its interface.
    fn properties(&self, py: Python<'_>) -> PyResult<Vec<(String, &'static str)>> {
        self.with(py, |stepped| {
            let properties = stepped.agent.board().properties();
            properties.iter().map(|one| (format!("/{}", one.path()), one.descriptor().name)).collect()
        })
    }

    /// Time, ns, number of the last cycle, and whether the mission is in progress.
    fn state(&self, py: Python<'_>) -> PyResult<(u64, u64, bool)> {
        self.with(py, |stepped| (stepped.agent.now(), stepped.cycle, stepped.is_running))
    }

    /// Digest of all values that were written, as that of `slate run`.
    fn digest(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |stepped| {
            let digest = stepped.agent.digest();
            digest.map_or_else(|| "none".into(), |digest| format!("{digest:016x}"))
        })
    }

    /// Outcome, reason and figures of the judges, as JSON.
    fn result(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |stepped| {
            let verdict = stepped.observation.verdict().filter(|_| !stepped.is_running);
            let outcome = verdict.as_ref().map(|verdict| verdict.outcome());
            let judged = stepped.observation.metrics();
            let figures: serde_json::Map<_, _> = judged
                .into_iter()
                .flat_map(|metrics| metrics.figures)
                .map(|(name, number)| (name, json!(number)))
                .collect();
            json!({
                "outcome": outcome,
                "message": verdict.map(|verdict| verdict.reason),
                "figures": figures,
            })
            .to_string()
        })
    }

    /// Ends the agent and its recording; returns the file of the recording.
    /// In a process that was forked, both are the parent's.
    fn close(&self, py: Python<'_>) -> PyResult<Option<PathBuf>> {
        if self.process != std::process::id() {
            return Ok(None);
        }
        let Some(stepped) = py.detach(|| self.lock().take()) else { return Ok(None) };
        py.detach(|| stepped.end()).map_err(|error| PyException::new_err(error.to_string()))
    }
}

/// Checks that a buffer takes that many numbers.
fn check_target(target: &PyBuffer<f64>, length: usize) -> PyResult<()> {
    if !target.readonly() && target.item_count() == length {
        return Ok(());
    }
    let found = target.item_count();
    let kind = if target.readonly() { "a read-only buffer" } else { "a buffer" };
    Err(PyValueError::new_err(format!(
        "expected a writable buffer of {length} numbers, found {kind} of {found}"
    )))
}

impl Drop for SteppedAgent {
    fn drop(&mut self) {
        // In a process that was forked, its threads, files and sockets are the parent's.
        if self.process != std::process::id() {
            std::mem::forget(self.stepped.get_mut().unwrap_or_else(PoisonError::into_inner).take());
        }
    }
}

impl SteppedAgent {
    fn lock(&self) -> MutexGuard<'_, Option<Stepped>> {
        self.stepped.lock().unwrap_or_else(|poisoned| {
            // An agent whose cycle has panicked is given up.
            let mut stepped = poisoned.into_inner();
            *stepped = None;
            stepped
        })
    }

    /// Does work on the agent without the GIL.
    /// Another thread may be making cycles.
    fn with<R: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut Stepped) -> R + Send) -> PyResult<R> {
        if self.process != std::process::id() {
            return Err(PyRuntimeError::new_err(
                "the simulation was made before a fork: make one in each process",
            ));
        }
        py.detach(|| {
            let mut stepped = self.lock();
            let closed = || PyValueError::new_err("the simulation is closed");
            stepped.as_mut().map(work).ok_or_else(closed)
        })
    }
}

impl Stepped {
    fn load(
        name: &str,
        sets: Vec<String>,
        program: Option<PathBuf>,
        recording: Option<PathBuf>,
    ) -> Result<Self, LoadProblem> {
        let application = examples::find(name, None, DEFAULTS.map(String::from).to_vec(), sets, None)?;
        let Application { configuration, database, plugins, .. } = application;
        if configuration.time_source().is_none() {
            return Err(LoadProblem {
                message: format!("a simulation needs a simulator: `{name}` has no time source"),
                help: Some("set `time.source`, or use slate.start, which runs it on the wall clock".into()),
                report: None,
            });
        }
        let recording = recording.map(|file| {
            let recorder = Recorder::new(configuration.record());
            recorder.attach_files(slate_run::scene::files(&configuration));
            SimulationRecording { recorder, file, has_begun: false }
        });
        let recorder = recording.as_ref().map(|recording| &recording.recorder);
        let options = Options {
            mode: Mode::Staged,
            rate: Rate::Max,
            log: recorder.into_iter().map(Recorder::log_target).collect(),
            // Robots in the simulator arm themselves.
            armed: true,
            isolation_program: program,
            follows_files: false,
            recording: recorder.cloned().map(|recorder| Arc::new(recorder) as _),
            ..Options::default()
        };
        let agent = Agent::load_with(&database, &plugins, options).map_err(RunError::from)?;
        let observation = Observation::new(&configuration, agent.board().as_ref())?;
        let control = ControlledAgent::new(&agent).map_err(|error| RunError::Unreachable(error.into()))?;
        Ok(Self { agent, observation, control, recording, cycle: 0, is_running: true })
    }

    /// Returns an input that is set in each cycle.
    /// An input that moves a robot past its gate is refused.
    fn input(&self, url: &str) -> Result<DrivenInput, String> {
        if self.recording.as_ref().is_some_and(|recording| recording.has_begun) {
            return Err(format!(
                "{url}: name the inputs that are driven before the first cycle, as this simulation is recorded"
            ));
        }
        let input = self.agent.composer().external_input(url.trim_start_matches('/'));
        let (property, field) = input.map_err(|error| format!("{url}: {error}\nhelp: {}", error.help))?;
        property.set_external("python");
        DrivenInput::new(property, &field)
    }

    /// Makes one cycle.
    ///
    /// # Errors
    /// A mission that has ended.
    fn cycle(&mut self) -> PyResult<()> {
        if !self.is_running {
            return Err(PyRuntimeError::new_err(format!(
                "the mission ended in cycle {}: make another simulation",
                self.cycle
            )));
        }
        if let Some(recording) = self.recording.as_mut().filter(|recording| !recording.has_begun) {
            recording.recorder.begin(&self.agent, &recording.file);
            recording.has_begun = true;
        }
        if !self.agent.step() {
            let reason = "a module has not returned from its step, and nothing goes on without it";
            return Err(PyException::new_err(reason));
        }
        self.cycle += 1;
        self.is_running = self.observation.is_running();
        Ok(())
    }

    /// Makes cycles for some time.
    /// Returns their number, and whether the mission has ended.
    #[allow(clippy::disallowed_methods, reason = "signals are looked for by the wall clock")]
    fn advance(&mut self, cycles: u64) -> PyResult<(u64, bool)> {
        let begin = Instant::now();
        let mut made = 0;
        while made < cycles && begin.elapsed() < SIGNALS {
            self.cycle()?;
            made += 1;
            if !self.is_running {
                return Ok((made, true));
            }
        }
        Ok((made, false))
    }

    fn find(&self, url: &str) -> PyResult<(Arc<Property>, String)> {
        let parsed = Url::parse(url).map_err(|error| PyKeyError::new_err(error.to_string()))?;
        self.agent.board().resolve(&parsed).map_err(|error| unknown(&error))
    }

    fn end(mut self) -> Result<Option<PathBuf>, RecordError> {
        let recording = self.recording.take().filter(|recording| recording.has_begun);
        let recorded = recording.map(|recording| recording.recorder.end(&mut self.agent)).transpose()?;
        Ok(recorded.map(|recorded| recorded.file))
    }
}

/// Exception of an operation that was refused.
fn problem_exception(py: Python<'_>, problem: &Problem) -> PyErr {
    let body = problem.json();
    let text = |name: &str| body.get(name).and_then(Json::as_str).map(str::to_owned);
    refusal(py, problem.detail().to_owned(), text("help").unwrap_or_default(), text("code"), text("report"))
}

fn unknown(error: &BoardError) -> PyErr {
    PyKeyError::new_err(error.to_string())
}

/// Reason for which a simulation can't be loaded.
struct LoadProblem {
    message: String,
    help: Option<String>,
    /// File, line and caret of mistakes in a configuration.
    report: Option<String>,
}

impl LoadProblem {
    fn of(report: &Report) -> Self {
        let help = report.diagnostics().iter().find_map(|one| one.help_text()).map(str::to_owned);
        Self { message: report.to_string(), help, report: Some(report.render(false)) }
    }

    fn exception(self, py: Python<'_>) -> PyErr {
        let text = match (&self.report, &self.help) {
            (Some(report), _) => report.clone(),
            (None, Some(help)) => format!("{}\nhelp: {help}", self.message),
            (None, None) => self.message,
        };
        let error = ConfigurationError::new_err(text);
        for (name, content) in [("help", self.help), ("report", self.report)] {
            // An exception takes any attribute.
            let _ = error.value(py).setattr(name, content);
        }
        error
    }
}

impl From<ExampleError> for LoadProblem {
    fn from(error: ExampleError) -> Self {
        match &error {
            ExampleError::Configuration(report) => Self::of(report),
            other => Self { message: other.to_string(), help: other.help(), report: None },
        }
    }
}

impl From<RunError> for LoadProblem {
    fn from(error: RunError) -> Self {
        match &error {
            RunError::Configuration(report) => Self::of(report),
            other => Self { message: other.to_string(), help: other.help(), report: None },
        }
    }
}
