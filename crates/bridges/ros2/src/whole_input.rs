//! Inputs that messages fill.

use std::sync::Arc;

use slate_blackboard::Property;
use slate_runtime::Composer;

/// The input at a path, or why it can't be filled from outside and what to do.
pub fn whole_input(composer: &Composer, path: &str) -> Result<Arc<Property>, (String, &'static str)> {
    let (property, field) = composer.external_input(path).map_err(|error| (error.reason, error.help))?;
    if field.is_empty() {
        return Ok(property);
    }
    Err((format!("`{field}` is a field, and a message has a whole value"), "name the input alone"))
}
