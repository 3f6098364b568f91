//! Agreement of robots on the transitions of a joint plan.

mod state;

use serde::{Deserialize, Serialize};
pub use state::{SavedPartner, SavedReceived, SavedSynchronization, SynchronizerState};

use crate::joint::RobotNet;
use crate::net::PetriNet;

/// Statement of a robot about a transition that it shares with others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SynchronizationEntry {
    /// True if the robot could fire it now.
    pub is_ready: bool,
    /// Life of the deciding robot that the numbers are of.
    pub life: u64,
    /// Number of the open attempt; 0 for none.
    /// The deciding robot has opened it, or another one has promised to follow it.
    pub open: u64,
    /// Newest attempt in which it fired, or number of firings whose tokens it has sent.
    pub done: u64,
}

/// Statement of a robot about itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RobotStatement {
    /// Number of the run of its plan: another one after a restart.
    pub life: u64,
    /// Changes now and then, as long as the robot runs.
    pub beat: u64,
    /// True if its plan has reached its goal or failed.
    pub has_ended: bool,
}

/// Synchronization whose outcome another robot does not share.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SynchronizationError {
    /// Silence of the deciding robot.
    #[error(
        "`{robot}` is not heard since it was to decide about `{transition}`: whether it has fired it is unknown; \
         look after that robot, and start the plans again"
    )]
    InDoubt {
        /// Robot.
        robot: String,
        /// Identifier of the transition.
        transition: String,
    },
    /// End of a robot's plan in spite of its promise to follow.
    #[error("`{robot}` has ended its plan and not followed `{transition}`: start the plans again")]
    NotFollowed {
        /// Robot.
        robot: String,
        /// Identifier of the transition.
        transition: String,
    },
    /// Restoration of a robot to a state before the synchronization.
    #[error("this robot and `{robot}` count other firings of `{transition}`: restore both to one time")]
    Restored {
        /// Robot.
        robot: String,
        /// Identifier of the transition.
        transition: String,
    },
}

/// Another robot of the plan.
#[derive(Clone, Debug)]
struct Partner {
    name: String,
    statement: RobotStatement,
    /// Time of its last beat, ns of this robot's clock.
    last_beat: u64,
    /// True if the robot was absent at the last report.
    was_absent: bool,
    /// Entries by the transitions of the synchronizer.
    entries: Vec<SynchronizationEntry>,
}

/// Hard synchronization.
#[derive(Clone, Debug)]
struct Hard {
    transition: usize,
    /// Index in the list of identifiers.
    id: usize,
    /// Partner that decides; `None` where this robot does.
    decider: Option<usize>,
    /// Other robots.
    partners: Vec<usize>,
    entry: SynchronizationEntry,
    /// Number of attempts that this robot has opened.
    attempts: u64,
    /// True if all others have promised, or the deciding robot has fired.
    is_agreed: bool,
}

#[derive(Clone, Debug)]
struct Reception {
    transition: usize,
    id: usize,
    partner: usize,
    life: u64,
    done: u64,
}

/// Synchronizer of one robot with the others of a [`JointNet`](crate::JointNet).
///
/// The first robot by name decides about a hard synchronization: when all are ready it opens an attempt, each other robot
/// promises to follow and then changes nothing in its plan, and when all have promised the deciding robot fires, which
/// the others follow. Before a promise each may go another way; so a synchronization is fired by all or by none.
/// Statements may be late, lost or repeated, as each has the whole state. Two robots can't agree about a decision of
/// which one does not hear: a robot that has promised and hears nothing for the timeout fails, and the others hear that.
#[derive(Clone, Debug)]
pub struct Synchronizer {
    life: u64,
    timeout: u64,
    now: u64,
    has_ended: bool,
    ids: Vec<String>,
    partners: Vec<Partner>,
    hard: Vec<Hard>,
    /// Transition, identifier, number of firings.
    sent: Vec<(usize, usize, u64)>,
    received: Vec<Reception>,
}

