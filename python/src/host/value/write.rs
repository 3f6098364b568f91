//! Objects of Python as fields of values.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyDict, PyFloat, PyInt, PyString};
use slate_module::blackboard::interface::{Descriptor, Enumeration, Field, Kind, Primitive};

use super::{Place, Value, fill};
use crate::host::memory::{Epoch, Items, Numpy};

/// Field to be written, for messages.
struct Target<'a> {
    interface: &'a str,
    field: &'a str,
}

impl Target<'_> {
    fn wrong(&self, expected: &str, found: &str) -> PyErr {
        PyTypeError::new_err(format!(
            "`{}` of {}: expected {expected}, found {found}",
            self.field, self.interface
        ))
    }

    fn unfit(&self, kind: &Kind, value: &Bound<'_, PyAny>) -> PyErr {
        let found = value.repr().map_or_else(|_| "an object".into(), |text| text.to_string());
        let short: String = found.chars().take(60).collect();
        let name = value.get_type().name().map_or_else(|_| "?".into(), |name| name.to_string());
        self.wrong(&kind.describe(), &format!("{short} ({name})"))
    }
}

/// Checks that a tail has room for so many items.
pub fn fits(descriptor: &Descriptor, items: usize, capacity: usize) -> PyResult<()> {
    if descriptor.tail().is_none() || items <= capacity {
        return Ok(());
    }
    Err(PyValueError::new_err(format!(
        "{} with {items} items, and the port has room for {capacity}: raise its `capacity`",
        descriptor.name
    )))
}

/// Writes a whole value from a dict; returns its number of tail items.
///
/// # Errors
/// The first field that is missing, unknown or of another type.
pub fn write_dict(
    descriptor: &'static Descriptor,
    data: *mut u8,
    capacity: usize,
    value: &Bound<'_, PyAny>,
) -> PyResult<usize> {
    let Ok(table) = value.cast::<PyDict>() else {
        let found = value.get_type().name()?;
        return Err(PyTypeError::new_err(format!(
            "expected the fields of {}, found {found}",
            descriptor.name
        )));
    };
    let known = || descriptor.fields.iter().map(|field| field.name).collect::<Vec<_>>().join(", ");
    let mut items = 0;
    for field in descriptor.fields {
        let Some(value) = table.get_item(field.name)? else {
            let message = format!("{} needs its field `{}`; it has {}", descriptor.name, field.name, known());
            return Err(PyTypeError::new_err(message));
        };
        if matches!(field.kind, Kind::Tail(_)) {
            items = value.len()?;
            fits(descriptor, items, capacity)?;
        }
        // SAFETY: the field is within the value, which has room for the items.
        self::field(descriptor, field, unsafe { data.add(field.offset) }, items, &value)?;
    }
    if table.len() > descriptor.fields.len() {
        let unknown = table.keys().iter().map(|key| key.to_string());
        let unknown = unknown.filter(|key| descriptor.field(key).is_none()).collect::<Vec<_>>().join(", ");
        let message = format!("{} has no field {unknown}; it has {}", descriptor.name, known());
        return Err(PyTypeError::new_err(message));
    }
    Ok(items)
}

/// Writes a field; `items` is the number of items of a tail.
///
/// # Errors
/// An object that does not fit.
pub fn field(
    descriptor: &'static Descriptor,
    field: &'static Field,
    data: *mut u8,
    items: usize,
    value: &Bound<'_, PyAny>,
) -> PyResult<()> {
    let target = Target { interface: descriptor.name, field: field.name };
    object(&target, &field.kind, data, items, value)
}

