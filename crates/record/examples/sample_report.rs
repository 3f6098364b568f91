//! Writes the report of a made-up run into a directory, to see what the plots look like:
//! `cargo run -p slate-record --example sample_report -- /tmp/sample`

use slate_record::{Bounds, Goal, Outcome, Polygon, Report, Route, Sample, Scene, Summary, Trajectory};
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
    Scene {
        bounds: Bounds { minimum: [-2.5, -2.5], maximum: [2.5, 2.5] },
        polygons: vec![
            rectangle("east wall", 2.5, 0.0, 0.05, 5.0),
            rectangle("west wall", -2.475, 0.0, 0.05, 5.0),
            rectangle("north wall", 0.05, 2.5, 5.0, 0.05),
            rectangle("south wall", 0.05, -2.45, 5.0, 0.05),
            rectangle("box", 0.30, 1.1, 0.5, 0.5),
        ],
        circles: vec![],
        goals: vec![Goal { label: "goal (0, 0)".to_owned(), x: 0.0, y: 0.0 }],
        scripted: vec!["R1".to_owned()],
    }
}

/// R2 goes from leg to leg, R1 in curves.
fn trajectory() -> Trajectory {
    use Route::{Deliberative, Reactive};
    let legs = [
        (0.78, 1.68, Deliberative, "GoToOrigin"),
        (0.98, 1.35, Reactive, "AvoidObstacle(sonar=4, distance=0.24)"),
        (0.70, 0.95, Deliberative, "GoToOrigin"),
        (0.85, 0.62, Reactive, "AvoidObstacle(sonar=6, distance=0.19)"),
        (0.42, 0.34, Deliberative, "GoToOrigin"),
        (0.30, 0.55, Reactive, "AvoidObstacle(sonar=5, distance=0.28)"),
        (0.0, 0.0, Deliberative, "GoToOrigin"),
    ];
    let mut samples = Vec::new();
    let (mut x, mut y, mut theta) = (0.9, 2.2, 0.0);
    let (mut other_x, mut other_y, mut other_theta) = (1.6, -0.4, 2.4);
    let mut time = 0;
    for (goal_x, goal_y, route, action) in legs {
        loop {
            let error = libm::remainder(libm::atan2(goal_y - y, goal_x - x) - theta, core::f64::consts::TAU);
            let is_turning = route == Deliberative && error.abs() > 0.25;
            let action = if is_turning { "TurnToOrigin" } else { action };
            let sample = |robot: &str, x, y, theta, route, action: &str| Sample {
                time,
                robot: robot.to_owned(),
                x,
                y,
                theta,
                route,
                action: action.to_owned(),
            };
            samples.push(sample("R1", other_x, other_y, other_theta, None, "random walk"));
            samples.push(sample("R2", x, y, theta, Some(route), action));
            other_theta += 0.06 * libm::sin(time as f64 * 0.7e-9) + 0.02 * libm::cos(time as f64 * 2.3e-9);
            other_x += 0.008 * libm::cos(other_theta);
            other_y += 0.008 * libm::sin(other_theta);
            theta += 0.2 * error;
            let speed = if is_turning { 0.002 } else { 0.008 };
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
        message: None,
        sim_time_s: 19.05,
        wall_time_s: 0.048,
        path_length_m: 3.41,
        shortest_path_m: 2.52,
        collisions: 0,
        collisions_caused: 0,
        min_clearance_m: Some(0.118),
        route_switches: 6,
        reflexes: 31,
        ticks: 381,
        digest: "0123456789abcdef".to_owned(),
    }
}
