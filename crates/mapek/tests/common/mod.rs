//! A robot for tests: one command, and actions that end in every way.
#![allow(dead_code, missing_docs, reason = "each test uses a part of it")]

use serde::{Deserialize, Serialize};
use slate_interfaces::Twist2;
use slate_mapek::prelude::*;
use slate_mapek::{PlanStep, Planned, Reflex};
use slate_module::prelude::*;

#[ports]
pub struct Body {
    pub wheels: Command<Twist2>,
}

pub fn drive(acting: &Acting<'_, Body>, linear: f64) {
    acting.body.wheels.send(Twist2 { linear, angular: 0.0 }, acting.priority);
}

/// An action that drives with a speed for a number of steps; one of 0 steps is done at once.
macro_rules! driving {
    ($name:ident, $end:ident) => {
        #[derive(Clone, Serialize, Deserialize)]
        pub struct $name {
            speed: f64,
            steps: f64,
        }

        impl ActionKind for $name {
            const KIND: &'static str = stringify!($name);
            type Arguments = (f64, f64);

            fn start((speed, steps): (f64, f64)) -> Self {
                Self { speed, steps }
            }
        }

        impl Action<Body> for $name {
            fn act(&mut self, acting: &Acting<'_, Body>) -> Step {
                if self.steps <= 0.0 {
                    return Step::$end;
                }
                self.steps -= 1.0;
                drive(acting, self.speed);
                Step::Running
            }

            fn cancel(&mut self, acting: &Acting<'_, Body>) {
                drive(acting, -1000.0);
            }
        }
    };
}
driving!(Drive, Done);
driving!(Stumble, Failed);
driving!(Swerve, Done);

/// A macro-action: drives, turns back, and drives again beside another.
#[derive(Serialize, Deserialize)]
pub struct Tour {
    legs: InSequence<(Drive, Swerve, Repeat<Drive>)>,
}

impl ActionKind for Tour {
    const KIND: &'static str = "Tour";
    type Arguments = ();

    fn start((): ()) -> Self {
        Self { legs: InSequence::start(((1.0, 1.0), (2.0, 1.0), (2.0, (3.0, 1.0)))) }
    }

    fn children(&self, tree: &mut ActionTree) {
        tree.child(&self.legs);
    }
}

impl Action<Body> for Tour {
    fn act(&mut self, acting: &Acting<'_, Body>) -> Step {
        self.legs.act(acting)
    }
}

repertoire! {
    pub enum Actions for Body { Drive, Stumble, Swerve, Tour }
}

pub fn planned(action: ActionRequest, ticket: u64, epoch: u64) -> Planned {
    Planned { epoch, ticket, action, step: PlanStep::APPEND }
}

pub fn reflex(action: ActionRequest, rank: i32) -> Reflex {
    Reflex { action, rank }
}

/// How near the nearest thing is.
#[interface]
#[derive(PartialEq)]
pub struct Near {
    /// Meters.
    #[unit("m")]
    pub distance: f64,
}

/// Whether the way is free.
#[interface]
#[derive(PartialEq)]
pub struct Free {
    /// Whether it is.
    pub free: Bool,
}

#[ports]
pub struct Sonar {
    #[stale(after = "100ms")]
    pub range: Input<Near>,
}

/// Halves what the sonar says.
pub struct NearMonitor;

impl Monitor for NearMonitor {
    const NAME: &'static str = "near_monitor";
    type Sensors = Sonar;
    type Params = ();
    type State = ();
    type Value = Near;

    fn interpret((): &mut (), sensors: &Sonar, (): &(), _: &Tick) -> Option<Near> {
        sensors.range.fresh().map(|near| Near { distance: near.distance / 2.0 })
    }
}

#[ports]
pub struct ObservedNear {
    pub near: Observed<Near>,
    pub threshold: Input<Near>,
}

/// Tells when the way becomes free or blocked.
pub struct WayIsFree;

impl Analyze for WayIsFree {
    const NAME: &'static str = "way_is_free";
    type Observed = ObservedNear;
    type Params = ();
    type State = Option<bool>;
    type Value = Free;

    fn process(last: &mut Option<bool>, observed: &ObservedNear, (): &(), _: &Tick) -> Option<Free> {
        let free = observed.near.fresh()?.distance
            > 0.5 + observed.threshold.get().copied().unwrap_or_default().distance;
        (last.replace(free) != Some(free)).then_some(Free { free: free.into() })
    }
}

#[ports]
pub struct NoticedFree {
    pub free: Noticed<Free>,
}

/// Drives while the way is free.
pub struct Wanderer;

#[derive(Default, Serialize, Deserialize)]
pub struct Wandering {
    pub free: bool,
    pub changes: u32,
    pub ended: Vec<u64>,
}

impl Plan for Wanderer {
    const NAME: &'static str = "wanderer";
    type Noticed = NoticedFree;
    type Params = ();
    type State = Wandering;

    fn run(
        state: &mut Wandering,
        noticed: &NoticedFree,
        situation: &Situation<'_>,
        (): &(),
        _: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        state.changes += noticed.free.iter().len() as u32;
        state.ended.extend(situation.ended().map(|ended| ended.ticket));
        if let Some(noticed) = noticed.free.newest() {
            state.free = noticed.free.get();
            if !state.free {
                plan.clear();
            }
        }
        if state.free && situation.needs_plan() {
            plan.replace(Drive::request((1.0, 3.0)));
            plan.append(Swerve::request((0.5, 3.0)));
        }
    }
}

/// Swerves when something is near.
pub struct AvoidNear;

impl ReactiveModel for AvoidNear {
    const NAME: &'static str = "avoid_near";
    const RANK: i32 = 3;
    type Sensors = Sonar;
    type Params = ();
    type State = ();

    fn run((): &mut (), sensors: &Sonar, (): &(), _: &Tick) -> Option<ActionRequest> {
        let near = sensors.range.fresh()?.distance;
        (near < 0.2).then(|| Swerve::request((near, 3.0)))
    }
}
