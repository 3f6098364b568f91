//! Dynamic window approach.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_local_planning::{Dwa, DwaParameters, MotionState, ObstacleField, PlanarVelocity};
use slate_module::math;

use crate::common::{drive, footprint, line, rims, standing};

#[test]
fn a_robot_drives_round_a_column_beside_its_path() {
    let parameters = DwaParameters {
        acc_lim_x: 10.0,
        acc_lim_theta: 20.0,
        vx_samples: 6,
        sim_time: 2.0,
        ..DwaParameters::default()
    };
    let mut planner = Dwa::new(parameters, &footprint()).unwrap();
    let path = line([0.0, 0.0], [4.0, 0.0]);
    let ride = drive(standing(0.0, 0.0, 0.0), &[[1.5, 0.3]], [4.0, 0.0], 40.0, |state, field| {
        planner.plan(state, &path, field).unwrap()
    });
    assert!(ride.has_arrived && ride.clearance > 0.0, "{ride:?}");
}

#[test]
fn a_robot_turns_in_place_towards_a_path_behind_it() {
    let mut planner = Dwa::new(DwaParameters::default(), &footprint()).unwrap();
    let path = line([0.0, 0.0], [-2.0, 0.0]);
    let ride = drive(standing(0.0, 0.0, 0.0), &[], [-2.0, 0.0], 25.0, |state, field| {
        planner.plan(state, &path, field).unwrap()
    });
    assert!(ride.has_arrived, "{ride:?}");
}

#[test]
fn a_robot_without_a_free_velocity_escapes_backwards() {
    let mut planner = Dwa::new(DwaParameters::default(), &footprint()).unwrap();
    let columns: Vec<[f64; 2]> =
        (-6..=6).map(|k| 0.2 * f64::from(k)).map(|a| [0.4 * math::cos(a), 0.4 * math::sin(a)]).collect();
    let mut field = ObstacleField::new(4.0, 0.05).unwrap();
    field.update([0.0, 0.0], rims(&columns).into_iter());
    let velocity = planner.plan(&standing(0.0, 0.0, 0.0), &line([0.0, 0.0], [-1.0, 0.0]), &field).unwrap();
    assert_eq!(velocity, PlanarVelocity { vx: -0.1, vy: 0.0, wz: 0.0 });
}

#[test]
fn parameters_that_no_planner_can_have_are_named() {
    let refused = |parameters: DwaParameters| Dwa::new(parameters, &footprint()).unwrap_err().name;
    assert_eq!(refused(DwaParameters { sim_time: -1.0, ..DwaParameters::default() }), "sim_time");
    assert_eq!(refused(DwaParameters { vx_samples: 0, ..DwaParameters::default() }), "vx_samples");
    let fine = DwaParameters { sim_granularity: 1e-9, ..DwaParameters::default() };
    assert_eq!(refused(fine), "sim_granularity");
}

#[test]
fn a_measured_velocity_beyond_all_limits_still_gives_a_plan() {
    let mut planner = Dwa::new(DwaParameters::default(), &footprint()).unwrap();
    let field = ObstacleField::new(4.0, 0.05).unwrap();
    let path = line([0.0, 0.0], [1.0, 0.0]);
    let velocity = PlanarVelocity { vx: 1e300, vy: 0.0, wz: -1e300 };
    assert!(planner.plan(&MotionState { velocity, ..standing(0.0, 0.0, 0.0) }, &path, &field).is_some());
    assert!(planner.plan(&standing(2.5, 0.0, 0.0), &path, &field).is_none());
}
