//! Takeover of the loop by a module: request and execution.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};

use crossbeam_queue::ArrayQueue;
use slate_blackboard::wake::Wake;

use super::{LoopPolicy, LoopPosition, Schedule};

/// Takeover of the loop by a module: its policy.
struct Taken {
    /// Number that is unique in the agent.
    number: u64,
    policy: Box<dyn LoopPolicy>,
}

#[derive(Default)]
struct HeldPolicies {
    /// Active takeover.
    present: Option<Taken>,
    /// Pending takeover, active as soon as there is a plan for its stages.
    coming: Option<Taken>,
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
    over: AtomicU64,
    present: AtomicU64,
    coming: AtomicU64,
    held: Mutex<HeldPolicies>,
    /// Last requested stages, until a plan is made for them.
    wishes: ArrayQueue<Wish>,
    /// Replaced policies, until the planning thread ends them.
    past: ArrayQueue<Taken>,
    /// True if a plan may have to be made, or a policy ended.
    stirred: AtomicBool,
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
pub(super) type Wish = (u64, Schedule);

impl Takeover {
    fn held(&self) -> MutexGuard<'_, HeldPolicies> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the loop from its next cycle on.
    /// With other stages, as soon as there is a plan for them.
    pub fn take(&self, policy: Box<dyn LoopPolicy>, stages: Option<Schedule>) {
        let number = self.numbers.fetch_add(1, Ordering::Relaxed) + 1;
        let mut held = self.held();
        self.last.store(number, Ordering::Release);
        let taken = Taken { number, policy };
        let replaced = match stages {
            Some(stages) => {
                self.coming.store(number, Ordering::Release);
                // An earlier wish is none any more.
                drop(self.wishes.force_push((number, stages)));
                (held.coming.replace(taken), None)
            }
            None => {
                self.coming.store(0, Ordering::Release);
                self.present.store(number, Ordering::Release);
                (held.coming.take(), held.present.replace(taken))
            }
        };
        drop(held);
        // The module's code runs here, which must not happen under the lock.
        drop(replaced);
        self.stir();
    }

    /// Ends the takeover, and its policies.
    pub fn give_back(&self) {
        if self.last.load(Ordering::Acquire) == 0 {
            return;
        }
        self.suspend();
        let held = std::mem::take(&mut *self.held());
        self.last.store(0, Ordering::Release);
        drop(held);
        self.sweep();
    }

    /// Ends the takeover; its policies stay, as one of them may just hang.
    pub fn suspend(&self) {
        self.end(self.last.load(Ordering::Acquire));
    }

    /// Ends all takeovers up to that number.
    pub(super) fn end(&self, number: u64) {
        if self.over.fetch_max(number, Ordering::AcqRel) < number {
            self.stir();
        }
    }

    /// Returns true while the module has the loop, or will have it.
    pub fn is_held(&self) -> bool {
        self.last.load(Ordering::Acquire) > self.over.load(Ordering::Acquire)
    }

    /// Returns the number of the takeover active from now on; 0 for the program's.
    /// `planned` is the number of the stages for which there is a plan.
    pub(super) fn settle(&self, planned: u64) -> u64 {
        if planned != 0 && planned == self.coming.load(Ordering::Acquire) && self.holds(planned) {
            self.admit(planned);
        }
        Some(self.present.load(Ordering::Acquire)).filter(|present| self.holds(*present)).unwrap_or(0)
    }

    fn holds(&self, number: u64) -> bool {
        number > self.over.load(Ordering::Acquire)
    }

    /// Makes the pending takeover the active one, or leaves it for the next cycle.
    fn admit(&self, number: u64) {
        let Some(mut held) = self.try_held() else { return };
        if held.coming.is_none() || self.past.is_full() {
            return;
        }
        if let Some(past) = held.present.take() {
            // There is room, and nobody else puts anything in.
            let _ = self.past.push(past);
        }
        held.present = held.coming.take();
        // In this order, so that who looks finds it in one of the two.
        self.present.store(number, Ordering::Release);
        self.coming.store(0, Ordering::Release);
        self.stir();
    }

    fn try_held(&self) -> Option<MutexGuard<'_, HeldPolicies>> {
        match self.held.try_lock() {
            Ok(held) => Some(held),
            Err(TryLockError::Poisoned(error)) => Some(error.into_inner()),
            Err(TryLockError::WouldBlock) => None,
        }
    }

    /// Calls the policy of that takeover, unless it has ended.
    /// The module's code runs here.
    pub(super) fn choose(&self, number: u64, place: &LoopPosition<'_>) -> Choice {
        let Some(mut held) = self.try_held().filter(|_| self.holds(number)) else { return Choice::InOrder };
        let Some(taken) = held.present.as_mut().filter(|taken| taken.number == number) else {
            return Choice::InOrder;
        };
        match catch_unwind(AssertUnwindSafe(|| taken.policy.next(place))) {
            Ok(next) => Choice::Stage(next),
            Err(_) => Choice::Panicked,
        }
    }

    /// Returns the stages requested since the last call.
    pub(super) fn wish(&self) -> Option<Wish> {
        self.wishes.pop()
    }

    /// Returns true if a plan is needed for the stages of that takeover.
    pub(super) fn wants(&self, number: u64) -> bool {
        let is_named = |of: &AtomicU64| of.load(Ordering::Acquire) == number;
        // In this order, as what comes becomes what is present.
        self.holds(number) && (is_named(&self.coming) || is_named(&self.present))
    }

    /// Ends policies that were replaced.
    pub(super) fn sweep(&self) {
        while let Some(past) = self.past.pop() {
            drop(past);
        }
    }

    /// Returns true if work may be pending.
    pub(super) fn is_stirred(&self) -> bool {
        self.stirred.load(Ordering::Acquire)
    }

    /// Clears the pending flag before work starts.
    pub(super) fn clear_pending(&self) {
        self.stirred.store(false, Ordering::Release);
    }

    /// Signals that work may be pending.
    fn stir(&self) {
        self.stirred.store(true, Ordering::Release);
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
    places: Mutex<BTreeMap<Arc<str>, Arc<Takeover>>>,
}

impl Takeovers {
    fn places(&self) -> MutexGuard<'_, BTreeMap<Arc<str>, Arc<Takeover>>> {
        self.places.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a slot for a module that begins.
    pub fn add(&self, module: &Arc<str>) -> Arc<Takeover> {
        let takeover = Arc::new(Takeover {
            module: Arc::clone(module),
            numbers: Arc::clone(&self.numbers),
            last: AtomicU64::new(0),
            over: AtomicU64::new(0),
            present: AtomicU64::new(0),
            coming: AtomicU64::new(0),
            held: Mutex::default(),
            wishes: ArrayQueue::new(1),
            past: ArrayQueue::new(1),
            stirred: AtomicBool::new(false),
            closed: AtomicBool::new(false),
            wake: Wake::new(),
        });
        self.places().insert(Arc::clone(module), Arc::clone(&takeover));
        takeover
    }

    /// Returns the slot of a module.
    pub fn get(&self, module: &str) -> Option<Arc<Takeover>> {
        self.places().get(module).cloned()
    }

    /// Removes the slot of a module that has ended.
    pub fn remove(&self, takeover: &Arc<Takeover>) {
        takeover.close();
        self.places().retain(|_, other| !Arc::ptr_eq(other, takeover));
    }
}
