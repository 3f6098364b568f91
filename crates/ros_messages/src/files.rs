//! Definitions from `.msg`, `.srv` and `.action` files.

use std::fs;
use std::path::{Path, PathBuf};

use slate_blackboard::interface::Descriptor;
use slate_sorted::SortedMap;

use super::cdr::WireFormat;
use super::definition::{Definition, SEPARATOR};
use super::schema::{MAX_NESTING, SchemaField, primitive, reference, sections, suffix};
use super::standard::message_body;
use super::{Error, Schema, Standard};

/// Largest file, bytes.
const MAX_FILE_SIZE: u64 = 1 << 20;

/// Line between the parts of a service or an action.
const PART_SEPARATOR: &str = "---";

/// Messages that need no definition, as each reader knows them.
pub(super) const BUILTIN: [&str; 2] = ["builtin_interfaces/Time", "builtin_interfaces/Duration"];

/// Error of reading a definition from files.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{location}: {reason}")]
pub struct FileError {
    /// File, and its line if that is known: `msg/Sample.msg:3`.
    pub location: String,
    /// Found and expected.
    pub reason: String,
}

/// Definition from a file.
/// It has those of its nested messages and the place of each line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DefinitionFiles {
    format: WireFormat,
    definition: Definition,
    /// Places by line of the text.
    locations: Vec<FileLocation>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct FileLocation {
    path: PathBuf,
    /// Line, from 1.
    line: usize,
}

impl FileLocation {
    fn error(&self, reason: impl Into<String>) -> FileError {
        FileError { location: format!("{}:{}", self.path.display(), self.line), reason: reason.into() }
    }
}

impl DefinitionFiles {
    /// Reads a `.msg`, `.srv` or `.action` file.
    /// Without `name`, its type is that of its path, `PACKAGE/msg/NAME.msg`.
    ///
    /// Messages in it are searched for in the same file (each behind a line of `=` and `MSG: package/Name`), beside it
    /// (`NAME.msg`), below the same root (`PACKAGE/msg/NAME.msg`), and among those that are built in.
    ///
    /// # Errors
    /// A file is missing or no definition, a type is unknown, or a message contains itself.
    pub fn read(format: WireFormat, path: &Path, name: Option<&str>) -> Result<Self, FileError> {
        let name = match name {
            Some(name) => name.to_owned(),
            None => type_of_path(format, path)?,
        };
        let key = reference("", &name);
        let mut reader = FileReader { format, root: root(path), blocks: SortedMap::new(), lines: Vec::new() };
        reader.add_file(&key, path)?;
        reader.visit(&key, &mut Vec::new(), &mut Vec::new())?;
        let (lines, locations): (Vec<_>, Vec<_>) = reader.lines.into_iter().unzip();
        Ok(Self { format, definition: Definition { name, text: lines.join("\n") + "\n" }, locations })
    }

    /// Returns the type, and its fields followed by the messages in it.
    pub fn definition(&self) -> &Definition {
        &self.definition
    }

    /// Returns the schema of a message.
    ///
    /// # Errors
    /// The nesting of messages is too deep.
    pub fn schema(&self) -> Result<Schema, FileError> {
        Schema::parse(&self.definition.name, &self.definition.text).map_err(|error| self.error(error))
    }

    /// Returns the conversion of an interface's values to these messages.
    /// Fields of the same name must fit, or the only ones of both.
    ///
    /// # Errors
    /// A field does not fit, or none does.
    pub fn standard(&self, descriptor: &'static Descriptor) -> Result<Standard, FileError> {
        let (definition, schema) = (self.definition.clone(), self.schema()?);
        let name = definition.name.clone();
        let line = |path: &str| self.schema().ok().and_then(|schema| schema.line(path)).unwrap_or(1);
        Standard::defined(self.format, descriptor, definition, schema)
            .map_err(|(path, reason)| self.error(Error::Definition { name, line: line(&path), reason }))
    }

    /// Returns an error of the definition, at its place in the files.
    pub fn error(&self, error: Error) -> FileError {
        let (line, reason) = match error {
            Error::Definition { line, reason, .. } => (line, reason),
            other => (1, other.to_string()),
        };
        match self.locations.get(line.saturating_sub(1)).or(self.locations.first()) {
            Some(location) => location.error(reason),
            None => FileError { location: self.definition.name.clone(), reason },
        }
    }
}

/// Returns the type of a file in the layout of ROS's packages.
fn type_of_path(format: WireFormat, path: &Path) -> Result<String, FileError> {
    let text = |part: Option<&std::ffi::OsStr>| part.and_then(|part| part.to_str()).map(ToOwned::to_owned);
    let folder = path.parent();
    let package = folder.and_then(Path::parent).and_then(|package| text(package.file_name()));
    let (kind, name) = (text(folder.and_then(Path::file_name)), text(path.file_stem()));
    match (package, kind, name, text(path.extension())) {
        (Some(package), Some(kind), Some(name), Some(extension)) if kind == extension => {
            Ok(if format == WireFormat::Ros1 {
                format!("{package}/{name}")
            } else {
                format!("{package}/{kind}/{name}")
            })
        }
        _ => {
            let reason = "the type is not known from the path: expected PACKAGE/msg/NAME.msg, or type = \"package/msg/Name\"";
            Err(FileError { location: path.display().to_string(), reason: reason.into() })
        }
    }
}

/// Returns the folder of the packages that a file is in, or its own.
fn root(path: &Path) -> PathBuf {
    let folder = path.parent().unwrap_or(Path::new(""));
    let is_package =
        folder.file_name().is_some_and(|name| name == "msg" || name == "srv" || name == "action");
    match folder.parent().and_then(Path::parent).filter(|_| is_package) {
        Some(root) => root.to_owned(),
        None => folder.to_owned(),
    }
}

