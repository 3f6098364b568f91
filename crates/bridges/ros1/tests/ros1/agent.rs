//! An agent that runs, as a node of ROS 1.

use std::sync::Arc;

use slate_blackboard::interface::Value;
use slate_control::ControlSurface;
use slate_interfaces::{LaserScan, Odometry, Pose2, Twist2};
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_ros1::{Ros1Bridge, Ros1Settings};
use slate_runtime::Options;
use slate_runtime::configuration::{Configuration, Database};

#[path = "../../../topics/tests/shared/agent.rs"]
mod shared;

pub use shared::*;

pub type Running = shared::Running<Ros1Bridge>;

impl TestBridge for Ros1Bridge {
    const TABLE: &'static str = slate_ros1::SCHEME;

    fn opened(surface: &Arc<ControlSurface>, configuration: &Configuration) -> Self {
        Self::open(surface, &Ros1Settings::of(configuration).unwrap().unwrap()).unwrap()
    }

    fn started(&mut self) {
        self.start().unwrap();
    }
}

#[ports]
pub struct BaseIo {
    #[capacity(4)]
    scan: Input<LaserScan>,
    command: Input<Twist2>,
    sum: Output<Number>,
    odometry: Output<Odometry>,
}

/// Adds up all that it reads, and is somewhere.
pub struct Base;

#[module(stage = Act)]
impl Module for Base {
    type Io = BaseIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &BaseIo, _: &(), _: &Tick) -> Outcome {
        if let Some(scan) = io.scan.fresh() {
            let heard = scan.ranges.iter().filter(|range| range.is_finite());
            *state += heard.map(|range| f64::from(*range)).sum::<f64>();
        }
        *state += io.command.fresh().map_or(0.0, |command| command.linear);
        io.sum.set(Number { value: *state });
        io.odometry.set(Odometry {
            pose: Pose2 { x: *state, y: -2.5, theta: 0.0 },
            twist: io.command.get().copied().unwrap_or(Twist2::ZERO),
        });
        Outcome::Ok
    }
}

pub fn plugins() -> Vec<Plugin> {
    [Plugin::linked::<Base>()].into_iter().chain(shared_plugins()).collect()
}

/// An agent with links to a master.
pub fn linked(master: &str, links: &str) -> String {
    format!("[modules.base]\n[ros1]\nmaster = \"{master}\"\n[links]\n{links}")
}

/// An agent of modules and a table `[ros1]`.
pub fn database(text: &str) -> Database {
    database_of::<Ros1Bridge>(&format!("agent.name = \"r2-d2\"\nloop.period = \"10ms\"\n{text}"))
}

impl Running {
    /// An agent with links to a master.
    pub fn start(master: &str, links: &str) -> Self {
        Self::of(&linked(master, links))
    }

    /// An agent of modules and a table `[ros1]`.
    pub fn of(text: &str) -> Self {
        Self::load(text, Options::default()).connected()
    }

    /// The same in lockstep, in real time.
    pub fn lockstep(text: &str) -> Self {
        Self::load(text, lockstep()).connected()
    }

    /// An agent that is not a node yet.
    pub fn load(text: &str, options: Options) -> Self {
        Self::load_database(&database(text), &plugins(), options)
    }

    /// Sets a field, as a person does.
    pub fn set(&self, path: &str, field: &str, value: Value) {
        let (property, _) = self.composer.board().get(path).unwrap();
        property.set(field, &value, self.composer.now()).unwrap();
    }
}