/// Writes an object of that kind.
fn object(
    target: &Target<'_>,
    kind: &'static Kind,
    data: *mut u8,
    items: usize,
    value: &Bound<'_, PyAny>,
) -> PyResult<()> {
    match kind {
        Kind::Primitive(primitive) => number(target, kind, *primitive, data, value),
        Kind::Enumeration(enumeration) => constant(target, kind, enumeration, data, value),
        Kind::Text(capacity) => {
            let Ok(text) = value.cast::<PyString>() else { return Err(target.unfit(kind, value)) };
            let text = text.to_str()?.as_bytes();
            if text.len() > *capacity {
                return Err(target.wrong(&kind.describe(), &format!("{} bytes", text.len())));
            }
            // SAFETY: the caller gives room for the kind, and the text fits.
            unsafe {
                data.write_bytes(0, kind.size());
                data.cast::<u32>().write_unaligned(text.len() as u32);
                data.add(4).copy_from_nonoverlapping(text.as_ptr(), text.len());
            }
            Ok(())
        }
        Kind::Optional(item) => {
            let mut written = vec![0; kind.size()];
            if !value.is_none() {
                // The item has its place behind the mark.
                object(target, item, written[8..].as_mut_ptr(), 0, value)?;
                written[..4].copy_from_slice(&1_u32.to_ne_bytes());
            }
            // The value may have been a view of this memory.
            // SAFETY: the caller gives room for the kind.
            unsafe { data.copy_from_nonoverlapping(written.as_ptr(), written.len()) };
            Ok(())
        }
        Kind::Array(item, length) => {
            list(target, Items { kind: item, data, count: *length, writable: true }, value)
        }
        Kind::Sequence(item, capacity) => {
            let count = value.len().map_err(|_| target.unfit(kind, value))?;
            if count > *capacity {
                return Err(target.wrong(&kind.describe(), &format!("{count} items")));
            }
            // SAFETY: the caller gives room for the kind, which has its length before the items.
            let first = unsafe { data.add(8) };
            // Without numpy, fields that an item does not name are 0. An array may be a view of this memory, such as a part of
            // the items that are there, which numpy heeds.
            if !value.hasattr("dtype")? {
                let mut written = vec![0_u8; kind.size()];
                let items = written[8..].as_mut_ptr();
                list(target, Items { kind: item, data: items, count, writable: true }, value)?;
                written[..4].copy_from_slice(&(count as u32).to_ne_bytes());
                // SAFETY: as before.
                unsafe { data.copy_from_nonoverlapping(written.as_ptr(), written.len()) };
                return Ok(());
            }
            list(target, Items { kind: item, data: first, count, writable: true }, value)?;
            let used = count * item.size();
            // SAFETY: as before; the items fit, as their number was checked.
            unsafe {
                data.write_bytes(0, 8);
                data.cast::<u32>().write_unaligned(count as u32);
                first.add(used).write_bytes(0, kind.size() - 8 - used);
            }
            Ok(())
        }
        Kind::Tail(item) => list(target, Items { kind: item, data, count: items, writable: true }, value),
        Kind::Nested(descriptor) => {
            if value.is_instance_of::<PyDict>() || value.is_instance_of::<Value>() {
                let place = Place { descriptor, data, items: 0, writable: true, epoch: Epoch::now() };
                return fill(&place, 0, value).map(drop);
            }
            Err(target.unfit(kind, value))
        }
    }
}

