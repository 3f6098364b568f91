//! State of synchronizations by names, for snapshots and for a changed plan.

use serde::{Deserialize, Serialize};

use super::{RobotStatement, SynchronizationEntry, Synchronizer};

/// State of a [`Synchronizer`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct SynchronizerState {
    /// Number of the run; 0 for one that has not begun.
    pub life: u64,
    /// Time of the newest run of the robot, ns.
    pub now: u64,
    /// Timeout of partners in that run, ns.
    pub timeout: u64,
    /// True if the plan has ended.
    pub has_ended: bool,
    /// Hard synchronizations.
    pub hard: Vec<SavedSynchronization>,
    /// Sent tokens, with the number of firings.
    pub sent: Vec<(String, u64)>,
    /// Received tokens.
    pub received: Vec<SavedReceived>,
    /// Other robots.
    pub partners: Vec<SavedPartner>,
}

/// State of a hard synchronization.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SavedSynchronization {
    /// Identifier of the transition.
    pub id: String,
    /// Statement of the robot about it.
    pub entry: SynchronizationEntry,
    /// Number of attempts that the robot has opened.
    pub attempts: u64,
}

/// Tokens that were received.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SavedReceived {
    /// Identifier of the sent tokens.
    pub id: String,
    /// Life of the sender.
    pub life: u64,
    /// Number of firings whose tokens were put.
    pub done: u64,
}

/// Knowledge of another robot.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SavedPartner {
    /// Name of the robot.
    pub name: String,
    /// Newest statement.
    pub statement: RobotStatement,
    /// Time of its last change, ns.
    pub heard: u64,
    /// True if the robot was absent at the last report.
    pub was_absent: bool,
    /// Statements about transitions.
    pub entries: Vec<(String, SynchronizationEntry)>,
}

impl Synchronizer {
    /// Returns the state.
    pub fn state(&self) -> SynchronizerState {
        let id = |index: usize| self.ids[index].clone();
        let partners = self.partners.iter().map(|partner| SavedPartner {
            name: partner.name.clone(),
            statement: partner.statement,
            heard: partner.last_beat,
            was_absent: partner.was_absent,
            entries: self.ids.iter().cloned().zip(partner.entries.iter().copied()).collect(),
        });
        let hard = self.hard.iter().map(|hard| SavedSynchronization {
            id: id(hard.id),
            entry: hard.entry,
            attempts: hard.attempts,
        });
        let received = self.received.iter().map(|received| SavedReceived {
            id: id(received.id),
            life: received.life,
            done: received.done,
        });
        SynchronizerState {
            life: self.life,
            now: self.now,
            timeout: self.timeout,
            has_ended: self.has_ended,
            hard: hard.collect(),
            sent: self.sent.iter().map(|(_, sent, done)| (id(*sent), *done)).collect(),
            received: received.collect(),
            partners: partners.collect(),
        }
    }

    /// Restores a state, also of another version of the plan.
    ///
    /// # Errors
    /// If the plan lacks a transition that the robot has promised to fire.
    pub fn restore(&mut self, state: &SynchronizerState) -> Result<(), String> {
        if state.life == 0 {
            return Ok(());
        }
        for SavedSynchronization { id, entry, attempts } in &state.hard {
            match self.hard.iter_mut().find(|hard| self.ids[hard.id] == *id) {
                Some(hard) => (hard.entry, hard.attempts) = (*entry, *attempts),
                None if entry.open == 0 => {}
                None => return Err(format!("the plan lacks the transition `{id}`, which others wait for")),
            }
        }
        (self.life, self.now, self.timeout) = (state.life, state.now, state.timeout);
        self.has_ended = state.has_ended;
        for hard in self.hard.iter_mut().filter(|hard| hard.decider.is_none()) {
            hard.entry.life = self.life;
        }
        for (id, done) in &state.sent {
            let own = self.sent.iter_mut().find(|(_, sent, _)| self.ids[*sent] == *id);
            own.into_iter().for_each(|(.., count)| *count = *done);
        }
        for SavedReceived { id, life, done } in &state.received {
            let own = self.received.iter_mut().find(|received| self.ids[received.id] == *id);
            own.into_iter().for_each(|received| (received.life, received.done) = (*life, *done));
        }
        for SavedPartner { name, statement, heard, was_absent, entries } in &state.partners {
            let Some(own) = self.partners.iter_mut().find(|partner| partner.name == *name) else { continue };
            (own.statement, own.last_beat, own.was_absent) = (*statement, *heard, *was_absent);
            for (id, entry) in entries {
                let index = self.ids.iter().position(|own| own == id);
                index.into_iter().for_each(|index| own.entries[index] = *entry);
            }
        }
        Ok(())
    }
}
