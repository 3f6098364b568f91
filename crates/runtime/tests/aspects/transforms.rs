//! The aspect Transforms.

use slate_blackboard::channel::Budget;
use slate_blackboard::interface::View;
use slate_blackboard::{Access, Store};
use slate_interfaces::{Position, Quaternion, Transform};
use slate_module::Plugin;
use slate_module::aspect::{Aspect, RigidTransform, Transforms};
use slate_module::prelude::*;
use slate_runtime::{Agent, Options, Rate};

use crate::aspects::common::{Number, load, number};
use crate::aspects::{agent, logged, says, steps};

/// A frame at `x` in its parent.
fn transform(time: u64, parent: &str, child: &str, x: f64) -> Transform {
    Transform {
        time,
        parent: parent.into(),
        child: child.into(),
        translation: Position { x, y: 0.0, z: 0.0 },
        rotation: Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 },
        ..Transform::default()
    }
}

#[ports]
pub struct OdometryIo {
    base: Output<Transform>,
}

#[params]
pub struct OdometryParams {
    #[param(default = 1.0, doc = "meters that it has gone in each tick")]
    stride: f64,
    #[param(default = 0, doc = "says nonsense in that tick")]
    wrong_at: u64,
}

/// Goes ahead.
pub struct Odometry;

#[module(stage = SensorAcquire)]
impl Module for Odometry {
    type Io = OdometryIo;
    type Params = OdometryParams;
    type State = ();

    fn tick(_: &mut (), io: &OdometryIo, params: &OdometryParams, now: &Tick) -> Outcome {
        let mut transform = transform(now.now(), "odom", "base_link", now.number() as f64 * params.stride);
        if now.number() == params.wrong_at {
            transform.rotation.w = 2.0;
        }
        io.base.set(transform);
        Outcome::Ok
    }
}

#[ports]
pub struct MountIo {
    laser: Output<Transform>,
}

/// Tells once where the laser is screwed on: 0.25 m ahead, looking to the left.
pub struct Mount;

#[module(stage = SensorAcquire)]
impl Module for Mount {
    type Io = MountIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &MountIo, _: &(), now: &Tick) -> Outcome {
        if now.number() == 1 {
            let half = std::f64::consts::FRAC_1_SQRT_2;
            io.laser.set(Transform {
                rotation: Quaternion { x: 0.0, y: 0.0, z: half, w: half },
                fixed: true.into(),
                ..transform(0, "base_link", "laser", 0.25)
            });
        }
        Outcome::Ok
    }
}

#[params]
pub struct MapperParams {
    #[param(default = "odom", doc = "the frame to look up in")]
    target: Text<60>,
    #[param(default = "laser", doc = "the frame to look up")]
    source: Text<60>,
    #[param(default = 0, unit = "ns", doc = "how long ago; the newest for 0")]
    ago: u64,
}

#[ports]
pub struct MapperIo {
    transforms: Aspect<Transforms>,
    x: Output<Number>,
    y: Output<Number>,
    time: Output<Number>,
    frames: Output<Number>,
}

/// Shows where a point 1 m ahead of the laser is.
pub struct Mapper;

#[module(stage = SensorProcess)]
impl Module for Mapper {
    type Io = MapperIo;
    type Params = MapperParams;
    type State = ();

    fn tick(_: &mut (), io: &MapperIo, params: &MapperParams, now: &Tick) -> Outcome {
        let (target, source) = (params.target.as_str(), params.source.as_str());
        let set = |port: &Output<Number>, value: f64| port.set(Number { value });
        set(&io.frames, io.transforms.frames().len() as f64);
        match io.transforms.latest_common_time(target, source) {
            Ok(time) => set(&io.time, time.map_or(-1.0, |time| time as f64)),
            Err(reason) => now.warn(format_args!("{reason}")),
        }
        let found = match params.ago {
            0 => io.transforms.lookup_latest(target, source),
            ago => io.transforms.lookup(target, source, now.now().saturating_sub(ago)),
        };
        match found {
            Ok(place) => {
                let [x, y, _] = place.point([1.0, 0.0, 0.0]);
                set(&io.x, x);
                set(&io.y, y);
                assert_eq!(place * RigidTransform::IDENTITY, place);
                Outcome::Ok
            }
            Err(reason) => {
                now.warn(format_args!("{reason}"));
                Outcome::Degraded
            }
        }
    }
}

