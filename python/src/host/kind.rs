//! Kinds and instances of modules in Python, behind the calls of a module's table.

use std::path::Path;
use std::sync::Arc;

use pyo3::exceptions::PySyntaxError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use slate_module::blackboard::interface::{Descriptor, Kind, View};
use slate_module::table::{Bytes, DONE, PANICKED, REFUSED, SetupTable, Sink};
use slate_module::{
    Direction, Frame, InstanceFactory, ModuleKind, ModuleTable, Outcome, Refusal, Setup, Stage,
    decode_interface,
};

use super::memory::{Epoch, Numpy};
use super::plain;
use super::ports::Port;
use super::tick::{Tick, TickGuard};
use super::value::Place;

/// Class of Python that is a module.
struct PythonKind {
    class: Py<PyAny>,
    ports: Vec<PortOfKind>,
    params: &'static Descriptor,
    description: Vec<u8>,
}

struct PortOfKind {
    name: String,
    descriptor: &'static Descriptor,
    direction: Direction,
    required: bool,
}

/// Class with its name and documentation.
struct Declared {
    name: String,
    doc: String,
    kind: PythonKind,
}

/// Returns the kind of a class.
///
/// # Errors
/// A declaration that is no description of a module.
pub fn kind(class: &Bound<'_, PyAny>) -> Result<ModuleKind, Refusal> {
    let Declared { name, doc, kind } = Declared::of(class)?;
    let ports = kind.ports.iter().map(|port| port.descriptor);
    if ports
        .chain([kind.params])
        .any(|descriptor| descriptor.fields.iter().any(|field| has_array(&field.kind)))
    {
        // The import takes longer than a step may, and more memory than a module may need. Without numpy, a step that
        // reads an array fails.
        let _ = Numpy::get(class.py(), &name);
    }
    // SAFETY: the calls of the table are for what `PythonKind` makes.
    Ok(unsafe { ModuleKind::with_factory(Arc::new(kind), TABLE, (&name, &doc, ""), None) })
}

/// Returns true if a field of that kind is read as an array.
fn has_array(kind: &Kind) -> bool {
    match kind {
        Kind::Array(..) | Kind::Sequence(..) | Kind::Tail(_) => true,
        Kind::Optional(item) => has_array(item),
        Kind::Nested(descriptor) => descriptor.fields.iter().any(|field| has_array(&field.kind)),
        Kind::Primitive(_) | Kind::Enumeration(_) | Kind::Text(_) => false,
    }
}

impl Declared {
    fn of(class: &Bound<'_, PyAny>) -> Result<Self, Refusal> {
        let failed = |error: PyErr| refusal(class.py(), &error);
        let declared = class.call_method0("_declared").map_err(failed)?;
        let text = |name: &str| declared.get_item(name).and_then(|text| text.extract::<String>());
        let (name, doc) = (text("name").map_err(failed)?, text("doc").map_err(failed)?);
        let description = declared.get_item("description").map_err(failed)?;
        let ports = description.get_item("ports").and_then(|ports| ports.try_iter()).map_err(failed)?;
        let ports = ports
            .map(|port| port_of(&port.map_err(failed)?).map_err(|error| Refusal(format!("{name}: {error}"))));
        let ports = ports.collect::<Result<_, _>>()?;
        let params =
            description.get_item("params").and_then(|params| plain::encode(&params)).map_err(failed)?;
        let description = plain::encode(&description).map_err(failed)?;
        let (class, params) = (class.clone().unbind(), decode_interface(&params)?);
        Ok(Self { name, doc, kind: PythonKind { class, ports, params, description } })
    }
}

