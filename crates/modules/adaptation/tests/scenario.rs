//! EXP1's robot with sensors that fail on the way, and the loop that looks after it.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::ops::Range;
use std::path::PathBuf;
use std::time::Duration;

use slate::blackboard::interface::Value;
use slate::runtime::configuration::{self, Database};
use slate::runtime::log::MemoryTarget;
use slate::runtime::{Agent, Control, Options, Rate};

/// The drive of a seed.
struct Drive {
    agent: Agent,
    log: MemoryTarget,
}

impl Drive {
    fn new(sets: &[&str]) -> Self {
        let path =
            PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../examples/adaptation/adaptation.toml");
        let options = configuration::Options {
            sets: sets.iter().map(|set| (*set).to_owned()).collect(),
            extra_tables: ["world", "report"].map(Into::into).to_vec(),
            ..configuration::Options::default()
        };
        let database = Database::open(path, options).unwrap();
        let plugins = [slate::sim::plugin(), slate_wheeled::plugin(), slate_adaptation::plugin()];
        let log = MemoryTarget::default();
        let options = Options {
            rate: Rate::Max,
            armed: true,
            follows_files: false,
            log: vec![Box::new(log.clone())],
            ..Options::default()
        };
        Self { agent: Agent::load_with(&database, &plugins, options).unwrap(), log }
    }

    fn of(kind: &str, seed: u32, more: &[&str]) -> Self {
        let (kind, seed) = (format!("world.faults.ring.kind={kind}"), format!("agent.seed={seed}"));
        let sets: Vec<&str> = [&*kind, &*seed].into_iter().chain(more.iter().copied()).collect();
        Self::new(&sets)
    }

    fn number(&self, path: &str) -> f64 {
        self.agent.board().read(path).unwrap().and_then(|(value, _)| value.as_f64()).unwrap()
    }

    fn text(&self, path: &str) -> String {
        let value = self.agent.board().read(path).unwrap().map(|(value, _)| value);
        value.as_ref().and_then(Value::as_str).unwrap_or_default().to_owned()
    }

    fn until(&mut self, seconds: f64) {
        while (self.agent.now() as f64) < seconds * 1e9 {
            assert!(self.agent.step());
        }
    }

    /// Runs to the verdict; returns the outcome.
    fn finish(&mut self) -> String {
        while !["SUCCEEDED", "FAILED"].contains(&&*self.text("referee/verdict/state")) {
            assert!(self.agent.step());
        }
        self.text("referee/verdict/outcome")
    }

    /// What the robot's Monitor reads.
    fn source(&self) -> String {
        let links = self.agent.composer().links();
        links.iter().find(|link| link.to == "r2/range_monitor/sonar").unwrap().from.clone()
    }

    /// The first word of each line that the managing loop logs, and the fields of that name.
    fn chain(&self, field: &str) -> Vec<(String, String)> {
        self.agent.logger().flush(Duration::from_secs(10));
        let lines = self.log.lines();
        let own = lines.iter().filter(|line| line.module.starts_with("r2_manager/"));
        own.map(|line| {
            let value = line.fields.iter().find(|(key, _)| key == field).map(|(_, value)| value.clone());
            (line.text.split(':').next().unwrap().to_owned(), value.unwrap_or_default())
        })
        .collect()
    }
}

/// For each seed: the robot reaches its goal and causes no contact, all decisions are logged from the change to the
/// effect, and in the end it drives as it began.
fn is_survived(kind: &str, seeds: Range<u32>) {
    for seed in seeds {
        let mut drive = Drive::of(kind, seed, &[]);
        drive.until(4.0);
        assert_eq!(drive.source(), "/r2/laser_ring/value", "{kind}, seed {seed}: the fault began at 2.5 s");
        assert_eq!(drive.number("r2/planner/params/max_linear_velocity"), 0.15);
        assert_eq!(drive.text("r2_manager/execute/adaptation/progress"), "EFFECTIVE");
        assert_eq!(drive.finish(), "GOAL_REACHED", "{kind}, seed {seed}");
        assert_eq!(drive.source(), "/r2/sonar/value", "{kind}, seed {seed}");
        assert_eq!(drive.number("r2/planner/params/max_linear_velocity"), 0.4);
        let steps: Vec<_> = drive.chain("decision");
        let expected = [
            ("change", ""),
            ("plan", "1"),
            ("action", "1"),
            ("action", "1"),
            ("effect", "1"),
            ("change", ""),
            ("plan", "2"),
            ("action", "2"),
            ("action", "2"),
            ("effect", "2"),
        ];
        let steps: Vec<_> = steps.iter().map(|(step, decision)| (&**step, &**decision)).collect();
        assert_eq!(steps, expected, "{kind}, seed {seed}");
        let changes: Vec<_> =
            drive.chain("change").into_iter().filter(|(step, _)| step != "action").collect();
        assert_eq!(changes[0].1, changes[1].1, "the plan names the change that it answers");
        let conditions: Vec<_> =
            drive.chain("condition").into_iter().map(|(_, condition)| condition).collect();
        assert_eq!(conditions.concat(), format!("{}HEALTHY", kind.to_uppercase()));
    }
}

