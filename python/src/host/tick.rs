//! Time, random numbers and log of a step.

use std::ptr::null_mut;
use std::sync::atomic::{AtomicPtr, AtomicUsize, Ordering};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyString};
use slate_module::{FieldValue, Frame, Level};

use super::memory::thread;

/// Time, random numbers and log of a step, as `Tick` in Rust.
#[pyclass(frozen, module = "slate")]
#[derive(Default)]
pub struct Tick {
    frame: AtomicPtr<Frame>,
    /// Number of the thread that ticks.
    thread: AtomicUsize,
}

impl Tick {
    /// Binds it for a tick, or ends its use.
    pub fn bind(&self, frame: *const Frame) {
        self.thread.store(thread(), Ordering::Relaxed);
        self.frame.store(frame.cast_mut(), Ordering::Relaxed);
    }

    fn tick(&self) -> PyResult<slate_module::Tick> {
        // SAFETY: the frame lives during the tick, and is null outside of it.
        let frame = unsafe { self.frame.load(Ordering::Relaxed).as_ref() };
        let frame = frame.ok_or_else(|| PyRuntimeError::new_err("a tick is used after its end"))?;
        if self.thread.load(Ordering::Relaxed) != thread() {
            let message =
                "a tick is used by another thread: only `tick` may use it; pass copies of what it has";
            return Err(PyRuntimeError::new_err(message));
        }
        // SAFETY: as above.
        Ok(unsafe { slate_module::Tick::new(frame) })
    }

    fn log(&self, level: Level, text: &str, fields: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        let tick = self.tick()?;
        let Some(fields) = fields else {
            tick.log(level, format_args!("{text}"));
            return Ok(());
        };
        let pairs = fields.iter().map(|(key, value)| Ok((key.to_string(), FieldText::of(&value)?)));
        let pairs: Vec<(String, FieldText)> = pairs.collect::<PyResult<_>>()?;
        let shown: Vec<_> = pairs.iter().map(|(key, value)| (key.as_str(), value.value())).collect();
        tick.log_with(level, format_args!("{text}"), &shown);
        Ok(())
    }
}

#[pymethods]
impl Tick {
    /// Agent time, ns.
    fn now(&self) -> PyResult<u64> {
        Ok(self.tick()?.now())
    }

    /// Agent time, s.
    fn seconds(&self) -> PyResult<f64> {
        Ok(self.tick()?.seconds())
    }

    /// Time since this module's last tick, s; 0 in the first.
    fn elapsed(&self) -> PyResult<f64> {
        Ok(self.tick()?.elapsed())
    }

    /// Number of the tick, from 1.
    fn number(&self) -> PyResult<u64> {
        Ok(self.tick()?.number())
    }

    /// Random number uniform in [0, 1), from the module's own stream.
    fn unit(&self) -> PyResult<f64> {
        Ok(self.tick()?.random(|random| random.unit()))
    }

    /// Random number uniform in [low, high).
    fn uniform(&self, low: f64, high: f64) -> PyResult<f64> {
        Ok(self.tick()?.random(|random| random.uniform(low, high)))
    }

    /// Standard normal random number, mean 0 and stddev 1.
    fn normal(&self) -> PyResult<f64> {
        Ok(self.tick()?.random(|random| random.normal()))
    }

    /// 64 random bits.
    fn bits(&self) -> PyResult<u64> {
        Ok(self.tick()?.random(|random| random.bits()))
    }

    /// Logs information for users; fields are read by tools.
    #[pyo3(signature = (text, **fields))]
    fn info(&self, text: &str, fields: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.log(Level::Info, text, fields)
    }

    /// Logs a problem with which the robot goes on.
    #[pyo3(signature = (text, **fields))]
    fn warn(&self, text: &str, fields: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.log(Level::Warn, text, fields)
    }

    /// Logs a failure.
    #[pyo3(signature = (text, **fields))]
    fn error(&self, text: &str, fields: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.log(Level::Error, text, fields)
    }
}

impl Tick {
    /// Logs an exception with its traceback, a line at a time.
    pub fn log_exception(&self, py: Python<'_>, error: &PyErr) {
        let lines = traceback(py, error).unwrap_or_else(|_| error.to_string());
        for line in lines.lines().filter(|line| !line.trim().is_empty()) {
            // It fails outside of a tick only.
            let _ = self.log(Level::Error, line, None);
        }
    }
}

/// Returns an exception as the interpreter prints it.
pub fn traceback(py: Python<'_>, error: &PyErr) -> PyResult<String> {
    // The exception itself does not have its traceback: the interpreter lends the two apart.
    let parts = (error.get_type(py), error.value(py), error.traceback(py));
    let lines = py.import("traceback")?.call_method1("format_exception", parts)?;
    Ok(lines.extract::<Vec<String>>()?.concat())
}

/// Value of a field of a log message.
enum FieldText {
    Bool(bool),
    Integer(i64),
    Float(f64),
    Text(String),
}

impl FieldText {
    fn of(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(if value.is_instance_of::<PyBool>() {
            Self::Bool(value.extract()?)
        } else if value.is_instance_of::<PyInt>() {
            value.extract().map_or_else(|_| Self::Text(value.to_string()), Self::Integer)
        } else if value.is_instance_of::<PyFloat>() {
            Self::Float(value.extract()?)
        } else if let Ok(text) = value.cast::<PyString>() {
            Self::Text(text.to_str()?.into())
        } else {
            Self::Text(value.str()?.to_string())
        })
    }

    fn value(&self) -> FieldValue<'_> {
        match self {
            Self::Bool(value) => FieldValue::Bool(*value),
            Self::Integer(value) => FieldValue::Integer(*value),
            Self::Float(value) => FieldValue::Float(*value),
            Self::Text(value) => FieldValue::Text(value),
        }
    }
}

/// Ends the use of a tick when it is dropped.
pub struct TickGuard<'a>(pub &'a Tick);

impl Drop for TickGuard<'_> {
    fn drop(&mut self) {
        self.0.frame.store(null_mut(), Ordering::Relaxed);
    }
}
