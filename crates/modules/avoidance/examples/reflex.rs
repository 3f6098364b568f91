//! Runs EXP1 or EXP2 many times in the bare simulator with the reflex law and prints how it did:
//! `cargo run --release -p slate-avoidance --example reflex -- [exp1|authors|exp2] [first seed] [runs] [rules as JSON]`.

use std::error::Error;

use serde_json::json;
use slate_avoidance::{
    Disc, Footprint, Maneuver, ROBOT_SENSOR, ReflexInput, ReflexRules, SONAR, SensorRule, approach_speed,
    react,
};
use slate_interfaces::{Chassis, Echo, Pose2, SonarPlacement, SonarScan};
use slate_module::blackboard::interface::Value;
use slate_module::{Bool, Sequence, Text, math};
use slate_sim::Simulation;
use slate_sim::drive::Wheels;
use slate_sim::scenario::Scenario;
use slate_sim::shortest_path::shortest_path;

const TICK: f64 = 0.02;
const TIME_LIMIT: f64 = 120.0;
const REACHED: f64 = 0.1;
/// Time for which a route must hold to count, seconds.
const HELD: f64 = 0.2;

#[derive(Default)]
struct Run {
    seed: u64,
    reached: bool,
    time: f64,
    length: f64,
    reactive: f64,
    shortest: f64,
    clearance: f64,
    caused: Vec<(f64, String)>,
    contacts: usize,
    changes: u32,
    held: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument =
        |index: usize, default: &str| arguments.get(index).map_or(default, String::as_str).to_owned();
    let scene = argument(0, "exp1");
    let (first, runs): (u64, u64) = (argument(1, "1001").parse()?, argument(2, "200").parse()?);
    let rules = rules(&serde_json::from_str(&argument(3, "{}"))?);
    let outcomes: Vec<_> = std::thread::scope(|scope| {
        let halves: Vec<_> = (0..2)
            .map(|half| {
                let (scene, rules) = (&scene, &rules);
                scope.spawn(move || {
                    (first..first + runs)
                        .filter(|seed| seed % 2 == half)
                        .map(|seed| run(seed, scene, rules).map_err(|error| format!("seed {seed}: {error}")))
                        .collect::<Vec<_>>()
                })
            })
            .collect();
        halves.into_iter().flat_map(|half| half.join().unwrap_or_default()).collect()
    });
    let mut results = outcomes.into_iter().collect::<Result<Vec<_>, _>>()?;
    results.sort_by_key(|run| run.seed);
    report(&results, std::env::var("QUIET").is_ok());
    Ok(())
}

