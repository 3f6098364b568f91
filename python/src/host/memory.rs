//! Memory of a tick that Python sees: its arrays are views, not copies.

use std::cell::UnsafeCell;
use std::collections::BTreeMap;
use std::ffi::c_int;
use std::ptr::from_ref;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use pyo3::exceptions::{PyRuntimeError, PyTypeError};
use pyo3::ffi;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyTuple};
use slate_module::blackboard::interface::{Kind, Primitive};

/// Counts begins and ends of ticks; odd during a tick.
static EPOCH: AtomicU64 = AtomicU64::new(0);

/// Arrays that exist, by number, with the names of their fields.
static LIVE_VIEWS: Mutex<BTreeMap<u64, String>> = Mutex::new(BTreeMap::new());

fn live_views() -> MutexGuard<'static, BTreeMap<u64, String>> {
    LIVE_VIEWS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Counts views of memory.
static VIEWS: AtomicU64 = AtomicU64::new(0);

/// Number of views at the begin of the tick.
/// Earlier ones belong to exceptions that are still looked at.
static FIRST_VIEW_OF_TICK: AtomicU64 = AtomicU64::new(0);

/// Blocks of fixtures, by their addresses.
static BLOCKS: Mutex<BTreeMap<usize, Weak<Block>>> = Mutex::new(BTreeMap::new());

fn blocks() -> MutexGuard<'static, BTreeMap<usize, Weak<Block>>> {
    BLOCKS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Zeroed memory of a fixture, aligned for every interface.
/// Views of it own it, too: an array that a test keeps may outlive the fixture.
pub struct Block(Box<[UnsafeCell<u128>]>);

// SAFETY: the GIL orders the users of the memory.
unsafe impl Send for Block {}
// SAFETY: as above.
unsafe impl Sync for Block {}

impl Block {
    /// Returns a block of at least so many bytes.
    pub fn new(bytes: usize) -> Arc<Self> {
        let words = std::iter::repeat_with(|| UnsafeCell::new(0)).take(bytes.div_ceil(16).max(1));
        let block = Arc::new(Self(words.collect()));
        blocks().insert(block.data() as usize, Arc::downgrade(&block));
        block
    }

    /// Returns the address of its first byte.
    pub fn data(&self) -> *mut u8 {
        self.0.as_ptr().cast_mut().cast()
    }

    /// Returns the block that has an address; `None` for memory of an agent.
    fn of(address: *const u8) -> Option<Arc<Self>> {
        let block = blocks().range(..=address as usize).next_back()?.1.upgrade()?;
        ((address as usize) < block.data() as usize + size_of_val(&*block.0)).then_some(block)
    }
}

impl Drop for Block {
    fn drop(&mut self) {
        blocks().remove(&(self.data() as usize));
    }
}

/// Returns a number of the calling thread, which no other living thread has.
pub fn thread() -> usize {
    thread_local!(static MARK: u8 = const { 0 });
    MARK.with(|mark| from_ref(mark) as usize)
}

/// Tick in which memory may be used.
#[derive(Clone, Copy, PartialEq)]
pub struct Epoch {
    number: u64,
    /// Thread of the tick.
    /// Numpy lets others run while it copies, and a tick does not wait for them.
    thread: usize,
}

impl Epoch {
    /// Returns the present one.
    pub fn now() -> Self {
        Self { number: EPOCH.load(Ordering::Relaxed), thread: thread() }
    }

    /// Begins a tick.
    pub fn begin() {
        EPOCH.fetch_add(1, Ordering::Relaxed);
        FIRST_VIEW_OF_TICK.store(VIEWS.load(Ordering::Relaxed), Ordering::Relaxed);
    }

    /// Ends a tick.
    pub fn end() {
        EPOCH.fetch_add(1, Ordering::Relaxed);
    }

    /// Checks that no array of the ended tick exists.
    ///
    /// # Errors
    /// The first array that does, by its field.
    pub fn check_views(py: Python<'_>) -> PyResult<()> {
        let kept = || {
            let views = live_views();
            views.range(FIRST_VIEW_OF_TICK.load(Ordering::Relaxed)..).next().map(|(_, name)| name.clone())
        };
        if kept().is_none() {
            return Ok(());
        }
        // A cycle of references may hold it, such as an exception that a variable of its own frame has.
        py.import("gc")?.call_method0("collect")?;
        let Some(name) = kept() else { return Ok(()) };
        Err(PyRuntimeError::new_err(format!(
            "the array of {name} is kept after the tick, when its memory changes: keep a copy, `array.copy()`"
        )))
    }

    /// Checks that its tick lasts, in this thread.
    pub fn check(self, what: &dyn std::fmt::Display) -> PyResult<()> {
        let now = Self::now();
        if self == now {
            return Ok(());
        }
        if self.number == now.number {
            return Err(PyRuntimeError::new_err(format!(
                "{what} is used by another thread: only `tick` may; pass copies, `value.to_dict()`"
            )));
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
    /// Block of a fixture; an agent's memory is mapped as long as the process lives.
    _block: Option<Arc<Block>>,
}

// SAFETY: the memory is mapped as long as the process lives, or owned; the GIL orders its users.
unsafe impl Send for Memory {}
// SAFETY: as above.
unsafe impl Sync for Memory {}

#[pymethods]
impl Memory {
    unsafe fn __getbuffer__(slf: Bound<'_, Self>, view: *mut ffi::Py_buffer, flags: c_int) -> PyResult<()> {
        let memory = slf.get();
        let readonly = c_int::from(!memory.writable);
        // SAFETY: the interpreter passes a view to be filled, which owns this object; that the memory.
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
        live_views().insert(memory.number, memory.name.clone());
        Ok(())
    }

    unsafe fn __releasebuffer__(&self, _view: *mut ffi::Py_buffer) {
        live_views().remove(&self.number);
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
            _block: Block::of(self.data),
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
                let raised = pyo3::exceptions::PyImportError::new_err(message);
                raised.set_cause(py, Some(error));
                raised
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