impl Synchronizer {
    /// Begins a run of a robot's part of a plan at a time, ns.
    /// The time distinguishes it from earlier runs.
    pub fn new(net: &RobotNet, robot: &str, now: u64) -> Self {
        // 0 is that of a robot that was not heard.
        let life = now.max(1);
        let mut made = Self {
            life,
            timeout: u64::MAX,
            now,
            has_ended: false,
            ids: Vec::new(),
            partners: Vec::new(),
            hard: Vec::new(),
            sent: Vec::new(),
            received: Vec::new(),
        };
        for hard in &net.hard {
            let id = made.id(&hard.id);
            let others = hard.robots.iter().filter(|other| *other != robot);
            let partners: Vec<usize> = others.map(|other| made.partner(other)).collect();
            let decider = if hard.robots.first().is_some_and(|first| first == robot) {
                None
            } else {
                partners.first().copied()
            };
            let entry =
                SynchronizationEntry { life: if decider.is_none() { life } else { 0 }, ..Default::default() };
            let transition = hard.transition;
            made.hard.push(Hard { transition, id, decider, partners, entry, attempts: 0, is_agreed: false });
        }
        for (transition, id) in &net.sent {
            let id = made.id(id);
            made.sent.push((*transition, id, 0));
        }
        for received in &net.received {
            let (id, partner) = (made.id(&received.id), made.partner(&received.robot));
            let transition = received.transition;
            made.received.push(Reception { transition, id, partner, life: 0, done: 0 });
        }
        for partner in &mut made.partners {
            partner.entries = vec![SynchronizationEntry::default(); made.ids.len()];
        }
        made
    }

    fn id(&mut self, id: &str) -> usize {
        self.ids.iter().position(|other| other == id).unwrap_or_else(|| {
            self.ids.push(id.into());
            self.ids.len() - 1
        })
    }

    fn partner(&mut self, name: &str) -> usize {
        self.partners.iter().position(|partner| partner.name == name).unwrap_or_else(|| {
            let statement = RobotStatement::default();
            let last_beat = self.now;
            let name = name.into();
            let partner = Partner { name, statement, last_beat, was_absent: false, entries: Vec::new() };
            self.partners.push(partner);
            self.partners.len() - 1
        })
    }

    /// Begins a run of the robot at a time.
    /// Both the time and the timeout of its partners are in ns.
    ///
    /// A robot that was frozen itself does not take others for absent.
    pub fn begin(&mut self, now: u64, timeout: u64) {
        self.timeout = timeout;
        let gap = now.saturating_sub(self.now);
        if gap > timeout / 2 {
            self.partners.iter_mut().for_each(|partner| partner.last_beat += gap);
        }
        self.now = now;
    }

    /// Receives the newest statement of a partner.
    /// It may be any robot of the plan.
    pub fn receive<'a>(
        &mut self,
        robot: &str,
        statement: RobotStatement,
        entries: impl Iterator<Item = (&'a str, SynchronizationEntry)>,
    ) {
        let Some(partner) = self.partners.iter_mut().find(|partner| partner.name == robot) else { return };
        if partner.statement != statement {
            partner.last_beat = self.now;
        }
        if partner.statement.life != statement.life {
            partner.entries.fill(SynchronizationEntry::default());
        }
        partner.statement = statement;
        for (id, entry) in entries {
            if let Some(index) = self.ids.iter().position(|own| own == id) {
                partner.entries[index] = entry;
            }
        }
    }

    /// Returns true if a robot of the plan is absent.
    /// It is not heard for the timeout, or at its end. `None` for robots outside the plan.
    pub fn is_absent(&self, robot: &str) -> Option<bool> {
        let index = self.partners.iter().position(|partner| partner.name == robot)?;
        Some(self.is_silent(index) || self.partners[index].statement.has_ended)
    }

    /// Reports each robot that has become absent, or is back.
    /// Its name, true if it is absent, and true if it has ended.
    pub fn report_presence(&mut self, mut report: impl FnMut(&str, bool, bool)) {
        for index in 0..self.partners.len() {
            let has_ended = self.partners[index].statement.has_ended;
            let is_absent = has_ended || self.is_silent(index);
            let partner = &mut self.partners[index];
            if std::mem::replace(&mut partner.was_absent, is_absent) != is_absent {
                report(&partner.name, is_absent, has_ended);
            }
        }
    }

