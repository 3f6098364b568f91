//! Errors of Lua.

use crate::error::BehaviorError;
use crate::files::SkillFiles;

/// Error text of Lua when the scripts exceed their memory limit.
const NO_MEMORY: &str = "not enough memory";

/// Converts an error of Lua.
/// Its text begins with file and line if it has them.
pub fn behavior_error(error: &mlua::Error, files: &SkillFiles) -> BehaviorError {
    let text = reason(error);
    let split = text.split_once(".lua:").and_then(|(file, rest)| {
        let (line, reason) = rest.split_once(": ")?;
        Some((files.path(&format!("{file}.lua"))?, line.parse().ok()?, reason))
    });
    match split {
        Some((file, line, reason)) => BehaviorError::at(line, reason).of_file(&file),
        None => BehaviorError::new(text),
    }
}

/// Returns true if the scripts exceed their memory limit.
pub fn is_out_of_memory(error: &mlua::Error) -> bool {
    reason(error) == NO_MEMORY
}

/// Returns the message of an error of Lua, without its stack.
fn reason(error: &mlua::Error) -> String {
    let text = match error {
        mlua::Error::CallbackError { cause, .. } => return reason(cause),
        mlua::Error::RuntimeError(text) => text.clone(),
        mlua::Error::SyntaxError { message, .. } => message.clone(),
        mlua::Error::MemoryError(_) => NO_MEMORY.into(),
        other => other.to_string(),
    };
    let end = text.find("\nstack traceback:").unwrap_or(text.len());
    text[..end].into()
}
