use slate_runtime::configuration::{Configuration, Diagnostic, Report, Span};
use slate_runtime::{ExternalPorts, PropertyFacts};

/// Property that does not fit its topic.
#[derive(Debug, thiserror::Error)]
#[error("/{property} and {topic}: {reason}")]
pub struct TopicMismatch {
    /// Path of the property.
    pub property: String,
    /// Topic.
    pub topic: String,
    /// Reason, in words.
    pub reason: String,
    /// Advice.
    pub help: &'static str,
    /// Place in the configuration.
    pub place: Option<Span>,
}

impl TopicMismatch {
    /// Creates a mismatch of a property and a topic.
    pub fn new(property: &str, topic: &str, reason: impl Into<String>, help: &'static str) -> Box<Self> {
        let (property, topic) = (property.into(), topic.into());
        Box::new(Self { property, topic, reason: reason.into(), help, place: None })
    }

    /// Sets the place in the configuration.
    #[must_use]
    pub fn at(mut self: Box<Self>, place: impl Into<Option<Span>>) -> Box<Self> {
        self.place = place.into();
        self
    }

    /// Returns the error with file, line and help.
    /// `configuration` must be the one that the topic came from.
    pub fn report(&self, configuration: &Configuration) -> Report {
        let help = Some(self.help.to_owned());
        Report::from(match self.place {
            Some(span) => configuration.diagnostic(span, self.to_string(), help),
            None => Diagnostic::without_place(self.to_string(), help),
        })
    }
}

/// Returns the input that a topic fills.
///
/// # Errors
/// When it is missing, a link fills it, or a field of it is named.
pub fn input<P: ExternalPorts>(
    ports: &P,
    path: &str,
    topic: &str,
) -> Result<P::Property, Box<TopicMismatch>> {
    let found = ports.external_input(path);
    let (property, field) =
        found.map_err(|error| TopicMismatch::new(path, topic, error.reason, error.help))?;
    if field.is_empty() {
        return Ok(property);
    }
    let reason = format!("`{field}` is a field, and a topic has a whole value");
    Err(TopicMismatch::new(path, topic, reason, "name the input alone"))
}

/// Returns the property whose values a topic has.
///
/// # Errors
/// When it is missing, it has no value, or a field of it is named.
pub fn output<P: ExternalPorts>(
    ports: &P,
    path: &str,
    topic: &str,
) -> Result<P::Property, Box<TopicMismatch>> {
    let wrong = |reason: String, help| TopicMismatch::new(path, topic, reason, help);
    let found = ports.find(path);
    let (property, field) =
        found.map_err(|error| wrong(error.to_string(), "`slate list` shows the properties"))?;
    if !field.is_empty() {
        let reason = format!("`{field}` is a field, and a topic has a whole value");
        return Err(wrong(reason, "name the property"));
    }
    if let Some((reason, help)) = ports.output_refusal(path) {
        return Err(wrong(reason, help));
    }
    if property.has_value() {
        Ok(property)
    } else {
        Err(wrong("it takes messages, and has no value".into(), "name an output"))
    }
}
