//! Published program of RoCS's authors, thread by thread, in EXP1's scene.
//! `cargo run --release -p slate-exp1 --example published -- 100` runs it for 100 seeds.
//!
//! Its Monitors, Analyzes, Plan, ReactiveModel and Execute are threads that sleep 50 ms between two steps. Each reads what the
//! one before published last, and wheels keep their speed until the next command. Its Plan goes round four corners; the
//! table also has the origin as the goal, and what stands in the way of it. It uses none of Slate's blocks.

use std::collections::VecDeque;
use std::f64::consts::PI;

use slate::blackboard::interface::Value;
use slate::interfaces::{Echo, SonarScan};
use slate::module::{Random, Sequence, math};
use slate::runtime::configuration::{self, Configuration};
use slate::sim::drive::Wheels;
use slate::sim::{Scenario, Simulation};
use slate_avoidance::{Rocs, RocsVariant};

fn main() -> Result<(), String> {
    let seeds = std::env::args().nth(1).unwrap_or_else(|| "100".into());
    let seeds: u64 =
        seeds.parse().map_err(|_| format!("expected a number of seeds such as `100`, found `{seeds}`"))?;
    println!("| goals | difference | runs that reach them | median time | least distance to the last |");
    println!("|---|---|---|---|---|");
    for trial in trials() {
        let runs = (1..=seeds).map(|seed| run(&trial, seed)).collect::<Result<Vec<_>, _>>()?;
        let mut times: Vec<f64> = runs.iter().filter_map(|run| run.reached).collect();
        times.sort_by(f64::total_cmp);
        let median = times.get(times.len() / 2).map_or("-".into(), |time| format!("{time:.1} s"));
        let nearest = runs.iter().map(|run| run.nearest).fold(f64::INFINITY, math::min);
        let goals = if trial.goals.len() > 1 { "four corners" } else { "origin" };
        println!("| {goals} | {} | {} of {seeds} | {median} | {nearest:.2} m |", trial.name, times.len());
    }
    Ok(())
}

/// Program under one condition.
pub struct Trial {
    /// Name of the difference from the published program and scene.
    pub name: &'static str,
    /// Goals in sequence, meters.
    pub goals: &'static [[f64; 2]],
    /// Settings of the experiment.
    pub sets: &'static [&'static str],
    /// Program's law.
    pub variant: RocsVariant,
    /// Pause of the threads, seconds of the simulator.
    pub pause: f64,
}

/// Returns the conditions of the table.
pub fn trials() -> Vec<Trial> {
    let usual = |name, goals| Trial { name, goals, sets: &[], variant: RocsVariant::Rocs, pause: 0.05 };
    let origin = &[[0.0, 0.0]][..];
    vec![
        usual("none", CORNERS),
        // In their logs the robot drives 3 to 7 steps of 50 ms, mostly 3, 4 or 6, between two lines that are 50 ms apart.
        Trial { pause: FAST, ..usual("simulator 4 times as fast as the program, as in their logs", CORNERS) },
        usual("the paper's goal", origin),
        Trial { pause: FAST, ..usual("and simulator 4 times as fast", origin) },
        Trial { variant: RocsVariant::RocsFixed, ..usual("and clamp corrected", origin) },
        Trial { sets: &[AWAY_R1], ..usual("and R1 away", origin) },
        Trial { sets: &[NO_BOX], ..usual("and no box", origin) },
        Trial { sets: &[AWAY_R1, NO_BOX], ..usual("and neither", origin) },
    ]
}

/// Goals of the published Plan.
const CORNERS: &[[f64; 2]] = &[[2.0, 2.0], [2.0, -2.0], [-2.0, 2.0], [-2.0, -2.0]];
const FAST: f64 = 0.2;
const AWAY_R1: &str = "world.layouts.authors.robots.r1={ x = 2.0, y = -2.0, theta = 0.0 }";
const NO_BOX: &str = "world.layouts.authors.bodies=[]";

/// Result of a run.
pub struct Run {
    /// Time at which the last goal was reached, seconds.
    pub reached: Option<f64>,
    /// Least distance of its position to the last goal, meters.
    pub nearest: f64,
}

