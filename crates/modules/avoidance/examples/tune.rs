//! Monte Carlo evaluation of the avoidance in the first experiment's world.
//! Runs the bare simulator many times and prints the result: `cargo run --release -p slate-avoidance --example tune --
//! [avoider|rocs|rocs-fixed|none] [first seed] [runs] [sonar profile] [parameters as JSON]`.

// The wall time of a step is one of the figures.
#![allow(clippy::disallowed_methods)]

use std::error::Error;
use std::time::Instant;

use slate_avoidance::{Avoider, Decision, Footprint, Parameters, Rocs, RocsVariant};
use slate_interfaces::{Echo, Point2, Pose2, SonarPlacement, SonarScan, Twist2, WheelSpeeds};
use slate_module::{Bool, Random, Sequence, math};
use slate_sim::drive::Wheels;
use slate_sim::geometry::{Point, Polygon};
use slate_sim::layout::ObstructedWay;
use slate_sim::robot::RobotDescription;
use slate_sim::script::RandomWalk;
use slate_sim::shortest_path::shortest_path;
use slate_sim::world::{Body, World};
use slate_sim::{Placement, Simulation};
use slate_sorted::SortedMap;

const STEP: u64 = 10_000_000;
const TICK: f64 = 0.02;
const TIME_LIMIT: f64 = 120.0;
const REACHED: f64 = 0.1;

#[derive(Clone, Copy)]
enum Controller {
    Avoider,
    Rocs(RocsVariant),
    None,
}

#[derive(Default)]
struct Result {
    seed: u64,
    reached: bool,
    time: f64,
    length: f64,
    shortest: f64,
    clearance: f64,
    contacts: Vec<(f64, String, bool)>,
    switches: u32,
    microseconds: f64,
    ticks: u32,
}

fn main() -> std::result::Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument =
        |index: usize, default: &str| arguments.get(index).map_or(default, String::as_str).to_owned();
    let controller = match argument(0, "avoider").as_str() {
        "avoider" => Controller::Avoider,
        "rocs" => Controller::Rocs(RocsVariant::Rocs),
        "rocs-fixed" => Controller::Rocs(RocsVariant::RocsFixed),
        _ => Controller::None,
    };
    let (first, runs): (u64, u64) = (argument(1, "1").parse()?, argument(2, "200").parse()?);
    let profile = argument(3, "vrep");
    let parameters: Parameters = serde_json::from_str(&argument(4, "{}"))?;
    let mut results = Vec::new();
    let outcomes: Vec<_> = std::thread::scope(|scope| {
        let halves: Vec<_> = (0..2)
            .map(|half| {
                let (profile, parameters) = (&profile, parameters);
                scope.spawn(move || {
                    (first..first + runs)
                        .filter(|seed| seed % 2 == half)
                        .map(|seed| {
                            run(seed, controller, profile, &parameters)
                                .map_err(|error| format!("seed {seed}: {error}"))
                        })
                        .collect::<Vec<_>>()
                })
            })
            .collect();
        halves.into_iter().flat_map(|half| half.join().unwrap_or_default()).collect()
    });
    for outcome in outcomes {
        results.push(outcome?);
    }
    results.sort_by_key(|result| result.seed);
    report(&results);
    Ok(())
}

