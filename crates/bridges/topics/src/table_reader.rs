use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use slate_module::parse_duration;
use slate_ros_messages::{DefinitionFiles, WireFormat};
use slate_runtime::Message;
use slate_runtime::configuration::{Configuration, Diagnostic, Report, Span, Spanned, Table, Value};

/// Largest depth of a topic.
const MAX_DEPTH: i64 = 10_000;

const DEFINITION_HELP: &str = "write definition = \"PACKAGE/msg/NAME.msg\", a path from the folder of this file, with the files of messages in it beside it";
const TYPE_HELP: &str = "write type = \"my_package/msg/Sample\"; in ROS 1 \"my_package/Sample\"";

/// Entry of a table: its key, the place of the key, and its value.
pub type KeyedValue = (String, Span, Spanned<Value>);

/// Resolver of a topic's or service's whole name.
/// The error is the reason why the middleware forbids the name.
pub type NameResolver = Box<dyn Fn(&str) -> Result<String, String>>;

/// Reads the table of a bridge, and collects its errors.
pub struct TableReader<'c> {
    configuration: &'c Configuration,
    /// Name of the table, and scheme of links.
    scheme: &'static str,
    format: WireFormat,
    resolve: NameResolver,
    errors: Vec<Diagnostic>,
}

impl<'c> TableReader<'c> {
    /// Creates a reader of the table of that name.
    /// `format` is that of the messages.
    pub fn new(
        configuration: &'c Configuration,
        scheme: &'static str,
        format: WireFormat,
        resolve: NameResolver,
    ) -> Self {
        Self { configuration, scheme, format, resolve, errors: Vec::new() }
    }

    /// Resolves names of topics and services from now on in this way.
    pub fn set_resolver(&mut self, resolve: NameResolver) {
        self.resolve = resolve;
    }

