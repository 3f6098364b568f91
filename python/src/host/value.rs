//! Values of interfaces in memory, field by field.

pub(super) mod write;

use pyo3::exceptions::{PyAttributeError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyString};
use slate_module::blackboard::interface::{Descriptor, Field, Kind, Primitive};

use super::memory::{Epoch, Items};

/// Place of a value in memory.
#[derive(Clone, Copy)]
pub struct Place {
    pub descriptor: &'static Descriptor,
    pub data: *mut u8,
    /// Number of tail items.
    pub items: usize,
    pub writable: bool,
    pub epoch: Epoch,
}

// SAFETY: it is used during its tick only, which `check` ensures and in which the memory stays; the GIL orders its users.
unsafe impl Send for Place {}
// SAFETY: as above.
unsafe impl Sync for Place {}

impl Place {
    /// Checks that it may be used.
    pub fn check(&self) -> PyResult<()> {
        self.epoch.check(&format_args!("a value of {}", self.descriptor.name))
    }

    fn field(&self, name: &str) -> PyResult<&'static Field> {
        self.descriptor.field(name).ok_or_else(|| {
            let known: Vec<_> = self.descriptor.fields.iter().map(|field| field.name).collect();
            let name = format!("{} has no field `{name}`; it has {}", self.descriptor.name, known.join(", "));
            PyAttributeError::new_err(name)
        })
    }

    /// Returns a field: a number, text, array or value.
    pub fn get(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        self.check()?;
        let field = self.field(name)?;
        self.read(py, field, false)
    }

    /// Sets a field of an output.
    pub fn set(&self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        self.check()?;
        let field = self.field(name)?;
        if !self.writable {
            let message =
                format!("`{name}` of {} is an input's, which can't be written", self.descriptor.name);
            return Err(PyAttributeError::new_err(message));
        }
        // SAFETY: the field is within the value.
        let data = unsafe { self.data.add(field.offset) };
        write::field(self.descriptor, field, data, self.items, value)
    }

    /// Reads a field; arrays are views of numpy, or lists if it is `plain`.
    fn read(&self, py: Python<'_>, field: &'static Field, plain: bool) -> PyResult<Py<PyAny>> {
        // SAFETY: the field is within the value.
        let data = unsafe { self.data.add(field.offset) };
        let place = Place { data, ..*self };
        place.read_kind(py, &field.kind, plain, &|| format!("`{}` of {}", field.name, self.descriptor.name))
    }

    /// Reads what is at this place, of that kind.
    fn read_kind(
        &self,
        py: Python<'_>,
        kind: &'static Kind,
        plain: bool,
        name: &dyn Fn() -> String,
    ) -> PyResult<Py<PyAny>> {
        let items = |kind: &'static Kind, offset: usize, count: usize| {
            // SAFETY: the items are within the value.
            let data = unsafe { self.data.add(offset) };
            if plain {
                let place = |i: usize| Place { data: data.wrapping_add(i * kind.size()), ..*self };
                let list = (0..count).map(|i| place(i).read_kind(py, kind, true, name));
                return Ok(PyList::new(py, list.collect::<PyResult<Vec<_>>>()?)?.into_any().unbind());
            }
            let items = Items { kind, data, count, writable: self.writable };
            items.array(py, &name()).map(Bound::unbind)
        };
        match kind {
            Kind::Primitive(primitive) => self.primitive(py, *primitive),
            Kind::Enumeration(enumeration) => {
                let number = self.read_kind(py, &enumeration.carrier, plain, name)?;
                let value = number.extract::<i128>(py)?;
                let mut constants = enumeration.constants.iter();
                let constant = constants.find(|constant| i128::from(constant.value) == value);
                Ok(constant.map_or(number, |constant| PyString::new(py, constant.name).into_any().unbind()))
            }
            Kind::Text(capacity) => {
                // SAFETY: the text is within the value, and its length is bounded.
                let text = unsafe { std::slice::from_raw_parts(self.data.add(4), self.length(*capacity)) };
                Ok(PyString::new(py, &String::from_utf8_lossy(text)).into_any().unbind())
            }
            Kind::Optional(_) if self.length(1) == 0 => Ok(py.None()),
            Kind::Optional(item) => {
                // SAFETY: the item is behind the flag.
                Place { data: unsafe { self.data.add(8) }, ..*self }.read_kind(py, item, plain, name)
            }
            Kind::Array(item, length) => items(item, 0, *length),
            Kind::Sequence(item, capacity) => items(item, 8, self.length(*capacity)),
            Kind::Tail(item) => items(item, 0, self.items),
            Kind::Nested(descriptor) => {
                let nested = Place { descriptor, items: 0, ..*self };
                if plain { nested.dict(py) } else { Ok(Py::new(py, Value(nested))?.into_any()) }
            }
        }
    }

    /// Reads the length of a text or a sequence; a damaged one may be anything.
    fn length(&self, capacity: usize) -> usize {
        // SAFETY: the length is within the value.
        (unsafe { self.data.cast::<u32>().read_unaligned() } as usize).min(capacity)
    }

    fn primitive(&self, py: Python<'_>, primitive: Primitive) -> PyResult<Py<PyAny>> {
        macro_rules! number {
            ($type:ty) => {
                // SAFETY: the number is within the value, and every pattern of bits is one.
                Ok(unsafe { self.data.cast::<$type>().read_unaligned() }
                    .into_pyobject(py)?
                    .into_any()
                    .unbind())
            };
        }
        match primitive {
            // SAFETY: as above.
            Primitive::Bool => {
                Ok((unsafe { self.data.read() } != 0).into_pyobject(py)?.to_owned().into_any().unbind())
            }
            Primitive::U8 => number!(u8),
            Primitive::U16 => number!(u16),
            Primitive::U32 => number!(u32),
            Primitive::U64 => number!(u64),
            Primitive::I8 => number!(i8),
            Primitive::I16 => number!(i16),
            Primitive::I32 => number!(i32),
            Primitive::I64 => number!(i64),
            Primitive::F32 => number!(f32),
            Primitive::F64 => number!(f64),
        }
    }

    /// Returns a copy of all fields, without numpy.
    pub fn dict(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let table = PyDict::new(py);
        for field in self.descriptor.fields {
            table.set_item(field.name, self.read(py, field, true)?)?;
        }
        Ok(table.into_any().unbind())
    }
}

