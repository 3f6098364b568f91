use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::{ActionRequest, PlanStep, Route};

/// An action in the pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct QueuedAction {
    /// The action.
    pub action: ActionRequest,
    /// Origin.
    pub origin: Origin,
    /// Time at which it was queued or renewed, nanoseconds.
    #[serde(default)]
    pub queued: u64,
}

/// Origin of an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Origin {
    /// The Plan's message of that number.
    Plan(u64),
    /// A reflex.
    Reflex {
        /// Number of the model that sent it.
        source: u32,
        /// The model's rank.
        rank: i32,
    },
}

impl QueuedAction {
    /// Returns the route on which it came.
    pub fn route(&self) -> Route {
        match self.origin {
            Origin::Plan(_) => Route::DELIBERATIVE,
            Origin::Reflex { .. } => Route::REACTIVE,
        }
    }

    /// Returns the Plan's number of it; 0 for a reflex.
    pub fn ticket(&self) -> u64 {
        match self.origin {
            Origin::Plan(ticket) => ticket,
            Origin::Reflex { .. } => 0,
        }
    }

    /// Returns the rank of a reflex.
    pub fn rank(&self) -> Option<i32> {
        match self.origin {
            Origin::Plan(_) => None,
            Origin::Reflex { rank, .. } => Some(rank),
        }
    }

    /// Returns true if both are the same reflex, sent again.
    fn repeats(&self, other: &Self) -> bool {
        self.origin == other.origin && self.action.kind == other.action.kind && self.rank().is_some()
    }
}

/// Result of an offered action.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Admission {
    /// The action is queued.
    Waiting,
    /// The action renews the arguments of the running reflex.
    Renewed,
    /// The action was planned before the latest reflex.
    OldEpoch,
    /// The queue is full.
    Full,
}

/// Queued actions and the running one (RoCS, 5.1), with two levels of priority.
///
/// High-priority actions are first, by rank, then by arrival; then normal ones. A reflex clears the normal actions, preempts a planned
/// action or a reflex of lower rank, and raises the epoch, so that plans of an earlier epoch are refused. Planned actions change normal
/// actions only: they neither remove nor delay a reflex.
///
/// The number of actions of each level is bounded; only construction allocates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Saved")]
pub struct Pipeline {
    high: VecDeque<QueuedAction>,
    normal: VecDeque<QueuedAction>,
    running: Option<QueuedAction>,
    interrupted: Option<QueuedAction>,
    epoch: u64,
    replan: bool,
    /// Time of actions queued now, nanoseconds; set in each cycle.
    #[serde(skip)]
    now: u64,
    /// Counts the changes of the waiting actions.
    revision: u64,
}

#[derive(Deserialize)]
struct Saved {
    high: VecDeque<QueuedAction>,
    normal: VecDeque<QueuedAction>,
    running: Option<QueuedAction>,
    interrupted: Option<QueuedAction>,
    epoch: u64,
    replan: bool,
    #[serde(default)]
    revision: u64,
}

impl From<Saved> for Pipeline {
    fn from(Saved { high, normal, running, interrupted, epoch, replan, revision }: Saved) -> Self {
        let mut result = Self { running, interrupted, epoch, replan, revision, ..Self::default() };
        // Into the queues with full capacity, as a tick must not allocate.
        result.high.extend(high.into_iter().take(Self::CAPACITY));
        result.normal.extend(normal.into_iter().take(Self::CAPACITY));
        result
    }
}

impl Default for Pipeline {
    fn default() -> Self {
        let queue = || VecDeque::with_capacity(Self::CAPACITY);
        Self {
            high: queue(),
            normal: queue(),
            running: None,
            interrupted: None,
            epoch: 0,
            replan: false,
            now: 0,
            revision: 0,
        }
    }
}

impl Pipeline {
    /// Capacity of each level.
    pub const CAPACITY: usize = 64;

    /// Sets the time of actions queued from now on, nanoseconds.
    pub fn set_time(&mut self, now: u64) {
        self.now = now;
    }

    /// Offers a reflex. Passes cleared actions to `cleared`; a preempted one is in
    /// [`take_interrupted`](Pipeline::take_interrupted).
    pub fn reflex(
        &mut self,
        action: ActionRequest,
        source: u32,
        rank: i32,
        cleared: impl FnMut(QueuedAction),
    ) -> Admission {
        let entry = QueuedAction { action, origin: Origin::Reflex { source, rank }, queued: self.now };
        let mut cleared = cleared;
        let admission = self.admit(entry, &mut cleared);
        if admission != Admission::Full {
            self.clear_planned(&mut cleared);
            self.epoch += 1;
            self.replan = true;
        }
        admission
    }