#[test]
fn a_ring_that_freezes_is_survived() {
    is_survived("frozen", 1..8);
}

#[test]
fn a_ring_that_says_no_numbers_is_survived() {
    is_survived("invalid", 8..15);
}

#[test]
fn a_ring_that_is_late_is_survived() {
    is_survived("late", 15..22);
}

/// No managing loop.
const ALONE: &str = "robots.r2_manager.modules.planner.enabled=false";

/// For how many cycles of four seconds the robot stands while its ring fails.
fn stands(kind: &str, sets: &[&str]) -> usize {
    let mut drive = Drive::of(kind, 1, sets);
    drive.until(3.0);
    let stands = (0..200).filter(|_| {
        assert!(drive.agent.step());
        drive.number("r2/wheels/command/left") == 0.0
    });
    stands.count()
}

#[test]
fn without_the_loop_the_robot_stands_while_its_ring_fails() {
    for kind in ["frozen", "invalid", "late"] {
        assert!(stands(kind, &[ALONE]) > 150, "{kind}");
        assert_eq!(stands(kind, &[]), 0, "{kind}: the loop has given it the laser");
    }
}

#[test]
fn a_run_repeats_its_changes_in_the_same_cycles() {
    let digest = |run: &dyn Fn(&mut Agent)| {
        let mut drive = Drive::of("frozen", 3, &[]);
        run(&mut drive.agent);
        (drive.agent.now(), drive.agent.digest().unwrap(), drive.source())
    };
    let steps = digest(&|agent| (0..250).for_each(|_| assert!(agent.step())));
    assert_eq!(steps.2, "/r2/laser_ring/value");
    assert_eq!(digest(&|agent| (0..250).for_each(|_| assert!(agent.step()))), steps);
    let threads = digest(&|agent| {
        let observer = |cycle: &slate::runtime::Cycle<'_>| {
            if cycle.number < 250 { Control::Continue } else { Control::Stop }
        };
        agent.run(Box::new(observer)).unwrap();
    });
    assert_eq!(threads, steps, "with the loop in a thread of its own");
}

#[test]
fn without_a_sensor_the_robot_stops_until_one_recovers() {
    let laser = "world.faults.laser={ robot = \"r2\", sensor = \"laser\", kind = \"silent\", from = 3.0, until = 5.0 }";
    let mut drive = Drive::of("silent", 1, &[laser]);
    drive.until(3.1);
    assert_eq!(drive.text("r2_manager/execute/adaptation/alternative"), "laser");
    drive.until(4.0);
    assert_eq!(drive.text("r2_manager/execute/adaptation/alternative"), "stand");
    for _ in 0..100 {
        assert!(drive.agent.step());
        assert_eq!(
            [drive.number("r2/wheels/command/left"), drive.number("r2/wheels/command/right")],
            [0.0; 2]
        );
    }
    drive.until(7.5);
    assert_eq!(drive.source(), "/r2/laser_ring/value", "the laser is back since 5 s");
    assert_eq!(drive.finish(), "GOAL_REACHED");
    assert_eq!(drive.source(), "/r2/sonar/value");
}

#[test]
fn when_settings_are_refused_the_next_alternative_is_taken() {
    let wrong = "robots.r2_manager.modules.execute.inputs.alternatives.list=[{ name = \"sonar\", speed = 0.4 }, \
                 { name = \"laser\", speed = 0.15, changes = [\"robots.r2.modules.planner.params.max_linear_velocty=0.15\"] }, \
                 { name = \"stand\", changes = [\"robots.r2.modules.execute.enabled=false\"] }]";
    let mut drive = Drive::of("frozen", 1, &[wrong]);
    drive.until(4.0);
    assert_eq!(drive.source(), "/r2/sonar/value");
    assert_eq!(drive.text("r2_manager/execute/adaptation/alternative"), "stand");
    assert_eq!(drive.text("r2_manager/execute/adaptation/progress"), "EFFECTIVE");
    assert_eq!([drive.number("r2/wheels/command/left"), drive.number("r2/wheels/command/right")], [0.0; 2]);
    let plans = drive.chain("alternative").into_iter().filter(|(step, _)| step == "plan");
    assert_eq!(plans.map(|(_, name)| name).collect::<Vec<_>>(), ["laser", "laser", "laser", "stand"]);
    let lines = drive.log.lines();
    assert!(lines.iter().any(|line| line.text.contains("did you mean `max_linear_velocity`")));
}
