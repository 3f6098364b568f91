//! Memory of a tick that Python sees: its arrays are views, not copies.

use std::collections::BTreeMap;
use std::ffi::c_int;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use pyo3::exceptions::{PyRuntimeError, PyTypeError};
use pyo3::ffi;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyTuple};
use slate_module::blackboard::interface::{Kind, Primitive};

/// Counts begins and ends of ticks; odd during a tick.
static EPOCH: AtomicU64 = AtomicU64::new(0);

/// Arrays that exist, by number, with the names of their fields.
static LENT: Mutex<BTreeMap<u64, String>> = Mutex::new(BTreeMap::new());

/// Counts views of memory.
static VIEWS: AtomicU64 = AtomicU64::new(0);

/// Number of views at the begin of the tick.
/// Earlier ones belong to exceptions that are still looked at.
static EARLIER: AtomicU64 = AtomicU64::new(0);

/// Tick in which memory may be used.
#[derive(Clone, Copy, PartialEq)]
pub struct Epoch(u64);

impl Epoch {
    /// Returns the present one.
    pub fn now() -> Self {
        Self(EPOCH.load(Ordering::Relaxed))
    }

    /// Begins a tick.
    pub fn begin() {
        EPOCH.fetch_add(1, Ordering::Relaxed);
        EARLIER.store(VIEWS.load(Ordering::Relaxed), Ordering::Relaxed);
    }

    /// Ends a tick.
    ///
    /// # Errors
    /// Arrays of the tick that still exist, by their fields.
    pub fn end() -> PyResult<()> {
        EPOCH.fetch_add(1, Ordering::Relaxed);
        let lent = LENT.lock().unwrap_or_else(PoisonError::into_inner);
        let mut own = lent.range(EARLIER.load(Ordering::Relaxed)..);
        let Some((_, name)) = own.next() else { return Ok(()) };
        Err(PyRuntimeError::new_err(format!(
            "the array of {name} is kept after the tick, when its memory changes: keep a copy, `array.copy()`"
        )))
    }

    /// Checks that its tick lasts.
    pub fn check(self, what: &dyn std::fmt::Display) -> PyResult<()> {
        if self == Self::now() {
            return Ok(());
        }
        Err(PyRuntimeError::new_err(format!(
            "{what} is used after its tick, when its memory changes: keep a copy, `value.to_dict()`"
        )))
    }
}

/// Memory of a field, for the buffer protocol.
#[pyclass(frozen, module = "slate._slate")]
pub struct Memory {
    data: *mut u8,
    length: usize,
    writable: bool,
    number: u64,
    name: String,
}

// SAFETY: the memory is mapped as long as the process lives; the interpreter's lock orders its users.
unsafe impl Send for Memory {}
// SAFETY: as above.
unsafe impl Sync for Memory {}

#[pymethods]
impl Memory {
    unsafe fn __getbuffer__(slf: Bound<'_, Self>, view: *mut ffi::Py_buffer, flags: c_int) -> PyResult<()> {
        let memory = slf.get();
        let readonly = c_int::from(!memory.writable);
        // SAFETY: the interpreter passes a view to be filled; the memory outlives the process's last view.
        let code = unsafe {
            ffi::PyBuffer_FillInfo(
                view,
                slf.as_ptr(),
                memory.data.cast(),
                memory.length as ffi::Py_ssize_t,
                readonly,
                flags,
            )
        };
        if code != 0 {
            return Err(PyErr::fetch(slf.py()));
        }
        LENT.lock().unwrap_or_else(PoisonError::into_inner).insert(memory.number, memory.name.clone());
        Ok(())
    }

    unsafe fn __releasebuffer__(&self, _view: *mut ffi::Py_buffer) {
        LENT.lock().unwrap_or_else(PoisonError::into_inner).remove(&self.number);
    }
}

/// Items of a field in memory.
#[derive(Clone, Copy)]
pub struct Items {
    pub kind: &'static Kind,
    pub data: *mut u8,
    pub count: usize,
    pub writable: bool,
}

impl Items {
    /// Returns the items as an array of numpy, a view of the memory.
    ///
    /// # Errors
    /// Without numpy.
    pub fn array<'py>(self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let (base, inner) = flatten(self.kind);
        let numpy = Numpy::get(py, name)?;
        let dtype = dtype(py, numpy, base)?;
        let mut shape = vec![self.count];
        shape.extend(&inner);
        if self.count == 0 || self.kind.size() == 0 {
            return numpy.zeros.bind(py).call1((PyTuple::new(py, shape)?, dtype));
        }
        let memory = Memory {
            data: self.data,
            length: self.count * self.kind.size(),
            writable: self.writable,
            number: VIEWS.fetch_add(1, Ordering::Relaxed),
            name: name.into(),
        };
        let flat = numpy.from_buffer.bind(py).call1((Bound::new(py, memory)?, dtype))?;
        if inner.is_empty() {
            return Ok(flat);
        }
        flat.call_method1("reshape", (PyTuple::new(py, shape)?,))
    }
}