fn plugins() -> Vec<Plugin> {
    vec![Plugin::linked::<Odometry>(), Plugin::linked::<Mount>(), Plugin::linked::<Mapper>()]
}

const ROBOT: &str = "loop.period = \"10ms\"\n[modules.odometry]\n[modules.mount]\n[modules.mapper]\n";

#[test]
fn outputs_of_transforms_form_a_tree_for_lookups() {
    let mut agent = agent(ROBOT, &plugins());
    steps(&mut agent, 3);
    // What was written in this cycle counts, as its stage comes later.
    assert!((number(&agent, "mapper/x/value") - 3.25).abs() < 1e-12);
    assert!((number(&agent, "mapper/y/value") - 1.0).abs() < 1e-12);
    assert_eq!(number(&agent, "mapper/time/value"), 20e6);
    assert_eq!(number(&agent, "mapper/frames/value"), 3.0);
}

#[test]
fn the_past_is_known_and_between_two_times_too() {
    let text = format!("{ROBOT}params.ago = 15000000\n");
    let mut agent = agent(&text, &plugins());
    steps(&mut agent, 5);
    assert!(
        (number(&agent, "mapper/x/value") - 3.75).abs() < 1e-12,
        "half-way between the third and the fourth"
    );
}

#[test]
fn a_slow_module_misses_no_transform_of_a_fast_one() {
    let text = format!("{ROBOT}every = \"400ms\"\nparams.ago = 385000000\n");
    let mut agent = agent(&text, &plugins());
    steps(&mut agent, 41);
    assert!((number(&agent, "mapper/x/value") - 2.75).abs() < 1e-12, "{}", number(&agent, "mapper/x/value"));
}

#[test]
fn unknown_values_are_described_in_words() {
    let text = format!("{ROBOT}params.source = \"camera\"\n");
    let (mut agent, log) = logged(&text, &plugins());
    steps(&mut agent, 1);
    assert!(says(&agent, &log, "mapper", "there is no frame `camera` yet"), "{:?}", log.lines());
    let text = format!("{ROBOT}params.ago = 1000000000\n");
    let (mut agent, log) = logged(&text, &plugins());
    steps(&mut agent, 2);
    assert!(!says(&agent, &log, "mapper", "the oldest kept"), "the time is cut at 0: {:?}", log.lines());
}

#[test]
fn an_invalid_transform_is_skipped_and_reported_to_its_users() {
    let text = ROBOT.replace("[modules.odometry]", "[modules.odometry]\nparams.wrong_at = 1");
    let (mut agent, log) = logged(&text, &plugins());
    steps(&mut agent, 1);
    assert!(says(&agent, &log, "mapper", "there is no frame `odom` yet"), "{:?}", log.lines());
    let cause = "of /odometry/base was refused: `odom` -> `base_link` is not a transform";
    assert!(says(&agent, &log, "mapper", cause), "{:?}", log.lines());
    steps(&mut agent, 1);
    assert!((number(&agent, "mapper/x/value") - 2.25).abs() < 1e-12, "the next one counts");
}

/// Opens a property of transforms beside the modules.
fn open(agent: &Agent, path: &str, budget: Budget) -> slate_blackboard::channel::Writer {
    let store = Store { capacity: 0, depth: 4, budget };
    let board = agent.board();
    let property = board.add_channel(path, "", Transform::DESCRIPTOR, store, Access::Output).unwrap();
    property.channel().unwrap().writer().unwrap()
}

const READERS: Budget = Budget { latest: 1, queues: 4, window: 4 };