    /// Returns the configuration.
    pub fn configuration(&self) -> &'c Configuration {
        self.configuration
    }

    /// Returns the name of the table, and scheme of links.
    pub fn scheme(&self) -> &'static str {
        self.scheme
    }

    /// Returns whether no error was found.
    pub fn is_valid(&self) -> bool {
        self.errors.is_empty()
    }

    /// Returns the settings, or the errors found.
    ///
    /// # Errors
    /// All that were found.
    pub fn finish<T>(self, settings: T) -> Result<T, Report> {
        if self.errors.is_empty() { Ok(settings) } else { Err(Report::from(self.errors)) }
    }

    /// Adds an error with a place and help.
    pub fn add(&mut self, span: impl Into<Option<Span>>, message: impl Into<Message>, help: &str) {
        self.errors.push(match span.into() {
            Some(span) => self.configuration.diagnostic(span, message, Some(help.into())),
            None => Diagnostic::without_place(message, Some(help.into())),
        });
    }

    /// Reads the table at a value of the configuration; an empty one without it.
    pub fn table(&mut self, root: Option<&Spanned<Value>>) -> Table {
        let Some(root) = root else { return Table::default() };
        root.as_table().cloned().unwrap_or_else(|| {
            let scheme = self.scheme;
            let message = format!("`{scheme}` is a table, found {}", root.describe());
            self.add(root.span, message, &format!("write [{scheme}]"));
            Table::default()
        })
    }

    /// Refuses keys of a table that are not among the known ones.
    pub fn check_keys(&mut self, table: &Table, place: &str, known: &[&str]) {
        self.errors.extend(self.configuration.unknown_keys(table, place, known));
    }

    /// Reads the entries of a table in the table.
    pub fn entries(&mut self, table: &Table, name: &str, help: &str) -> Vec<KeyedValue> {
        let Some(value) = table.get(name) else { return Vec::new() };
        let Some(entries) = value.as_table() else {
            self.add(value.span, format!("`{name}` is a table, found {}", value.describe()), help);
            return Vec::new();
        };
        entries.iter().map(|(key, entry)| (key.to_owned(), entry.key, entry.value.clone())).collect()
    }

    /// Reads a text and its place.
    pub fn text(&mut self, table: &Table, name: &str, help: &str) -> Option<(String, Span)> {
        let value = table.get(name)?;
        if value.as_str().is_none() {
            self.add(value.span, format!("`{name}` takes a text, found {}", value.describe()), help);
        }
        Some((value.as_str()?.to_owned(), value.span))
    }

    /// Reads a truth value; false without one.
    pub fn flag(&mut self, table: &Table, name: &str) -> bool {
        let Some(value) = table.get(name) else { return false };
        if value.as_bool().is_none() {
            let message = format!("`{name}` takes true or false, found {}", value.describe());
            self.add(value.span, message, &format!("write {name} = true"));
        }
        value.as_bool().unwrap_or(false)
    }

    /// Reads the timeout for an answer.
    pub fn timeout(&mut self, table: &Table, usual: Duration) -> Duration {
        let help = "write timeout = \"2s\"";
        let Some((text, span)) = self.text(table, "timeout", help) else { return usual };
        match parse_duration(&text).filter(|time| *time > 0) {
            Some(time) => Duration::from_nanos(time),
            None => {
                self.add(span, format!("expected a duration such as \"2s\", found {text:?}"), help);
                usual
            }
        }
    }

    /// Reads the depth of a topic's history, in messages.
    pub fn depth(&mut self, table: &Table) -> Option<u16> {
        let value = table.get("depth")?;
        let depth = value.as_integer().filter(|depth| (1..=MAX_DEPTH).contains(depth));
        if depth.is_none() {
            let message = format!("`depth` is a number from 1 to {MAX_DEPTH}, found {}", value.value);
            self.add(value.span, message, "write depth = 10");
        }
        depth.map(|depth| depth as u16)
    }

    /// Reads a path in the agent.
    pub fn path(&mut self, text: &str, span: Span, help: &str) -> Option<String> {
        match self.configuration.own_path(text) {
            Ok(path) => Some(path),
            Err(report) => {
                let first = report.diagnostics().first();
                self.add(span, first.map_or_else(String::new, |first| first.message().into()), help);
                None
            }
        }
    }

    /// Reads the whole name of a topic or a service.
    pub fn topic(&mut self, name: &str, span: Span, help: &str) -> Option<String> {
        match (self.resolve)(name) {
            Ok(topic) => Some(topic),
            Err(reason) => {
                self.add(span, format!("`{name}` can't be the name of a topic: {reason}"), help);
                None
            }
        }
    }

    /// Returns the message definition in the file that `definition` names.
    /// `type` is needed where the path does not tell it.
    pub fn message_definition(&mut self, table: &Table) -> Option<Arc<DefinitionFiles>> {
        let name = self.text(table, "type", TYPE_HELP);
        let Some((file, span)) = self.text(table, "definition", DEFINITION_HELP) else {
            if let Some((_, span)) = name {
                self.add(span, "`type` is the type of a `definition`, and that is missing", DEFINITION_HELP);
            }
            return None;
        };
        if let Some((name, span)) = &name {
            let parts: Vec<_> = name.split('/').collect();
            let is_type = match (self.format, &parts[..]) {
                (WireFormat::Ros1, [package, own]) | (WireFormat::Cdr, [package, "msg", own]) => {
                    !package.is_empty() && !own.is_empty()
                }
                _ => false,
            };
            if !is_type {
                self.add(*span, format!("`{name}` is not a type of a message"), TYPE_HELP);
                return None;
            }
        }
        self.definition_files(&file, span, name.as_ref().map(|(name, _)| name.as_str()))
    }

    /// Returns the definition of a service or an action.
    /// The file of a path that ends in `extension`, or else the text.
    pub fn definition_text(&mut self, text: &str, span: Span, name: &str, extension: &str) -> Option<String> {
        let is_file = Path::new(text).extension().is_some_and(|own| own == extension) && !text.contains('\n');
        match is_file {
            true => Some(self.definition_files(text, span, Some(name))?.definition().text.clone()),
            false => Some(text.to_owned()),
        }
    }

    fn definition_files(
        &mut self,
        file: &str,
        span: Span,
        name: Option<&str>,
    ) -> Option<Arc<DefinitionFiles>> {
        let path = self.configuration.folder_of(span).join(file);
        let found = DefinitionFiles::read(self.format, &path, name);
        found.map(Arc::new).map_err(|error| self.add(span, error.to_string(), DEFINITION_HELP)).ok()
    }

    /// Returns the format of its messages.
    pub fn format(&self) -> WireFormat {
        self.format
    }
}