/// Functions of numpy.
pub struct Numpy {
    from_buffer: Py<PyAny>,
    zeros: Py<PyAny>,
    dtype: Py<PyAny>,
    pub copy_to: Py<PyAny>,
}

impl Numpy {
    /// Imports it, for the field of that name.
    pub fn get<'py>(py: Python<'py>, name: &str) -> PyResult<&'py Self> {
        static NUMPY: PyOnceLock<Numpy> = PyOnceLock::new();
        NUMPY.get_or_try_init(py, || {
            let module = py.import("numpy").map_err(|error| {
                let message = format!("{name} is an array, which needs numpy: pip install numpy");
                let told = pyo3::exceptions::PyImportError::new_err(message);
                told.set_cause(py, Some(error));
                told
            })?;
            let function = |name| module.getattr(name).map(Bound::unbind);
            Ok(Self {
                from_buffer: function("frombuffer")?,
                zeros: function("zeros")?,
                dtype: function("dtype")?,
                copy_to: function("copyto")?,
            })
        })
    }
}

/// Takes arrays of arrays apart: items and inner shape.
fn flatten(kind: &'static Kind) -> (&'static Kind, Vec<usize>) {
    let (mut kind, mut inner) = (kind, Vec::new());
    while let Kind::Array(item, length) = kind {
        inner.push(*length);
        kind = item;
    }
    (kind, inner)
}

/// Returns the type of items in numpy; each is made once.
fn dtype<'py>(py: Python<'py>, numpy: &Numpy, kind: &'static Kind) -> PyResult<Bound<'py, PyAny>> {
    static KNOWN: Mutex<BTreeMap<usize, Py<PyAny>>> = Mutex::new(BTreeMap::new());
    let address = std::ptr::from_ref(kind) as usize;
    if let Some(known) = KNOWN.lock().unwrap_or_else(PoisonError::into_inner).get(&address) {
        return Ok(known.bind(py).clone());
    }
    let made = numpy.dtype.bind(py).call1((format(py, kind)?,))?;
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner).insert(address, made.clone().unbind());
    Ok(made)
}

/// Returns the specification of a type for numpy.
fn format<'py>(py: Python<'py>, kind: &Kind) -> PyResult<Bound<'py, PyAny>> {
    let structure = |members: Vec<(&str, Bound<'py, PyAny>, usize)>, size: usize| {
        let table = PyDict::new(py);
        table.set_item("names", members.iter().map(|member| member.0).collect::<Vec<_>>())?;
        table.set_item("formats", members.iter().map(|member| &member.1).collect::<Vec<_>>())?;
        table.set_item("offsets", members.iter().map(|member| member.2).collect::<Vec<_>>())?;
        table.set_item("itemsize", size)?;
        Ok::<_, PyErr>(table.into_any())
    };
    let word = || Ok::<_, PyErr>("u4".into_pyobject(py)?.into_any());
    let several = |kind: &Kind, count: usize| {
        Ok::<_, PyErr>((format(py, kind)?, (count,)).into_pyobject(py)?.into_any())
    };
    Ok(match kind {
        Kind::Primitive(primitive) => code(*primitive).into_pyobject(py)?.into_any(),
        Kind::Enumeration(enumeration) => format(py, &enumeration.carrier)?,
        Kind::Array(item, length) => several(item, *length)?,
        Kind::Text(capacity) => {
            let bytes = format!("S{capacity}").into_pyobject(py)?.into_any();
            structure(vec![("length", word()?, 0), ("bytes", bytes, 4)], kind.size())?
        }
        Kind::Optional(item) => {
            structure(vec![("present", word()?, 0), ("value", format(py, item)?, 8)], kind.size())?
        }
        Kind::Sequence(item, capacity) => {
            let items = several(item, *capacity)?;
            structure(vec![("length", word()?, 0), ("items", items, 8)], kind.size())?
        }
        Kind::Nested(descriptor) => {
            let members = descriptor
                .fields
                .iter()
                .map(|field| Ok((field.name, format(py, &field.kind)?, field.offset)))
                .collect::<PyResult<_>>()?;
            structure(members, descriptor.size)?
        }
        Kind::Tail(_) => return Err(PyTypeError::new_err("a tail has no fixed size")),
    })
}

fn code(primitive: Primitive) -> &'static str {
    match primitive {
        Primitive::Bool => "?",
        Primitive::U8 => "u1",
        Primitive::U16 => "u2",
        Primitive::U32 => "u4",
        Primitive::U64 => "u8",
        Primitive::I8 => "i1",
        Primitive::I16 => "i2",
        Primitive::I32 => "i4",
        Primitive::I64 => "i8",
        Primitive::F32 => "f4",
        Primitive::F64 => "f8",
    }
}
