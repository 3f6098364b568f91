//! Model predictive path integral control.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_interfaces::Pose2;
use slate_local_planning::{
    MotionLimits, MotionModel, MotionState, Mppi, MppiCritics, MppiMemory, MppiParameters, ObstacleField,
    ObstaclesCritic, PathCritic, PlanarVelocity,
};
use slate_module::{Random, math};

use crate::common::{drive, footprint, line, rims, standing, wall};

fn planner(parameters: MppiParameters) -> Mppi {
    Mppi::new(parameters, &footprint(), Random::new(1, "test")).unwrap()
}

fn small() -> MppiParameters {
    MppiParameters { batch_size: 300, ..MppiParameters::default() }
}

#[test]
fn a_robot_drives_round_columns_beside_its_path() {
    // The straight path leads within 0.15 m of their rims, and the robot is 0.4 m wide.
    let columns = [[1.2, 0.25], [2.4, -0.25], [2.4, 0.9]];
    let mut planner = planner(small());
    let path = line([0.0, 0.0], [4.0, 0.0]);
    let ride = drive(standing(0.0, 0.0, 0.0), &columns, [4.0, 0.0], 20.0, |state, field| {
        planner.plan(state, &path, None, field).unwrap_or(PlanarVelocity::ZERO)
    });
    assert!(ride.has_arrived && ride.clearance > 0.02, "{ride:?}");
    // The straight path takes 8 s at 0.5 m/s.
    assert!(ride.time < 15.0, "{ride:?}");
}

#[test]
fn a_robot_fits_through_a_gap_little_wider_than_itself() {
    // The gap is 0.6 m wide, the robot 0.4 m, and 0.64 m from corner to corner.
    let mut columns = wall([1.5, 0.4], [1.5, 3.0]);
    columns.extend(wall([1.5, -0.4], [1.5, -3.0]));
    let mut planner = planner(small());
    let path = line([0.0, 0.0], [3.0, 0.0]);
    let ride = drive(standing(0.0, 0.15, 0.3), &columns, [3.0, 0.0], 20.0, |state, field| {
        planner.plan(state, &path, None, field).unwrap_or(PlanarVelocity::ZERO)
    });
    assert!(ride.has_arrived && ride.clearance > 0.0, "{ride:?}");
}

#[test]
fn a_robot_ends_at_the_heading_that_is_wanted() {
    let mut planner = planner(small());
    let path = line([0.0, 0.0], [2.0, 0.0]);
    let mut state = standing(0.0, 0.0, 0.0);
    let _ = drive(state, &[], [9.0, 9.0], 12.0, |now, field| {
        state = *now;
        planner.plan(now, &path, Some(0.6), field).unwrap()
    });
    let error = math::angle_between(state.pose.theta, 0.6).abs();
    assert!(error < 0.2 && math::hypot(state.pose.x - 2.0, state.pose.y) < 0.3, "{state:?}");
}

#[test]
fn a_target_in_the_robots_frame_needs_no_localization() {
    let mut planner = planner(small());
    // The target is left behind the robot, which sees it move.
    let target = [-1.0, 1.5];
    let ride = drive(standing(0.0, 0.0, 0.0), &[], target, 15.0, |state, _| {
        let (across, up) = (target[0] - state.pose.x, target[1] - state.pose.y);
        let (sine, cosine) = (math::sin(state.pose.theta), math::cos(state.pose.theta));
        let ahead = [across * cosine + up * sine, up * cosine - across * sine];
        let own = MotionState { pose: Pose2 { x: 0.0, y: 0.0, theta: 0.0 }, velocity: state.velocity };
        let mut field = ObstacleField::new(4.0, 0.1).unwrap();
        field.update([0.0, 0.0], std::iter::empty());
        planner.plan(&own, &line([0.0, 0.0], ahead), None, &field).unwrap()
    });
    assert!(ride.has_arrived, "{ride:?}");
}

#[test]
fn a_velocity_keeps_all_limits() {
    let limits = MotionLimits { ax_max: 1.0, ax_min: -1.0, az_max: 2.0, ..MotionLimits::default() };
    let mut planner = planner(MppiParameters { limits, ..small() });
    let path = line([0.0, 0.0], [0.0, 4.0]);
    let mut before = PlanarVelocity::ZERO;
    let _ = drive(standing(0.0, 0.0, 0.0), &[[0.1, 2.0]], [0.0, 4.0], 8.0, |state, field| {
        let now = planner.plan(state, &path, None, field).unwrap();
        assert!((-0.3501..=0.5001).contains(&now.vx) && now.wz.abs() < 1.9001, "{now:?}");
        assert!((now.vx - before.vx).abs() < 0.0501 && (now.wz - before.wz).abs() < 0.1001, "{now:?}");
        before = now;
        now
    });
}