/// Writes items: an array of the same type and shape, bytes, or any sequence.
fn list(target: &Target<'_>, items: Items, value: &Bound<'_, PyAny>) -> PyResult<()> {
    let py = value.py();
    if value.hasattr("dtype")? {
        let name = format!("`{}` of {}", target.field, target.interface);
        let view = items.array(py, &name)?;
        let of = |array: &Bound<'_, PyAny>, name| array.getattr(name).map(Bound::unbind);
        let is_same = |name| of(&view, name)?.bind(py).eq(of(value, name)?);
        if !is_same("dtype")? || !is_same("shape")? {
            let text = |array: &Bound<'_, PyAny>| -> PyResult<String> {
                Ok(format!("{} of shape {}", array.getattr("dtype")?, array.getattr("shape")?))
            };
            return Err(target.wrong(&text(&view)?, &text(value)?));
        }
        let numpy = Numpy::get(py, &name)?;
        return numpy.copy_to.bind(py).call1((view, value)).map(drop);
    }
    let size = items.kind.size();
    if let (Ok(bytes), Kind::Primitive(Primitive::U8)) = (value.cast::<PyBytes>(), items.kind) {
        let bytes = bytes.as_bytes();
        if bytes.len() != items.count {
            return Err(target.wrong(&format!("{} bytes", items.count), &format!("{}", bytes.len())));
        }
        // SAFETY: the caller gives room for the items.
        unsafe { items.data.copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) };
        return Ok(());
    }
    let length = value.len().ok().filter(|_| !value.is_instance_of::<PyString>());
    if length != Some(items.count) {
        let expected = format!("{} x {}", items.count, items.kind.describe());
        let name = value.get_type().name()?;
        let found = length.map_or_else(|| name.to_string(), |length| format!("a {name} of {length} items"));
        return Err(target.wrong(&expected, &found));
    }
    // SAFETY: the caller gives room for the items.
    let mut written = unsafe { std::slice::from_raw_parts(items.data, items.count * size) }.to_vec();
    for (i, item) in value.try_iter()?.enumerate().take(items.count) {
        object(target, items.kind, written[i * size..].as_mut_ptr(), 0, &item?)?;
    }
    // Items may have been views of this memory.
    // SAFETY: as above.
    unsafe { items.data.copy_from_nonoverlapping(written.as_ptr(), written.len()) };
    Ok(())
}

fn constant(
    target: &Target<'_>,
    kind: &Kind,
    enumeration: &'static Enumeration,
    data: *mut u8,
    value: &Bound<'_, PyAny>,
) -> PyResult<()> {
    let Ok(name) = value.cast::<PyString>() else {
        return object(target, &enumeration.carrier, data, 0, value);
    };
    let name = name.to_str()?;
    let mut constants = enumeration.constants.iter();
    let Some(constant) = constants.find(|constant| constant.name.eq_ignore_ascii_case(name)) else {
        return Err(target.unfit(kind, value));
    };
    object(target, &enumeration.carrier, data, 0, constant.value.into_pyobject(value.py())?.as_any())
}

fn number(
    target: &Target<'_>,
    kind: &Kind,
    primitive: Primitive,
    data: *mut u8,
    value: &Bound<'_, PyAny>,
) -> PyResult<()> {
    let unfit = || target.unfit(kind, value);
    // SAFETY: the caller gives room for the number.
    macro_rules! write {
        ($type:ty, $number:expr) => {
            unsafe { data.cast::<$type>().write_unaligned($number) }
        };
    }
    macro_rules! integer {
        ($type:ty) => {{
            // A number of numpy is no int, but can stand for one; a boolean does not.
            if value.is_instance_of::<PyBool>() || value.is_instance_of::<PyFloat>() {
                return Err(unfit());
            }
            write!($type, value.extract::<$type>().map_err(|_| unfit())?)
        }};
    }
    match primitive {
        Primitive::Bool => {
            let is_number = value.is_instance_of::<PyInt>() && !value.is_instance_of::<PyBool>();
            let truth = if is_number { None } else { value.extract::<bool>().ok() };
            write!(u8, truth.ok_or_else(unfit)?.into())
        }
        Primitive::U8 => integer!(u8),
        Primitive::U16 => integer!(u16),
        Primitive::U32 => integer!(u32),
        Primitive::U64 => integer!(u64),
        Primitive::I8 => integer!(i8),
        Primitive::I16 => integer!(i16),
        Primitive::I32 => integer!(i32),
        Primitive::I64 => integer!(i64),
        Primitive::F32 | Primitive::F64 => {
            let number = value.extract::<f64>().ok().filter(|_| !value.is_instance_of::<PyBool>());
            let number = number.ok_or_else(unfit)?;
            if primitive == Primitive::F64 { write!(f64, number) } else { write!(f32, number as f32) }
        }
    }
    Ok(())
}
