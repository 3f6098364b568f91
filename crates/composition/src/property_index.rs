//! Properties by path, of an agent or of a composition without one.

use std::sync::Arc;

use slate_blackboard::interface::Descriptor;
use slate_blackboard::{Access, Board, BoardError, Carrier, Property, Shape, Url};
use slate_configuration::{Configuration, Report};

/// Facts about a property that do not depend on its values.
pub trait PropertyFacts: Clone {
    /// Returns the path in the agent, without a leading slash.
    fn path(&self) -> &str;

    /// Returns the interface of its values or messages.
    fn descriptor(&self) -> &'static Descriptor;

    /// Returns the writer.
    fn access(&self) -> Access;

    /// Returns the layout of its values or messages.
    fn shape(&self) -> Shape;

    /// Returns true if it has values, and does not receive messages.
    fn has_value(&self) -> bool {
        self.access() != Access::Messages
    }
}

impl PropertyFacts for Arc<Property> {
    fn path(&self) -> &str {
        Property::path(self)
    }

    fn descriptor(&self) -> &'static Descriptor {
        Property::descriptor(self)
    }

    fn access(&self) -> Access {
        Property::access(self)
    }

    fn shape(&self) -> Shape {
        match self.carrier() {
            Carrier::Channel(channel) => channel.shape(),
            Carrier::Mailbox(mailbox) => mailbox.shape(),
        }
    }
}

/// Properties by path, of an agent or of a composition without one.
pub trait PropertyIndex {
    /// Property.
    type Property: PropertyFacts;

    /// Returns the name of the agent.
    fn agent(&self) -> &str;

    /// Returns the property at a path, and the field that the rest of the path names.
    /// The field is empty for the whole value.
    ///
    /// # Errors
    /// [`BoardError::Unknown`] with the nearest names.
    fn find(&self, path: &str) -> Result<(Self::Property, String), BoardError>;

    /// Returns all properties in the order of their paths.
    fn properties(&self) -> Vec<Self::Property>;

    /// Returns the property of a URL of this agent, and the field that it names.
    ///
    /// # Errors
    /// As [`find`](Self::find), or that the URL belongs to another agent.
    fn resolve(&self, url: &Url) -> Result<(Self::Property, String), BoardError> {
        if url.agent().is_some_and(|agent| agent != self.agent()) {
            return Err(BoardError::OtherAgent { url: url.to_string(), agent: self.agent().into() });
        }
        self.find(&url.path_in(""))
    }
}

impl PropertyIndex for Board {
    type Property = Arc<Property>;

    fn agent(&self) -> &str {
        Board::agent(self)
    }

    fn find(&self, path: &str) -> Result<(Arc<Property>, String), BoardError> {
        Board::find(self, path)
    }

    fn properties(&self) -> Vec<Arc<Property>> {
        Board::properties(self)
    }
}

/// Checks that the properties of facts exist.
/// A robot states facts to its team. A property may be missing while its module is not loaded.
///
/// # Errors
/// The first that is missing.
pub fn check_facts(
    configuration: &Configuration,
    index: &impl PropertyIndex,
    is_loaded: impl Fn(&str) -> bool,
) -> Result<(), Report> {
    let facts = configuration.share().and_then(|share| share.knowledge.as_ref());
    for (topic, path) in facts.iter().flat_map(|knowledge| &knowledge.facts) {
        let waits = configuration.modules().iter().any(|module| {
            let name = module.name.value.as_str();
            let is_its = path.value.strip_prefix(name).is_some_and(|rest| rest.starts_with('/'));
            is_its && !is_loaded(name)
        });
        if let Err(error) = index.find(&path.value)
            && !waits
        {
            let message = format!("what this robot states about `{topic}`: {error}");
            let help = "name the output of a block that states facts: \"block/output\"".to_owned();
            return Err(configuration.diagnostic(path.span, message, Some(help)).into());
        }
    }
    Ok(())
}
