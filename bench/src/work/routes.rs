//! Two routes of a robot, from the sensor's tick to the driver's tick.
//! A reflex, and a plan through Monitor, Analyze, Plan and Execute; also while other threads use all cores.
//!
//! RoCS can't be installed. What stands for it is a loop of its blocks as they are in its published code: a thread each, which
//! looks every 50 ms whether there is something to do.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use slate::interfaces::{Clearance, WheelSpeeds};
use slate::module::Plugin;
use slate::prelude::*;
use slate::runtime::{Agent, Control, Mode, Options};

use super::agents;
use crate::machine::{now, set_real_time};
use crate::measure::{Contest, Effort, Samples};
use crate::table::{Role, Table};

/// When the sensor spoke for which no command has come yet; 0 if it has.
static SENSED: AtomicU64 = AtomicU64::new(0);

/// Latencies of the commands, ns.
static TIMES: Mutex<Vec<u64>> = Mutex::new(Vec::new());

/// The ports of the sensor.
#[ports]
pub struct RangeIo {
    range: Output<Clearance>,
}

/// Sensor whose range falls, 50 times a second.
pub struct RangeSensor;

#[module(stage = SensorAcquire, every = "20ms")]
impl Module for RangeSensor {
    type Io = RangeIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &RangeIo, _: &(), _: &Tick) -> Outcome {
        io.range.set(Clearance { distance: 0.1 });
        SENSED.store(now(), Ordering::Release);
        Outcome::Ok
    }
}

/// The ports of the driver.
#[ports]
pub struct DriverIo {
    #[role("actuation")]
    command: Input<WheelSpeeds>,
}

/// Gives commands to the wheels.
pub struct Driver;

#[module(stage = ActExec, on = command)]
impl Module for Driver {
    type Io = DriverIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &DriverIo, _: &(), _: &Tick) -> Outcome {
        if io.command.get().is_some_and(|command| command.left != 0.0) {
            let sensed = SENSED.swap(0, Ordering::AcqRel);
            if let (true, Ok(mut times)) = (sensed > 0, TIMES.lock()) {
                times.push(now() - sensed);
            }
        }
        Outcome::Ok
    }
}

/// Input of the reflex.
#[ports]
pub struct Near {
    range: Input<Clearance>,
}

/// Turns away from what is near.
pub struct Avoid;

impl ReactiveModel for Avoid {
    const NAME: &'static str = "avoid";
    type Sensors = Near;
    type Params = ();
    type State = ();

    fn run(_: &mut (), sensors: &Near, _: &(), _: &Tick) -> Option<ActionRequest> {
        (sensors.range.updated()?.distance < 0.3).then(|| Turn::request(()))
    }
}

/// Tells how near something is.
pub struct RangeMonitor;

impl Monitor for RangeMonitor {
    const NAME: &'static str = "range_monitor";
    type Sensors = Near;
    type Params = ();
    type State = ();
    type Value = Clearance;

    fn interpret(_: &mut (), sensors: &Near, _: &(), _: &Tick) -> Option<Clearance> {
        sensors.range.updated().copied()
    }
}

/// Input of the Analyze.
#[ports]
pub struct ObservedRange {
    range: Observed<Clearance>,
}

/// Finds everything relevant.
pub struct Nearness;

impl Analyze for Nearness {
    const NAME: &'static str = "nearness";
    type Observed = ObservedRange;
    type Params = ();
    type State = ();
    type Value = Clearance;

    fn process(_: &mut (), observed: &ObservedRange, _: &(), _: &Tick) -> Option<Clearance> {
        observed.range.updated().copied()
    }
}

/// Input of the Plan.
#[ports]
pub struct NoticedRange {
    range: Noticed<Clearance>,
}

/// Plans to turn away.
pub struct Planner;

impl Plan for Planner {
    const NAME: &'static str = "planner";
    type Noticed = NoticedRange;
    type Params = ();
    type State = ();

