use std::marker::PhantomData;
use std::ops::Deref;

use serde::{Deserialize, Serialize};
use slate_module::{
    Input, Module, Outbox, Outcome, Params, Ports, Refusal, Setup, Spec, Stage, Tick, Trigger, ports,
};

use crate::block::{BlockState, distinct, on};
use crate::port::{PlanOut, role};
use crate::{ActionRequest, Ended, ExecuteStatus, PlanStep, Planned, Route};

/// Decides on the robot's behaviour and sends its actions to Execute (RoCS, 4.2). It is woken by the Analyzes that
/// it notices, and by Execute when its status changes. A robot has one.
pub trait Plan: 'static {
    /// The name by which configuration finds it, in snake case.
    const NAME: &'static str;
    /// What it does.
    const DOC: &'static str = "";
    /// What it notices: a [`Noticed`](crate::Noticed) port for each Analyze, and plain inputs for knowledge.
    type Noticed: Ports;
    /// What users may tune.
    type Params: Params;
    /// What it remembers.
    type State: BlockState;

    /// Plans: puts the actions into the agenda, which goes to Execute when this returns.
    fn run(
        state: &mut Self::State,
        noticed: &Self::Noticed,
        situation: &Situation<'_>,
        params: &Self::Params,
        now: &Tick,
        plan: &mut Agenda<'_>,
    );
}

/// What Execute is doing, as the Plan sees it.
#[derive(Clone, Copy, Debug)]
pub struct Situation<'a> {
    status: &'a ExecuteStatus,
    /// Endings up to this number were seen by an earlier run.
    seen: u64,
    /// Whether Execute has not yet taken what the Plan sent.
    pending: bool,
}

impl Situation<'_> {
    /// Whether Execute does nothing and nothing waits.
    pub fn is_idle(&self) -> bool {
        self.status.route == Route::IDLE && self.status.high == 0 && self.status.normal == 0
    }

    /// Whether a reflex or a failure cleared the plan, and no new one reached Execute since.
    pub fn must_replan(&self) -> bool {
        self.status.replan.get()
    }

    /// Whether a reflex has the robot.
    pub fn is_reactive(&self) -> bool {
        self.status.route == Route::REACTIVE
    }

    /// Whether Execute has no plan, and none is on its way: idle or to be planned anew.
    pub fn needs_plan(&self) -> bool {
        !self.pending && (self.is_idle() || self.must_replan())
    }

    /// The actions that ended since the last run, at most the latest eight, oldest first.
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

/// Collects the actions of a plan.
#[derive(Debug)]
pub struct Agenda<'a> {
    outbox: &'a Outbox<Planned>,
    epoch: u64,
    ticket: &'a mut u64,
}

impl Agenda<'_> {
    /// Puts an action behind those that wait. Its number comes back when it ended
    /// ([`Ended::ticket`]); nothing when no more fit in this run.
    pub fn append(&mut self, action: ActionRequest) -> Option<u64> {
        self.send(action, PlanStep::APPEND)
    }

    /// Cancels what is planned, the running action too, and begins with this action instead.
    pub fn replace(&mut self, action: ActionRequest) -> Option<u64> {
        self.send(action, PlanStep::REPLACE)
    }

    /// Cancels what is planned, the running action too.
    pub fn clear(&mut self) -> Option<u64> {
        self.send(ActionRequest::default(), PlanStep::CLEAR)
    }

    fn send(&mut self, action: ActionRequest, step: PlanStep) -> Option<u64> {
        let ticket = *self.ticket + 1;
        let sent = self.outbox.send(Planned { epoch: self.epoch, ticket, action, step, reserved: [0; 7] });
        sent.then(|| {
            *self.ticket = ticket;
            ticket
        })
    }
}

/// What the framework adds to a Plan's ports.
#[ports]
pub struct PlanPorts {
    /// What Execute is doing.
    situation: Input<ExecuteStatus>,
    /// The actions for Execute.
    #[window(64)]
    plan: PlanOut,
}

/// What a Plan and the framework remember of it.
#[derive(Default, Serialize, Deserialize)]
#[serde(bound = "S: BlockState")]
pub struct PlanMemory<S> {
    state: S,
    ticket: u64,
    /// When the last message was sent, nanoseconds.
    sent: u64,
    /// The last ending that a run saw.
    seen: u64,
}

/// How long a message may be on its way before the Plan takes it for lost, nanoseconds.
const LOST: u64 = 100_000_000;

/// A Plan that nobody tells anything runs after so long, nanoseconds.
const LOOK: u64 = 200_000_000;

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
            on(&Self::Io::describe(), |port| port.role == role::CHANGE || port.name == "situation");
        // Nobody tells a Plan that a parameter or what it reads of the knowledge is another one now.
        if let Trigger::On { timeout, .. } = &mut trigger {
            *timeout = Some(timeout.map_or(LOOK, |stale| stale.min(LOOK)));
        }
        Spec { trigger, deadline: None, unique: "plan" }
    }

    fn create(_: &Setup<'_>, _: &P::Params) -> Result<Self::State, Refusal> {
        distinct::<Self::Io>()?;
        Ok(PlanMemory::default())
    }

    fn tick(memory: &mut Self::State, (noticed, own): &Self::Io, params: &P::Params, now: &Tick) -> Outcome {
        let status = &*own.situation;
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
