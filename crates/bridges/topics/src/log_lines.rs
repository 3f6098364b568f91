//! Lines of the log, for a topic that has them.

use slate_blackboard::interface::Value;
use slate_control::ControlSurface;

use crate::outbound::date;

/// Last lines of the log.
const LOG_TAIL: &str = "log/tail";

/// Line of the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeLogLine {
    /// When, ns: time of the simulation in lockstep, else the date.
    pub time: u64,
    /// `ERROR`, `WARN`, `INFO`, `DEBUG` or `TRACE`.
    pub level: String,
    /// Module; empty for the agent.
    pub module: String,
    /// Text.
    pub text: String,
}

/// Follows the log of an agent.
#[derive(Clone, Debug, Default)]
pub struct LogLines {
    /// Number of the line that was taken last.
    taken: u64,
}

impl LogLines {
    /// Lines that were not taken yet.
    ///
    /// # Errors
    /// When the log can't be read, in words.
    pub fn take(&mut self, surface: &ControlSurface) -> Result<Vec<NodeLogLine>, String> {
        let found = surface.board().get(LOG_TAIL);
        let last = found.and_then(|(tail, _)| Some(tail.channel()?.published())).unwrap_or(0);
        if last == self.taken {
            return Ok(Vec::new());
        }
        let mut lines = Vec::new();
        for (line, stamp) in surface.board().history(LOG_TAIL).map_err(|error| error.to_string())? {
            if stamp.sequence <= self.taken {
                continue;
            }
            self.taken = stamp.sequence;
            let text = |name: &str| line.get(name).and_then(Value::as_str).unwrap_or_default().to_owned();
            let time = line.get("time").and_then(Value::as_integer).and_then(|time| u64::try_from(time).ok());
            let module = Some(text("module")).filter(|module| module != "agent").unwrap_or_default();
            let time = date(surface.agent.composer(), time.unwrap_or_default());
            lines.push(NodeLogLine { time, level: text("level"), module, text: text("text") });
        }
        Ok(lines)
    }
}
