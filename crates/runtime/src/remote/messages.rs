//! Messages that tools send.

use std::thread::sleep;
use std::time::Duration;

use serde_json::Value as Json;
use slate_blackboard::interface::{self, Value};
use slate_blackboard::message::Status;
use slate_blackboard::{BoardError, Carrier};

use super::desk::{Desk, Done, refusal, result};
use super::properties::KNOWN;
use crate::mistake::{Message, Mistake};

/// How long it is waited for what becomes of a message.
const ANSWER: Duration = Duration::from_secs(1);

/// How often it is looked.
const LOOK: Duration = Duration::from_millis(2);

impl Desk {
    /// Sends a message to a property that takes them, and tells what becomes of it within a second: `done` or `accepted`; when
    /// it is only found out whether it would be taken, `fits`.
    pub(super) fn send(&self, url: &str, value: &Json, dry_run: bool) -> Done {
        if self.elsewhere(url).is_some() {
            let message = Mistake::OtherAgent.of(format!("{url} is of another agent"));
            return Err(refusal(message, "ask that agent itself, with --agent"));
        }
        let path = self.path_of(url)?;
        let unknown = |error: BoardError| refusal(Message::from(&error), KNOWN);
        let (property, field) = self.composer.board().find(&path).map_err(unknown)?;
        let Carrier::Mailbox(mailbox) = property.carrier() else {
            let message = Mistake::Value.of(format!("/{} takes no messages", property.path()));
            return Err(refusal(
                message,
                "`slate set` sets what can be set; `slate list` shows what there is",
            ));
        };
        if !field.is_empty() {
            let message = Mistake::Name.of(format!("/{path} is a part of a message"));
            return Err(refusal(message, "send the whole one"));
        }
        let descriptor = property.descriptor();
        let names = descriptor.fields.iter().map(|field| field.name).filter(|name| *name != "reserved");
        let lacking: Vec<_> = names.filter(|name| value.get(name).is_none()).collect();
        let shape = mailbox.shape();
        let mut bytes = vec![0; shape.bytes(shape.capacity)];
        let help = format!("a message is a {}, with all its fields", descriptor.name);
        let no_value = |error: serde_json::Error| refusal(Mistake::Value.of(error.to_string()), &help);
        let value: Value = serde_json::from_value(value.clone()).map_err(no_value)?;
        let wrong = |error| {
            let message = Message::from(&BoardError::Access { url: format!("/{path}"), error });
            refusal(message, &help)
        };
        let items = interface::edit(descriptor, &mut bytes, 0, "", &value).map_err(wrong)?;
        if !lacking.is_empty() {
            let message = Mistake::Value.of(format!("the message lacks {}", lacking.join(", ")));
            return Err(refusal(message, &help));
        }
        if dry_run {
            return result("fits");
        }
        let full = |reason: String| refusal(reason, "wait for the module that takes them");
        let mut sender = mailbox.sender().map_err(|error| full(error.to_string()))?;
        let sent = sender.send(&bytes[..shape.bytes(items)], items, self.composer.now());
        let ticket = sent.map_err(|error| full(error.to_string()))?;
        let mut waited = Duration::ZERO;
        loop {
            match sender.status(ticket) {
                Status::Done => return result("done"),
                Status::Refused(code) => {
                    let message = format!("/{path} refuses the message, with code {code}");
                    let help = format!(
                        "the module's log may say why: slate log; code {code} is one of {}",
                        descriptor.name
                    );
                    return Err(refusal(message, &help));
                }
                Status::Accepted if waited < ANSWER => {}
                Status::Accepted | Status::Unknown => return result("accepted"),
            }
            sleep(LOOK);
            waited += LOOK;
        }
    }
}
