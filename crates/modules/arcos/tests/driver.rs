//! The driver in an agent, with a simulated robot at the end of a pseudo-terminal.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and a robot on a line lives by the wall clock"
)]

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use slate_arcos::port::{Port, PortError};
use slate_arcos_controller::{Controller, ControllerOptions, Faults};
use slate_interfaces::WheelSpeeds;
use slate_module::blackboard::Board;
use slate_module::blackboard::interface::Value;
use slate_module::prelude::*;
use slate_runtime::configuration::{self, Configuration};
use slate_runtime::log::MemoryTarget;
use slate_runtime::{Agent, Composer, Control, Stopper};

/// How long a test waits for what must come, also on a busy machine.
const TIMEOUT: Duration = Duration::from_secs(20);

/// What the pilot commands.
#[ports]
pub struct PilotIo {
    wheels: Command<WheelSpeeds>,
}

/// What the test wants.
#[params]
pub struct PilotParams {
    #[param(default = 0.0, doc = "left wheel")]
    left: f64,
    #[param(default = 0.0, doc = "right wheel")]
    right: f64,
    #[param(default = 0, range = 0..=1, doc = "whether it commands")]
    commands: u64,
    #[param(default = 0, doc = "milliseconds for which it holds the whole agent up, once")]
    sleep: u64,
}

/// Commands what the test wants.
pub struct Pilot;

#[module(stage = Act)]
impl Module for Pilot {
    type Io = PilotIo;
    type Params = PilotParams;
    type State = bool;

    fn tick(slept: &mut bool, io: &PilotIo, params: &PilotParams, _: &Tick) -> Outcome {
        if params.commands == 1 {
            let speeds = WheelSpeeds { left: params.left, right: params.right };
            io.wheels.send(speeds, Priority::Plan);
        }
        if params.sleep > 0 && !std::mem::replace(slept, true) {
            std::thread::sleep(Duration::from_millis(params.sleep));
        }
        Outcome::Ok
    }
}

/// A path that no other test has.
fn unique(name: &str) -> PathBuf {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    std::env::temp_dir().join(format!("slate-arcos-{}-{count}-{name}", std::process::id()))
}

fn controller(link: &Path, at: [f64; 3], faults: Faults) -> Controller {
    let options = ControllerOptions { at, link: Some(link.into()), faults, ..ControllerOptions::default() };
    Controller::start(options).unwrap()
}

fn configured(device: &Path, more: &str) -> Configuration {
    let text = format!(
        r#"
        [loop]
        period = "20ms"
        hang = "30s"
        [modules.pioneer]
        params.device = "{}"
        {more}
        [modules.pilot]
        [links]
        "pioneer/wheels" = "wheels/command"
        [actuators.wheels]
        command = "pilot/wheels"
        limits = {{ left = [-12.3, 12.3], right = [-12.3, 12.3] }}
        time_to_live = "100ms"
        safe = {{ left = 0.0, right = 0.0 }}
        "#,
        device.display()
    );
    Configuration::from_text("test.toml", &text, &configuration::Options::default()).unwrap()
}

/// An agent with the driver, which runs until this is dropped.
struct Running {
    board: Arc<Board>,
    stopper: Stopper,
    composer: Composer,
    thread: Option<JoinHandle<()>>,
    log: MemoryTarget,
}

impl Running {
    fn new(device: &Path) -> Self {
        let log = MemoryTarget::default();
        let options =
            slate_runtime::Options { armed: true, log: vec![Box::new(log.clone())], ..Default::default() };
        let plugins = [slate_arcos::plugin(), slate_module::Plugin::linked::<Pilot>()];
        let mut agent = Agent::load(&configured(device, ""), &plugins, options).unwrap();
        let (board, stopper) = (Arc::clone(agent.board()), agent.stopper());
        let composer = agent.composer();
        let run = move || drop(agent.run(Box::new(|_| Control::Continue)));
        Self { board, stopper, composer, thread: Some(std::thread::spawn(run)), log }
    }

    /// Connected to a robot.
    fn connected(device: &Path) -> Self {
        let running = Self::new(device);
        running.until("a connection", || running.is_up());
        running
    }

    fn number(&self, path: &str) -> f64 {
        let value = self.board.read(path).unwrap().map(|(value, _)| value);
        match value {
            Some(Value::Bool(value)) => f64::from(u8::from(value)),
            value => value.and_then(|value| value.as_f64()).unwrap_or(f64::NAN),
        }
    }

