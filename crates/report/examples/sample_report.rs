//! Report of a made-up run, written into a directory to inspect the plots.
//! `cargo run -p slate-report --example sample_report -- /tmp/sample`

use slate_report::{
    Bounds, Cone, Goal, Outcome, Polygon, Report, Robot, Route, Sample, Scene, Summary, Trajectory,
};
use std::{error::Error, path::PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    let directory = std::env::args_os().nth(1).map_or(PathBuf::from("sample"), PathBuf::from);
    let (scene, trajectory, summary) = (scene(), trajectory(), summary());
    Report { summary: &summary, scene: &scene, trajectory: &trajectory }.write(&directory)?;
    print!("{summary}");
    Ok(())
}

fn rectangle(name: &str, x: f64, y: f64, width: f64, height: f64) -> Polygon {
    let (width, height) = (width / 2.0, height / 2.0);
    let points = vec![
        [x - width, y - height],
        [x + width, y - height],
        [x + width, y + height],
        [x - width, y + height],
    ];
    Polygon { name: name.to_owned(), points }
}

fn scene() -> Scene {
    let corners = [[1.7, 1.7], [1.7, -1.7], [-1.7, -1.7], [-1.7, 1.7]];
    let goals = (1..).zip(corners).map(|(number, [x, y])| Goal { label: format!("goal {number}"), x, y });
    Scene {
        bounds: Bounds { minimum: [-2.5, -2.475], maximum: [2.525, 2.525] },
        polygons: vec![
            rectangle("east wall", 2.5, 0.0, 0.05, 5.0),
            rectangle("west wall", -2.475, 0.0, 0.05, 5.0),
            rectangle("north wall", 0.05, 2.5, 5.0, 0.05),
            rectangle("south wall", 0.05, -2.45, 5.0, 0.05),
            rectangle("box", -0.45, 0.275, 0.5, 0.5),
        ],
        circles: vec![],
        goals: goals.collect(),
        robots: vec![
            pioneer("R1", -0.3, -0.9, 2.4),
            pioneer("R2", 0.2, 1.4, 0.3),
            summit("R3", -1.2, 1.5, 0.1),
        ],
        scripted: vec!["R1".to_owned()],
    }
}

fn pioneer(name: &str, x: f64, y: f64, theta: f64) -> Robot {
    let side =
        [[0.19, 0.05], [0.155, 0.11], [0.0975, 0.1905], [-0.0975, 0.1905], [-0.215, 0.13], [-0.265, 0.05]];
    let other = side.iter().rev().map(|[x, y]| [*x, -y]);
    let front = [(0.111, 0.125, 50.0), (0.146, 0.083, 30.0), (0.165, 0.027, 10.0)];
    let cones = front.iter().flat_map(|(x, y, degrees)| [cone(*x, *y, *degrees), cone(*x, -y, -degrees)]);
    Robot {
        name: name.to_owned(),
        x,
        y,
        theta,
        outline: side.iter().copied().chain(other).collect(),
        wheels: vec![[[-0.0975, 0.1405], [0.0975, 0.1905]], [[-0.0975, -0.1905], [0.0975, -0.1405]]],
        cones: cones.collect(),
    }
}

fn summit(name: &str, x: f64, y: f64, theta: f64) -> Robot {
    let wheel = |x: f64, y: f64| [[x - 0.11, y - 0.055], [x + 0.11, y + 0.055]];
    Robot {
        name: name.to_owned(),
        x,
        y,
        theta,
        outline: vec![[0.362, 0.308], [-0.362, 0.308], [-0.362, -0.308], [0.362, -0.308]],
        wheels: vec![wheel(0.229, 0.235), wheel(0.229, -0.235), wheel(-0.229, 0.235), wheel(-0.229, -0.235)],
        cones: vec![cone(0.338, 0.138, 35.0), cone(0.338, -0.012, 0.0), cone(0.338, -0.137, -30.0)],
    }
}

fn cone(x: f64, y: f64, degrees: f64) -> Cone {
    Cone { x, y, direction: degrees.to_radians(), opening: 0.5, range: 1.0 }
}

