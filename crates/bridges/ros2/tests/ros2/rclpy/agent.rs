//! An agent that runs, as a node of ROS.

use std::sync::Arc;

use slate_control::ControlSurface;
use slate_interfaces::{Image, LaserScan, Odometry, Pose2, Twist2};
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_ros2::{RosBridge, RosSettings};
use slate_runtime::Options;
use slate_runtime::configuration::{Configuration, Database};

#[path = "../../../../topics/tests/shared/agent.rs"]
mod shared;

pub use shared::*;

pub type Running = shared::Running<RosBridge>;

impl TestBridge for RosBridge {
    const TABLE: &'static str = slate_ros2::TABLE;

    fn opened(surface: &Arc<ControlSurface>, configuration: &Configuration) -> Self {
        Self::open(surface, &RosSettings::of(configuration).unwrap().unwrap()).unwrap()
    }

    fn started(&mut self) {
        self.start().unwrap();
    }
}

#[ports]
pub struct SensorIo {
    odometry: Output<Odometry>,
    count: Output<Number>,
    #[capacity(8)]
    scan: Output<LaserScan>,
}

/// Counts, and is somewhere.
pub struct Sensor;

#[module(stage = SensorAcquire)]
impl Module for Sensor {
    type Io = SensorIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &SensorIo, _: &(), _: &Tick) -> Outcome {
        *state += 1.0;
        io.count.set(Number { value: *state });
        io.odometry.set(Odometry {
            pose: Pose2 { x: *state, y: -2.5, theta: std::f64::consts::FRAC_PI_2 },
            twist: Twist2 { linear: 0.5, angular: -0.25 },
        });
        io.scan.write(3, |scan| {
            (scan.angle_min, scan.angle_increment) = (-0.5, 0.5);
            (scan.range_min, scan.range_max) = (0.1, 10.0);
            scan.ranges.copy_from_slice(&[1.0, f32::INFINITY, 2.5]);
        });
        Outcome::Ok
    }
}

#[ports]
pub struct DriverIo {
    #[capacity(4)]
    scan: Input<LaserScan>,
    command: Input<Twist2>,
    number: Input<Number>,
    linked: Input<Number>,
    seen: Output<Number>,
    wheels: Output<Twist2>,
}

/// Adds up all that it reads, and passes the command on.
pub struct Driver;

#[module(stage = Act)]
impl Module for Driver {
    type Io = DriverIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &DriverIo, _: &(), _: &Tick) -> Outcome {
        if let Some(scan) = io.scan.fresh() {
            *state += scan
                .ranges
                .iter()
                .filter(|range| range.is_finite())
                .map(|range| f64::from(*range))
                .sum::<f64>();
        }
        *state += io.command.fresh().map_or(0.0, |command| command.linear);
        *state += io.number.fresh().map_or(0.0, |number| number.value);
        io.seen.set(Number { value: *state });
        let _ = io.linked.get();
        io.wheels.set(io.command.get().copied().unwrap_or(Twist2::ZERO));
        Outcome::Ok
    }
}

#[ports]
pub struct EyeIo {
    #[capacity(8_388_608)]
    image: Input<Image>,
}

/// Looks at large images.
pub struct Eye;

#[module(stage = SensorProcess)]
impl Module for Eye {
    type Io = EyeIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &EyeIo, _: &(), _: &Tick) -> Outcome {
        let _ = io.image.get();
        Outcome::Ok
    }
}

pub fn plugins() -> Vec<Plugin> {
    let own = [
        Plugin::linked::<Sensor>(),
        Plugin::linked::<Driver>(),
        Plugin::linked::<Eye>(),
        Plugin::linked::<super::actions::Counter>(),
        Plugin::linked::<super::actions::Seeker>(),
        Plugin::linked::<super::lockstep::Cart>(),
    ];
    own.into_iter().chain(shared_plugins()).collect()
}

pub fn configuration(name: &str, ros2: &str) -> String {
    format!(
        "[agent]\nname = \"{name}\"\n[loop]\nperiod = \"10ms\"\n[modules.sensor]\n[modules.driver]\n[links]\n\
         \"driver/linked\" = \"sensor/count\"\n[ros2]\n{ros2}\n"
    )
}

pub fn database(text: &str) -> Database {
    database_of::<RosBridge>(text)
}

impl Running {
    /// An agent of a name with a table `[ros2]`.
    pub fn start(name: &str, ros2: &str) -> Self {
        Self::of(&configuration(name, ros2))
    }

    /// An agent of a configuration with a table `[ros2]`.
    pub fn of(text: &str) -> Self {
        Self::load_text(text).connected()
    }

    /// An agent of a configuration that is not a node yet.
    pub fn load_text(text: &str) -> Self {
        Self::load_database(&database(text), &plugins(), Options::default())
    }

    /// An agent in lockstep, in real time.
    pub fn lockstep(text: &str) -> Self {
        Self::load_database(&database(text), &plugins(), lockstep()).connected()
    }

    pub fn has_logged(&self, words: &str) -> bool {
        self.logged(words) > 0
    }

    /// Stops all actuators.
    pub fn stop_actuators(&self, reason: &str) {
        self.surface.agent.stop(reason);
    }
}

/// Runs a test of that path in a network namespace of its own.
pub fn alone(test: &str, body: impl FnOnce(u16)) {
    let prepare = || {
        super::peer::python();
        super::peer::cyclone_python();
    };
    slate_test_tools::alone(test, prepare, body);
}
