//! What the agent of the tests is made of.

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

#[ports]
pub struct SensorIo {
    count: Output<Speed>,
    pose: Output<Pose2>,
    trace: Debug<Speed>,
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
        Outcome::Ok
    }
}

#[ports]
pub struct DriverIo {
    goal: Input<Pose2>,
    ambient: Input<Speed>,
    linked: Input<Speed>,
    speeds: Queue<Speed>,
    notes: Inbox<Speed>,
    heard: Output<Speed>,
    sum: Output<Speed>,
    seen: Output<Speed>,
}

/// Repeats what it reads, adds up what comes in its queue, and hears messages that are not negative.
pub struct Driver;

#[module(stage = Act)]
impl Module for Driver {
    type Io = DriverIo;
    type Params = ();
    type State = (f64, f64);

    fn tick((heard, sum): &mut (f64, f64), io: &DriverIo, _: &(), _: &Tick) -> Outcome {
        for note in io.notes.iter() {
            match note.value {
                value if value < 0.0 => note.refuse(1),
                value => *heard += value,
            }
        }
        io.heard.set(Speed { value: *heard });
        *sum += io.speeds.iter().map(|speed| speed.value).sum::<f64>();
        io.sum.set(Speed { value: *sum });
        let ambient = io.ambient.get().copied().unwrap_or(Speed { value: 0.0 });
        io.seen.set(Speed { value: ambient.value + io.goal.get().map_or(0.0, |goal| goal.x) });
        let _ = io.linked.get();
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

pub fn plugins() -> Vec<Plugin> {
    vec![Plugin::linked::<Sensor>(), Plugin::linked::<Driver>(), Plugin::linked::<Scout>()]
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