fn report(results: &[Result]) {
    let count = results.len() as f64;
    for result in results {
        let caused = result.contacts.iter().any(|contact| contact.2);
        let spl = result.shortest / math::max(result.length, result.shortest);
        if !result.reached || caused || spl < 0.6 {
            let Result { seed, reached, time, clearance, .. } = result;
            let contacts = result.contacts.iter().filter(|contact| contact.2).collect::<Vec<_>>();
            println!(
                "seed {seed}: reached {reached} after {time:.1} s, spl {spl:.2}, clearance {clearance:.3}, {contacts:.2?}"
            );
        }
    }
    let reached = results.iter().filter(|result| result.reached).count();
    let caused: usize =
        results.iter().map(|result| result.contacts.iter().filter(|contact| contact.2).count()).sum();
    let contacts: usize = results.iter().map(|result| result.contacts.len()).sum();
    let spl: f64 = results
        .iter()
        .filter(|result| result.reached)
        .map(|result| result.shortest / math::max(result.length, result.shortest))
        .sum();
    let kilometers: f64 = results.iter().map(|result| result.length / 1000.0).sum();
    let mut times: Vec<f64> = results.iter().map(|result| result.time).collect();
    times.sort_by(f64::total_cmp);
    let time = |part: f64| times.get((part * (count - 1.0)) as usize).copied().unwrap_or_default();
    let microseconds: f64 = results.iter().map(|result| result.microseconds).sum();
    let ticks: u32 = results.iter().map(|result| result.ticks).sum();
    let switches: u32 = results.iter().map(|result| result.switches).sum();
    println!(
        "reached {reached}/{}, caused {caused} ({:.2}/km), contacts {contacts}, SPL {:.3}, time median {:.1} s 95 % {:.1} s, {:.1} switches a run, {:.2} us a tick",
        results.len(),
        caused as f64 / kilometers,
        spl / count,
        time(0.5),
        time(0.95),
        f64::from(switches) / count,
        microseconds / f64::from(ticks),
    );
}

fn run(
    seed: u64,
    controller: Controller,
    profile: &str,
    parameters: &Parameters,
) -> std::result::Result<Result, Box<dyn Error>> {
    let description = RobotDescription::named("pioneer_p3dx").ok_or("no pioneer_p3dx")??;
    let mut world = World::named("rocs_arena").ok_or("no rocs_arena")??;
    let rules = ObstructedWay {
        robot: "r2".into(),
        disturber: "r1".into(),
        start: [-2.0, 2.0, 1.98, 2.3],
        disturber_start: [-1.5, 1.5, 0.3, 1.7],
        box_size: 0.5,
        box_offset: 0.3,
        start_clearance: 0.03,
    };
    let outlines =
        SortedMap::from([("r1".into(), description.outline()), ("r2".into(), description.outline())]);
    let goal = Point2 { x: 0.0, y: 0.0 };
    let layout =
        rules.lay_out(&world, &outlines, Point::new(goal.x, goal.y), &mut Random::new(seed, "layout"))?;
    world.bodies.extend(layout.bodies.clone());
    let robots: Vec<_> = layout
        .robots
        .iter()
        .map(|(name, pose)| Placement {
            name: name.clone(),
            description: description.clone(),
            sonar: profile.to_owned(),
            pose: *pose,
            script: (name == "r1").then(RandomWalk::default),
        })
        .collect();
    let mut simulation = Simulation::new(&world, &robots, seed, STEP)?;
    let robot = simulation.robot("r2").ok_or("no r2")?;
    let bodies: Vec<Polygon> = world.bodies.iter().filter_map(Body::polygon).collect();
    let footprint = Footprint::new(&description.footprint)?;
    let outline = footprint.clone();
    let half_width = footprint.half_width();
    let start = simulation.pose(robot).point();
    let shortest = shortest_path(&bodies, start, Point::new(goal.x, goal.y), half_width).ok_or("no way")?;

    let mut avoider = Avoider::new(footprint);
    let mut result = Result { seed, shortest, clearance: f64::INFINITY, ..Result::default() };
    let mut was_clear = true;
    let trace = std::env::var("TRACE").is_ok();
    while result.time < TIME_LIMIT {
        let pose = simulation.pose(robot);
        let pose = Pose2 { x: pose.x, y: pose.y, theta: pose.theta };
        let scan = scan(&simulation, robot).ok_or("no sonar")?;
        let planned = plan(pose, goal, parameters);
        let begin = Instant::now();
        let decision = match controller {
            Controller::Avoider => {
                avoider.update_map(pose, &scan, parameters, result.time);
                match avoider.steer(pose, goal, parameters, result.time) {
                    Decision::Clear => None,
                    Decision::Avoid(twist) => Some(wheels(twist)),
                }
            }
            Controller::Rocs(variant) => Rocs { variant }.react(&scan),
            Controller::None => None,
        };
        // A step that another process interrupted says nothing.
        let elapsed = begin.elapsed().as_secs_f64() * 1e6;
        if elapsed < 400.0 {
            result.microseconds += elapsed;
        }
        result.ticks += 1;
        result.switches += u32::from(decision.is_none() != was_clear);
        was_clear = decision.is_none();
        let command = decision.unwrap_or_else(|| wheels(planned));
        if trace && result.ticks.is_multiple_of(5) {
            let linear = 0.5 * 0.0975 * (command.left + command.right);
            let angular = 0.0975 * (command.right - command.left) / 0.331;
            let other = simulation.pose(1 - robot);
            println!(
                "{:6.2} ({:.2} {:.2} {:.2}) {} v {linear:.2} w {angular:.2} clearance {:.3} r1 ({:.2} {:.2} {:.2}) marks {} heard {:.3} {:?}",
                result.time,
                pose.x,
                pose.y,
                pose.theta,
                if was_clear { "clear" } else { "avoid" },
                simulation.clearance(robot),
                other.x,
                other.y,
                other.theta,
                avoider.map().obstacles().count(),
                nearest_mark(&avoider, &outline, pose, result.time).0,
                nearest_mark(&avoider, &outline, pose, result.time).1,
            );
        }
        simulation.command(robot, Wheels { left: command.left, right: command.right });
        let before = simulation.pose(robot).point();
        for _ in 0..2 {
            simulation.step();
        }
        simulation.sense();
        result.time += TICK;
        let here = simulation.pose(robot).point();
        result.length += here.minus(before).norm();
        result.clearance = math::min(result.clearance, simulation.clearance(robot));
        for contact in simulation.take_contacts() {
            let own = contact.robot == "r2";
            if own || contact.other == "r2" {
                let caused = if own { contact.caused } else { contact.caused_by_other };
                if trace {
                    println!("{contact:?}");
                }
                result.contacts.push((result.time, if own { contact.other } else { contact.robot }, caused));
            }
        }
        if math::hypot(here.x - goal.x, here.y - goal.y) <= REACHED {
            result.reached = true;
            break;
        }
    }
    if trace {
        println!("box {:?}", layout.bodies);
        for mark in avoider.map().obstacles() {
            println!("mark {:.2} {:.2}", mark.x, mark.y);
        }
    }
    Ok(result)
}

