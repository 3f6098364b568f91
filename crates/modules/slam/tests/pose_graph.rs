//! Optimization of pose graphs.

use nalgebra::Matrix3;
use proptest::prelude::*;
use slate_interfaces::Pose2;
use slate_module::math;
use slate_slam::{Constraint, PoseGraph, se2};

fn constraint(from: usize, to: usize, relative: Pose2, is_robust: bool) -> Constraint {
    let information = Matrix3::from_diagonal(&[400.0, 400.0, 4000.0].into());
    Constraint { from, to, relative, information, is_robust }
}

/// Poses on a circle that are measured in turn, and a guess of them that drifts.
fn circle() -> (Vec<Pose2>, PoseGraph) {
    let truth: Vec<Pose2> = (0..40)
        .map(|k| {
            let angle = f64::from(k) * 2.0 * std::f64::consts::PI / 40.0;
            Pose2 { x: 5.0 * math::sin(angle), y: 5.0 - 5.0 * math::cos(angle), theta: angle }
        })
        .collect();
    let mut graph = PoseGraph { poses: vec![truth[0]], ..PoseGraph::default() };
    for k in 1..truth.len() {
        let exact = se2::relative(truth[k - 1], truth[k]);
        let drifted = Pose2 { theta: exact.theta + 0.02, ..exact };
        graph.poses.push(se2::compose(graph.poses[k - 1], drifted));
        graph.constraints.push(constraint(k - 1, k, drifted, false));
    }
    graph.constraints.push(constraint(39, 0, se2::relative(truth[39], truth[0]), true));
    (truth, graph)
}

fn apart(a: Pose2, b: Pose2) -> f64 {
    math::hypot(a.x - b.x, a.y - b.y)
}

#[test]
fn loop_closure_spreads_the_drift_over_the_loop() {
    let (truth, mut graph) = circle();
    assert!(apart(graph.poses[39], truth[39]) > 2.0);
    // A kernel that lets a loop move the graph.
    let found = graph.optimize(1e9);
    assert!(found.after < found.before);
    assert!(apart(graph.poses[39], truth[39]) < 0.2);
    assert!(apart(graph.poses[20], truth[20]) < 1.0);
    assert_eq!(graph.poses[0], truth[0]);
}

#[test]
fn wrong_loop_closure_is_outvoted() {
    let (truth, mut graph) = circle();
    graph.optimize(1e9);
    let right = graph.poses.clone();
    graph.constraints.push(constraint(5, 25, Pose2 { x: 0.1, y: 0.0, theta: 0.0 }, true));
    graph.optimize(10.0);
    let moved = graph.poses.iter().zip(&right).map(|(a, b)| apart(*a, *b)).fold(0.0, math::max);
    assert!(moved < 0.5, "{moved}");
    assert!(apart(graph.poses[5], graph.poses[25]) > 0.5 * apart(truth[5], truth[25]));
}

#[test]
fn invalid_constraints_are_left_out() {
    let (_, mut graph) = circle();
    let expected = {
        let mut graph = graph.clone();
        graph.optimize(1e9);
        graph.poses
    };
    graph.constraints.push(constraint(3, 99, Pose2::default(), false));
    graph.constraints.push(constraint(4, 4, Pose2::default(), false));
    graph.constraints.push(constraint(1, 2, Pose2::UNKNOWN, false));
    graph.optimize(1e9);
    assert!(graph.poses == expected);
    assert_eq!(PoseGraph::default().optimize(1.0).iterations, 1);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn consistent_constraints_give_the_true_poses(
        truth in prop::collection::vec((-9.0..9.0_f64, -9.0..9.0_f64, -3.0..3.0_f64), 2..12),
        pairs in prop::collection::vec((0..12_usize, 0..12_usize), 0..12),
        noise in prop::collection::vec((-0.1..0.1_f64, -0.1..0.1_f64, -0.1..0.1_f64), 12),
    ) {
        let truth: Vec<Pose2> = truth.into_iter().map(|(x, y, theta)| Pose2 { x, y, theta }).collect();
        let chain = (1..truth.len()).map(|k| (k - 1, k));
        let pairs = pairs.into_iter().filter(|(a, b)| a != b && *a < truth.len() && *b < truth.len());
        let constraints = chain.chain(pairs).map(|(a, b)| constraint(a, b, se2::relative(truth[a], truth[b]), false));
        let shift = |(at, pose): (usize, &Pose2)| match at {
            0 => *pose,
            _ => Pose2 { x: pose.x + noise[at].0, y: pose.y + noise[at].1, theta: pose.theta + noise[at].2 },
        };
        let poses = truth.iter().enumerate().map(shift).collect();
        let mut graph = PoseGraph { constraints: constraints.collect(), poses };
        graph.optimize(1.0);
        for (found, wanted) in graph.poses.iter().zip(&truth) {
            prop_assert!(apart(*found, *wanted) < 1e-6);
        }
    }
}