fn port_of(port: &Bound<'_, PyAny>) -> Result<PortOfKind, Refusal> {
    let py = port.py();
    let failed = |error: PyErr| refusal(py, &error);
    let interface =
        port.get_item("interface").and_then(|interface| plain::encode(&interface)).map_err(failed)?;
    let direction =
        port.get_item("direction").and_then(|direction| plain::encode(&direction)).map_err(failed)?;
    Ok(PortOfKind {
        name: port.get_item("name").and_then(|name| name.extract()).map_err(failed)?,
        descriptor: decode_interface(&interface)?,
        direction: slate_module::decode(&direction)?,
        required: port.get_item("required").and_then(|required| required.extract()).map_err(failed)?,
    })
}

impl InstanceFactory for PythonKind {
    fn describe(&self, _: &Setup<'_>) -> Result<Vec<u8>, Refusal> {
        Ok(self.description.clone())
    }

    fn create(&self, setup: &Setup<'_>, params: &[u8]) -> Result<*mut (), Refusal> {
        Python::attach(|py| {
            let made = self.start(py, setup, params).map_err(|error| shown_refusal(py, &error))?;
            Ok(Box::into_raw(Box::new(made)).cast())
        })
    }
}

impl Instance {
    /// Makes an instance of a class.
    ///
    /// # Errors
    /// The exception of its `create`, or a declaration that is not a module.
    pub fn of(class: &Bound<'_, PyAny>, setup: &Setup<'_>, params: &[u8]) -> PyResult<Self> {
        let declared = Declared::of(class).map_err(|refusal| super::wrong(&refusal))?;
        declared.kind.start(class.py(), setup, params)
    }

    /// Returns the object.
    pub fn object(&self) -> &Py<PyAny> {
        &self.object
    }
}

impl PythonKind {
    fn start(&self, py: Python<'_>, setup: &Setup<'_>, params: &[u8]) -> PyResult<Instance> {
        let (objects, parameters) = (PyDict::new(py), PyDict::new(py));
        let mut ports = Vec::new();
        for declared in &self.ports {
            let port = Port::new(declared.name.clone(), declared.descriptor, declared.direction);
            objects.set_item(&declared.name, port.object(py, declared.required)?)?;
            ports.push(port);
        }
        read_parameters(self.params, params, &parameters)?;
        let arguments = (objects, &parameters, setup.name, setup.seed, setup.period);
        let object = self.class.bind(py).call_method1("_start", arguments)?;
        Ok(Instance {
            tick: object.getattr("tick")?.unbind(),
            object: object.unbind(),
            now: Py::new(py, Tick::default())?,
            ports,
            params: self.params,
            params_version: None,
            parameters: parameters.unbind(),
        })
    }
}

/// Reads the values of parameters into the dict that the module sees.
fn read_parameters(
    descriptor: &'static Descriptor,
    bytes: &[u8],
    parameters: &Bound<'_, PyDict>,
) -> PyResult<()> {
    if View::new(descriptor, bytes, 0).is_none() {
        return Err(pyo3::exceptions::PyValueError::new_err("too few bytes of parameters"));
    }
    let data = bytes.as_ptr().cast_mut();
    let place = Place { descriptor, data, items: 0, writable: false, epoch: Epoch::now() };
    let values = place.dict(parameters.py())?;
    parameters.update(values.bind(parameters.py()).cast::<PyDict>()?.as_mapping())
}

/// Object of Python that is a module's instance.
pub struct Instance {
    object: Py<PyAny>,
    /// Its step, bound.
    tick: Py<PyAny>,
    now: Py<Tick>,
    ports: Vec<Arc<Port>>,
    params: &'static Descriptor,
    /// Version of the parameters that the object has; `None` before the first tick.
    params_version: Option<u64>,
    parameters: Py<PyDict>,
}

impl Instance {
    /// Makes a step; an exception goes to the log.
    ///
    /// # Safety
    /// The frame is ready for a tick of this module.
    unsafe fn tick(&mut self, py: Python<'_>, frame: &Frame) -> i32 {
        // SAFETY: passed on to the caller.
        unsafe { self.raising_tick(py, frame) }.unwrap_or_else(|error| {
            let now = self.now.get();
            now.bind(frame);
            let _guard = TickGuard(now);
            now.log_exception(py, &error);
            PANICKED
        })
    }

