//! Messages for which an agent in lockstep waits.

use std::time::Duration;

use slate_module::parse_duration;
use slate_runtime::configuration::{Span, Table};

use crate::table_reader::TableReader;

/// Keys of [`TopicWait`] in the entry of an input.
pub(crate) const WAIT_KEYS: [&str; 3] = ["wait_per", "timeout", "late"];

/// Default timeout for a message.
const DEFAULT_TIMEOUT: Duration = Duration::from_secs(10);

const WAIT_PER_HELP: &str =
    "write wait_per = \"/odom\", a topic that is written here, or \"/clock\", or a period such as \"20ms\"";
const LATE_HELP: &str = "write late = \"stop\" or \"continue\"";

/// Trigger of the wait for one message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WaitPer {
    /// Each value of a topic that the agent writes, or of `/clock`.
    Topic(String),
    /// Each period of the agent's time, ns.
    Period(u64),
}

/// Wait of an agent in lockstep for the messages of a topic.
/// One message for each value or period.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TopicWait {
    /// Trigger of the wait for one message.
    pub per: WaitPer,
    /// Timeout for a message, on the system's clock.
    /// Before the first message also for the node.
    pub timeout: Duration,
    /// Late policy: true to continue without the message, false to end the run.
    pub continue_when_late: bool,
    /// Place in the configuration.
    pub place: Span,
}

impl TopicWait {
    /// Reads the wait from an input's entry; `None` when cycles don't wait for it.
    pub(crate) fn read(reader: &mut TableReader<'_>, table: &Table) -> Option<Self> {
        let continue_when_late = match reader.text(table, "late", LATE_HELP) {
            Some((text, _)) if text == "continue" => true,
            Some((text, span)) if text != "stop" => {
                reader.add(
                    span,
                    format!("expected `late` to be stop or continue, found {text:?}"),
                    LATE_HELP,
                );
                false
            }
            _ => false,
        };
        let timeout = reader.timeout(table, DEFAULT_TIMEOUT);
        let Some((per, place)) = reader.text(table, "wait_per", WAIT_PER_HELP) else {
            for key in ["timeout", "late"] {
                if let Some(value) = table.get(key).filter(|_| table.get("wait_per").is_none()) {
                    reader.add(
                        value.span,
                        format!("`{key}` is that of `wait_per`, which is missing"),
                        WAIT_PER_HELP,
                    );
                }
            }
            return None;
        };
        let period = parse_duration(&per).filter(|period| *period > 0);
        let per = match period {
            Some(period) => WaitPer::Period(period),
            None => WaitPer::Topic(reader.topic(&per, place, WAIT_PER_HELP)?),
        };
        Some(Self { per, timeout, continue_when_late, place })
    }

    /// Refuses a wait for answers to a topic that is not written.
    pub(crate) fn check(
        &self,
        reader: &mut TableReader<'_>,
        is_written: impl Fn(&str) -> bool,
        has_clock: bool,
    ) {
        let (needs_clock, topic) = match &self.per {
            WaitPer::Topic(topic) => (topic == CLOCK_TOPIC, Some(topic)),
            // A node with a timer goes by it.
            WaitPer::Period(_) => (true, None),
        };
        if needs_clock && !has_clock {
            let help = format!("write clock = true in [{}]", reader.scheme());
            let text = "messages are waited for by the time of the agent, and /clock is not published";
            reader.add(self.place, text, &help);
        } else if let Some(topic) = topic.filter(|topic| *topic != CLOCK_TOPIC && !is_written(topic)) {
            let text = format!("messages for each value of {topic} are waited for, and no entry writes it");
            reader.add(self.place, text, WAIT_PER_HELP);
        }
    }
}

/// Topic of the agent's time.
pub const CLOCK_TOPIC: &str = "/clock";
