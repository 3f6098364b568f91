//! The Kalman filter as a library.

use proptest::prelude::*;
use slate_interfaces::Pose2;
use slate_localization::{
    FilterMeasurement, MeasuredLandmark, MeasuredVariables, MeasurementOutcome, PlanarFilter,
    PlanarFilterParameters, RangeKind, StateVariable, TangentPlane,
};
use slate_module::{Random, math};

/// ns.
const CYCLE: u64 = 50_000_000;
const NO_GATE: f64 = f64::INFINITY;

fn filter(parameters: PlanarFilterParameters) -> PlanarFilter {
    let mut filter = PlanarFilter::new(parameters).unwrap();
    assert!(filter.initialize(Pose2::default(), [0.1, 0.1, 0.1], 0));
    filter
}

fn twist(vx: f64, vyaw: f64) -> FilterMeasurement {
    let variables = MeasuredVariables::default()
        .with(StateVariable::Vx, vx, 0.02)
        .with(StateVariable::Vy, 0.0, 0.01)
        .with(StateVariable::Vyaw, vyaw, 0.05);
    FilterMeasurement::Odometry(variables)
}

fn position(x: f64, y: f64, stddev: f64) -> FilterMeasurement {
    let variance = stddev * stddev;
    FilterMeasurement::Position { position: [x, y], covariance: [variance, 0.0, 0.0, variance] }
}

fn landmark(place: [f64; 2], pose: &Pose2) -> FilterMeasurement {
    let (right, up) = (place[0] - pose.x, place[1] - pose.y);
    FilterMeasurement::Landmark(MeasuredLandmark {
        landmark: place,
        range: math::hypot(right, up),
        range_kind: RangeKind::Distance,
        bearing: math::angle_between(pose.theta, math::atan2(up, right)),
        range_stddev: 0.05,
        bearing_stddev: 0.02,
    })
}

fn any_measurement() -> impl Strategy<Value = FilterMeasurement> {
    let coordinate = -20.0..20.0_f64;
    let stddev = prop_oneof![Just(1e-4), 0.01..1.0_f64, Just(1e3)];
    prop_oneof![
        (-2.0..2.0_f64, -3.0..3.0_f64).prop_map(|(vx, vyaw)| twist(vx, vyaw)),
        (coordinate.clone(), coordinate.clone(), stddev.clone())
            .prop_map(|(x, y, stddev)| position(x, y, stddev)),
        (-4.0..4.0_f64, stddev.clone()).prop_map(|(theta, stddev)| {
            let heading = MeasuredVariables::default().with(StateVariable::Yaw, theta, stddev);
            FilterMeasurement::Variables(heading)
        }),
        (-3.0..3.0_f64, stddev.clone())
            .prop_map(|(angular_velocity, stddev)| FilterMeasurement::Gyroscope { angular_velocity, stddev }),
        (coordinate.clone(), coordinate, 0.001..20.0_f64, -4.0..4.0_f64, stddev).prop_map(
            |(x, y, range, bearing, stddev)| FilterMeasurement::Landmark(MeasuredLandmark {
                landmark: [x, y],
                range,
                range_kind: if x > y { RangeKind::Distance } else { RangeKind::Depth },
                bearing,
                range_stddev: stddev,
                bearing_stddev: stddev,
            })
        ),
    ]
}

/// Whether a symmetric matrix is positive, but for rounding (Cholesky).
fn is_positive(covariance: &[[f64; 10]; 10]) -> bool {
    let mut lower = [[0.0; 10]; 10];
    for row in 0..10 {
        for column in 0..=row {
            let sum: f64 = (0..column).map(|k| lower[row][k] * lower[column][k]).sum();
            let rest = covariance[row][column] - sum;
            if row == column {
                if rest < -1e-9 * (1.0 + covariance[row][row]) {
                    return false;
                }
                lower[row][row] = math::max(rest, 1e-12).sqrt();
            } else {
                lower[row][column] = rest / lower[column][column];
            }
        }
    }
    true
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn covariance_stays_symmetric_and_positive(
        measurements in prop::collection::vec((any_measurement(), 0..2_000_000_000_u64), 1..40),
    ) {
        let mut filter = filter(PlanarFilterParameters::default());
        let mut time = 0;
        for (measurement, pause) in measurements {
            time += pause;
            filter.update(&measurement, time, NO_GATE);
            let covariance = filter.covariance().unwrap();
            let is_symmetric = (0..100).all(|k| covariance[k / 10][k % 10] == covariance[k % 10][k / 10]);
            prop_assert!(is_symmetric && is_positive(&covariance));
            prop_assert!(filter.estimate().unwrap().pose.is_known());
        }
    }

    #[test]
    fn late_measurements_count_as_if_in_time(
        measurements in prop::collection::vec(any_measurement(), 3..20), late in 1..19_usize, by in 1..19_usize,
    ) {
        let parameters = PlanarFilterParameters { history_length: 10.0, ..PlanarFilterParameters::default() };
        let (mut in_time, mut lagged) = (filter(parameters), filter(parameters));
        let mut order: Vec<usize> = (0..measurements.len()).collect();
        for k in &order {
            in_time.update(&measurements[*k], CYCLE * (*k as u64 + 1), NO_GATE);
        }
        let late = late % measurements.len();
        let k = order.remove(late);
        order.insert((late + by).min(order.len()), k);
        for k in order {
            lagged.update(&measurements[k], CYCLE * (k as u64 + 1), NO_GATE);
        }
        let (a, b) = (in_time.estimate().unwrap(), lagged.estimate().unwrap());
        prop_assert!(math::hypot(a.pose.x - b.pose.x, a.pose.y - b.pose.y) < 1e-6);
        prop_assert!(a.covariance.iter().zip(&b.covariance).all(|(a, b)| (a - b).abs() < 1e-6 * (1.0 + a.abs())));
    }
}