    /// Makes a step.
    ///
    /// # Errors
    /// The exception of the step.
    ///
    /// # Safety
    /// As for [`tick`](Self::tick).
    pub unsafe fn raising_tick(&mut self, py: Python<'_>, frame: &Frame) -> PyResult<i32> {
        let now = self.now.clone_ref(py);
        now.get().bind(frame);
        let _guard = TickGuard(now.get());
        // SAFETY: passed on to the caller.
        unsafe { self.step(py, frame) }
    }

    /// # Safety
    /// As for [`tick`](Self::tick).
    unsafe fn step(&mut self, py: Python<'_>, frame: &Frame) -> PyResult<i32> {
        if self.params_version != Some(frame.params_version) {
            // SAFETY: the caller gives a frame with so many bytes of parameters.
            let bytes = unsafe { std::slice::from_raw_parts(frame.params, frame.params_size) };
            read_parameters(self.params, bytes, self.parameters.bind(py))?;
            self.params_version = Some(frame.params_version);
        }
        for (i, port) in self.ports.iter().enumerate().take(frame.port_count) {
            // SAFETY: the caller gives a frame with so many slots.
            port.bind(unsafe { frame.ports.add(i) });
        }
        Epoch::begin();
        let outcome = self.tick.call1(py, (&self.now,)).and_then(|outcome| code(outcome.bind(py)));
        self.ports.iter().for_each(|port| port.bind(std::ptr::null()));
        Epoch::end();
        // An exception keeps what the step had, and tells more.
        outcome.and_then(|code| Epoch::check_views(py).map(|()| code))
    }
}

/// Returns the code of an outcome; None counts as intended.
fn code(outcome: &Bound<'_, PyAny>) -> PyResult<i32> {
    if outcome.is_none() {
        return Ok(Outcome::Ok as i32);
    }
    let code = outcome
        .extract::<i32>()
        .ok()
        .filter(|code| (0..=2).contains(code) && !outcome.is_instance_of::<pyo3::types::PyBool>());
    code.ok_or_else(|| {
        pyo3::exceptions::PyTypeError::new_err(format!(
            "tick returned {outcome}: expected an Outcome or None"
        ))
    })
}

/// Returns an exception as a refusal, with its place in the source.
/// An exception that no line of the source raises has its innermost place.
pub fn refusal(py: Python<'_>, error: &PyErr) -> Refusal {
    let source = super::SOURCE.get();
    let place = || -> PyResult<String> {
        let frames = py.import("traceback")?.call_method1("extract_tb", (error.traceback(py),))?;
        let (mut innermost, mut own) = (None, None);
        for frame in frames.cast::<PyList>()?.iter() {
            let file: String = frame.getattr("filename")?.extract()?;
            let name = Path::new(&file).file_name().unwrap_or_default().display();
            let place = format!(" ({name}:{})", frame.getattr("lineno")?);
            if source.is_some_and(|source| Path::new(&file) == source) {
                own = Some(place.clone());
            }
            innermost = Some(place);
        }
        // A mistake of syntax says where it is; the innermost place is that of the compiler's call.
        let innermost = innermost.filter(|_| !error.is_instance_of::<PySyntaxError>(py));
        Ok(own.or(innermost).unwrap_or_default())
    };
    Refusal(format!("{error}{}", place().unwrap_or_default()))
}

/// Acts as [`refusal`], and prints the traceback.
/// Only in a process that runs the source for an agent: other programs show the exception itself.
pub fn shown_refusal(py: Python<'_>, error: &PyErr) -> Refusal {
    if super::SOURCE.get().is_some() {
        let shown = super::tick::traceback(py, error).unwrap_or_else(|_| error.to_string());
        eprintln!("{}", shown.trim_end());
    }
    refusal(py, error)
}