    fn admit(&mut self, entry: QueuedAction, cleared: &mut impl FnMut(QueuedAction)) -> Admission {
        if let Some(running) = self.running.as_mut().filter(|running| running.repeats(&entry)) {
            *running = entry;
            return Admission::Renewed;
        }
        self.revision += 1;
        if let Some(waiting) = self.high.iter_mut().find(|waiting| waiting.repeats(&entry)) {
            *waiting = entry;
            return Admission::Waiting;
        }
        let place = self.high.iter().take_while(|waiting| waiting.rank() >= entry.rank()).count();
        if self.high.len() == Self::CAPACITY {
            if place == self.high.len() {
                return Admission::Full;
            }
            self.high.pop_back().into_iter().for_each(cleared);
        }
        self.high.insert(place, entry);
        if self.running.is_some_and(|running| running.rank() < entry.rank()) {
            self.interrupt();
        }
        Admission::Waiting
    }

    /// Offers a planned action, or clears the plan.
    /// Passes cleared actions to `cleared`.
    pub fn planned(
        &mut self,
        action: ActionRequest,
        ticket: u64,
        epoch: u64,
        step: PlanStep,
        mut cleared: impl FnMut(QueuedAction),
    ) -> Admission {
        if epoch != self.epoch {
            return Admission::OldEpoch;
        }
        if step != PlanStep::APPEND {
            self.clear_planned(&mut cleared);
        }
        if step != PlanStep::CLEAR {
            if self.normal.len() == Self::CAPACITY {
                return Admission::Full;
            }
            let origin = Origin::Plan(ticket);
            self.normal.push_back(QueuedAction { action, origin, queued: self.now });
            self.revision += 1;
        }
        self.replan = false;
        Admission::Waiting
    }

    /// Abandons the plan and requests a new one.
    /// It clears the plan's actions and refuses those of its epoch.
    pub fn abandon_plan(&mut self, mut cleared: impl FnMut(QueuedAction)) {
        self.clear_planned(&mut cleared);
        self.epoch += 1;
        self.replan = true;
    }

    fn clear_planned(&mut self, cleared: &mut impl FnMut(QueuedAction)) {
        if self.running.is_some_and(|running| running.route() == Route::DELIBERATIVE) {
            self.interrupt();
        }
        self.revision += u64::from(!self.normal.is_empty());
        self.normal.drain(..).for_each(cleared);
    }

    fn interrupt(&mut self) {
        // Only the action that truly ran must be cancelled, and no other follows it until `advance`.
        self.interrupted = self.interrupted.or(self.running.take());
        self.running = None;
    }

    /// Takes the action that ran until another one took its place.
    /// Its owner cancels it before it lets the next one run.
    pub fn take_interrupted(&mut self) -> Option<QueuedAction> {
        self.interrupted.take()
    }

    /// Returns the running action; if none runs, the next one runs from now on.
    pub fn advance(&mut self) -> Option<QueuedAction> {
        if self.running.is_none() {
            self.running = self.high.pop_front().or_else(|| self.normal.pop_front());
            self.revision += u64::from(self.running.is_some());
        }
        self.running
    }

    /// Returns the running action.
    pub fn running(&self) -> Option<&QueuedAction> {
        self.running.as_ref()
    }

    /// Ends the running action.
    pub fn finish(&mut self) -> Option<QueuedAction> {
        self.running.take()
    }

    /// Returns the epoch, which each reflex and each failure of a plan raises.
    pub fn epoch(&self) -> u64 {
        self.epoch
    }

    /// Returns true if the plan was cleared and no new one came since.
    pub fn wants_plan(&self) -> bool {
        self.replan
    }

    /// Returns the numbers of queued reflexes and planned actions.
    pub fn waiting(&self) -> (usize, usize) {
        (self.high.len(), self.normal.len())
    }

    /// Counts the changes of the waiting actions.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Returns the waiting actions in the order of their turns.
    pub fn iter(&self) -> impl Iterator<Item = &QueuedAction> {
        self.high.iter().chain(&self.normal)
    }
}