    fn run(_: &mut (), noticed: &NoticedRange, _: &Situation<'_>, _: &(), _: &Tick, plan: &mut Agenda<'_>) {
        if noticed.range.newest().is_some_and(|range| range.distance < 0.3) {
            plan.replace(Turn::request(()));
        }
    }
}

/// Body that actions move.
#[ports]
pub struct Body {
    wheels: Command<WheelSpeeds>,
}

/// Turns away for a step.
#[derive(Serialize, Deserialize)]
pub struct Turn {
    is_done: bool,
}

impl ActionKind for Turn {
    const KIND: &'static str = "Turn";
    type Arguments = ();

    fn start((): ()) -> Self {
        Self { is_done: false }
    }
}

impl Action<Body> for Turn {
    fn act(&mut self, acting: &Acting<'_, Body>) -> Step {
        if std::mem::replace(&mut self.is_done, true) {
            return Step::Done;
        }
        acting.body.wheels.send(WheelSpeeds { left: -1.0, right: 1.0 }, acting.priority);
        Step::Running
    }
}

repertoire! {
    /// All that the robot can do.
    pub enum Actions for Body { Turn }
}

const SENSOR_AND_DRIVER: &str = r#"
[loop]
period = "5ms"
[log.targets]
console = false
[modules.range_sensor]
[modules.driver]
[modules.execute]
[actuators.wheels]
command = "execute/wheels"
"#;

const REFLEX: &str = r#"
[modules.avoid]
[links]
"driver/command" = "wheels/command"
"avoid/range" = "range_sensor/range"
"execute/reflexes" = "avoid/reflex"
"#;

const PLAN: &str = r#"
[modules.range_monitor]
[modules.nearness]
[modules.planner]
[links]
"driver/command" = "wheels/command"
"range_monitor/range" = "range_sensor/range"
"nearness/range" = "range_monitor/percept"
"planner/range" = "nearness/change"
"execute/plan" = "planner/plan"
"planner/situation" = "execute/status"
"#;

/// Lets a robot run until it has reacted so often.
fn robot(route: &str, mode: Mode, count: usize, samples: &mut Samples) {
    let plugins: Vec<Plugin> = vec![
        Plugin::linked::<RangeSensor>(),
        Plugin::linked::<Driver>(),
        slate::mapek::reactive::<Avoid>().into(),
        slate::mapek::monitor::<RangeMonitor>().into(),
        slate::mapek::analyze::<Nearness>().into(),
        slate::mapek::plan::<Planner>().into(),
        slate::mapek::execute::<Actions>().into(),
    ];
    let options = Options { mode, armed: true, ..Options::default() };
    let text = format!("{SENSOR_AND_DRIVER}{route}");
    let agent = Agent::load_with(&agents::database(&text), &plugins, options);
    let mut agent = agent.unwrap_or_else(|error| panic!("the modules of a bench fit: {error:?}"));
    if let Ok(mut times) = TIMES.lock() {
        times.clear();
        times.reserve(2 * count);
    }
    let end = agent.run(Box::new(move |_| {
        let enough = TIMES.lock().is_ok_and(|times| times.len() >= count);
        if enough { Control::Stop } else { Control::Continue }
    }));
    end.expect("the system has threads");
    if let Ok(times) = TIMES.lock() {
        times.iter().for_each(|took| samples.add(*took));
    }
}