    fn is_silent(&self, partner: usize) -> bool {
        self.now.saturating_sub(self.partners[partner].last_beat) > self.timeout
    }

    /// Decides by the received statements.
    ///
    /// # Errors
    /// If robots do not agree, and can't agree any more.
    pub fn decide(&mut self) -> Result<(), SynchronizationError> {
        for index in 0..self.hard.len() {
            match self.hard[index].decider {
                None => self.decide_own(index)?,
                Some(decider) => self.follow(index, decider)?,
            }
        }
        for received in &mut self.received {
            let partner = &self.partners[received.partner];
            if partner.statement.life != received.life {
                (received.life, received.done) = (partner.statement.life, 0);
            }
        }
        Ok(())
    }

    /// Decides as the deciding robot, once all others have promised.
    fn decide_own(&mut self, index: usize) -> Result<(), SynchronizationError> {
        let Hard { id, ref partners, entry, .. } = self.hard[index];
        let (mut is_agreed, mut is_open) = (entry.open > 0, entry.open > 0);
        for partner in partners {
            let other = &self.partners[*partner];
            let theirs = other.entries[id];
            let is_own = theirs.life == self.life;
            if is_own && theirs.done > entry.done {
                return Err(self.error(index, *partner, |robot, transition| {
                    SynchronizationError::Restored { robot, transition }
                }));
            }
            if is_own && other.statement.has_ended && theirs.open > 0 && theirs.open == entry.done {
                return Err(self.error(index, *partner, |robot, transition| {
                    SynchronizationError::NotFollowed { robot, transition }
                }));
            }
            let is_gone = other.statement.has_ended || self.is_silent(*partner);
            let has_promised = is_own && theirs.open == entry.open;
            is_open &= !is_gone && (theirs.is_ready || has_promised);
            is_agreed &= !is_gone && has_promised;
        }
        let hard = &mut self.hard[index];
        hard.is_agreed = is_agreed;
        if !is_open {
            hard.entry.open = 0;
        }
        Ok(())
    }

    /// Follows the deciding robot, once it has fired or given up.
    fn follow(&mut self, index: usize, decider: usize) -> Result<(), SynchronizationError> {
        let Hard { id, entry, .. } = self.hard[index];
        let other = &self.partners[decider];
        let theirs = other.entries[id];
        let life = other.statement.life;
        let is_silent = self.is_silent(decider);
        if entry.life != life {
            // It is not in the plan where it was, and has forgotten the attempt.
            self.hard[index].entry =
                SynchronizationEntry { life, done: theirs.done, ..SynchronizationEntry::default() };
            self.hard[index].is_agreed = false;
            return Ok(());
        }
        if theirs.done > entry.done && theirs.done != entry.open {
            return Err(self.error(index, decider, |robot, transition| SynchronizationError::Restored {
                robot,
                transition,
            }));
        }
        let hard = &mut self.hard[index];
        hard.is_agreed = entry.open > 0 && theirs.done == entry.open;
        if entry.open > 0 && !hard.is_agreed {
            if theirs.open != entry.open {
                hard.entry.open = 0;
            } else if is_silent {
                return Err(self.error(index, decider, |robot, transition| SynchronizationError::InDoubt {
                    robot,
                    transition,
                }));
            }
        }
        Ok(())
    }

    fn error(
        &self,
        index: usize,
        partner: usize,
        make: impl FnOnce(String, String) -> SynchronizationError,
    ) -> SynchronizationError {
        make(self.partners[partner].name.clone(), self.ids[self.hard[index].id].clone())
    }

    /// Returns true if this robot has promised to follow an open decision.
    pub fn is_bound(&self) -> bool {
        self.hard.iter().any(|hard| hard.decider.is_some() && hard.entry.open > 0)
    }

