//! Takeover of the loop by a module: request and execution.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};

use crossbeam_queue::ArrayQueue;
use slate_blackboard::wake::Wake;
use slate_sorted::SortedMap;

use super::{LoopPolicy, LoopPosition, Schedule};

/// Takeover of the loop by a module: its policy.
struct TakeoverPolicy {
    /// Number that is unique in the agent.
    number: u64,
    policy: Box<dyn LoopPolicy>,
}

#[derive(Default)]
struct TakeoverPolicies {
    /// Active takeover.
    active: Option<TakeoverPolicy>,
    /// Pending takeover, active as soon as there is a plan for its stages.
    pending: Option<TakeoverPolicy>,
}

/// Takeover slot of a module: policies and stages with which it takes the loop.
///
/// Numbers identify the active takeover, so that only the loop, which also runs the module, needs the lock: a hanging
/// policy holds it.
pub struct Takeover {
    /// Module that takes the loop.
    pub module: Arc<str>,
    numbers: Arc<AtomicU64>,
    /// Number of the last takeover; 0 for none.
    last: AtomicU64,
    /// Number up to which all takeovers have ended.
    ended: AtomicU64,
    active: AtomicU64,
    pending: AtomicU64,
    policies: Mutex<TakeoverPolicies>,
    /// Last requested stages, until a plan is made for them.
    requests: ArrayQueue<StageRequest>,
    /// Replaced policies, until the planning thread ends them.
    replaced: ArrayQueue<TakeoverPolicy>,
    /// True if a plan may have to be made, or a policy ended.
    has_work: AtomicBool,
    closed: AtomicBool,
    /// Wakes the planning thread.
    wake: Wake,
}

/// Choice of a policy.
pub(super) enum Choice {
    /// No policy that can be called: the stages follow one another.
    InOrder,
    /// Next stage, or the end of the cycle.
    Stage(Option<usize>),
    Panicked,
}

/// Requested stages of a module, and their number.
pub(super) type StageRequest = (u64, Schedule);

impl Takeover {
    fn policies(&self) -> MutexGuard<'_, TakeoverPolicies> {
        self.policies.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the loop from its next cycle on.
    /// With other stages, as soon as there is a plan for them.
    pub fn take(&self, policy: Box<dyn LoopPolicy>, stages: Option<Schedule>) {
        let number = self.numbers.fetch_add(1, Ordering::Relaxed) + 1;
        let mut policies = self.policies();
        self.last.store(number, Ordering::Release);
        let taken = TakeoverPolicy { number, policy };
        let replaced = match stages {
            Some(stages) => {
                self.pending.store(number, Ordering::Release);
                // An earlier request is void.
                drop(self.requests.force_push((number, stages)));
                (policies.pending.replace(taken), None)
            }
            None => {
                self.pending.store(0, Ordering::Release);
                self.active.store(number, Ordering::Release);
                (policies.pending.take(), policies.active.replace(taken))
            }
        };
        drop(policies);
        // The module's code runs here, which must not happen under the lock.
        drop(replaced);
        self.signal_work();
    }

    /// Ends the takeover, and its policies.
    pub fn release(&self) {
        if self.last.load(Ordering::Acquire) == 0 {
            return;
        }
        self.suspend();
        let policies = std::mem::take(&mut *self.policies());
        self.last.store(0, Ordering::Release);
        drop(policies);
        self.drop_replaced();
    }

    /// Ends the takeover; its policies stay, as one of them may just hang.
    pub fn suspend(&self) {
        self.end(self.last.load(Ordering::Acquire));
    }

    /// Ends all takeovers up to that number.
    pub(super) fn end(&self, number: u64) {
        if self.ended.fetch_max(number, Ordering::AcqRel) < number {
            self.signal_work();
        }
    }

    /// Returns true while the module has the loop, or will have it.
    pub fn is_held(&self) -> bool {
        self.last.load(Ordering::Acquire) > self.ended.load(Ordering::Acquire)
    }

    /// Returns the number of the takeover active from now on; 0 for the program's.
    /// `planned` is the number of the stages for which there is a plan.
    pub(super) fn select_active(&self, planned: u64) -> u64 {
        if planned != 0 && planned == self.pending.load(Ordering::Acquire) && self.has_not_ended(planned) {
            self.activate_pending(planned);
        }
        Some(self.active.load(Ordering::Acquire)).filter(|active| self.has_not_ended(*active)).unwrap_or(0)
    }

    fn has_not_ended(&self, number: u64) -> bool {
        number > self.ended.load(Ordering::Acquire)
    }