#[test]
fn an_omnidirectional_robot_moves_sideways() {
    let mut planner = planner(MppiParameters { motion_model: MotionModel::Omni, ..small() });
    let path = line([0.0, 0.0], [0.0, 2.0]);
    let ride = drive(standing(0.0, 0.0, 0.0), &[], [0.0, 2.0], 10.0, |state, field| {
        planner.plan(state, &path, None, field).unwrap()
    });
    assert!(ride.has_arrived && ride.state.pose.theta.abs() < 0.8, "{ride:?}");
}

#[test]
fn a_robot_that_skids_is_predicted_to_turn_less() {
    let turn = |motion_model| {
        let mut planner = planner(MppiParameters { motion_model, ..small() });
        let state =
            MotionState { velocity: PlanarVelocity { vx: 0.3, vy: 0.0, wz: 1.5 }, ..standing(0.0, 0.0, 0.0) };
        let field = ObstacleField::new(4.0, 0.1).unwrap();
        planner.plan(&state, &line([0.0, 0.0], [2.0, 0.0]), None, &field).unwrap();
        planner.trajectory().next().unwrap().theta
    };
    let (full, slipping) = (turn(MotionModel::Differential), turn(MotionModel::SkidSteer { slip: 0.5 }));
    assert!(slipping > 0.0 && slipping < 0.7 * full, "{slipping} {full}");
}

#[test]
fn a_robot_that_is_shut_in_gets_no_velocity() {
    let mut planner = planner(small());
    let columns: Vec<[f64; 2]> =
        (0..24).map(|k| 0.2618 * f64::from(k)).map(|a| [0.5 * math::cos(a), 0.5 * math::sin(a)]).collect();
    let mut field = ObstacleField::new(4.0, 0.05).unwrap();
    field.update([0.0, 0.0], rims(&columns).into_iter());
    let moving =
        MotionState { velocity: PlanarVelocity { vx: 1.2, vy: 0.0, wz: 0.0 }, ..standing(0.0, 0.0, 0.0) };
    assert!(planner.plan(&moving, &line([0.0, 0.0], [3.0, 0.0]), None, &field).is_none());
}

#[test]
fn the_same_seed_gives_the_same_velocities() {
    let run = || {
        let mut planner = planner(small());
        let path = line([0.0, 0.0], [4.0, 0.0]);
        drive(standing(0.0, 0.0, 0.2), &[[1.5, 0.1]], [4.0, 0.0], 4.0, |state, field| {
            planner.plan(state, &path, None, field).unwrap()
        })
        .state
    };
    assert_eq!(run(), run());
}

#[test]
fn nan_or_missing_path_gives_no_velocity() {
    let mut planner = planner(small());
    let field = ObstacleField::new(4.0, 0.05).unwrap();
    let path = line([0.0, 0.0], [2.0, 0.0]);
    assert!(planner.plan(&standing(f64::NAN, 0.0, 0.0), &path, None, &field).is_none());
    assert!(planner.plan(&standing(0.0, 0.0, 0.0), &[], None, &field).is_none());
    let nowhere = line([0.0, 0.0], [f64::INFINITY, 0.0]);
    assert!(planner.plan(&standing(0.0, 0.0, 0.0), &nowhere, None, &field).is_none());
    assert!(planner.plan(&standing(0.0, 0.0, 0.0), &path, Some(f64::NAN), &field).is_none());
    // Costs overflow.
    let far = line([0.0, 0.0], [1e39, 0.0]);
    let near_goal = PathCritic { threshold_to_consider: f64::MAX, ..MppiCritics::default().goal };
    let critics = MppiCritics { goal: near_goal, ..MppiCritics::default() };
    let mut overflowing = self::planner(MppiParameters { critics, ..small() });
    assert!(overflowing.plan(&standing(0.0, 0.0, 0.0), &far, None, &field).is_none());
    assert!(overflowing.plan(&standing(0.0, 0.0, 0.0), &path, None, &field).is_some());
    assert!(planner.plan(&standing(0.0, 0.0, 0.0), &path, None, &field).is_some());
}

#[test]
fn parameters_that_no_controller_can_have_are_named() {
    let refused = |parameters: MppiParameters| {
        Mppi::new(parameters, &footprint(), Random::new(1, "test")).unwrap_err().to_string()
    };
    let defaults = MppiParameters::default();
    assert_eq!(
        refused(MppiParameters { temperature: 0.0, ..defaults }),
        "invalid `temperature`: expected a number above 0"
    );
    assert!(refused(MppiParameters { time_steps: 0, ..defaults }).contains("time_steps"));
    let limits = MotionLimits { vx_min: 1.0, ..MotionLimits::default() };
    assert!(refused(MppiParameters { limits, ..defaults }).contains("vx_min"));
    let motion_model = MotionModel::SkidSteer { slip: 1.0 };
    assert!(refused(MppiParameters { motion_model, ..defaults }).contains("slip"));
    assert!(ObstacleField::new(1e9, 0.05).unwrap_err().to_string().contains("size"));
}

