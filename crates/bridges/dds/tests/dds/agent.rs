//! An agent that runs, as a participant of DDS.

use std::sync::Arc;

use slate_control::ControlSurface;
use slate_dds::{DdsBridge, DdsSettings};
use slate_interfaces::Twist2;
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::Options;
use slate_runtime::configuration::{Configuration, Database};

use crate::dds::interfaces::{Count, Point, Target};

#[path = "../../../topics/tests/shared/agent.rs"]
#[allow(dead_code, reason = "each bridge uses its part")]
mod shared;

pub use shared::*;

pub type Running = shared::Running<DdsBridge>;

impl TestBridge for DdsBridge {
    const TABLE: &'static str = slate_dds::TABLE;

    fn opened(surface: &Arc<ControlSurface>, configuration: &Configuration) -> Self {
        Self::open(surface, &DdsSettings::of(configuration).unwrap().unwrap()).unwrap()
    }

    fn started(&mut self) {
        self.start().unwrap();
    }
}

#[ports]
pub struct ScoutIo {
    found: Output<Target>,
}

/// Finds another target in each cycle.
pub struct Scout;

#[module(stage = SensorAcquire)]
impl Module for Scout {
    type Io = ScoutIo;
    type Params = ();
    type State = i64;

    fn tick(state: &mut i64, io: &ScoutIo, _: &(), _: &Tick) -> Outcome {
        *state += 1;
        let x = *state as f64;
        io.found.set(Target {
            position: Point { x, y: 0.25 },
            corner: [1.5, -x],
            path: Sequence::new(&[Point { x, y: 1.0 }, Point { x, y: 2.0 }]),
            weights: Sequence::new(&[0.5, 1.5]),
            id: 3,
            name: Text::from("scouted"),
            mode: 7,
            valid: true.into(),
            ..Target::default()
        });
        Outcome::Ok
    }
}

#[ports]
pub struct PlannerIo {
    target: Input<Target>,
    number: Input<Count>,
    point: Input<Point>,
    command: Input<Twist2>,
    seen: Output<Target>,
    sum: Output<Count>,
    wheels: Output<Twist2>,
}

/// Forwards its input, and adds it up.
pub struct Planner;

#[module(stage = Act)]
impl Module for Planner {
    type Io = PlannerIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &PlannerIo, _: &(), _: &Tick) -> Outcome {
        if let Some(target) = io.target.updated() {
            io.seen.set(*target);
            *state += target.position.x + target.weights.iter().map(|weight| f64::from(*weight)).sum::<f64>();
        }
        if let Some(command) = io.command.updated() {
            io.wheels.set(*command);
        }
        let _ = (io.number.get(), io.point.get());
        io.sum.set(Count { value: *state });
        Outcome::Ok
    }
}

pub fn plugins() -> Vec<Plugin> {
    vec![Plugin::linked::<Scout>(), Plugin::linked::<Planner>()]
}

pub fn database(dds: &str) -> Database {
    database_of::<DdsBridge>(&format!(
        "agent.name = \"r2\"\nloop.period = \"10ms\"\n[modules.scout]\n[modules.planner]\n[dds]\n{dds}\n"
    ))
}

/// An agent with a table `[dds]`.
pub fn start(dds: &str) -> Running {
    Running::load_database(&database(dds), &plugins(), Options::default()).connected()
}
