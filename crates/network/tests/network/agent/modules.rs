//! Modules of the tests' agent.

use slate_interfaces::Pose2;
use slate_mapek::{FactTable, Statements};
use slate_module::Plugin;
use slate_module::prelude::*;

/// A speed.
#[interface]
#[derive(PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Speed {
    /// Forward.
    #[unit("m/s")]
    pub value: f64,
}

/// Many bytes.
#[interface]
pub struct Picture {
    /// The count.
    pub number: f64,
    /// The bytes.
    pub data: [u8],
}

#[ports]
pub struct SensorIo {
    count: Output<Speed>,
    pose: Output<Pose2>,
    trace: Debug<Speed>,
    #[capacity(1048576)]
    picture: Output<Picture>,
}

#[params]
pub struct SensorParams {
    #[param(default = 1.0, range = 0.0..=5.0, unit = "m/s", doc = "Increment of the count")]
    step: f64,
}

/// Counts, and is somewhere.
pub struct Sensor;

#[module(stage = SensorAcquire)]
impl Module for Sensor {
    type Io = SensorIo;
    type Params = SensorParams;
    type State = f64;

    fn tick(state: &mut f64, io: &SensorIo, params: &SensorParams, _: &Tick) -> Outcome {
        *state += params.step;
        io.count.set(Speed { value: *state });
        io.pose.set(Pose2 { x: 1.5, y: -2.5, theta: 0.25 });
        io.trace.set(|| Speed { value: -1.0 });
        if *state % 8.0 < params.step {
            io.picture.write(1 << 20, |picture| picture.number = *state);
        }
        Outcome::Ok
    }
}

#[ports]
pub struct DriverIo {
    goal: Input<Pose2>,
    ambient: Input<Speed>,
    linked: Input<Speed>,
    #[capacity(1048576)]
    picture: Input<Picture>,
    #[window(1024)]
    speeds: Queue<Speed>,
    notes: Inbox<Speed>,
    heard: Output<Speed>,
    sum: Output<Speed>,
    last: Output<Speed>,
    gaps: Output<Speed>,
    seen: Output<Speed>,
}

#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct DriverState {
    heard: f64,
    sum: f64,
    last: f64,
    gaps: f64,
}

/// Repeats what it reads, adds up what comes in its queue with the gaps in it, and hears messages that are not negative.
pub struct Driver;

#[module(stage = Act)]
impl Module for Driver {
    type Io = DriverIo;
    type Params = ();
    type State = DriverState;

    fn tick(state: &mut DriverState, io: &DriverIo, _: &(), _: &Tick) -> Outcome {
        for note in io.notes.iter() {
            match note.value {
                value if value < 0.0 => note.refuse(1),
                value => state.heard += value,
            }
        }
        io.heard.set(Speed { value: state.heard });
        for speed in io.speeds.iter() {
            state.gaps += f64::from(state.sum > 0.0 && speed.value != state.last + 1.0);
            state.sum += speed.value;
            state.last = speed.value;
        }
        io.sum.set(Speed { value: state.sum });
        io.last.set(Speed { value: state.last });
        io.gaps.set(Speed { value: state.gaps });
        let ambient = io.ambient.get().copied().unwrap_or(Speed { value: 0.0 });
        io.seen.set(Speed { value: ambient.value + io.goal.get().map_or(0.0, |goal| goal.x) });
        let _ = (io.linked.get(), io.picture.get());
        Outcome::Ok
    }
}

#[ports]
pub struct ScoutIo {
    seen: Input<Speed>,
    found: Output<FactTable<Speed>>,
}

/// States what it sees, about a key of that number; takes it back when it is negative.
pub struct Scout;

#[module(stage = Think)]
impl Module for Scout {
    type Io = ScoutIo;
    type Params = ();
    type State = Statements<Speed>;

    fn tick(state: &mut Statements<Speed>, io: &ScoutIo, _: &(), now: &Tick) -> Outcome {
        if let Some(seen) = io.seen.updated().filter(|seen| seen.value != 0.0) {
            let key = seen.value.abs().to_string();
            match seen.value < 0.0 {
                true => assert!(state.retract(now.now(), &key)),
                false => assert!(state.state(now.now(), &key, 1.0, *seen)),
            }
        }
        assert!(state.write(now.now(), &io.found));
        Outcome::Ok
    }
}

#[ports]
pub struct WheelIo {
    turn: Command<Speed>,
}

/// Commands a wheel.
pub struct Wheel;

#[module(stage = Act)]
impl Module for Wheel {
    type Io = WheelIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &WheelIo, _: &(), _: &Tick) -> Outcome {
        io.turn.send(Speed { value: 2.0 }, Priority::Plan);
        Outcome::Ok
    }
}

pub fn plugins() -> Vec<Plugin> {
    vec![
        Plugin::linked::<Sensor>(),
        Plugin::linked::<Driver>(),
        Plugin::linked::<Scout>(),
        Plugin::linked::<Wheel>(),
    ]
}

/// How they are put together.
const CONFIGURATION: &str = r#"
[loop]
period = "10ms"
[modules.sensor]
[modules.driver]
[links]
"driver/linked" = "sensor/count"
"#;

/// The configuration of an agent with further links and a table `[network]`.
pub fn configuration(name: &str, links: &str, network: &str) -> String {
    format!("[agent]\nname = \"{name}\"\n{CONFIGURATION}{links}\n[network]\n{network}\n")
}