/// R2 goes from leg to leg, R3 where R2 was some seconds ago, R1 in curves.
fn trajectory() -> Trajectory {
    use Route::{Deliberative, Reactive};
    /// Delay of R3 behind R2, rows.
    const LAG: usize = 150;
    let legs = [
        (1.7, 1.7, Deliberative, "GoToPosition"),
        (1.5, 0.5, Deliberative, "GoToPosition"),
        (1.9, -0.2, Reactive, "AvoidObstacle(sonar=6, distance=0.19)"),
        (1.7, -1.7, Deliberative, "GoToPosition"),
        (0.4, -1.6, Deliberative, "GoToPosition"),
        (-0.2, -2.0, Reactive, "AvoidObstacle(sonar=5, distance=0.28)"),
        (-1.7, -1.7, Deliberative, "GoToPosition"),
        (-1.6, 0.3, Deliberative, "GoToPosition"),
        (-2.0, 0.9, Reactive, "AvoidObstacle(sonar=4, distance=0.24)"),
        (-1.7, 1.7, Deliberative, "GoToPosition"),
    ];
    let mut samples: Vec<Sample> = Vec::new();
    let mut ahead: Vec<(f64, f64, f64)> = Vec::new();
    let (mut x, mut y, mut theta) = (0.2, 1.4, 0.3);
    let (mut other_x, mut other_y, mut other_theta) = (-0.3, -0.9, 2.4);
    let (mut third_x, mut third_y) = (-1.2, 1.5);
    let mut time = 0;
    for (goal_x, goal_y, route, action) in legs {
        loop {
            let error = libm::remainder(libm::atan2(goal_y - y, goal_x - x) - theta, core::f64::consts::TAU);
            let is_turning = route == Deliberative && error.abs() > 0.25;
            let action = if is_turning { "TurnToPosition" } else { action };
            let sample = |robot: &str, x, y, theta, route, action: &str| Sample {
                time,
                robot: robot.to_owned(),
                x,
                y,
                theta,
                route,
                action: action.to_owned(),
            };
            ahead.push((x, y, theta));
            let (to_x, to_y, heading) = ahead[ahead.len().saturating_sub(LAG)];
            third_x += 0.02 * (to_x - third_x);
            third_y += 0.02 * (to_y - third_y);
            let is_near = libm::hypot(x - third_x, y - third_y) < 1.45;
            let (third_route, third_action) = if is_near {
                (Reactive, "AvoidObstacle(sonar=1, distance=0.4)")
            } else {
                (Deliberative, "Follow")
            };
            samples.push(sample("R1", other_x, other_y, other_theta, None, "random walk"));
            samples.push(sample("R2", x, y, theta, Some(route), action));
            samples.push(sample("R3", third_x, third_y, heading, Some(third_route), third_action));
            other_theta += 0.06 * libm::sin(time as f64 * 0.7e-9) + 0.02 * libm::cos(time as f64 * 2.3e-9);
            other_x += 0.003 * libm::cos(other_theta);
            other_y += 0.003 * libm::sin(other_theta);
            theta += 0.2 * error;
            let speed = if is_turning { 0.002 } else { 0.01 };
            x += speed * libm::cos(theta);
            y += speed * libm::sin(theta);
            time += 50_000_000;
            if (x - goal_x) * (x - goal_x) + (y - goal_y) * (y - goal_y) < 0.005 {
                break;
            }
        }
    }
    Trajectory { samples }
}

fn summary() -> Summary {
    let condition = |name: &str, value: &str| (name.to_owned(), value.to_owned());
    Summary {
        example: "sample".to_owned(),
        seed: 7,
        mode: "staged".to_owned(),
        conditions: [
            condition("sensor_profile", "simulator"),
            condition("noise", "none"),
            condition("speed", "0.15 m/s"),
        ]
        .into(),
        outcome: Outcome::GoalReached,
        verdict: None,
        message: None,
        sim_time_s: 61.0,
        wall_time_s: 0.048,
        time_to_goal_s: Some(61.0),
        path_length_m: Some(10.9),
        shortest_path_m: Some(10.2),
        collisions: 0,
        collisions_caused: 0,
        min_clearance_m: Some(0.118),
        route_switches: 6,
        reflexes: 31,
        figures: [("gap_in_band".to_owned(), 0.971)].into(),
        robots: [("R3".to_owned(), [("path_length".to_owned(), 9.8)].into())].into(),
        units: [("path_length".to_owned(), "m".to_owned())].into(),
        ticks: 3050,
        digest: "0123456789abcdef".to_owned(),
    }
}
