use std::net::SocketAddr;
use std::path::PathBuf;

use slate_module::Level;

use super::model::{Log, LogFile, LogTargets};
use super::problems::Problems;
use super::source::{Sources, Spanned};
use super::value::{Table, TableEntry, Value};
use crate::error_code::ErrorCode;
use crate::syslog::SyslogAddress;

const LEVELS: [(&str, Level); 5] = [
    ("error", Level::Error),
    ("warn", Level::Warn),
    ("info", Level::Info),
    ("debug", Level::Debug),
    ("trace", Level::Trace),
];

/// Default size of a log file, bytes.
const SIZE: u64 = 10_000_000;

/// Default number of older log files that are kept.
const KEEP: u32 = 5;

const UNITS: [(&str, u64); 9] = [
    ("KiB", 1 << 10),
    ("MiB", 1 << 20),
    ("GiB", 1 << 30),
    ("TiB", 1 << 40),
    ("kB", 1_000),
    ("MB", 1_000_000),
    ("GB", 1_000_000_000),
    ("TB", 1_000_000_000_000),
    ("B", 1),
];

/// Reader of `[log]`.
pub(super) struct LogReader<'a> {
    pub(super) sources: &'a Sources,
    pub(super) problems: &'a mut Problems,
}

impl LogReader<'_> {
    pub(super) fn log(&mut self, root: &Table) -> Option<Log> {
        let table = self.problems.table(root, "log")?;
        self.problems.unknown_keys(table, "in [log]", &["level", "levels", "repeat", "targets"]);
        let level = table.get("level").and_then(|value| self.problems.choice("level", value, &LEVELS));
        let mut levels = Vec::new();
        for (name, entry) in self.problems.table(table, "levels").into_iter().flat_map(Table::iter) {
            let good = self.problems.name("a module", name, true, entry.key);
            if let Some(level) = self.problems.choice(name, &entry.value, &LEVELS).filter(|_| good) {
                levels.push((Spanned::new(name.into(), entry.key), level));
            }
        }
        let repeat = table.get("repeat").and_then(|value| self.problems.count("repeat", value));
        let targets = self.problems.table(table, "targets").map(|table| self.log_targets(table));
        Some(Log { level: level?, levels, repeat: repeat?, targets: targets? })
    }

    fn log_targets(&mut self, table: &Table) -> LogTargets {
        let problems = &mut *self.problems;
        problems.unknown_keys(table, "in [log.targets]", &["console", "file", "syslog", "remote"]);
        // `false` in a later layer switches a target of an earlier one off.
        let wanted = |name| {
            let entry = table.entries.get(name)?;
            (entry.value.as_bool() != Some(false)).then_some(entry)
        };
        let (file, syslog, remote) = (wanted("file"), wanted("syslog"), wanted("remote"));
        let mut targets = LogTargets {
            console: problems.flag(table, "console").is_some_and(|flag| flag.value),
            file: file.and_then(|entry| problems.log_file(entry)),
            syslog: syslog.and_then(|entry| problems.syslog(&entry.value)),
            remote: remote.and_then(|entry| problems.remote(&entry.value)),
        };
        if let Some(LogFile { path, .. }) = &mut targets.file {
            path.value = self.sources.folder(path.span).join(&path.value);
        }
        targets
    }
}

impl Problems {
    fn log_file(&mut self, entry: &TableEntry) -> Option<LogFile> {
        const EXAMPLE: &str =
            "write file = \"agent.log\", or file = { path = \"agent.log\", size = \"10MB\", keep = 5 }";
        let table = match &entry.value.value {
            Value::Text(path) => {
                let path = Spanned::new(PathBuf::from(path), entry.value.span);
                return Some(LogFile { path, size: SIZE, keep: KEEP });
            }
            Value::Table(table) => table,
            other => {
                let message = ErrorCode::Value
                    .of(format!("`file` takes a path or a table, found {}", other.describe()));
                self.add(entry.value.span, message, EXAMPLE);
                return None;
            }
        };
        self.unknown_keys(table, "in [log.targets.file]", &["path", "size", "keep"]);
        if table.get("path").is_none() {
            self.add(entry.key, "the log file has no `path`", EXAMPLE);
        }
        let path = self.text(table, "path", "agent.log");
        let size = match table.get("size") {
            Some(value) => self.size("size", value),
            None => Some(SIZE),
        };
        let keep = match table.get("keep") {
            Some(value) => self.count("keep", value).map(|keep| keep.value.min(u32::MAX.into()) as u32),
            None => Some(KEEP),
        };
        let path = path.map(|path| Spanned::new(PathBuf::from(&path.value), path.span));
        Some(LogFile { path: path?, size: size?, keep: keep? })
    }

    fn syslog(&mut self, value: &Spanned<Value>) -> Option<Spanned<SyslogAddress>> {
        let address = match &value.value {
            Value::Bool(_) => Some(SyslogAddress::default()),
            Value::Text(path) if path.starts_with('/') => Some(SyslogAddress::Socket(path.into())),
            Value::Text(address) => address.parse().ok().map(SyslogAddress::Server),
            _ => None,
        };
        if address.is_none() {
            let help =
                "write syslog = true, a socket such as \"/dev/log\", or a server such as \"192.168.0.2:514\"";
            self.add(
                value.span,
                "`syslog` takes true, the path of a socket, or the address of a server",
                help,
            );
        }
        Some(Spanned::new(address?, value.span))
    }

    fn remote(&mut self, value: &Spanned<Value>) -> Option<Spanned<SocketAddr>> {
        let address = value.as_str().and_then(|text| text.parse().ok());
        if address.is_none() {
            let help = "write remote = \"127.0.0.1:7411\"; port 0 is any that is free";
            self.add(value.span, "`remote` takes an IP address and a port as text", help);
        }
        Some(Spanned::new(address?, value.span))
    }

    /// Reads a whole number from 0.
    fn count(&mut self, name: &str, value: &Spanned<Value>) -> Option<Spanned<u64>> {
        let count = value.as_integer().and_then(|number| u64::try_from(number).ok());
        if count.is_none() {
            let found = value.as_integer().map_or(value.describe().into(), |number| number.to_string());
            let message = ErrorCode::Value.of(format!("`{name}` takes a whole number from 0, found {found}"));
            self.add(value.span, message, format!("write a number such as {name} = 5"));
        }
        Some(Spanned::new(count?, value.span))
    }

    /// Reads a size in bytes, greater than 0.
    pub(super) fn size(&mut self, name: &str, value: &Spanned<Value>) -> Option<u64> {
        let size = value.as_str().and_then(parse_size).filter(|size| *size > 0);
        if size.is_none() {
            let help = format!(
                "a size is text with a unit of B, kB, MB, GB, TB, KiB, MiB, GiB or TiB, such as {name} = \"10MB\""
            );
            self.add(value.span, ErrorCode::Value.of(format!("`{name}` takes a size above zero")), help);
        }
        size
    }
}

fn parse_size(text: &str) -> Option<u64> {
    let (number, factor) =
        UNITS.iter().find_map(|(unit, factor)| Some((text.strip_suffix(unit)?, factor)))?;
    number.trim_end().parse::<u64>().ok()?.checked_mul(*factor)
}
