//! Messages that tools send.

use std::thread::sleep;
use std::time::Duration;

use serde_json::Value as Json;
use slate_blackboard::interface::{self, Descriptor, Value};
use slate_blackboard::message::Status;
use slate_blackboard::{BoardError, Carrier, Property};

use super::properties::PropertyDirectory;
use super::refusal::{Done, KNOWN, refusal, result};
use crate::entries::Refusal;
use slate_runtime::{ErrorCode, Message};

/// Timeout for the outcome of a message.
const OUTCOME_TIMEOUT: Duration = Duration::from_secs(1);

/// Polling period.
const POLL_PERIOD: Duration = Duration::from_millis(2);

/// Path of the last lines of the log.
const LOG_TAIL: &str = "log/tail";

/// Time until lines of the log are visible, at most.
const FLUSH_TIMEOUT: Duration = Duration::from_millis(500);

/// Alternative to sending actions to Execute, for people.
const SENDER_HELP: &str =
    "drive by `slate teleop`, or set what the Plan and Knowledge take: its goal, and the rules of reflexes";

/// Returns the block that alone sends to an inbox written by such a part.
/// The part is one of the architecture.
fn sender_block(part: &str) -> Option<&'static str> {
    match part {
        "plan" => Some("the Plan"),
        "reactive" => Some("ReactiveModels"),
        _ => None,
    }
}

/// Returns the fields of an interface that a value lacks, given what it `names`.
pub fn missing_fields(descriptor: &Descriptor, names: impl Fn(&str) -> bool) -> Vec<&'static str> {
    let fields = descriptor.fields.iter().map(|field| field.name);
    fields.filter(|name| *name != "reserved" && !names(name)).collect()
}

/// Sends messages to the inboxes of an agent.
#[derive(Clone)]
pub(crate) struct MessageSender {
    properties: PropertyDirectory,
}

impl MessageSender {
    /// Creates the sender of an agent.
    pub fn new(properties: &PropertyDirectory) -> Self {
        Self { properties: properties.clone() }
    }

    /// Returns the number of the newest line of the log.
    fn log_end(&self) -> u64 {
        let tail = self.properties.board().find(LOG_TAIL).ok();
        tail.and_then(|(property, _)| Some(property.channel()?.published())).unwrap_or(0)
    }

    /// Returns the reason why a module has refused a message, in its own words.
    /// These are its warnings since the log had `log_end` lines, as a code says little.
    fn refused_message(&self, property: &Property, code: u16, log_end: u64) -> Refusal {
        let path = property.path();
        let modules = self.properties.composer().modules().into_iter().map(|module| module.name);
        let owns = |name: &String| path.strip_prefix(name.as_str()).is_some_and(|rest| rest.starts_with('/'));
        let owner = modules.filter(owns).max_by_key(String::len);
        match owner.and_then(|module| self.warning(&module, log_end)) {
            Some(text) => refusal(format!("/{path} refuses the message: {text}"), "send one that it takes"),
            None => {
                let message = format!("/{path} refuses the message, with code {code}");
                let interface = property.descriptor().name;
                refusal(message, &format!("the interface {interface} defines the code"))
            }
        }
    }

    /// Returns the last line after that number in which a module warns.
    fn warning(&self, module: &str, after: u64) -> Option<String> {
        // Lines of the last step are not written yet.
        self.properties.composer().flush_log(FLUSH_TIMEOUT);
        let kept = self.properties.board().history(LOG_TAIL).ok()?;
        let text = |line: &Value, name: &str| line.get(name).and_then(Value::as_str).map(str::to_owned);
        let warns = |line: &Value| {
            let is_warning = text(line, "level").is_some_and(|level| level == "WARN" || level == "ERROR");
            is_warning && text(line, "module").as_deref() == Some(module)
        };
        let mut new = kept.into_iter().filter(|(_, stamp)| stamp.sequence > after).map(|(line, _)| line);
        new.rfind(warns).and_then(|line| text(&line, "text"))
    }

    /// Sends a message to an inbox and returns its outcome within a second.
    /// The outcome is `done` or `accepted`; in a dry run `fits`.
    pub fn send(&self, url: &str, value: &Json, dry_run: bool) -> Done {
        if self.properties.remote.of(url).is_some() {
            let message = ErrorCode::OtherAgent.of(format!("{url} is of another agent"));
            return Err(refusal(message, "ask that agent itself, with --agent"));
        }
        let path = self.properties.path_of(url)?;
        let unknown = |error: BoardError| refusal(Message::from(&error), KNOWN);
        let (property, field) = self.properties.board().find(&path).map_err(unknown)?;
        let Carrier::Mailbox(mailbox) = property.carrier() else {
            let message = ErrorCode::Value.of(format!("/{} takes no messages", property.path()));
            return Err(refusal(
                message,
                "`slate set` sets what can be set; `slate list` shows what there is",
            ));
        };
        if !field.is_empty() {
            let message = ErrorCode::Name.of(format!("/{path} is a part of a message"));
            return Err(refusal(message, "send the whole one"));
        }
        if let Some(sender) = sender_block(&property.part()) {
            let message = format!("/{} takes messages of {sender} alone", property.path());
            return Err(refusal(ErrorCode::Attachment.of(message), SENDER_HELP));
        }
        let descriptor = property.descriptor();
        let missing = missing_fields(descriptor, |name| value.get(name).is_some());
        let shape = mailbox.shape();
        let mut bytes = vec![0; shape.bytes(shape.capacity)];
        let help = format!("a message is a {}, with all its fields", descriptor.name);
        let no_value = |error: serde_json::Error| refusal(ErrorCode::Value.of(error.to_string()), &help);
        let value: Value = serde_json::from_value(value.clone()).map_err(no_value)?;
        let wrong = |error| {
            let message = Message::from(&BoardError::Access { url: format!("/{path}"), error });
            refusal(message, &help)
        };
        let items = interface::edit(descriptor, &mut bytes, 0, "", &value).map_err(wrong)?;
        if !missing.is_empty() {
            let message = ErrorCode::Value.of(format!("the message lacks {}", missing.join(", ")));
            return Err(refusal(message, &help));
        }
        if dry_run {
            return result("fits");
        }
        let full = |reason: String| refusal(reason, "wait for the module that takes them");
        let log_end = self.log_end();
        let mut sender = mailbox.sender().map_err(|error| full(error.to_string()))?;
        bytes.truncate(shape.bytes(items));
        let composer = self.properties.composer();
        let now = {
            let composer = composer.clone();
            move || composer.now()
        };
        let sent = composer.between_cycles(move || {
            let sent = sender.send(&bytes, items, now());
            (sender, sent)
        });
        let (sender, sent) = sent.ok_or_else(|| full("the agent has ended".into()))?;
        let ticket = sent.map_err(|error| full(error.to_string()))?;
        let mut waited = Duration::ZERO;
        loop {
            match sender.status(ticket) {
                Status::Done => return result("done"),
                Status::Refused(code) => return Err(self.refused_message(&property, code, log_end)),
                Status::Accepted if waited < OUTCOME_TIMEOUT => {}
                Status::Accepted | Status::Unknown => return result("accepted"),
            }
            sleep(POLL_PERIOD);
            waited += POLL_PERIOD;
        }
    }
}