/// Calls of an instance; [`PythonKind`] describes and makes it.
const TABLE: ModuleTable = ModuleTable {
    name: Bytes::NONE,
    doc: Bytes::NONE,
    section: Bytes::NONE,
    describe,
    create,
    tick,
    save,
    restore,
    may_unload,
    destroy,
};

unsafe extern "C" fn describe(_: *const SetupTable, _: *const Sink) -> i32 {
    REFUSED
}

unsafe extern "C" fn create(_: *const SetupTable, _: Bytes, _: *mut *mut (), _: *const Sink) -> i32 {
    REFUSED
}

unsafe extern "C" fn tick(instance: *mut (), frame: *const Frame) -> i32 {
    // SAFETY: the host passes what `PythonKind` made, to one thread at a time, and a frame that is ready.
    Python::attach(|py| unsafe { (*instance.cast::<Instance>()).tick(py, &*frame) })
}

/// Makes a call of an instance's method, and writes its result.
///
/// # Safety
/// The instance is what `PythonKind` made, and the sink is as the host made it.
unsafe fn answer(
    instance: *const (),
    sink: *const Sink,
    call: impl FnOnce(&Bound<'_, PyAny>) -> Result<Vec<u8>, Refusal>,
) -> i32 {
    // SAFETY: passed on to the caller.
    let instance = unsafe { &*instance.cast::<Instance>() };
    let result = Python::attach(|py| call(instance.object.bind(py)));
    let (code, bytes) = match result {
        Ok(bytes) => (DONE, bytes),
        Err(refusal) => (REFUSED, refusal.0.into_bytes()),
    };
    // SAFETY: passed on to the caller; the bytes live during the call.
    unsafe { (*sink).take(&bytes) };
    code
}

unsafe extern "C" fn save(instance: *const (), sink: *const Sink) -> i32 {
    let call = |object: &Bound<'_, PyAny>| {
        let saved = object.call_method0("_save").and_then(|state| plain::encode(&state));
        saved.map_err(|error| refusal(object.py(), &error))
    };
    // SAFETY: passed on to the caller.
    unsafe { answer(instance, sink, call) }
}

unsafe extern "C" fn restore(instance: *mut (), state: Bytes, sink: *const Sink) -> i32 {
    let call = |object: &Bound<'_, PyAny>| {
        let py = object.py();
        // SAFETY: the state lives during the call.
        let state = plain::decode(py, unsafe { state.as_slice() })
            .map_err(|error| Refusal(format!("its state does not fit: {error}")))?;
        let restored = object.call_method1("_restore", (state,));
        restored
            .map(|_| Vec::new())
            .map_err(|error| Refusal(format!("its state does not fit: {}", error.value(py))))
    };
    // SAFETY: passed on to the caller.
    unsafe { answer(instance, sink, call) }
}

unsafe extern "C" fn may_unload(instance: *const (), sink: *const Sink) -> i32 {
    let call = |object: &Bound<'_, PyAny>| {
        let veto = object.call_method0("may_unload").and_then(|veto| veto.extract::<Option<String>>());
        match veto.map_err(|error| refusal(object.py(), &error))? {
            Some(reason) => Err(Refusal(reason)),
            None => Ok(Vec::new()),
        }
    };
    // SAFETY: passed on to the caller.
    unsafe { answer(instance, sink, call) }
}

unsafe extern "C" fn destroy(instance: *mut (), _: *const Sink) -> i32 {
    // SAFETY: the host passes what `PythonKind` made, once.
    let instance = unsafe { Box::from_raw(instance.cast::<Instance>()) };
    Python::attach(|_| drop(instance));
    DONE
}

/// Returns true if a stage of the main loop has that name.
#[pyfunction]
pub fn is_stage(name: &str) -> bool {
    Stage::parse(name).is_some()
}
