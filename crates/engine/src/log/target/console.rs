use std::ffi::OsStr;
use std::io::{IsTerminal, Write};
use std::sync::LazyLock;

use slate_module::Level;

use super::{LogTarget, Record, level_name};

/// Standard error; in color on a terminal, unless `NO_COLOR` is set.
#[derive(Debug, Default)]
pub struct ConsoleTarget;

static IS_COLORED: LazyLock<bool> = LazyLock::new(|| {
    let variable = |name| std::env::var_os(name);
    wants_color(std::io::stderr().is_terminal(), variable("NO_COLOR").as_deref(), variable("TERM").as_deref())
});

impl LogTarget for ConsoleTarget {
    fn write(&mut self, record: &Record) {
        let line = if *IS_COLORED { colored(record) } else { format!("{record}\n") };
        // In one piece, so that lines of other threads don't come between; a closed stream is ignored.
        let _ = std::io::stderr().write_all(line.as_bytes());
    }
}

/// Returns true if the output may be colored, as <https://no-color.org> defines.
/// Any value of `NO_COLOR` but the empty one disables color.
fn wants_color(terminal: bool, no_color: Option<&OsStr>, term: Option<&OsStr>) -> bool {
    terminal && no_color.is_none_or(OsStr::is_empty) && term.is_none_or(|term| term != "dumb")
}

fn colored(record: &Record) -> String {
    let color = match record.level {
        Level::Error => "\x1b[31m",
        Level::Warn => "\x1b[33m",
        Level::Info => "\x1b[32m",
        Level::Debug => "\x1b[36m",
        Level::Trace => "\x1b[2m",
    };
    let (time, level) = (record.time as f64 * 1e-9, level_name(record.level));
    format!("{time:10.3} {color}{level:5}\x1b[0m \x1b[1m{}\x1b[0m: {}\n", record.module, record.message())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    #[test]
    fn color_is_for_terminals_that_want_it() {
        let xterm = Some(OsStr::new("xterm"));
        assert!(wants_color(true, None, xterm) && wants_color(true, Some(OsStr::new("")), xterm));
        assert!(!wants_color(false, None, xterm));
        assert!(!wants_color(true, Some(OsStr::new("0")), xterm));
        assert!(!wants_color(true, None, Some(OsStr::new("dumb"))));
    }

    #[test]
    fn color_adds_nothing_but_color() {
        let mut record = Record::new(1_500_000_000, Level::Warn, &Arc::from("r2/planner"), "no way\x1b[2J");
        record.fields.push(("goal".into(), "door".into()));
        let mut plain = colored(&record);
        for code in ["\x1b[33m", "\x1b[1m", "\x1b[0m"] {
            plain = plain.replace(code, "");
        }
        assert_eq!(plain, format!("{record}\n"));
        assert_eq!(plain, "     1.500 warn  r2/planner: no way\\u{1b}[2J goal=door\n");
    }
}
