//! Messages of this agent's modules to a mailbox of another agent.

use std::sync::mpsc::{Receiver as Answers, TryRecvError};

use slate_blackboard::Carrier;
use slate_blackboard::message::{ABANDONED, Answer as Reply, Receiver};
use slate_runtime::sharing::{DemandState, RemotePath, SharingHost, Site};

use crate::peers::Peers;
use crate::session::DeliveryStatus;

/// Timeout of the answers to messages, ns.
/// Later messages wait behind them.
const ANSWER_TIMEOUT: u64 = 1_000_000_000;

pub(super) struct Outbox {
    path: RemotePath,
    /// Receiver of the modules' messages, with their schema.
    receiver: Option<(u64, Receiver)>,
    /// Messages without a final answer, by their positions.
    pending: Vec<(usize, Answers<DeliveryStatus>)>,
    since: u64,
    /// Reason why the last message was not delivered.
    error: Option<String>,
    /// Absence of the other agent.
    absent: bool,
    reported: Option<DemandState>,
}

impl Outbox {
    pub fn new(path: RemotePath) -> Self {
        Self {
            path,
            receiver: None,
            pending: Vec::new(),
            since: 0,
            error: None,
            absent: true,
            reported: None,
        }
    }

    pub fn report_status(&mut self, host: &SharingHost, absence: Option<String>) {
        if std::mem::replace(&mut self.absent, absence.is_some()) && absence.is_none() {
            // An earlier error does not apply to the next message.
            self.error = None;
        }
        let state = match absence.or_else(|| self.error.clone()) {
            Some(reason) => DemandState::Absent { reason },
            None => DemandState::Served { property: self.path.path.clone() },
        };
        if self.reported.as_ref() != Some(&state) {
            self.reported = Some(state.clone());
            host.report(&self.path, state);
        }
    }

    /// Sends waiting messages, and passes answers on; true while answers are pending.
    pub fn forward(&mut self, peers: &Peers, site: &Site, now: u64) -> bool {
        if self.receiver.is_none() {
            let found = site.board.get(&self.path.mirror_path()).filter(|(_, field)| field.is_empty());
            self.receiver = found.and_then(|(property, _)| match property.carrier() {
                Carrier::Mailbox(mailbox) => Some((property.descriptor().hash, mailbox.receiver().ok()?)),
                _ => None,
            });
        }
        let Some((schema, receiver)) = &mut self.receiver else { return false };
        if self.pending.is_empty() {
            if receiver.collect() == 0 {
                return false;
            }
            self.since = now;
            let mut refused = Vec::new();
            for (index, message) in receiver.messages().enumerate() {
                match peers.send(&self.path.agent, &self.path.path, *schema, message.items(), message.bytes())
                {
                    Ok(answers) => self.pending.push((index, answers)),
                    Err(error) => {
                        self.error = Some(error.to_string());
                        refused.push(index);
                    }
                }
            }
            refused.into_iter().for_each(|index| receiver.answer(index, Reply::Refused(ABANDONED)));
        }
        let late = now.saturating_sub(self.since) > ANSWER_TIMEOUT;
        let error = &mut self.error;
        let path = &self.path;
        self.pending.retain(|(index, answers)| {
            let reply = loop {
                match answers.try_recv() {
                    Ok(DeliveryStatus::Accepted) => *error = None,
                    Ok(DeliveryStatus::Done) => break Reply::Done,
                    Ok(DeliveryStatus::Refused(code)) => break Reply::Refused(code),
                    Ok(DeliveryStatus::NoMailbox) => {
                        *error = Some(format!("agent `{}` has no such inbox at /{}", path.agent, path.path));
                        break Reply::Refused(ABANDONED);
                    }
                    Ok(DeliveryStatus::Denied) => {
                        *error = Some(format!(
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
            receiver.answer(*index, reply);
            false
        });
        if self.pending.is_empty() {
            receiver.release();
        }
        !self.pending.is_empty()
    }
}