#[test]
fn landmarks_correct_a_wrong_start() {
    let mut filter = filter(PlanarFilterParameters::default());
    let places = [[3.0, 1.0], [-2.0, 4.0], [1.0, -3.0]];
    let mut truth = Pose2 { x: 0.2, y: -0.2, theta: 0.2 };
    for cycle in 1..=100 {
        truth.theta += 0.02;
        truth.x += 0.02 * math::cos(truth.theta);
        truth.y += 0.02 * math::sin(truth.theta);
        filter.update(&twist(0.4, 0.4), cycle * CYCLE, NO_GATE);
        filter.update(&landmark(places[cycle as usize % 3], &truth), cycle * CYCLE, 5.0);
    }
    let estimate = filter.estimate().unwrap();
    assert!(math::hypot(estimate.pose.x - truth.x, estimate.pose.y - truth.y) < 0.05);
    assert!(math::angle_between(estimate.pose.theta, truth.theta).abs() < 0.02);
    assert!(estimate.covariance[0].sqrt() < 0.05 && filter.rejected() == 0);
}

#[test]
fn errors_are_as_large_as_the_covariance_says() {
    let mut random = Random::new(1, "noise");
    let (mut sum, mut count) = (0.0, 0.0);
    for _ in 0..40 {
        let mut filter = filter(PlanarFilterParameters {
            process_noise: [1e-9, 1e-9, 1e-9, 1.0, 1e-9, 1.0],
            ..PlanarFilterParameters::default()
        });
        let mut truth =
            Pose2 { x: 0.1 * random.normal(), y: 0.1 * random.normal(), theta: 0.1 * random.normal() };
        for cycle in 1..=60_u64 {
            truth.theta += 0.01;
            truth.x += 0.02 * math::cos(truth.theta);
            truth.y += 0.02 * math::sin(truth.theta);
            let measured = twist(0.4 + 0.02 * random.normal(), 0.2 + 0.05 * random.normal());
            filter.update(&measured, cycle * CYCLE, NO_GATE);
            if cycle % 10 == 0 {
                let [x, y] = [truth.x + 0.1 * random.normal(), truth.y + 0.1 * random.normal()];
                filter.update(&position(x, y, 0.1), cycle * CYCLE, NO_GATE);
            }
        }
        let estimate = filter.estimate().unwrap();
        let error = [estimate.pose.x - truth.x, estimate.pose.y - truth.y];
        let [xx, xy, _, _, yy, ..] = estimate.covariance;
        let square = error[0] * error[0] * yy - 2.0 * error[0] * error[1] * xy + error[1] * error[1] * xx;
        sum += square / (xx * yy - xy * xy);
        count += 1.0;
    }
    // Expected 2; 95 % of means of 40 are within 1.4 and 2.7.
    assert!((1.2..3.0).contains(&(sum / count)), "{}", sum / count);
}

#[test]
fn outliers_are_rejected_and_counted() {
    let mut filter = filter(PlanarFilterParameters::default());
    let before = filter.estimate();
    let outcome = filter.update(&position(5.0, 0.0, 0.1), 0, 4.0);
    assert!(matches!(outcome, MeasurementOutcome::Rejected(distance) if distance > 30.0));
    assert_eq!((filter.estimate(), filter.rejected()), (before, 1));
    assert!(matches!(filter.update(&position(0.1, 0.0, 0.1), 0, 4.0), MeasurementOutcome::Accepted(_)));
}

