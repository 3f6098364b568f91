//! SLAM of a drive with a particle filter.

use slate_interfaces::Pose2;
use slate_module::Random;
use slate_slam::{ParticleSlam, ParticleSlamParameters};

use crate::world::{drive, largest_error};

#[test]
fn filter_corrects_the_drift_of_odometry() {
    let steps = drive(2, 1);
    let mut slam = ParticleSlam::new(ParticleSlamParameters::default()).unwrap();
    let mut random = Random::new(1, "filter");
    for step in &steps {
        slam.insert(step.odometry, &step.points, &mut random);
        assert!((1.0..=30.001).contains(&slam.effective_number()));
    }
    let error = largest_error(slam.poses(), &steps);
    assert!(error < 0.3, "{error}");
}

#[test]
fn restored_filter_goes_on_as_the_saved_one() {
    let steps = drive(1, 2);
    let parameters = ParticleSlamParameters { particles: 5, ..ParticleSlamParameters::default() };
    let mut slam = ParticleSlam::new(parameters).unwrap();
    let mut random = Random::new(2, "filter");
    for step in &steps[..30] {
        slam.insert(step.odometry, &step.points, &mut random);
    }
    let bytes = postcard::to_allocvec(&(&slam, random)).unwrap();
    let (mut restored, mut restored_random): (ParticleSlam, Random) = postcard::from_bytes(&bytes).unwrap();
    for step in &steps[30..60] {
        let expected = slam.insert(step.odometry, &step.points, &mut random);
        assert_eq!(restored.insert(step.odometry, &step.points, &mut restored_random), expected);
    }
    assert!(restored == slam);
}

#[test]
fn bad_scans_do_no_harm() {
    let parameters = ParticleSlamParameters { particles: 3, ..ParticleSlamParameters::default() };
    let mut slam = ParticleSlam::new(parameters).unwrap();
    let mut random = Random::new(3, "filter");
    for points in [&[][..], &[[f64::NAN, 0.0]], &[[1.0, 0.0]], &[[1e300, f64::INFINITY]]] {
        slam.insert(Pose2 { x: 0.5, ..Pose2::default() }, points, &mut random);
    }
    slam.insert(Pose2::UNKNOWN, &[[1.0, 0.0]], &mut random);
    slam.insert(Pose2 { x: 500.5, ..Pose2::default() }, &[[1.0, 0.0]], &mut random);
    assert_eq!(slam.odometry_jumps(), 1);
    assert!(slam.poses().iter().all(|pose| pose.is_known() && pose.x < 10.0));
    assert!(slam.effective_number().is_finite());
}
