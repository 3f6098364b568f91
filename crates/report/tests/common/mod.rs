//! Runs to report on.
#![allow(dead_code, missing_docs, reason = "each test uses its part")]

use slate_report::{Bounds, Goal, Outcome, Polygon, Route, Sample, Scene, Summary, Trajectory};

pub fn summary(seed: u64) -> Summary {
    Summary {
        example: "exp1".to_owned(),
        seed,
        mode: "staged".to_owned(),
        conditions: [("noise".to_owned(), "none".to_owned())].into(),
        outcome: Outcome::GoalReached,
        verdict: None,
        message: None,
        sim_time_s: 20.0,
        wall_time_s: 0.05,
        time_to_goal_s: Some(20.0),
        path_length_m: Some(2.0),
        shortest_path_m: Some(2.0),
        collisions: 0,
        collisions_caused: 0,
        min_clearance_m: Some(0.2),
        route_switches: 2,
        reflexes: 5,
        figures: [].into(),
        robots: [].into(),
        units: [].into(),
        ticks: 400,
        digest: "00ff".to_owned(),
    }
}

pub fn sample(time: u64, robot: &str, x: f64, y: f64, route: Option<Route>, action: &str) -> Sample {
    Sample { time, robot: robot.to_owned(), x, y, theta: 0.5, route, action: action.to_owned() }
}

/// R2 on a straight way with one sample per given route.
pub fn trajectory(routes: &[Option<Route>]) -> Trajectory {
    let samples = routes.iter().zip(0_u32..).map(|(route, step)| {
        let x = f64::from(step) * 0.3;
        sample(u64::from(step) * 100_000_000, "R2", x, 1.0, *route, "GoToOrigin")
    });
    Trajectory { samples: samples.collect() }
}

pub fn square(name: &str, x: f64, y: f64, side: f64) -> Polygon {
    Polygon {
        name: name.to_owned(),
        points: vec![[x, y], [x + side, y], [x + side, y + side], [x, y + side]],
    }
}

pub fn scene() -> Scene {
    Scene {
        bounds: Bounds { minimum: [-2.5, -2.5], maximum: [2.5, 2.5] },
        polygons: vec![square("box", 0.5, 0.5, 0.5)],
        circles: vec![],
        goals: vec![Goal { label: "goal".to_owned(), x: 0.0, y: 0.0 }],
        robots: vec![],
        scripted: vec!["R1".to_owned()],
    }
}
