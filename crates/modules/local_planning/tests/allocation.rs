//! A cycle allocates nothing.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_avoidance::Footprint;
use slate_interfaces::{Point2, Pose2};
use slate_local_planning::{
    Dwa, DwaParameters, MotionState, Mppi, MppiParameters, ObservationBuffer, ObstacleField, PlanarVelocity,
};
use slate_module::Random;

#[test]
fn a_cycle_allocates_nothing() {
    let footprint = Footprint::new(&[[0.25, 0.2], [-0.25, 0.2], [-0.25, -0.2], [0.25, -0.2]]).unwrap();
    let parameters = MppiParameters { batch_size: 100, ..MppiParameters::default() };
    let mut mppi = Mppi::new(parameters, &footprint, Random::new(1, "test")).unwrap();
    let mut dwa = Dwa::new(DwaParameters::default(), &footprint).unwrap();
    let mut field = ObstacleField::new(4.0, 0.05).unwrap();
    let mut memory = ObservationBuffer::new(1.0, 0.2);
    let path: Vec<Point2> = (0..80).map(|k| Point2 { x: 0.05 * f64::from(k), y: 0.0 }).collect();
    let mut cycle = |step: u32| {
        let pose = Pose2 { x: 0.01 * f64::from(step), y: 0.0, theta: 0.1 };
        let velocity = PlanarVelocity { vx: 0.2, vy: 0.0, wz: 0.1 };
        memory.insert(0.05 * f64::from(step), &pose, &[[1.0, 0.4], [1.2, -0.5]]);
        field.update([pose.x, pose.y], memory.points());
        let state = MotionState { pose, velocity };
        assert!(mppi.plan(&state, &path, Some(0.0), &field).is_some());
        assert!(dwa.plan(&state, &path, &field).is_some());
    };
    (0..40).for_each(&mut cycle);
    let made = allocation_counter::measure(|| (40..80).for_each(&mut cycle));
    assert_eq!(made.count_total, 0);
}