/// Time for each goal, seconds.
const LIMIT: u64 = 120;
/// Time between two steps of their simulator, nanoseconds.
const STEP: u64 = 50_000_000;
/// Distance at which a goal is reached, meters.
const TOLERANCE: f64 = 0.1;
/// Offset of the authors' body frame behind the axle, meters.
/// Their position is that of the body's frame.
const BODY_FRAME: f64 = 0.0445;

/// Runs the program.
///
/// # Errors
/// When the configuration or the world is wrong.
pub fn run(trial: &Trial, seed: u64) -> Result<Run, String> {
    let scenario = scenario(trial, seed)?;
    let mut simulation = Simulation::new(&scenario.world, &scenario.placements, seed, scenario.step)
        .map_err(|error| error.to_string())?;
    let robot = simulation.robot("r2").ok_or("the world has no robot `r2`")?;
    let mut program = Program::new(trial, seed);
    let mut run = Run { reached: None, nearest: f64::INFINITY };
    let mut seen = Seen::default();
    let (last, limit) =
        (trial.goals.last().ok_or("the trial has no goal")?, LIMIT * trial.goals.len() as u64);
    while simulation.now() < limit * 1_000_000_000 {
        if simulation.now().is_multiple_of(STEP) {
            simulation.sense();
            seen = observe(&simulation, robot);
            run.nearest = math::min(run.nearest, seen.distance(*last));
            simulation.command(robot, program.wheels);
        }
        let now = simulation.now() as f64 * 1e-9;
        program.step(now, &seen);
        if program.goals.is_empty() {
            run.reached = Some(now);
            break;
        }
        simulation.step();
    }
    Ok(run)
}

fn scenario(trial: &Trial, seed: u64) -> Result<Scenario, String> {
    let sets = ["world.layout=authors"].iter().chain(trial.sets).map(|set| (*set).to_owned());
    let options = configuration::Options {
        sets: sets.collect(),
        extra_tables: ["world", "report"].map(Into::into).to_vec(),
        ..configuration::Options::default()
    };
    let configuration = Configuration::from_text("exp1.toml", slate_exp1::CONFIGURATION, &options)
        .map_err(|error| error.to_string())?;
    let world = configuration.table("world").ok_or("the configuration has no [world]")?;
    Scenario::new(&Value::from(world), seed).map_err(|error| error.to_string())
}

/// Sensor readings in a step of the simulator.
#[derive(Clone, Copy, Default)]
struct Seen {
    sonar: SonarScan,
    x: f64,
    y: f64,
    theta: f64,
}

impl Seen {
    fn distance(&self, [x, y]: [f64; 2]) -> f64 {
        math::hypot(x - self.x, y - self.y)
    }
}

fn observe(simulation: &Simulation, robot: usize) -> Seen {
    let pose = simulation.pose(robot);
    let mut sonar = SonarScan::default();
    if let Some((echoes, _)) = simulation.sonar(robot) {
        let echoes = echoes.iter().map(|echo| Echo { range: echo.range, heard: echo.heard.into() });
        sonar.echoes = Sequence::new(&echoes.collect::<Vec<_>>());
    }
    let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
    let (x, y) = (pose.x - BODY_FRAME * cosine, pose.y - BODY_FRAME * sine);
    Seen { sonar, x, y, theta: pose.theta }
}

/// Action of the published program.
#[derive(Clone, Copy)]
enum Action {
    /// Drive from a pose towards the goal.
    GoToPosition { from: [f64; 3] },
    /// Turn by an angle, with the wheels' common and opposite velocity.
    TurnToAngle { angle: f64, base: f64, turn: f64 },
    /// `GoAhead`, `Turn`, `Stop` and the reflex.
    SetWheels(Wheels),
}

/// Number of their threads: the Monitors are one here, and so are the Analyzes.
const THREADS: usize = 5;
const MONITOR: usize = 0;
const ANALYZE: usize = 1;
const REACTIVE: usize = 2;
const PLAN: usize = 3;

