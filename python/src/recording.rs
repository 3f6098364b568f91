//! Recordings, read into columns.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use pyo3::exceptions::{PyException, PyKeyError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use slate_bag::{Decoder, Error, Reader, Selection, verify};

use crate::columns::{Column, Columns};

/// Time after which a long read looks for signals, such as Ctrl-C.
const SIGNALS: Duration = Duration::from_millis(50);

/// File of a recording.
#[pyclass(frozen, module = "slate._slate")]
pub struct RecordingFile {
    path: PathBuf,
}

/// Messages of one topic: times, ns, and columns by field.
/// A column has its name, the type of its numbers, its content, and the lengths of its lists.
type Table<'py> = (Bound<'py, PyBytes>, Vec<(String, &'static str, Bound<'py, PyAny>, Option<Vec<u32>>)>);

#[pymethods]
impl RecordingFile {
    #[new]
    fn new(path: PathBuf) -> Self {
        Self { path }
    }

    /// Content of the file, as `slate bag info --json` has it.
    fn info(&self, py: Python<'_>) -> PyResult<String> {
        let info = py.detach(|| verify(&mut Reader::open(&self.path)?)).map_err(|error| exception(&error))?;
        serde_json::to_string(&info).map_err(|error| PyException::new_err(error.to_string()))
    }

    /// Messages of one topic between two times after the first message, ns.
    #[pyo3(signature = (topic, start=None, end=None))]
    fn table<'py>(
        &self,
        py: Python<'py>,
        topic: &str,
        start: Option<u64>,
        end: Option<u64>,
    ) -> PyResult<Table<'py>> {
        let mut selection = Selection::new([topic]);
        (selection.from, selection.to) = (start, end);
        let columns = py.detach(|| self.columns(&selection))?;
        let (times, columns) = columns.into_parts();
        let columns = columns.into_iter().map(|(name, column)| {
            let (lengths, dtype) = (column.list_lengths(), column.dtype());
            let content = match column {
                Column::Numbers { bytes, .. } => PyBytes::new(py, &bytes).into_any(),
                Column::Texts { items, .. } => items.into_pyobject(py)?,
            };
            Ok::<_, PyErr>((name, dtype, content, lengths))
        });
        Ok((PyBytes::new(py, &times), columns.collect::<PyResult<_>>()?))
    }

    /// Content of an attached file, such as `configuration.toml`.
    fn attachment<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyBytes>> {
        let read = || -> Result<Option<Vec<u8>>, Error> {
            let mut reader = Reader::open(&self.path)?;
            for number in 0..reader.attachments() {
                if let Some(found) = reader.attachment(number)?.filter(|found| found.name == name) {
                    return Ok(Some(found.data));
                }
            }
            Ok(None)
        };
        let found = py.detach(read).map_err(|error| exception(&error))?;
        found.map(|data| PyBytes::new(py, &data)).ok_or_else(|| PyKeyError::new_err(name.to_owned()))
    }
}

impl RecordingFile {
    #[allow(clippy::disallowed_methods, reason = "signals are looked for by the wall clock")]
    fn columns(&self, selection: &Selection) -> PyResult<Columns> {
        let mut reader = Reader::open(&self.path).map_err(|error| exception(&error))?;
        let (mut columns, mut decoder) = (Columns::default(), Decoder::default());
        let (mut interrupted, mut looked) = (None, Instant::now());
        let read = selection.visit(&mut reader, |message| {
            let value = decoder.decode_named(message);
            columns
                .add(message.log_time, &value)
                .map_err(|what| Error::Unfit { path: self.path.clone(), what })?;
            if looked.elapsed() >= SIGNALS {
                interrupted = Python::attach(|py| py.check_signals()).err();
                looked = Instant::now();
            }
            Ok(interrupted.is_none())
        });
        match interrupted {
            Some(interrupt) => Err(interrupt),
            None => read.map(|()| columns).map_err(|error| exception(&error)),
        }
    }
}

fn exception(error: &Error) -> PyErr {
    match error {
        Error::Read { source, .. } if source.kind() == std::io::ErrorKind::NotFound => {
            pyo3::exceptions::PyFileNotFoundError::new_err(error.to_string())
        }
        Error::Damaged { path, .. } => PyException::new_err(format!(
            "{error}\nhelp: `slate bag repair {}` recovers what is left",
            slate_runtime::printable(path)
        )),
        other => PyException::new_err(other.to_string()),
    }
}