fn report(results: &[Run], quiet: bool) {
    let count = results.len() as f64;
    let spl = |run: &Run| run.shortest / math::max(run.length, run.shortest);
    let good = |run: &Run| run.reached && run.caused.is_empty();
    for run in results.iter().filter(|run| !quiet && (!good(run) || spl(run) < 0.6)) {
        println!(
            "seed {}: reached {} after {:.1} s, spl {:.2}, clearance {:.3}, changes {}, {:.2?}",
            run.seed,
            run.reached,
            run.time,
            spl(run),
            run.clearance,
            run.changes,
            run.caused
        );
    }
    let median = |value: &dyn Fn(&Run) -> f64| {
        let mut values: Vec<f64> = results.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    println!(
        "success {:.1} %, reached {}, runs with cause {}, SPL {:.3}, share {:.1} %, changes {}, held {:.3}, time {:.1} s, contacts {}",
        100.0 * results.iter().filter(|run| good(run)).count() as f64 / count,
        results.iter().filter(|run| run.reached).count(),
        results.iter().filter(|run| !run.caused.is_empty()).count(),
        results.iter().filter(|run| good(run)).map(spl).sum::<f64>() / count,
        100.0 * median(&|run| run.reactive / math::max(run.length, 1e-9)),
        median(&|run| f64::from(run.changes)),
        results.iter().map(|run| run.held).sum::<f64>() / count,
        median(&|run| run.time),
        results.iter().map(|run| run.contacts).sum::<usize>(),
    );
}

/// The rules with values by name; `reaction_distance` and `yield_distance` are those of the sensors.
fn rules(values: &std::collections::BTreeMap<String, f64>) -> ReflexRules {
    let value = |name: &str, default: f64| values.get(name).copied().unwrap_or(default);
    let rule = |sensor: &str, distance: f64| SensorRule { distance, sensor: Text::new(sensor) };
    ReflexRules {
        reaction_time: value("reaction_time", 0.0),
        side_clearance: value("side_clearance", 0.03),
        min_clearance: value("min_clearance", 0.03),
        free_distance: value("free_distance", 0.6),
        turn_clearance: value("turn_clearance", 0.02),
        drive_distance: value("drive_distance", 0.2),
        linear_velocity: value("linear_velocity", 0.3),
        sensors: Sequence::new(&[
            rule(SONAR, value("reaction_distance", 0.2)),
            rule(ROBOT_SENSOR, value("yield_distance", 0.45)),
        ]),
    }
}

fn world(scene: &str) -> serde_json::Value {
    let profile = std::env::var("PROFILE").unwrap_or("vrep".into());
    match scene {
        "exp2" => json!({
            "arena": "rocs_arena", "layout": "random", "sonar": profile, "robot_sensor": profile,
            "goal": [1.2, 1.2],
            "robots": {
                "r1": { "model": "pioneer_p3dx", "script": { "wheel_speed": 1.2 } },
                "r3": { "model": "summit_xl" },
            },
            "random": {
                "robot": "r3", "disturber": "r1",
                "start": [-1.8, -1.2, -1.8, -1.2], "disturber_start": [-0.9, 0.9, -0.9, 0.9],
                "box_size": 0.5, "box_offset": 0.3, "start_clearance": 0.3,
            },
        }),
        _ => json!({
            "arena": "rocs_arena", "layout": if scene == "authors" { "authors" } else { "random" },
            "sonar": profile, "goal": [0.0, 0.0],
            "robots": {
                "r1": { "model": "pioneer_p3dx", "script": { "wheel_speed": 1.2 } },
                "r2": { "model": "pioneer_p3dx" },
            },
            "random": {
                "robot": "r2", "disturber": "r1",
                "start": [-2.0, 2.0, 1.98, 2.3], "disturber_start": [-1.5, 1.5, 0.3, 1.7],
                "box_size": 0.5, "box_offset": 0.3, "start_clearance": 0.03,
            },
            "layouts": { "authors": {
                "robots": { "r1": { "x": 0.3, "y": 1.9, "theta": 0.0 }, "r2": { "x": 0.6, "y": 0.8, "theta": 0.0 } },
                "bodies": [{ "name": "box", "center": [-0.45, 0.275], "size": [0.5, 0.5] }],
            } },
        }),
    }
}

/// A turn on the spot as the action `TurnAngle` does it.
#[derive(Clone, Copy, Debug)]
struct Turning {
    heading: f64,
    speed: f64,
}

impl Turning {
    fn to(pose: Pose2, angle: f64, speed: f64) -> Self {
        Self { heading: math::wrap_angle(pose.theta + angle), speed }
    }

    fn step(&self, pose: Pose2) -> Option<f64> {
        let error = math::angle_between(pose.theta, self.heading);
        (error.abs() >= 0.1).then(|| math::clamp(4.0 * error, -self.speed, self.speed))
    }
}

#[derive(Clone, Copy, Debug)]
enum Running {
    Idle,
    Plan { turn: Option<Turning>, speed: f64 },
    Reflex { turn: Option<Turning>, maneuver: Maneuver, left: f64 },
}

fn wheels(chassis: &Chassis, linear: f64, angular: f64) -> Wheels {
    let side = 0.5 * chassis.track * angular;
    Wheels { left: (linear - side) / chassis.wheel_radius, right: (linear + side) / chassis.wheel_radius }
}

fn run(seed: u64, scene: &str, rules: &ReflexRules) -> Result<Run, Box<dyn Error>> {
    let name = if scene == "exp2" { "r3" } else { "r2" };
    let table: Value = serde_json::from_value(world(scene))?;
    let scenario = Scenario::new(&table, seed)?;
    let goal = scenario.goal;
    let mut simulation = Simulation::new(&scenario.world, &scenario.placements, seed, scenario.step)?;
    let robot = simulation.robot(name).ok_or("no robot")?;
    let description = &scenario.placements[robot].description;
    let chassis = description.chassis();
    let corners: Vec<_> = chassis.outline.iter().map(|corner| [corner.x, corner.y]).collect();
    let footprint = Footprint::new(&corners)?;
    let half_width = corners.iter().map(|corner| corner[1]).fold(0.0, math::max);
    let start = simulation.pose(robot).point();
    let shortest = shortest_path(&scenario.static_outlines(), start, goal, half_width).ok_or("no way")?;
    let acceleration = chassis.maximum_wheel_acceleration * chassis.wheel_radius;
    let deceleration = math::min(0.8, acceleration);

    let mut result = Run { seed, shortest, clearance: f64::INFINITY, ..Run::default() };
    let mut running = Running::Idle;
    let mut crowded = false;
    // The counted route, the present one and since when.
    let (mut route, mut present, mut since) = (None, None, 0.0);
    let trace = std::env::var("TRACE").is_ok();
    let hold = if name == "r3" { 60.0 } else { 0.0 };
    let mut arrived: Option<f64> = None;
    let (mut stay, mut near_goal) = (0u32, 0u32);
    let placed = simulation.pose(robot);
    let mut pose = Pose2 { x: placed.x, y: placed.y, theta: placed.theta };
    while result.time < TIME_LIMIT || arrived.is_some() {
        let fix = simulation.fix(robot);
        if let Some(position) = fix.position {
            (pose.x, pose.y) = (position.x, position.y);
        }
        pose.theta = fix.orientation.unwrap_or(pose.theta);
        let scan = scan(&simulation, robot).ok_or("no sonar")?;
        let robots = simulation.robot_sensor(robot).map_or(&[][..], |sensor| sensor.sightings());
        let robots = robots.iter().map(|seen| Disc {
            x: seen.range * math::cos(seen.bearing),
            y: seen.range * math::sin(seen.bearing),
            radius: 0.28,
        });
        let (_, (speed, _)) = simulation.odometry(robot);
        let measured = ReflexInput::new(&scan, robots, speed);
        let nearest = scan
            .echoes
            .iter()
            .filter(|echo| echo.heard.get())
            .fold(scan.range_max, |least, echo| math::min(least, echo.range));
        let was_crowded = crowded;
        crowded = nearest < if crowded { 0.8 } else { 0.6 };
        // The reflex.
        if let Some(maneuver) = react(rules, &footprint, &measured) {
            let turn = Turning::to(pose, maneuver.angle, 1.0);
            let begun = Running::Reflex { turn: Some(turn), maneuver, left: maneuver.duration };
            running = match running {
                Running::Reflex { turn: Some(old), maneuver: last, .. }
                    if last.angle * maneuver.angle < 0.0 =>
                {
                    Running::Reflex { turn: Some(old), maneuver: last, left: last.duration }
                }
                _ => begun,
            };
        }
        let distance = math::hypot(goal.x - pose.x, goal.y - pose.y);
        let idle = matches!(running, Running::Idle);
        let deliberative = matches!(running, Running::Plan { .. });
        if (idle && distance > if arrived.is_some() { 0.15 } else { 0.05 })
            || (deliberative && was_crowded != crowded)
        {
            running = Running::Plan { turn: None, speed: if crowded { 0.3 } else { 0.4 } };
        }
        let mut command = Wheels::default();
        let mut next = running;
        match &mut next {
            Running::Idle => {}
            Running::Plan { turn, speed } => {
                let error = math::angle_between(pose.theta, math::atan2(goal.y - pose.y, goal.x - pose.x));
                if distance < 0.05 {
                    next = Running::Idle;
                } else {
                    if turn.is_none() && error.abs() > 0.2 {
                        *turn = Some(Turning::to(pose, error, 1.2));
                    }
                    match turn.and_then(|turn| turn.step(pose)) {
                        Some(angular) => command = wheels(&chassis, 0.0, angular),
                        None => {
                            *turn = None;
                            let linear = approach_speed(*speed, distance, deceleration);
                            command = wheels(&chassis, linear, math::clamp(2.0 * error, -1.5, 1.5));
                        }
                    }
                }
            }
            Running::Reflex { turn, maneuver, left } => match turn.and_then(|turn| turn.step(pose)) {
                Some(angular) => command = wheels(&chassis, 0.0, angular),
                None => {
                    *turn = None;
                    if *left <= 0.0 {
                        next = Running::Idle;
                    } else {
                        *left -= TICK;
                        command = wheels(&chassis, maneuver.linear, 0.0);
                    }
                }
            },
        }
        let reactive = matches!(next, Running::Reflex { .. });
        if trace {
            let other = simulation.pose(1 - robot);
            println!(
                "{:6.2} ({:.2} {:.2} {:.2}) {next:.2?} clearance {:.3} r1 ({:.2} {:.2} {:.2})",
                result.time,
                pose.x,
                pose.y,
                pose.theta,
                simulation.clearance(robot),
                other.x,
                other.y,
                other.theta,
            );
        }
        running = next;
        let now = (!matches!(running, Running::Idle)).then_some(reactive);
        if now != present {
            (present, since) = (now, result.time);
        }
        if present.is_some() && present != route && result.time - since >= HELD && arrived.is_none() {
            result.changes += u32::from(route.is_some());
            route = present;
        }
        simulation.command(robot, command);
        let before = simulation.pose(robot).point();
        for _ in 0..2 {
            simulation.step();
        }
        simulation.sense();
        result.time += TICK;
        let here = simulation.pose(robot).point();
        let way = here.minus(before).norm();
        if arrived.is_none() {
            result.length += way;
            result.reactive += if reactive { way } else { 0.0 };
        }
        result.clearance = math::min(result.clearance, simulation.clearance(robot));
        for contact in simulation.take_contacts() {
            let own = contact.robot == name;
            if own || contact.other == name {
                let caused = if own { contact.caused } else { contact.caused_by_other };
                if trace {
                    println!("{contact:?}");
                }
                result.contacts += 1;
                if caused {
                    result.caused.push((result.time, if own { contact.other } else { contact.robot }));
                }
            }
        }
        let away = math::hypot(here.x - goal.x, here.y - goal.y);
        if arrived.is_none() && away <= REACHED {
            arrived = Some(result.time);
        }
        if let Some(arrived) = arrived {
            stay += 1;
            near_goal += u32::from(away <= 0.3);
            result.held = f64::from(near_goal) / f64::from(stay);
            if result.time - arrived >= hold {
                result.reached = hold == 0.0 || result.held >= 0.9;
                break;
            }
        }
    }
    if trace {
        println!("{:?}", scenario.world.bodies.last());
    }
    Ok(result)
}

fn scan(simulation: &Simulation, robot: usize) -> Option<SonarScan> {
    let (echoes, ring) = simulation.sonar(robot)?;
    let description = ring.description();
    let placements: Vec<_> = description
        .placements
        .iter()
        .map(|[x, y, degrees]| SonarPlacement { x: *x, y: *y, theta: degrees.to_radians() })
        .collect();
    let echoes: Vec<_> =
        echoes.iter().map(|echo| Echo { range: echo.range, heard: Bool::from(echo.heard) }).collect();
    Some(SonarScan {
        field_of_view: description.field_of_view,
        range_min: description.range_min,
        range_max: description.range_max,
        placements: Sequence::new(&placements),
        echoes: Sequence::new(&echoes),
    })
}