struct FileReader {
    format: WireFormat,
    root: PathBuf,
    /// Lines of messages that were found, by package and name.
    blocks: SortedMap<String, Vec<(String, FileLocation)>>,
    /// The text so far.
    lines: Vec<(String, FileLocation)>,
}

impl FileReader {
    /// Reads the messages of a file, of which the first has that package and name.
    fn add_file(&mut self, key: &str, path: &Path) -> Result<(), FileError> {
        let wrong = |reason: String| FileError { location: path.display().to_string(), reason };
        let size =
            fs::metadata(path).map_err(|error| wrong(format!("the file can't be read: {error}")))?.len();
        if size > MAX_FILE_SIZE {
            return Err(wrong(format!("the file has {size} bytes, more than {MAX_FILE_SIZE}")));
        }
        let text =
            fs::read_to_string(path).map_err(|error| wrong(format!("the file can't be read: {error}")))?;
        let (mut own, mut is_opened) = (key.to_owned(), false);
        self.blocks.entry(own.clone()).or_default();
        for (at, line) in text.lines().enumerate() {
            let location = FileLocation { path: path.to_owned(), line: at + 1 };
            let code = line.trim();
            if code.len() >= PART_SEPARATOR.len() && code.bytes().all(|byte| byte == b'=') {
                is_opened = true;
                continue;
            }
            if is_opened && !code.is_empty() {
                let name = code.strip_prefix("MSG:").map(str::trim);
                let name =
                    name.ok_or_else(|| location.error("expected `MSG: package/Name` below the line of `=`"))?;
                (own, is_opened) = (reference("", name), false);
                self.blocks.insert(own.clone(), Vec::new());
                continue;
            }
            if let Some(block) = self.blocks.get_mut(&own) {
                block.push((line.to_owned(), location));
            }
        }
        Ok(())
    }

    /// Appends a message and its nested messages.
    /// `open` are the messages that contain it, `done` those already appended.
    fn visit(&mut self, key: &str, open: &mut Vec<String>, done: &mut Vec<String>) -> Result<(), FileError> {
        let Some(block) = self.blocks.get(key).cloned() else { return Ok(()) };
        // A message without lines has the place of the one before.
        if !done.is_empty()
            && let Some((_, location)) = block.first().or(self.lines.last()).cloned()
        {
            let lines = [SEPARATOR.to_owned(), format!("MSG: {key}")];
            self.lines.extend(lines.map(|line| (line, location.clone())));
        }
        self.lines.extend(block.iter().cloned());
        done.push(key.to_owned());
        open.push(key.to_owned());
        let body: Vec<_> =
            block.iter().map(|(line, _)| if line.trim() == PART_SEPARATOR { "" } else { line }).collect();
        let body = body.join("\n");
        let at = |line: usize| block[line - 1].1.clone();
        let found = sections(key, &body).map_err(|error| match error {
            Error::Definition { line, reason, .. } => at(line).error(reason),
            other => FileError { location: key.into(), reason: other.to_string() },
        })?;
        for SchemaField { number, of, .. } in found.iter().flat_map(|(_, fields)| fields) {
            let location = at(*number);
            let (item, _) = suffix(of).map_err(|reason| location.error(reason))?;
            if primitive(item).map_err(|reason| location.error(reason))?.is_some()
                || (self.format == WireFormat::Ros1 && matches!(item, "time" | "duration"))
            {
                continue;
            }
            let inner = self.find(key, item, &location)?;
            if let Some(first) = open.iter().position(|own| *own == inner) {
                let chain = [&open[first..], std::slice::from_ref(&inner)].concat().join(" > ");
                return Err(location.error(format!("a message can't contain itself: {chain}")));
            }
            if open.len() >= MAX_NESTING {
                return Err(
                    location.error(format!("messages stand more than {MAX_NESTING} deep in each other"))
                );
            }
            if !done.contains(&inner) {
                self.visit(&inner, open, done)?;
            }
        }
        open.pop();
        Ok(())
    }

    /// Returns package and name of a type that a message names.
    /// Its definition is found among the files.
    fn find(&mut self, owner: &str, item: &str, location: &FileLocation) -> Result<String, FileError> {
        let package = owner.split('/').next().unwrap_or_default();
        let key = reference(package, item);
        if self.blocks.contains_key(&key) || BUILTIN.contains(&key.as_str()) {
            return Ok(key);
        }
        let (package, name) = key.split_once('/').unwrap_or(("", &key));
        let beside = location.path.with_file_name(format!("{name}.msg"));
        let below = self.root.join(package).join("msg").join(format!("{name}.msg"));
        let candidates = if item.contains('/') { vec![below] } else { vec![beside, below] };
        if let Some(path) = candidates.iter().find(|path| path.is_file()) {
            let path = path.clone();
            self.add_file(&key, &path)?;
            return Ok(key);
        }
        let known = if item == "Header" { "std_msgs/Header" } else { &key };
        if let Some(body) = message_body(self.format, known) {
            let location = |at: usize| FileLocation { path: PathBuf::from(known), line: at + 1 };
            let lines = body.lines().enumerate().map(|(at, line)| (line.to_owned(), location(at)));
            self.blocks.insert(known.to_owned(), lines.collect());
            return Ok(known.to_owned());
        }
        let looked: Vec<_> = candidates.iter().map(|path| path.display().to_string()).collect();
        Err(location.error(format!(
            "unknown type `{item}`: expected a primitive type, a built-in message, or a file {}",
            looked.join(" or ")
        )))
    }
}