#[test]
fn an_appearing_property_is_followed_a_vanished_one_released() {
    let mut agent = agent(&format!("{ROBOT}params.source = \"camera\"\n"), &plugins());
    steps(&mut agent, 2);
    let mut writer = open(&agent, "camera/mount", READERS);
    let mut value = Transform { fixed: true.into(), ..transform(0, "base_link", "camera", 0.5) };
    writer.write(View::of(&mut value).bytes(), 0, 0).unwrap();
    steps(&mut agent, 1);
    assert!((number(&agent, "mapper/x/value") - 4.5).abs() < 1e-12);
    let (property, _) = agent.board().find("camera/mount").unwrap();
    assert_eq!(property.readers(), 1);
    agent.board().remove("camera/mount").unwrap();
    steps(&mut agent, 1);
    assert_eq!(property.readers(), 0);
    assert!((number(&agent, "mapper/x/value") - 5.5).abs() < 1e-12, "the frame stays where it was");
    // The path may have another one.
    let mut writer = open(&agent, "camera/mount", READERS);
    let mut value = Transform { fixed: true.into(), ..transform(0, "base_link", "camera", 1.5) };
    writer.write(View::of(&mut value).bytes(), 0, 0).unwrap();
    steps(&mut agent, 1);
    assert!((number(&agent, "mapper/x/value") - 7.5).abs() < 1e-12);
}

#[test]
fn many_changes_of_the_board_are_not_lost() {
    let mut agent = agent(&format!("{ROBOT}params.source = \"camera\"\n"), &plugins());
    steps(&mut agent, 2);
    let mut writers: Vec<_> = (0..500).map(|i| open(&agent, &format!("noise/{i}"), READERS)).collect();
    (0..500).for_each(|i| agent.board().remove(&format!("noise/{i}")).unwrap());
    writers.clear();
    let mut writer = open(&agent, "camera/mount", READERS);
    let mut value = Transform { fixed: true.into(), ..transform(0, "base_link", "camera", 0.5) };
    writer.write(View::of(&mut value).bytes(), 0, 0).unwrap();
    steps(&mut agent, 1);
    assert!((number(&agent, "mapper/x/value") - 4.5).abs() < 1e-12);
}

#[test]
fn a_property_out_of_readers_is_reported_to_those_without_it() {
    let (mut agent, log) = logged(&format!("{ROBOT}params.source = \"camera\"\n"), &plugins());
    let none = Budget { latest: 1, queues: 0, window: 0 };
    let mut writer = open(&agent, "camera/mount", none);
    writer.write(View::of(&mut transform(0, "base_link", "camera", 0.5)).bytes(), 0, 0).unwrap();
    steps(&mut agent, 1);
    assert!(says(&agent, &log, "mapper", "/camera/mount can't be read"), "{:?}", log.lines());
}

#[test]
fn many_modules_may_look_up_the_same_frames() {
    let mut text = ROBOT.to_owned();
    (0..15).for_each(|i| text.push_str(&format!("[modules.m{i}]\nkind = \"mapper\"\n")));
    let mut agent = agent(&text, &plugins());
    steps(&mut agent, 4);
    for i in 0..15 {
        assert!((number(&agent, &format!("m{i}/x/value")) - 4.25).abs() < 1e-12);
    }
}

#[test]
fn a_module_that_is_unloaded_reads_no_more() {
    let mut agent = agent(ROBOT, &plugins());
    steps(&mut agent, 2);
    let (property, _) = agent.board().find("odometry/base").unwrap();
    assert_eq!(property.readers(), 1);
    agent.composer().unload("mapper").unwrap();
    assert_eq!(property.readers(), 0);
}

#[test]
fn run_is_the_same_on_any_thread() {
    let run = |workers: usize| {
        let mut text = format!("time.source = \"dice\"\n[modules.dice]\n{ROBOT}");
        // Two that disagree about one frame.
        text.push_str("[modules.other]\nkind = \"odometry\"\nparams.stride = 2.0\n");
        text.push_str("[modules.second]\nkind = \"mapper\"\nparams.ago = 5000000\n");
        let text = text.replace("loop.period = \"10ms\"\n", "");
        let options = Options { workers, always_help: true, rate: Rate::Max, ..Options::default() };
        let mut agent = load(&text, &plugins(), options).unwrap();
        steps(&mut agent, 30);
        agent.digest().unwrap()
    };
    let alone = run(0);
    assert_eq!(run(1), alone);
    assert_eq!(run(2), alone);
}