    /// Makes the pending takeover the active one, or leaves it for the next cycle.
    fn activate_pending(&self, number: u64) {
        let Some(mut policies) = self.try_policies() else { return };
        if policies.pending.is_none() || self.replaced.is_full() {
            return;
        }
        if let Some(replaced) = policies.active.take() {
            // It has room, as only this thread pushes.
            let _ = self.replaced.push(replaced);
        }
        policies.active = policies.pending.take();
        // In this order, so that a reader finds it in one of the two.
        self.active.store(number, Ordering::Release);
        self.pending.store(0, Ordering::Release);
        self.signal_work();
    }

    fn try_policies(&self) -> Option<MutexGuard<'_, TakeoverPolicies>> {
        match self.policies.try_lock() {
            Ok(policies) => Some(policies),
            Err(TryLockError::Poisoned(error)) => Some(error.into_inner()),
            Err(TryLockError::WouldBlock) => None,
        }
    }

    /// Calls the policy of that takeover, unless it has ended.
    /// The module's code runs here.
    pub(super) fn choose(&self, number: u64, position: &LoopPosition<'_>) -> Choice {
        let Some(mut policies) = self.try_policies().filter(|_| self.has_not_ended(number)) else {
            return Choice::InOrder;
        };
        let Some(taken) = policies.active.as_mut().filter(|taken| taken.number == number) else {
            return Choice::InOrder;
        };
        match catch_unwind(AssertUnwindSafe(|| taken.policy.next(position))) {
            Ok(next) => Choice::Stage(next),
            Err(_) => Choice::Panicked,
        }
    }

    /// Returns the stages requested since the last call.
    pub(super) fn next_request(&self) -> Option<StageRequest> {
        self.requests.pop()
    }

    /// Returns true if a plan is needed for the stages of that takeover.
    pub(super) fn needs_plan(&self, number: u64) -> bool {
        let names = |of: &AtomicU64| of.load(Ordering::Acquire) == number;
        // In this order, as what comes becomes what is present.
        self.has_not_ended(number) && (names(&self.pending) || names(&self.active))
    }

    /// Ends policies that were replaced.
    pub(super) fn drop_replaced(&self) {
        while let Some(replaced) = self.replaced.pop() {
            drop(replaced);
        }
    }

    /// Returns true if work may be pending.
    pub(super) fn has_pending_work(&self) -> bool {
        self.has_work.load(Ordering::Acquire)
    }

    /// Clears the pending flag before work starts.
    pub(super) fn clear_pending(&self) {
        self.has_work.store(false, Ordering::Release);
    }

    /// Signals that work may be pending.
    fn signal_work(&self) {
        self.has_work.store(true, Ordering::Release);
        self.wake.notify(1);
    }

    /// Waits until there may be something to do; false at the end.
    pub(super) fn wait(&self) -> bool {
        self.wake.wait();
        !self.closed.load(Ordering::Acquire)
    }

    /// Ends the thread that makes plans.
    pub fn close(&self) {
        self.closed.store(true, Ordering::Release);
        self.wake.notify(1);
    }
}

/// Takeover slots of an agent's modules.
#[derive(Default)]
pub struct Takeovers {
    numbers: Arc<AtomicU64>,
    slots: Mutex<SortedMap<Arc<str>, Arc<Takeover>>>,
}

impl Takeovers {
    fn slots(&self) -> MutexGuard<'_, SortedMap<Arc<str>, Arc<Takeover>>> {
        self.slots.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a slot for a module that begins.
    pub fn add(&self, module: &Arc<str>) -> Arc<Takeover> {
        let takeover = Arc::new(Takeover {
            module: Arc::clone(module),
            numbers: Arc::clone(&self.numbers),
            last: AtomicU64::new(0),
            ended: AtomicU64::new(0),
            active: AtomicU64::new(0),
            pending: AtomicU64::new(0),
            policies: Mutex::default(),
            requests: ArrayQueue::new(1),
            replaced: ArrayQueue::new(1),
            has_work: AtomicBool::new(false),
            closed: AtomicBool::new(false),
            wake: Wake::new(),
        });
        self.slots().insert(Arc::clone(module), Arc::clone(&takeover));
        takeover
    }

    /// Returns the slot of a module.
    pub fn get(&self, module: &str) -> Option<Arc<Takeover>> {
        self.slots().get(module).cloned()
    }

    /// Removes the slot of a module that has ended.
    pub fn remove(&self, takeover: &Arc<Takeover>) {
        takeover.close();
        self.slots().retain(|_, other| !Arc::ptr_eq(other, takeover));
    }
}