    fn text(&self, path: &str) -> String {
        let value = self.board.read(path).unwrap().map(|(value, _)| value);
        value.as_ref().and_then(Value::as_str).unwrap_or_default().to_owned()
    }

    fn is_up(&self) -> bool {
        self.text("pioneer/status/connection") == "UP"
    }

    /// Where odometry is: x, y, theta.
    fn odometry(&self) -> [f64; 3] {
        ["x", "y", "theta"].map(|field| self.number(&format!("pioneer/odometry/pose/{field}")))
    }

    /// Returns the pose by odometry when its last report has arrived.
    fn last_odometry(&self) -> [f64; 3] {
        let mut last = (self.odometry(), Instant::now());
        self.until("the last odometry", || {
            let pose = self.odometry();
            if pose != last.0 {
                last = (pose, Instant::now());
            }
            last.1.elapsed() > Duration::from_millis(300)
        });
        last.0
    }

    fn set(&self, parameter: &str, value: Value) {
        self.board.write(&format!("pilot/params/{parameter}"), &value, 0).unwrap();
    }

    /// Commands the wheels, rad/s.
    fn drive(&self, left: f64, right: f64) {
        self.set("left", Value::Float(left));
        self.set("right", Value::Float(right));
        self.set("commands", Value::Integer(1));
    }

    /// Commands nothing more.
    fn cease(&self) {
        self.set("commands", Value::Integer(0));
    }

    /// Lets the wheels turn again, as a person does after a loss.
    fn rearm(&self) {
        self.until("a stop", || self.composer.actuators().iter().all(|(_, reason)| reason.is_some()));
        assert!(!self.composer.arm(), "a stop is reset first");
        self.composer.reset();
        assert!(self.composer.arm());
    }