struct Program {
    /// Goals not reached yet.
    goals: &'static [[f64; 2]],
    law: Rocs,
    random: Random,
    /// Next wake-up time of each thread, seconds.
    wakes: [f64; THREADS],
    pause: f64,
    monitored: Option<Seen>,
    analyzed: Option<Seen>,
    /// Pipeline, and the priority that it assumes for its head.
    actions: VecDeque<(f64, Action)>,
    top: f64,
    wheels: Wheels,
}

impl Program {
    fn new(trial: &Trial, seed: u64) -> Self {
        let mut random = Random::new(seed, "published");
        Self {
            goals: trial.goals,
            law: Rocs { variant: trial.variant },
            wakes: std::array::from_fn(|_| random.uniform(0.0, trial.pause)),
            random,
            pause: trial.pause,
            monitored: None,
            analyzed: None,
            actions: VecDeque::new(),
            top: 0.0,
            wheels: Wheels::default(),
        }
    }

    /// Runs the threads whose pause is over.
    /// They run in the order in which they wake up.
    fn step(&mut self, now: f64, seen: &Seen) {
        loop {
            let (mut thread, mut wakes) = (0, f64::INFINITY);
            for (index, time) in self.wakes.iter().enumerate() {
                (thread, wakes) = if *time < wakes { (index, *time) } else { (thread, wakes) };
            }
            if wakes > now {
                return;
            }
            // Work and the scheduler take up to 4 % more.
            self.wakes[thread] += self.pause * self.random.uniform(1.0, 1.04);
            match thread {
                MONITOR => self.monitored = Some(*seen),
                ANALYZE => self.analyzed = self.monitored,
                REACTIVE => self.react(),
                PLAN => self.plan(),
                _ => self.execute(),
            }
        }
    }

    fn react(&mut self) {
        if let Some(speeds) = self.monitored.and_then(|seen| self.law.react(&seen.sonar)) {
            let wheels = Wheels { left: speeds.left, right: speeds.right };
            self.push(60.0, Action::SetWheels(wheels));
        }
    }

    fn plan(&mut self) {
        if let Some(seen) = self.analyzed.filter(|_| self.actions.is_empty()) {
            if self.goals.first().is_some_and(|goal| seen.distance(*goal) < TOLERANCE) {
                self.goals = &self.goals[1..];
            }
            self.push(1.0, Action::GoToPosition { from: [seen.x, seen.y, seen.theta] });
        }
    }

    /// Pushes an action: a higher priority clears the Pipeline, a lower is dropped.
    /// The priority is compared with the head's. The head's is known from the last time that an action was taken only,
    /// so that a plan also clears a reflex.
    fn push(&mut self, priority: f64, action: Action) {
        if priority > self.top {
            self.actions.clear();
        }
        if priority >= self.top {
            self.actions.push_back((priority, action));
        }
    }

    fn execute(&mut self) {
        let Some((_, action)) = self.actions.pop_front() else { return };
        self.top = self.actions.front().map_or(0.0, |(priority, _)| *priority);
        match action {
            Action::SetWheels(wheels) => self.wheels = wheels,
            Action::GoToPosition { from } => self.go_to_position(from),
            Action::TurnToAngle { angle, base, turn } => {
                let turn = math::min(turn, angle.abs() / 2.0 + turn * 0.2);
                let turn = if angle > 0.0 { turn } else { -turn };
                self.push(1.0, Action::SetWheels(Wheels { left: base - turn, right: base + turn }));
            }
        }
    }

    fn go_to_position(&mut self, [x, y, theta]: [f64; 3]) {
        let Some(goal) = self.goals.first() else { return };
        let (dx, dy) = (goal[0] - x, goal[1] - y);
        let mut angle = math::atan2(dy, dx) - theta;
        if angle <= -PI {
            angle += 2.0 * PI;
        } else if angle > PI {
            angle -= 2.0 * PI;
        }
        let action = if math::hypot(dx, dy) < TOLERANCE {
            Action::SetWheels(Wheels::default())
        } else if angle.abs() > 0.2 {
            Action::TurnToAngle { angle, base: 0.0, turn: 1.2 }
        } else if angle.abs() > 0.1 {
            Action::TurnToAngle { angle, base: 2.0, turn: 2.0 }
        } else {
            Action::SetWheels(Wheels { left: 1.0, right: 1.0 })
        };
        self.push(1.0, action);
    }
}