#[test]
fn measurements_that_are_no_number_change_nothing() {
    let mut filter = filter(PlanarFilterParameters::default());
    let before = filter.clone();
    for measurement in [position(f64::NAN, 0.0, 0.1), position(0.0, 0.0, 0.0), twist(f64::INFINITY, 0.0)] {
        assert_eq!(filter.update(&measurement, CYCLE, NO_GATE), MeasurementOutcome::Invalid);
    }
    assert!(!filter.initialize(Pose2::UNKNOWN, [0.1; 3], 0));
    assert_eq!(filter, before);
}

#[test]
fn measurements_before_the_history_are_refused() {
    let mut filter = filter(PlanarFilterParameters::default());
    filter.update(&twist(1.0, 0.0), 10 * CYCLE, NO_GATE);
    let outcome = filter.update(&position(0.0, 0.0, 0.1), 2 * CYCLE, NO_GATE);
    assert!(matches!(outcome, MeasurementOutcome::TooLate(seconds) if (seconds - 0.4).abs() < 1e-9));
}

#[test]
fn the_bias_of_a_gyroscope_is_learned_at_rest() {
    let parameters =
        PlanarFilterParameters { initial_gyroscope_bias_stddev: 0.05, ..PlanarFilterParameters::default() };
    let mut filter = filter(parameters);
    for cycle in 1..400 {
        filter.update(&twist(0.0, 0.0), cycle * CYCLE, NO_GATE);
        let gyroscope = FilterMeasurement::Gyroscope { angular_velocity: 0.03, stddev: 0.02 };
        filter.update(&gyroscope, cycle * CYCLE, NO_GATE);
    }
    let (bias, stddev) = filter.variable(StateVariable::GyroscopeBias).unwrap();
    assert!((bias - 0.03).abs() < 0.01 && stddev < 0.01, "{bias} {stddev}");
}

#[test]
fn scales_of_odometry_and_camera_are_learned() {
    let mut filter = filter(PlanarFilterParameters {
        initial_odometry_scale_stddev: [0.1, 0.1],
        initial_landmark_scale_stddev: 0.1,
        ..PlanarFilterParameters::default()
    });
    let places = [[4.0, 1.0], [-2.0, 4.0], [1.0, -3.0], [-3.0, -2.0]];
    let mut truth = Pose2::default();
    for cycle in 1..=800_u64 {
        truth.theta = math::wrap_angle(truth.theta + 0.02);
        truth.x += 0.02 * math::cos(truth.theta);
        truth.y += 0.02 * math::sin(truth.theta);
        filter.update(&twist(0.4 * 1.08, 0.4 * 0.95), cycle * CYCLE, NO_GATE);
        let place = places[cycle as usize % 4];
        let (right, up) = (place[0] - truth.x, place[1] - truth.y);
        let (depth, left) = (
            right * math::cos(truth.theta) + up * math::sin(truth.theta),
            up * math::cos(truth.theta) - right * math::sin(truth.theta),
        );
        if depth > 0.5 {
            let seen = MeasuredLandmark {
                landmark: place,
                range: 1.04 * depth,
                range_kind: RangeKind::Depth,
                bearing: math::atan2(left, depth),
                range_stddev: 0.05,
                bearing_stddev: 0.02,
            };
            filter.update(&FilterMeasurement::Landmark(seen), cycle * CYCLE, NO_GATE);
        }
    }
    for (variable, scale) in [
        (StateVariable::OdometryLinearScale, 1.08),
        (StateVariable::OdometryAngularScale, 0.95),
        (StateVariable::LandmarkRangeScale, 1.04),
    ] {
        let (mean, stddev) = filter.variable(variable).unwrap();
        assert!((mean - scale).abs() < 0.015 && stddev < 0.03, "{variable:?} {mean} {stddev}");
    }
}

#[test]
fn invalid_parameters_are_refused_by_name() {
    let wrong = PlanarFilterParameters { history_length: f64::NAN, ..PlanarFilterParameters::default() };
    assert!(PlanarFilter::new(wrong).unwrap_err().to_string().contains("history_length"));
}

#[test]
fn fixes_are_meters_east_and_north() {
    // A degree of latitude at 50 degrees is 111,229 m, and one of longitude 71,696 m, in WGS 84.
    let plane = TangentPlane::new(50.0, 7.0).unwrap();
    let [east, north] = plane.project(50.001, 7.001);
    assert!((east - 71.696).abs() < 0.01 && (north - 111.229).abs() < 0.01, "{east} {north}");
    let [across, _] = TangentPlane::new(0.0, 179.999).unwrap().project(0.0, -179.999);
    assert!((across - 222.64).abs() < 0.1, "{across}");
    assert!(TangentPlane::new(90.1, 0.0).is_none() && TangentPlane::new(f64::NAN, 0.0).is_none());
}
