//! Plain objects of Python as CBOR: states, and descriptions of modules.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde::ser::{Error as _, SerializeMap, SerializeSeq};
use serde::{Deserialize, Serialize, Serializer};
use slate_module::Refusal;

/// Object to be written: None, booleans, numbers, text, bytes, lists and dicts.
struct Plain<'a, 'py>(&'a Bound<'py, PyAny>);

/// Encodes an object as CBOR.
///
/// # Errors
/// An object of another type, by its type.
pub fn encode(object: &Bound<'_, PyAny>) -> PyResult<Vec<u8>> {
    slate_module::encode(&Plain(object)).map_err(|refusal: Refusal| PyTypeError::new_err(refusal.0))
}

/// Decodes an object from CBOR.
///
/// # Errors
/// When the bytes are no CBOR.
pub fn decode(py: Python<'_>, bytes: &[u8]) -> Result<Py<PyAny>, Refusal> {
    slate_module::decode::<Decoded>(bytes)
        .and_then(|decoded| decoded.object(py).map_err(|error| Refusal(error.to_string())))
}

impl Serialize for Plain<'_, '_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let object = self.0;
        let failed = |error: PyErr| S::Error::custom(error);
        if object.is_none() {
            serializer.serialize_none()
        } else if let Ok(value) = object.cast::<PyBool>() {
            serializer.serialize_bool(value.is_true())
        } else if object.is_instance_of::<PyInt>() {
            let value = object.extract::<i128>().map_err(failed)?;
            match (i64::try_from(value), u64::try_from(value)) {
                (Ok(value), _) => serializer.serialize_i64(value),
                (_, Ok(value)) => serializer.serialize_u64(value),
                _ => serializer.serialize_i128(value),
            }
        } else if let Ok(value) = object.cast::<PyFloat>() {
            serializer.serialize_f64(value.value())
        } else if let Ok(text) = object.cast::<PyString>() {
            serializer.serialize_str(text.to_str().map_err(failed)?)
        } else if let Ok(bytes) = object.cast::<PyBytes>() {
            serializer.serialize_bytes(bytes.as_bytes())
        } else if object.is_instance_of::<PyList>() || object.is_instance_of::<PyTuple>() {
            let mut list = serializer.serialize_seq(object.len().ok())?;
            for item in object.try_iter().map_err(failed)? {
                list.serialize_element(&Plain(&item.map_err(failed)?))?;
            }
            list.end()
        } else if let Ok(table) = object.cast::<PyDict>() {
            let mut map = serializer.serialize_map(Some(table.len()))?;
            for (key, value) in table.iter() {
                let Ok(key) = key.cast::<PyString>() else {
                    return Err(S::Error::custom(format!("the key {key} of a dict is not a text")));
                };
                map.serialize_entry(key.to_str().map_err(failed)?, &Plain(&value))?;
            }
            map.end()
        } else {
            let name = object.get_type().name().map_err(failed)?;
            Err(S::Error::custom(format!(
                "a {name} can't be saved: only None, booleans, numbers, text, bytes, lists, tuples, dicts with \
                 text for keys, and arrays of numpy can"
            )))
        }
    }
}

/// Object that was read.
enum Decoded {
    Null,
    Bool(bool),
    Integer(i128),
    Float(f64),
    Text(String),
    Bytes(Vec<u8>),
    List(Vec<Decoded>),
    Table(Vec<(String, Decoded)>),
}

impl Decoded {
    fn object(self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(match self {
            Self::Null => py.None(),
            Self::Bool(value) => PyBool::new(py, value).to_owned().into_any().unbind(),
            Self::Integer(value) => value.into_pyobject(py)?.into_any().unbind(),
            Self::Float(value) => PyFloat::new(py, value).into_any().unbind(),
            Self::Text(text) => PyString::new(py, &text).into_any().unbind(),
            Self::Bytes(bytes) => PyBytes::new(py, &bytes).into_any().unbind(),
            Self::List(items) => {
                let items = items.into_iter().map(|item| item.object(py)).collect::<PyResult<Vec<_>>>()?;
                PyList::new(py, items)?.into_any().unbind()
            }
            Self::Table(entries) => {
                let table = PyDict::new(py);
                for (key, value) in entries {
                    table.set_item(key, value.object(py)?)?;
                }
                table.into_any().unbind()
            }
        })
    }
}

impl<'de> Deserialize<'de> for Decoded {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        AnyObject.deserialize(deserializer)
    }
}

/// Visitor that accepts any object.
struct AnyObject;

impl<'de> DeserializeSeed<'de> for AnyObject {
    type Value = Decoded;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Decoded, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for AnyObject {
    type Value = Decoded;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a state")
    }

    fn visit_unit<E: Error>(self) -> Result<Decoded, E> {
        Ok(Decoded::Null)
    }

    fn visit_none<E: Error>(self) -> Result<Decoded, E> {
        Ok(Decoded::Null)
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<Decoded, E> {
        Ok(Decoded::Bool(value))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Decoded, E> {
        Ok(Decoded::Integer(value.into()))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Decoded, E> {
        Ok(Decoded::Integer(value.into()))
    }

    fn visit_i128<E: Error>(self, value: i128) -> Result<Decoded, E> {
        Ok(Decoded::Integer(value))
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Decoded, E> {
        Ok(Decoded::Float(value))
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<Decoded, E> {
        Ok(Decoded::Text(value.into()))
    }

    fn visit_bytes<E: Error>(self, value: &[u8]) -> Result<Decoded, E> {
        Ok(Decoded::Bytes(value.into()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Decoded, A::Error> {
        let mut list = Vec::new();
        while let Some(item) = items.next_element()? {
            list.push(item);
        }
        Ok(Decoded::List(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Decoded, A::Error> {
        let mut table = Vec::new();
        while let Some(entry) = entries.next_entry()? {
            table.push(entry);
        }
        Ok(Decoded::Table(table))
    }
}
