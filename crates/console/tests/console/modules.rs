//! Modules of the tests' agent.

use slate_interfaces::{
    Echo, Image, ImageFormat, Odometry, Path, Point2, Pose2, Position, Quaternion, Transform, Twist2,
};
use slate_module::Plugin;
use slate_module::prelude::*;

/// A speed.
#[interface]
#[derive(PartialEq)]
pub struct Speed {
    /// Forward.
    #[unit("m/s")]
    pub value: f64,
}

/// A place.
#[interface]
#[derive(PartialEq)]
pub struct Place {
    /// East.
    #[unit("m")]
    pub x: f64,
    /// North.
    #[unit("m")]
    pub y: f64,
}

#[ports]
pub struct SensorIo {
    count: Output<Speed>,
    place: Output<Place>,
    #[capacity(12288)]
    image: Output<Image>,
    #[capacity(2)]
    way: Output<Path>,
}

#[params]
pub struct SensorParams {
    #[param(default = 1.0, range = 0.0..=5.0, unit = "m/s", doc = "by how much it counts")]
    step: f64,
    #[param(default = "robot", doc = "what it is called")]
    label: Text<20>,
}

/// Counts, is somewhere, sees a picture, and has a way to go.
pub struct Sensor;

#[module(stage = SensorAcquire)]
impl Module for Sensor {
    type Io = SensorIo;
    type Params = SensorParams;
    type State = f64;

    fn tick(state: &mut f64, io: &SensorIo, params: &SensorParams, _: &Tick) -> Outcome {
        *state += params.step;
        io.count.set(Speed { value: *state });
        io.place.set(Place { x: 1.5, y: f64::NAN });
        io.image.write(64 * 64 * 3, |image| {
            (image.width, image.height, image.step, image.format) = (64, 64, 64 * 3, ImageFormat::RGB8);
            image.data.fill(*state as u8);
        });
        io.way.write(2, |way| {
            way.length = 5.0;
            way.points.copy_from_slice(&[Point2 { x: 0.0, y: 0.0 }, Point2 { x: 3.0, y: 4.0 }]);
        });
        Outcome::Ok
    }
}

#[ports]
pub struct DriverIo {
    goal: Input<Place>,
    wheel: Command<Speed>,
    notes: Inbox<Speed>,
    heard: Output<Speed>,
    history: Queue<Speed>,
}

/// Commands what its goal says, and hears messages that are not less than nothing.
pub struct Driver;

#[module(stage = Act)]
impl Module for Driver {
    type Io = DriverIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &DriverIo, _: &(), now: &Tick) -> Outcome {
        io.wheel.send(Speed { value: io.goal.get().copied().unwrap_or_default().x }, Priority::Plan);
        for note in io.notes.iter() {
            match note.value {
                value if value < -100.0 => note.refuse(2),
                value if value < 0.0 => {
                    now.warn(format_args!("{value} is less than nothing; send 0 or more"));
                    note.refuse(1);
                }
                value => *state += value,
            }
        }
        let _ = io.history.iter().count();
        io.heard.set(Speed { value: *state });
        Outcome::Ok
    }
}

#[ports]
pub struct RoverIo {
    truth: Output<Pose2>,
    odometry: Output<Odometry>,
    echo: Output<Echo>,
    camera: Output<Transform>,
}

#[params]
pub struct RoverParams {
    #[param(default = 0.0, unit = "m", doc = "where it begins in the map")]
    begin: f64,
    #[param(default = 1.0, doc = "which part of its way it measures; nothing without")]
    measures: f64,
}

/// Drives along, and has a camera.
pub struct Rover;

#[module(stage = SensorAcquire)]
impl Module for Rover {
    type Io = RoverIo;
    type Params = RoverParams;
    type State = f64;

    fn tick(state: &mut f64, io: &RoverIo, params: &RoverParams, _: &Tick) -> Outcome {
        *state += 0.5;
        io.truth.set(Pose2 { x: params.begin + *state, y: 2.0, theta: 0.0 });
        if params.measures > 0.0 {
            let pose = Pose2 { x: *state * params.measures, y: 0.0, theta: 0.0 };
            io.odometry.set(Odometry { pose, twist: Twist2 { linear: 0.5, angular: 0.0 } });
        }
        io.echo.set(Echo { range: 1.0, ..Echo::default() });
        io.camera.set(Transform {
            time: 0,
            parent: "base_link".into(),
            child: "camera".into(),
            translation: Position { x: 0.1, y: 0.0, z: 0.3 },
            rotation: Quaternion::IDENTITY,
            fixed: true.into(),
        });
        Outcome::Ok
    }
}

/// All of them.
pub fn plugins() -> Vec<Plugin> {
    vec![Plugin::linked::<Sensor>(), Plugin::linked::<Driver>(), Plugin::linked::<Rover>()]
}

/// How they are put together.
pub const CONFIGURATION: &str = r#"
[agent]
name = "tester"
[loop]
period = "10ms"
[modules.sensor]
[modules.driver]
[links]
"driver/history" = "sensor/count"
[actuators.wheel]
command = "driver/wheel"
limits = { value = [-5.0, 5.0] }
"#;