/// Measures a thread per block that polls every 50 ms.
fn polling(count: usize, samples: &mut Samples) {
    const POLL: Duration = Duration::from_millis(50);
    let places: Vec<_> = (0..3).map(|_| Arc::new(Mutex::new(None::<u64>))).collect();
    let stop = Arc::new(AtomicBool::new(false));
    // Between sensor and Execute: the reactive model, or the Plan.
    let middle = {
        let (stop, from, to) = (Arc::clone(&stop), Arc::clone(&places[0]), Arc::clone(&places[1]));
        thread::spawn(move || {
            while !stop.load(Ordering::Acquire) {
                if let (Ok(mut from), Ok(mut to)) = (from.lock(), to.lock())
                    && let Some(sensed) = from.take()
                {
                    *to = Some(sensed);
                }
                thread::sleep(POLL);
            }
        })
    };
    let execute = {
        let (stop, from, to) = (Arc::clone(&stop), Arc::clone(&places[1]), Arc::clone(&places[2]));
        thread::spawn(move || {
            while !stop.load(Ordering::Acquire) {
                if let (Ok(mut from), Ok(mut to)) = (from.lock(), to.lock())
                    && let Some(sensed) = from.take()
                {
                    *to = Some(sensed);
                }
                thread::sleep(POLL);
            }
        })
    };
    let driver = {
        let (stop, from) = (Arc::clone(&stop), Arc::clone(&places[2]));
        thread::spawn(move || {
            let mut times = Vec::new();
            while times.len() < count {
                times.extend(from.lock().ok().and_then(|mut from| from.take()).map(|sensed| now() - sensed));
                thread::sleep(POLL);
            }
            stop.store(true, Ordering::Release);
            times
        })
    };
    let mut wait = 211;
    while !stop.load(Ordering::Acquire) {
        // At any time beside the polls.
        wait = 200 + (wait * 7) % 97;
        thread::sleep(Duration::from_millis(wait));
        if let Ok(mut place) = places[0].lock() {
            *place = Some(now());
        }
    }
    let _ = (middle.join(), execute.join());
    driver.join().into_iter().flatten().for_each(|took| samples.add(took));
}

/// Threads that want the processor all the time.
struct Busy {
    stop: Arc<AtomicBool>,
    threads: Vec<thread::JoinHandle<()>>,
}

impl Busy {
    fn start(count: usize) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let thread = |_| {
            let stop = Arc::clone(&stop);
            thread::spawn(move || {
                while !stop.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            })
        };
        let threads = (0..count).map(thread).collect();
        Self { stop, threads }
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.threads.drain(..).for_each(|thread| drop(thread.join()));
    }
}

const THREADS: usize = 8;

const PRIORITY: i32 = 50;

/// Measures all lines.
pub fn run(effort: Effort, table: &mut Table) {
    let (count, few) = (effort.count(200), effort.count(20));
    let mut contest = Contest::new("routes", "a plan, from the sensor to the driver");
    contest.with("Slate, staged", Role::Slate, move |samples| robot(PLAN, Mode::Staged, count, samples));
    contest.with("Slate, threaded", Role::Slate, move |samples| robot(PLAN, Mode::Threaded, count, samples));
    contest.with("threads that poll each 50 ms, as RoCS", Role::Model, move |samples| polling(few, samples));
    contest.run(effort, table);

    let mut contest = Contest::new("routes", "a reflex, from the sensor to the driver");
    contest
        .with("Slate, threaded", Role::Slate, move |samples| robot(REFLEX, Mode::Threaded, count, samples));
    contest.with("Slate, staged", Role::Slate, move |samples| robot(REFLEX, Mode::Staged, count, samples));
    contest.with("threads that poll each 50 ms, as RoCS", Role::Model, move |samples| polling(few, samples));
    contest.run(effort, table);

    let mut contest = Contest::new("routes", format!("a reflex while {THREADS} other threads are busy"));
    if set_real_time(PRIORITY) && set_real_time(0) {
        contest.with("Slate, threaded, in real time (SCHED_FIFO)", Role::Slate, move |samples| {
            let _busy = Busy::start(THREADS);
            set_real_time(PRIORITY);
            robot(REFLEX, Mode::Threaded, count, samples);
            set_real_time(0);
        });
    } else {
        table.absent("routes", "Slate in real time", "the system does not allow SCHED_FIFO: run it as root");
    }
    contest.with("Slate, threaded, as any program", Role::Slate, move |samples| {
        let _busy = Busy::start(THREADS);
        robot(REFLEX, Mode::Threaded, count, samples);
    });
    contest.with("threads that poll each 50 ms, as RoCS", Role::Model, move |samples| {
        let _busy = Busy::start(THREADS);
        polling(few, samples);
    });
    contest.run(effort, table);
}