    /// Begins a step of the net.
    pub fn begin_step(&mut self) {
        self.hard.iter_mut().for_each(|hard| hard.entry.is_ready = false);
    }

    /// Returns whether a transition with its tokens fires.
    /// `holds` is the value of its guard.
    pub fn permits(&mut self, transition: usize, holds: bool) -> bool {
        let is_bound = self.is_bound();
        if let Some(hard) = self.hard.iter_mut().find(|hard| hard.transition == transition) {
            if hard.decider.is_some() {
                // A promise is followed, whatever the guard says now.
                hard.entry.is_ready = holds && !is_bound;
                return hard.is_agreed;
            }
            hard.entry.is_ready = holds && !is_bound;
            return hard.entry.is_ready && hard.is_agreed;
        }
        let received = self.received.iter().find(|received| received.transition == transition);
        let has_come = received
            .is_none_or(|received| self.partners[received.partner].entries[received.id].done > received.done);
        holds && has_come && !is_bound
    }

    /// Returns true if a transition fires with other robots.
    /// Or if it sends or takes their tokens.
    pub fn shares(&self, transition: usize) -> bool {
        self.hard.iter().any(|hard| hard.transition == transition)
            || self.received.iter().any(|received| received.transition == transition)
            || self.sent.iter().any(|(sent, ..)| *sent == transition)
    }

    /// Records the firing of a transition.
    pub fn fired(&mut self, transition: usize) {
        if let Some(hard) = self.hard.iter_mut().find(|hard| hard.transition == transition) {
            hard.entry = SynchronizationEntry {
                is_ready: false,
                open: 0,
                done: hard.entry.open,
                life: hard.entry.life,
            };
            hard.is_agreed = false;
        }
        if let Some((.., count)) = self.sent.iter_mut().find(|(sent, ..)| *sent == transition) {
            *count += 1;
        }
        if let Some(received) = self.received.iter_mut().find(|received| received.transition == transition) {
            received.done += 1;
        }
    }

    /// Ends a run of the robot: opens attempts, and promises to follow.
    ///
    /// `marking` is that after the last step, and `has_ended` tells whether the plan has ended.
    pub fn end(&mut self, net: &PetriNet, marking: &[u32], has_ended: bool) {
        self.has_ended = has_ended;
        for index in 0..self.hard.len() {
            let Hard { id, transition, decider, ref partners, mut entry, .. } = self.hard[index];
            entry.is_ready &= !has_ended && net.transitions()[transition].is_enabled(marking);
            match decider {
                None if !entry.is_ready => entry.open = 0,
                None if entry.open == 0 => {
                    let is_ready = |partner: &usize| {
                        let other = &self.partners[*partner];
                        other.entries[id].is_ready && !other.statement.has_ended && !self.is_silent(*partner)
                    };
                    if partners.iter().all(is_ready) {
                        self.hard[index].attempts += 1;
                        entry.open = self.hard[index].attempts;
                    }
                }
                None => {}
                Some(decider) => {
                    let theirs = self.partners[decider].entries[id];
                    let is_new = theirs.open > entry.done && entry.life == theirs.life;
                    if entry.is_ready && is_new && !self.is_silent(decider) && !self.is_bound() {
                        entry.open = theirs.open;
                    }
                }
            }
            self.hard[index].entry = entry;
        }
    }

    /// Returns the statement of the robot about itself.
    pub fn statement(&self) -> RobotStatement {
        let beat = self.now / (self.timeout / 8).max(1);
        RobotStatement { life: self.life, beat, has_ended: self.has_ended }
    }

    /// Returns the statements of the robot about transitions, by their identifiers.
    pub fn entries(&self) -> impl Iterator<Item = (&str, SynchronizationEntry)> {
        let id = |index: usize| self.ids[index].as_str();
        let hard = self.hard.iter().map(move |hard| (id(hard.id), hard.entry));
        let sent = self.sent.iter().map(move |(_, sent, done)| {
            (id(*sent), SynchronizationEntry { done: *done, life: self.life, ..Default::default() })
        });
        hard.chain(sent)
    }
}
