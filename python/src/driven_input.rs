//! Inputs that are set in each cycle.

use std::sync::Arc;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use slate_blackboard::Property;
use slate_blackboard::interface::{Kind, Primitive};

/// Input of numbers that is set in each cycle.
#[pyclass(frozen, module = "slate._slate")]
pub struct DrivenInput {
    property: Arc<Property>,
    /// Offsets of the fields, bytes.
    offsets: Vec<usize>,
    size: usize,
    /// Names of the fields, in order.
    #[pyo3(get)]
    names: Vec<&'static str>,
}

impl DrivenInput {
    pub fn new(property: Arc<Property>, field: &str) -> Result<Self, String> {
        let descriptor = property.descriptor();
        let is_number = |kind: &Kind| *kind == Kind::Primitive(Primitive::F64);
        if !field.is_empty() || !descriptor.fields.iter().all(|field| is_number(&field.kind)) {
            return Err(format!(
                "/{}: expected an input all of whose fields are f64, such as Twist2, found {}",
                property.path(),
                if field.is_empty() { descriptor.name } else { "a field" }
            ));
        }
        let offsets = descriptor.fields.iter().map(|field| field.offset).collect();
        let names = descriptor.fields.iter().map(|field| field.name).collect();
        Ok(Self { offsets, size: descriptor.size, names, property })
    }

    /// Sets the input at a time, ns.
    pub fn set(&self, values: &[f64], time: u64) -> PyResult<()> {
        if values.len() != self.offsets.len() {
            return Err(PyValueError::new_err(format!(
                "/{}: expected {} numbers ({}), found {}",
                self.property.path(),
                self.offsets.len(),
                self.names.join(", "),
                values.len()
            )));
        }
        let mut bytes = vec![0; self.size];
        for (offset, value) in self.offsets.iter().zip(values) {
            bytes[*offset..offset + 8].copy_from_slice(&value.to_ne_bytes());
        }
        let set = self.property.set_bytes(&bytes, time);
        set.map(drop).map_err(|error| PyValueError::new_err(error.to_string()))
    }
}
