//! Messages of this agent's modules to a mailbox of another agent.

use std::sync::mpsc::{Receiver as Answers, TryRecvError};

use slate_blackboard::Carrier;
use slate_blackboard::message::{ABANDONED, Answer as Reply, Receiver};
use slate_runtime::sharing::{RemotePath, SharingHost, Site, Standing};

use crate::peers::Peers;
use crate::session::DeliveryStatus;

/// Timeout of the answers to messages, ns.
/// Later messages wait behind them.
const DELIVERY_TIMEOUT: u64 = 1_000_000_000;

pub(super) struct Outbox {
    path: RemotePath,
    /// Receiver of the modules' messages, with their schema.
    receiver: Option<(u64, Receiver)>,
    /// Messages without a final answer, by their positions.
    open: Vec<(usize, Answers<DeliveryStatus>)>,
    since: u64,
    /// Reason why the last message was not delivered.
    trouble: Option<String>,
    /// Absence of the other agent.
    absent: bool,
    told: Option<Standing>,
}

impl Outbox {
    pub fn new(path: RemotePath) -> Self {
        Self { path, receiver: None, open: Vec::new(), since: 0, trouble: None, absent: true, told: None }
    }

    pub fn look(&mut self, host: &SharingHost, absence: Option<String>) {
        if std::mem::replace(&mut self.absent, absence.is_some()) && absence.is_none() {
            // What troubled messages before says nothing of the next one.
            self.trouble = None;
        }
        let standing = match absence.or_else(|| self.trouble.clone()) {
            Some(reason) => Standing::Absent { reason },
            None => Standing::Served { property: self.path.path.clone() },
        };
        if self.told.as_ref() != Some(&standing) {
            self.told = Some(standing.clone());
            host.report(&self.path, standing);
        }
    }

    /// Sends waiting messages, and passes answers on; true while answers are pending.
    pub fn forward(&mut self, peers: &Peers, site: &Site, now: u64) -> bool {
        if self.receiver.is_none() {
            let found = site.board.get(&self.path.place()).filter(|(_, field)| field.is_empty());
            self.receiver = found.and_then(|(property, _)| match property.carrier() {
                Carrier::Mailbox(mailbox) => Some((property.descriptor().hash, mailbox.receiver().ok()?)),
                _ => None,
            });
        }
        let Some((schema, receiver)) = &mut self.receiver else { return false };
        if self.open.is_empty() {
            if receiver.collect() == 0 {
                return false;
            }
            self.since = now;
            let mut refused = Vec::new();
            for (place, message) in receiver.messages().enumerate() {
                match peers.send(&self.path.agent, &self.path.path, *schema, message.items(), message.bytes())
                {
                    Ok(answers) => self.open.push((place, answers)),
                    Err(error) => {
                        self.trouble = Some(error.to_string());
                        refused.push(place);
                    }
                }
            }
            refused.into_iter().for_each(|place| receiver.answer(place, Reply::Refused(ABANDONED)));
        }
        let late = now.saturating_sub(self.since) > DELIVERY_TIMEOUT;
        let trouble = &mut self.trouble;
        let path = &self.path;
        self.open.retain(|(place, answers)| {
            let reply = loop {
                match answers.try_recv() {
                    Ok(DeliveryStatus::Accepted) => *trouble = None,
                    Ok(DeliveryStatus::Done) => break Reply::Done,
                    Ok(DeliveryStatus::Refused(code)) => break Reply::Refused(code),
                    Ok(DeliveryStatus::NoMailbox) => {
                        *trouble =
                            Some(format!("agent `{}` has no such mailbox at /{}", path.agent, path.path));
                        break Reply::Refused(ABANDONED);
                    }
                    Ok(DeliveryStatus::Denied) => {
                        *trouble = Some(format!(
                            "agent `{}` does not allow this agent to send messages to /{}",
                            path.agent, path.path
                        ));
                        break Reply::Refused(ABANDONED);
                    }
                    Ok(DeliveryStatus::Full | DeliveryStatus::Vanished) | Err(TryRecvError::Disconnected) => {
                        break Reply::Refused(ABANDONED);
                    }
                    Err(TryRecvError::Empty) if late => break Reply::Refused(ABANDONED),
                    Err(TryRecvError::Empty) => return true,
                }
            };
            receiver.answer(*place, reply);
            false
        });
        if self.open.is_empty() {
            receiver.release();
        }
        !self.open.is_empty()
    }
}
