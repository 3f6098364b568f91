//! Errors in the arguments of a command.

use clap::error::{ContextKind, ContextValue};

/// Returns the message of a usage error without its hint.
pub fn message(error: &clap::Error) -> String {
    parts(error).0
}

/// Returns the hint of a usage error.
/// It names the command that was meant, else usage and similar names.
pub fn help(error: &clap::Error) -> String {
    suggested_verb(error).map_or_else(|| parts(error).1, str::to_owned)
}

fn parts(error: &clap::Error) -> (String, String) {
    let text = error.render().to_string();
    let text = text.strip_prefix("error: ").unwrap_or(&text);
    let (message, help) = text.split_once("\n\n").unwrap_or((text, ""));
    (message.trim().to_owned(), help.trim().to_owned())
}

/// Returns the command for a name that other systems use.
pub fn suggested_verb(error: &clap::Error) -> Option<&'static str> {
    let Some(ContextValue::String(verb)) = error.get(ContextKind::InvalidSubcommand) else { return None };
    FOREIGN_COMMANDS.iter().find(|(names, _)| names.contains(&verb.as_str())).map(|(_, help)| *help)
}

/// Names of commands in other tools, and their equivalents here.
const FOREIGN_COMMANDS: [(&[&str], &str); 6] = [
    (
        &["plot"],
        "`slate bag plot FILE FIELD` plots a recording, `slate console` live values; `slate watch URL --csv` prints a table",
    ),
    (
        &["param", "params", "parameter", "parameters"],
        "`slate tree '/**/params' --values` lists parameters, `slate set /MODULE/params/NAME VALUE` sets one, and \
         `slate config diff` and `save` show and keep changes",
    ),
    (
        &["show", "info"],
        "`slate get URL` prints a value, `slate tree` lists properties, `slate ps` lists running agents",
    ),
    (&["start", "launch"], "`slate run NAME` starts an agent"),
    (&["topic", "topics"], "`slate list` lists the properties, `slate watch URL` prints their values"),
    (&["node", "nodes"], "`slate module list` lists the modules, `slate top` shows their timing"),
];
