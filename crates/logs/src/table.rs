use std::io::Write;
use std::path::{Path, PathBuf};

use slate_sorted::SortedMap;

use crate::open;
use slate_bag::whole::PartialFile;
use slate_bag::{Decoder, Error, Message, Selection, Unread, Value, seconds};

/// A file that [`export_csv`] has written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Table {
    /// Path of the file.
    pub path: PathBuf,
    /// Topic of the messages.
    pub topic: String,
    /// Number of rows.
    pub rows: u64,
}

/// Writes the messages of each selected topic as a CSV table.
/// Columns are the log time in seconds, the sequence number, and the fields of the value; a list is one cell. An `out`
/// that ends with `.csv` is the file of the only topic, otherwise the folder of all. Returns the tables, and the
/// messages that can't be read, which are in no table.
///
/// # Errors
/// When the file is damaged, `out` can't be written, or is one file for several topics.
pub fn export_csv(
    path: &Path,
    selection: &Selection,
    out: &Path,
) -> Result<(Vec<Table>, Vec<Unread>), Error> {
    let mut reader = open(path)?;
    let is_file = out.extension().is_some_and(|extension| extension == "csv");
    if !is_file {
        std::fs::create_dir_all(out).map_err(|source| Error::Write { path: out.into(), source })?;
    }
    let mut decoder = Decoder::default();
    let mut open: SortedMap<String, OpenTable> = SortedMap::new();
    selection.visit(&mut reader, |message| {
        let topic = &message.channel.topic;
        let unfit = |what| Error::Unfit { path: path.into(), what };
        let value = decoder.decode(message);
        if let Value::Unread { .. } = value {
            return Ok(true);
        }
        let fields = value.fields(false);
        if !open.contains_key(topic) {
            if is_file && !open.is_empty() {
                let what = "it would hold several topics; select one, or name a folder".into();
                return Err(Error::Unfit { path: out.into(), what });
            }
            let target = if is_file { out.to_owned() } else { out.join(file_name(topic)) };
            if let Some((other, _)) = open.iter().find(|(_, open)| open.table.path == target) {
                let what = format!("`{other}` and `{topic}` would both be written there; select one of them");
                return Err(Error::Unfit { path: target, what });
            }
            open.insert(topic.clone(), OpenTable::new(topic, target, &fields)?);
        }
        let Some(table) = open.get_mut(topic) else { return Ok(true) };
        table.row(message, &fields).and_then(|fits| match fits {
            true => Ok(true),
            false => Err(unfit(format!(
                "message {} of `{topic}` has other fields than those before, so it does not form a table",
                table.table.rows
            ))),
        })
    })?;
    let finish = |open: OpenTable| open.part.finish().map(|()| open.table);
    let tables = open.into_values().map(finish).collect::<Result<_, _>>()?;
    Ok((tables, decoder.into_unread()))
}

/// Returns the file name of a topic: `/r2/range` becomes `r2_range.csv`.
fn file_name(topic: &str) -> String {
    let allowed = |character: char| character.is_alphanumeric() || "-_.".contains(character);
    let name = topic.trim_start_matches('/');
    let name: String =
        name.chars().map(|character| if allowed(character) { character } else { '_' }).collect();
    format!("{name}.csv")
}

/// A table that is written.
struct OpenTable {
    table: Table,
    columns: Vec<String>,
    part: PartialFile,
}

impl OpenTable {
    fn new(topic: &str, path: PathBuf, fields: &[(String, String)]) -> Result<Self, Error> {
        let columns: Vec<_> = fields.iter().map(|(name, _)| name.clone()).collect();
        let part = PartialFile::create(&path)?;
        let mut open = Self { table: Table { path, topic: topic.into(), rows: 0 }, columns, part };
        let columns = open.columns.clone();
        open.line(["time_s", "sequence"].into_iter().chain(columns.iter().map(String::as_str)))?;
        Ok(open)
    }

    fn line<'a>(&mut self, cells: impl Iterator<Item = &'a str>) -> Result<(), Error> {
        let cells: Vec<_> = cells.map(quoted).collect();
        let path = &self.table.path;
        writeln!(self.part, "{}", cells.join(","))
            .map_err(|source| Error::Write { path: path.clone(), source })
    }

    /// Writes a message; false if it has other fields.
    fn row(&mut self, message: &Message, fields: &[(String, String)]) -> Result<bool, Error> {
        if !self.columns.iter().eq(fields.iter().map(|(name, _)| name)) {
            return Ok(false);
        }
        let (time, sequence) = (seconds(message.log_time), message.sequence.to_string());
        self.line([&time[..], &sequence].into_iter().chain(fields.iter().map(|(_, text)| text.as_str())))?;
        self.table.rows += 1;
        Ok(true)
    }
}

/// Returns a cell, in quotes if it needs them.
fn quoted(cell: &str) -> String {
    match cell.contains(['"', ',', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.into(),
    }
}