/// Returns the twist of a planner without obstacle avoidance.
/// It turns to the goal and drives there.
fn plan(pose: Pose2, goal: Point2, parameters: &Parameters) -> Twist2 {
    let bearing = math::angle_between(pose.theta, math::atan2(goal.y - pose.y, goal.x - pose.x));
    if bearing.abs() > parameters.heading_tolerance {
        Twist2 {
            linear: 0.0,
            angular: if bearing > 0.0 {
                parameters.max_angular_velocity
            } else {
                -parameters.max_angular_velocity
            },
        }
    } else {
        Twist2 { linear: parameters.max_linear_velocity, angular: bearing }
    }
}

fn wheels(twist: Twist2) -> WheelSpeeds {
    let side = 0.5 * 0.331 * twist.angular;
    WheelSpeeds { left: (twist.linear - side) / 0.0975, right: (twist.linear + side) / 0.0975 }
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

/// Returns distance, and age and position (robot frame), of the nearest mark.
fn nearest_mark(avoider: &Avoider, outline: &Footprint, pose: Pose2, time: f64) -> (f64, [f64; 3]) {
    let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
    avoider.map().obstacles().fold((f64::INFINITY, [0.0; 3]), |least, mark| {
        let (dx, dy) = (mark.x - pose.x, mark.y - pose.y);
        let (x, y) = (cosine * dx + sine * dy, cosine * dy - sine * dx);
        let distance = outline.distance(x, y);
        if distance < least.0 { (distance, [time - mark.since, x, y]) } else { least }
    })
}