    fn until(&self, what: &str, mut is: impl FnMut() -> bool) {
        let start = Instant::now();
        while !is() {
            assert!(
                start.elapsed() < TIMEOUT,
                "never: {what}; {} {:?}; the log: {:#?}",
                self.text("pioneer/status/text"),
                self.odometry(),
                self.log.lines().iter().map(|record| record.text.clone()).collect::<Vec<_>>()
            );
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    fn until_logged(&self, part: &str) {
        self.until(part, || self.log.lines().iter().any(|record| record.text.contains(part)));
    }

    /// Until the robot stands, and odometry says so.
    fn until_it_stands(&self, controller: &Controller) {
        self.until("standing", || controller.wheels() == (0.0, 0.0));
        let stands = || {
            self.number("pioneer/odometry/twist/linear") == 0.0
                && self.number("pioneer/odometry/twist/angular") == 0.0
        };
        self.until("odometry that stands", stands);
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stopper.stop();
        let _ = self.thread.take().unwrap().join();
    }
}

fn distance(from: [f64; 3], to: [f64; 3]) -> f64 {
    math::hypot(to[0] - from[0], to[1] - from[1])
}

/// Half a meter per second.
const FAST: f64 = 0.5 / 0.0975;

/// Drives a meter and turns by a right angle, and compares what odometry says with where the robot is.
fn drives_a_meter_and_turns(running: &Running, controller: &Controller) {
    let (start, began) = (controller.pose(), running.odometry());
    running.drive(FAST, FAST);
    running.until("a meter", || distance(began, running.odometry()) > 0.9);
    running.cease();
    running.until_it_stands(controller);
    let driven = distance(start, controller.pose());
    assert!(driven > 0.85, "{driven} m");
    let measured = distance(began, running.last_odometry());
    assert!((driven - measured).abs() < 0.08, "{measured} of {driven} m");

    running.drive(-3.0, 3.0);
    running.until("a right angle", || math::angle_between(began[2], running.odometry()[2]) > 1.4);
    running.cease();
    running.until_it_stands(controller);
    let turned = math::angle_between(start[2], controller.pose()[2]);
    let measured = math::angle_between(began[2], running.last_odometry()[2]);
    assert!(turned > 1.2 && (turned - measured).abs() < 0.15, "{measured} of {turned} rad");
}

#[test]
fn the_robot_drives_turns_and_senses() {
    let link = unique("drives");
    let controller = controller(&link, [-1.0, 0.8, 0.0], Faults::default());
    let running = Running::connected(&link);
    drives_a_meter_and_turns(&running, &controller);
    assert_eq!(running.text("pioneer/status/text"), "slate-sim (Pioneer p3dx-sh)");
    assert_eq!(running.number("pioneer/battery/voltage"), 12.6);
    assert_eq!(running.number("pioneer/bumper/front") + running.number("pioneer/bumper/back"), 0.0);
    assert_eq!(running.number("pioneer/status/motors"), 1.0);
    running.until("a scan", || running.board.read("pioneer/sonar/range_max").unwrap().is_some());
    for sonar in 0..16 {
        let range = running.number(&format!("pioneer/sonar/echoes/{sonar}/range"));
        assert!((0.1..=5.0).contains(&range), "{sonar}: {range}");
    }
    // The agent's end is the end of the connection.
    running.drive(FAST, FAST);
    running.until("motion", || controller.wheels().0 > 0.1);
    drop(running);
    let start = Instant::now();
    while controller.is_open() || controller.wheels() != (0.0, 0.0) {
        assert!(start.elapsed() < TIMEOUT, "it was told to stop");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn the_robot_stops_without_commands_and_when_the_agent_hangs() {
    let link = unique("ceases");
    let controller = controller(&link, [-1.0, 0.8, 0.0], Faults::default());
    let running = Running::connected(&link);
    running.drive(2.0, 2.0);
    running.until("motion", || controller.wheels().0 > 0.1);
    running.cease();
    running.until_it_stands(&controller);
    running.drive(2.0, 2.0);
    running.until("motion", || controller.wheels().0 > 0.1);
    // No cycle passes, so no property commands a stop of the wheels.
    let begin = Instant::now();
    running.set("sleep", Value::Integer(4_000));
    running.until("standing", || controller.wheels() == (0.0, 0.0));
    assert!(begin.elapsed() < Duration::from_millis(3_500), "the thread stopped it, not the tick");
    running.until("motion again", || controller.wheels().0 > 0.1);
}

#[test]
fn damaged_bytes_are_counted_and_survived() {
    let link = unique("damaged");
    let faults = Faults { drop: 0.002, corrupt: 0.002, ..Faults::default() };
    let controller = controller(&link, [-1.0, 0.8, 0.0], faults);
    let running = Running::connected(&link);
    drives_a_meter_and_turns(&running, &controller);
    running.until("damage", || running.number("pioneer/status/bad_checksums") > 0.0);
}

#[test]
fn silent_or_noisy_robot_is_reported_and_found_again() {
    let link = unique("silent");
    let controller = controller(&link, [-1.0, 0.8, 0.0], Faults::default());
    let running = Running::connected(&link);
    let silent = Faults { silent: true, ..Faults::default() };
    let noise = Faults { noise: true, ..Faults::default() };
    for (faults, text) in [(silent, "stopped responding"), (noise, "noise")] {
        running.drive(1.0, 1.0);
        running.until("motion", || controller.wheels().0 > 0.05);
        controller.set_faults(faults);
        running.until("a loss", || !running.is_up());
        running.until_logged(text);
        // It still receives, and gets a stop.
        running.until("standing", || controller.wheels() == (0.0, 0.0));
        running.cease();
        controller.set_faults(Faults::default());
        running.until("a connection", || running.is_up());
        running.rearm();
    }
    assert_eq!(running.number("pioneer/status/losses"), 2.0);
    let before = controller.pose();
    running.drive(1.0, 1.0);
    running.until("motion", || distance(before, controller.pose()) > 0.05);
}

#[test]
fn a_replugged_cable_reconnects_without_motion() {
    let link = unique("pulled");
    let controller = controller(&link, [-1.0, 0.8, 0.0], Faults::default());
    let running = Running::connected(&link);
    running.drive(1.0, 1.0);
    running.until("motion", || controller.wheels().0 > 0.05);
    controller.unplug();
    running.until("a loss", || !running.is_up());
    running.until_logged("was disconnected");
    running.until_logged("does not exist");
    running.cease();
    // The robot's own watchdog.
    running.until("standing", || controller.wheels() == (0.0, 0.0));
    let (before, measured) = (controller.pose(), running.odometry());
    controller.plug().unwrap();
    running.until("a connection", || running.is_up());
    running.until("odometry that goes on", || running.odometry() == measured);
    assert!(distance(before, controller.pose()) < 0.005, "it drove on");
    // A robot that was switched off and on has forgotten where it was; the driver has not.
    running.rearm();
    running.drive(1.0, 1.0);
    running.until("motion", || distance(measured, running.odometry()) > 0.1);
    running.cease();
    running.until_it_stands(&controller);
    let measured = running.odometry();
    controller.restart();
    running.until("a loss", || running.number("pioneer/status/losses") == 2.0);
    running.until("a connection", || running.is_up());
    assert!(distance(measured, running.odometry()) < 0.01, "{measured:?} {:?}", running.odometry());
}

#[test]
fn a_reconnected_robot_moves_only_after_reset_and_arming() {
    let link = unique("back");
    let first = controller(&link, [-1.0, 0.8, 0.0], Faults::default());
    let running = Running::connected(&link);
    running.drive(1.0, 1.0);
    running.until("motion", || first.wheels().0 > 0.05);
    drop(first);
    running.until("a loss", || !running.is_up());
    // The planner continues.
    let second = controller(&link, [-1.0, 0.8, 0.0], Faults::default());
    running.until("a connection", || running.is_up());
    running.until_logged("`slate reset` and then `slate arm`");
    let begin = Instant::now();
    while begin.elapsed() < Duration::from_millis(500) {
        assert_eq!(second.wheels(), (0.0, 0.0), "it drives off by itself");
        std::thread::sleep(Duration::from_millis(2));
    }
    running.rearm();
    running.until("motion", || second.wheels().0 > 0.05);
}

#[test]
fn a_robot_that_comes_later_is_found() {
    let link = unique("later");
    let running = Running::new(&unique("elsewhere"));
    running.until_logged("elsewhere does not exist");
    // A parameter that changes acts at once.
    let device = Value::Text(link.display().to_string());
    running.board.write("pioneer/params/device", &device, 0).unwrap();
    running.until("a reason", || running.text("pioneer/status/text").contains("later does not exist"));
    let mut options = ControllerOptions { link: Some(link.clone()), ..ControllerOptions::default() };
    options.faults.silent = true;
    let controller = Controller::start(options).unwrap();
    running.until("a reason", || running.text("pioneer/status/text").contains("does not answer"));
    controller.set_faults(Faults::default());
    running.until("a connection", || running.is_up());
    let told =
        running.log.lines().iter().filter(|record| record.text.contains("later does not exist")).count();
    assert_eq!(told, 1, "each reason is told once");
}

#[test]
fn a_wall_presses_the_bumper_and_the_robot_can_back_off() {
    let link = unique("wall");
    // Not half a meter before the wall in the east.
    let controller = controller(&link, [1.9, 0.8, 0.0], Faults::default());
    let running = Running::connected(&link);
    running.drive(FAST, FAST);
    running.until("a bump", || running.number("pioneer/bumper/front") == 1.0);
    running.until_logged("stalled");
    running.until("a stall", || running.number("pioneer/status/left_stalled") == 1.0);
    assert_eq!(running.number("pioneer/bumper/back"), 0.0);
    running.drive(-2.0, -2.0);
    running.until("freedom", || {
        running.number("pioneer/bumper/front") == 0.0 && running.number("pioneer/status/left_stalled") == 0.0
    });
    // The stop button ends all motion, and only a person starts the motors again.
    controller.set_stop_button(true);
    running.until("the button", || running.number("pioneer/status/stop_button") == 1.0);
    running.until_logged("switched off at the robot");
    controller.set_stop_button(false);
    running.until("its release", || running.number("pioneer/status/stop_button") == 0.0);
    assert!(!controller.motors());
    controller.press_motors_button();
    running.until("motion", || controller.wheels().0 < -0.1);
}

#[test]
fn devices_that_are_none_are_refused_in_words() {
    let refused = |path: &Path, baud| Port::open(path, baud).unwrap_err();
    let missing = unique("missing");
    assert_eq!(refused(&missing, 9600), PortError::Missing(missing.clone()));
    assert!(refused(&missing, 9600).to_string().contains("plugged in"));
    assert_eq!(refused(Path::new("/dev/null"), 9600), PortError::NotSerial("/dev/null".into()));
    assert_eq!(refused(&std::env::temp_dir(), 9600), PortError::NotSerial(std::env::temp_dir()));
    let controller = Controller::start(ControllerOptions::default()).unwrap();
    let first = Port::open(controller.path(), 9600).unwrap();
    assert_eq!(refused(controller.path(), 9600), PortError::Busy(controller.path().into()));
    drop(first);
    Port::open(controller.path(), 115_200).unwrap();
}

#[test]
fn a_model_that_is_not_known_is_refused_before_anything_starts() {
    let configuration = configured(Path::new("/dev/ttyUSB0"), "params.model = \"p4dx\"");
    let plugins = [slate_arcos::plugin(), slate_module::Plugin::linked::<Pilot>()];
    let error = Agent::load(&configuration, &plugins, slate_runtime::Options::default()).unwrap_err();
    assert!(format!("{error:?}").contains("p3dx-sh"), "{error:?}");
}
