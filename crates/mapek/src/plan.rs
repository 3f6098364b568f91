use std::marker::PhantomData;
use std::ops::Deref;

use serde::{Deserialize, Serialize};
use slate_module::role;
use slate_module::{
    Input, Module, Outbox, Outcome, Params, Ports, Refusal, Setup, Spec, Stage, Tick, Trigger, ports,
};

use crate::block::{BlockState, distinct, on};
use crate::port::PlanOut;
use crate::{ActionRequest, Ended, ExecuteStatus, PlanStep, Planned, Route};

/// Decision on the robot's behavior (RoCS, 4.2).
/// A Plan sends its actions to Execute. A robot has one.
///
/// Analyzes and changes of Execute's status trigger it.
pub trait Plan: 'static {
    /// Kind in the configuration, in snake case.
    const NAME: &'static str;
    /// Description.
    const DOC: &'static str = "";
    /// Ports: one [`Noticed`](crate::Noticed) for each Analyze, and plain inputs.
    /// The plain inputs are for knowledge.
    type Noticed: Ports;
    /// Parameters.
    type Params: Params;
    /// State.
    type State: BlockState;

    /// Plans: adds actions to the agenda, which is sent to Execute afterwards.
    fn run(
        state: &mut Self::State,
        noticed: &Self::Noticed,
        situation: &Situation<'_>,
        params: &Self::Params,
        now: &Tick,
        plan: &mut Agenda<'_>,
    );
}

/// Status of Execute at the Plan.
#[derive(Clone, Copy, Debug)]
pub struct Situation<'a> {
    status: &'a ExecuteStatus,
    /// Number of the newest ending of earlier runs.
    seen: u64,
    /// Set while messages to Execute are pending.
    pending: bool,
}

impl Situation<'_> {
    /// Returns whether no action runs or is queued.
    pub fn is_idle(&self) -> bool {
        self.status.route == Route::IDLE && self.status.high == 0 && self.status.normal == 0
    }

    /// Returns true if a new plan is needed.
    /// A reflex or a failure has cleared the plan, and no new one has reached Execute.
    pub fn must_replan(&self) -> bool {
        self.status.replan.get()
    }

    /// Returns whether a reflex runs.
    pub fn is_reactive(&self) -> bool {
        self.status.route == Route::REACTIVE
    }

    /// Returns whether Execute has no plan, and none is pending: idle, or replanning.
    pub fn needs_plan(&self) -> bool {
        !self.pending && (self.is_idle() || self.must_replan())
    }

    /// Iterates over the actions that ended since the previous run, oldest first.
    /// At most the newest eight.
    pub fn ended(&self) -> impl Iterator<Item = &Ended> {
        self.status.ended.iter().filter(|ended| ended.number > self.seen)
    }
}

impl Deref for Situation<'_> {
    type Target = ExecuteStatus;

    fn deref(&self) -> &ExecuteStatus {
        self.status
    }
}

/// Actions of a plan.
#[derive(Debug)]
pub struct Agenda<'a> {
    outbox: &'a Outbox<Planned>,
    epoch: u64,
    ticket: &'a mut u64,
}

impl Agenda<'_> {
    /// Queues an action. Returns its number, which is reported at its end
    /// ([`Ended::ticket`]); `None` if no more fit in this run.
    pub fn append(&mut self, action: ActionRequest) -> Option<u64> {
        self.send(action, PlanStep::APPEND)
    }

    /// Replaces the plan, with its running action, by this action.
    pub fn replace(&mut self, action: ActionRequest) -> Option<u64> {
        self.send(action, PlanStep::REPLACE)
    }

    /// Cancels the plan, with its running action.
    pub fn clear(&mut self) -> Option<u64> {
        self.send(ActionRequest::default(), PlanStep::CLEAR)
    }

    fn send(&mut self, action: ActionRequest, step: PlanStep) -> Option<u64> {
        let ticket = *self.ticket + 1;
        let sent = self.outbox.send(Planned { epoch: self.epoch, ticket, action, step });
        sent.then(|| {
            *self.ticket = ticket;
            ticket
        })
    }
}

/// Additional ports of a Plan.
#[ports]
pub struct PlanPorts {
    /// Status of Execute.
    situation: Input<ExecuteStatus>,
    /// Actions for Execute.
    #[window(64)]
    plan: PlanOut,
}

/// State of a Plan and of the framework for it.
#[derive(Default, Serialize, Deserialize)]
#[serde(bound = "S: BlockState")]
pub struct PlanMemory<S> {
    state: S,
    ticket: u64,
    /// Time of the newest message, nanoseconds.
    sent: u64,
    /// The last ending that a run saw.
    seen: u64,
}

/// Time after which the Plan takes an unanswered message for lost, nanoseconds.
const LOST: u64 = 100_000_000;

/// Maximum period of a Plan without a trigger, nanoseconds.
const MAX_PERIOD: u64 = 200_000_000;

/// A [`Plan`] as a module.
pub struct PlanBlock<P>(PhantomData<fn() -> P>);

impl<P: Plan> Module for PlanBlock<P> {
    type Io = (P::Noticed, PlanPorts);
    type Params = P::Params;
    type State = PlanMemory<P::State>;

    const NAME: &'static str = P::NAME;
    const DOC: &'static str = P::DOC;
    const STAGE: Stage = Stage::Think;

    fn spec() -> Spec {
        let mut trigger =
            on(&Self::Io::describe(), &|port| port.role == role::CHANGE || port.name == "situation");
        // A Plan is not notified of changed parameters or knowledge.
        if let Trigger::On { timeout, .. } = &mut trigger {
            *timeout = Some(timeout.map_or(MAX_PERIOD, |stale| stale.min(MAX_PERIOD)));
        }
        Spec { trigger, deadline: None, unique: "plan" }
    }

    fn create(_: &Setup<'_>, _: &P::Params) -> Result<Self::State, Refusal> {
        distinct(&Self::Io::describe())?;
        Ok(PlanMemory::default())
    }

    fn tick(memory: &mut Self::State, (noticed, own): &Self::Io, params: &P::Params, now: &Tick) -> Outcome {
        let idle;
        let status = match own.situation.get() {
            Some(status) => status,
            None => {
                // Execute has not run yet.
                idle = ExecuteStatus::default();
                &idle
            }
        };
        let pending = status.ticket < memory.ticket && now.now().saturating_sub(memory.sent) < LOST;
        let situation = Situation { status, seen: memory.seen, pending };
        let before = memory.ticket;
        let mut agenda = Agenda { outbox: &own.plan.0, epoch: status.epoch, ticket: &mut memory.ticket };
        P::run(&mut memory.state, noticed, &situation, params, now, &mut agenda);
        if memory.ticket != before {
            memory.sent = now.now();
        }
        memory.seen = status.ended.last().map_or(memory.seen, |ended| ended.number);
        Outcome::Ok
    }
}