/// Value of an interface during a tick.
/// Its fields are attributes, and items by their names.
#[pyclass(frozen, module = "slate")]
pub struct Value(pub Place);

#[pymethods]
impl Value {
    fn __getattr__(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        self.0.get(py, name)
    }

    fn __setattr__(&self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        self.0.set(name, value)
    }

    fn __getitem__(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        self.0.get(py, name)
    }

    fn __setitem__(&self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        self.0.set(name, value)
    }

    fn __dir__(&self) -> Vec<&'static str> {
        self.0.descriptor.fields.iter().map(|field| field.name).chain(["to_dict"]).collect()
    }

    /// Returns a copy of all fields, with lists for arrays.
    fn to_dict(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.0.check()?;
        self.0.dict(py)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let fields =
            if self.0.check().is_ok() { self.0.dict(py)?.bind(py).repr()?.to_string() } else { "..".into() };
        Ok(format!("{}({fields})", self.0.descriptor.name))
    }

    fn __eq__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<bool> {
        self.0.check()?;
        match other.cast::<Self>() {
            Ok(other) => {
                other.get().0.check()?;
                self.0.dict(py)?.bind(py).eq(other.get().0.dict(py)?)
            }
            Err(_) => self.0.dict(py)?.bind(py).eq(other),
        }
    }
}

/// Writes a value as a whole; returns its number of tail items.
///
/// # Errors
/// The first field that does not fit.
pub fn fill(place: &Place, capacity: usize, value: &Bound<'_, PyAny>) -> PyResult<usize> {
    if let Ok(other) = value.cast::<Value>() {
        let other = &other.get().0;
        other.check()?;
        if other.descriptor.hash != place.descriptor.hash {
            let message = format!(
                "expected a value of {}, found one of {}",
                place.descriptor.name, other.descriptor.name
            );
            return Err(PyTypeError::new_err(message));
        }
        write::fits(place.descriptor, other.items, capacity)?;
        let bytes = place.descriptor.shape(other.items).bytes(other.items);
        // SAFETY: both places have room for a value of the interface with so many items; they may be the same.
        unsafe { place.data.copy_from(other.data, bytes) };
        return Ok(other.items);
    }
    write::write_dict(place.descriptor, place.data, capacity, value)
}