#[test]
fn a_robot_that_touches_a_point_does_not_drive_into_a_wall() {
    // Collisions alone hold it back.
    let obstacles =
        ObstaclesCritic { repulsion_weight: 0.0, critical_weight: 0.0, ..MppiCritics::default().obstacles };
    let critics = MppiCritics { obstacles, ..MppiCritics::default() };
    let mut planner = planner(MppiParameters { critics, ..small() });
    let wall: Vec<[f64; 2]> = (-40..=40).map(|k| [1.0, 0.025 * f64::from(k)]).collect();
    let mut field = ObstacleField::new(6.0, 0.05).unwrap();
    let mut state = standing(0.0, 0.0, 0.0);
    let path = line([0.0, 0.0], [2.5, 0.0]);
    let mut nearest = f64::INFINITY;
    for _ in 0..100 {
        // A point at a corner behind, which the robot takes along.
        let Pose2 { x, y, theta } = state.pose;
        let (sine, cosine) = (math::sin(theta), math::cos(theta));
        let corner = [x - 0.25 * cosine - 0.2 * sine, y - 0.25 * sine + 0.2 * cosine];
        field.update([x, y], wall.iter().copied().chain([corner]));
        let velocity = planner.plan(&state, &path, None, &field).unwrap_or(PlanarVelocity::ZERO);
        state.velocity = velocity;
        state.pose.theta += 0.05 * velocity.wz;
        state.pose.x += 0.05 * velocity.vx * math::cos(state.pose.theta);
        state.pose.y += 0.05 * velocity.vx * math::sin(state.pose.theta);
        for [wall_x, wall_y] in &wall {
            let (across, up) = (wall_x - state.pose.x, wall_y - state.pose.y);
            let (sine, cosine) = (math::sin(state.pose.theta), math::cos(state.pose.theta));
            let distance = footprint().distance(across * cosine + up * sine, up * cosine - across * sine);
            nearest = math::min(nearest, distance);
        }
    }
    assert!(nearest > 0.0 && state.pose.x > 0.3, "{nearest} {state:?}");
    // It can't stop before the wall any more, which the point at its corner does not hide.
    let velocity = PlanarVelocity { vx: 0.5, vy: 0.0, wz: 0.0 };
    let late = MotionState { velocity, ..standing(0.735, 0.0, 0.0) };
    field.update([0.735, 0.0], wall.iter().copied().chain([[0.485, 0.2]]));
    assert!(planner.plan(&late, &path, None, &field).is_none());
}

#[test]
fn a_robot_drives_no_farther_than_its_field_reaches() {
    let mut planner = planner(small());
    let mut field = ObstacleField::new(4.0, 0.05).unwrap();
    field.update([0.0, 0.0], std::iter::empty());
    let path = line([0.0, 0.0], [5.0, 0.0]);
    let mut state = standing(0.0, 0.0, 0.0);
    for _ in 0..160 {
        state.velocity = planner.plan(&state, &path, None, &field).unwrap_or(PlanarVelocity::ZERO);
        state.pose.theta += 0.05 * state.velocity.wz;
        state.pose.x += 0.05 * state.velocity.vx * math::cos(state.pose.theta);
        state.pose.y += 0.05 * state.velocity.vx * math::sin(state.pose.theta);
    }
    assert!(state.pose.x > 1.0 && state.pose.x < 1.75, "{state:?}");
    assert!(planner.plan(&standing(3.0, 0.0, 0.0), &path, None, &field).is_none());
    field.update([f64::NAN, 0.0], std::iter::empty());
    assert!(planner.plan(&standing(0.0, 0.0, 0.0), &path, None, &field).is_none());
}

#[test]
fn a_measured_velocity_beyond_all_limits_is_held() {
    let mut planner = planner(small());
    let field = ObstacleField::new(20.0, 0.05).unwrap();
    let velocity = PlanarVelocity { vx: 0.0, vy: 0.0, wz: 1e30 };
    let state = MotionState { velocity, ..standing(0.0, 0.0, 0.0) };
    let path = line([0.0, 0.0], [2.0, 0.0]);
    assert!(planner.plan(&state, &path, None, &field).is_some_and(|velocity| velocity.wz.abs() < 6.0));
    assert!(planner.trajectory().all(|pose| pose.x.abs() < 3.0 && pose.y.abs() < 3.0));
}

#[test]
fn a_controller_goes_on_by_its_memory() {
    let (robot, path) = (standing(0.0, 0.0, 0.0), line([0.0, 0.0], [3.0, 0.0]));
    let mut field = ObstacleField::new(6.0, 0.05).unwrap();
    field.update([0.0, 0.0], rims(&[[1.2, 0.1]]).into_iter());
    let parameters = MppiParameters { batch_size: 100, ..MppiParameters::default() };
    let make = || Mppi::new(parameters, &footprint(), Random::new(1, "planner")).unwrap();
    let mut first = make();
    for _ in 0..5 {
        first.plan(&robot, &path, None, &field).unwrap();
    }
    let mut memory = MppiMemory::default();
    first.remember(&mut memory);
    let mut second = make();
    second.resume(&memory);
    for _ in 0..3 {
        let velocity = first.plan(&robot, &path, None, &field);
        assert_eq!(second.plan(&robot, &path, None, &field), velocity);
    }
}
