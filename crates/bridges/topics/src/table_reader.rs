use slate_runtime::configuration::{Span, Spanned, Table, Value};

use crate::service_type::ServiceType;

/// An entry of a table: its key, where that is, and its value.
pub type KeyedValue = (String, Span, Spanned<Value>);

/// Reads values of the table of a bridge, and notes what is wrong with them.
pub trait TableReader {
    /// Notes a mistake at a place, and what to do.
    fn add(&mut self, span: Span, message: String, help: &str);

    /// Notes keys of a table that are none of those that are known.
    fn check_keys(&mut self, table: &Table, place: &str, known: &[&str]);

    /// The entries of a table in the table.
    fn entries(&mut self, table: &Table, name: &str, help: &str) -> Vec<KeyedValue>;

    /// A text, and where it is.
    fn text(&mut self, table: &Table, name: &str, help: &str) -> Option<(String, Span)>;

    /// A truth value; false without one.
    fn truth(&mut self, table: &Table, name: &str) -> bool;

    /// A path in the agent.
    fn path(&mut self, text: &str, span: Span, help: &str) -> Option<String>;

    /// The whole name of a topic or a service.
    fn topic(&mut self, name: &str, span: Span, help: &str) -> Option<String>;

    /// The type of a service, with its definition if that is given.
    ///
    /// # Errors
    /// The reason in words.
    fn service_type(&self, name: &str, definition: Option<&str>) -> Result<ServiceType, String>;
}
