//! Obstacle avoidance to a target in the robot's own frame.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_navigation::{AvoidanceStatus, ObstacleAvoidance};
use slate_plugin::interfaces::{LaserScan, Pose2, Twist2};
use slate_plugin::module::math;
use slate_plugin::module::testing::Fixture;

const BEAMS: usize = 181;

/// A robot that moves as it is commanded, among columns of 0.2 m radius.
struct Ride {
    avoidance: Fixture<ObstacleAvoidance>,
    pose: [f64; 3],
    columns: Vec<[f64; 2]>,
    clearance: f64,
}

impl Ride {
    fn new(columns: &[[f64; 2]]) -> Self {
        let avoidance = Fixture::new();
        Self { avoidance, pose: [0.0; 3], columns: columns.to_vec(), clearance: f64::INFINITY }
    }

    fn scan(&mut self) {
        let ([x, y, theta], columns) = (self.pose, self.columns.clone());
        self.avoidance.write::<LaserScan>("laser_scan", BEAMS, |scan| {
            (scan.angle_min, scan.angle_increment) =
                (-std::f64::consts::PI, std::f64::consts::TAU / (BEAMS - 1) as f64);
            (scan.range_min, scan.range_max) = (0.05, 10.0);
            for (beam, range) in scan.ranges.iter_mut().enumerate() {
                let angle = theta + scan.angle_min + beam as f64 * scan.angle_increment;
                let (c, s) = (math::cos(angle), math::sin(angle));
                let hit = |[cx, cy]: &[f64; 2]| {
                    let (dx, dy) = (cx - x, cy - y);
                    let (along, aside) = (c * dx + s * dy, c * dy - s * dx);
                    let square = 0.04 - aside * aside;
                    (along > 0.0 && square > 0.0).then(|| along - square.sqrt())
                };
                *range = columns.iter().filter_map(hit).fold(f64::INFINITY, math::min) as f32;
            }
        });
    }

    /// Goes on for so many tenths of a second.
    fn drive(&mut self, steps: usize) -> AvoidanceStatus {
        for _ in 0..steps {
            self.scan();
            self.avoidance.tick();
            let Twist2 { linear, angular } = self.avoidance.output("control_speed").unwrap();
            let [x, y, theta] = self.pose;
            let middle = theta + 0.05 * angular;
            self.pose = [
                x + 0.1 * linear * math::cos(middle),
                y + 0.1 * linear * math::sin(middle),
                theta + 0.1 * angular,
            ];
            for [cx, cy] in &self.columns {
                let away = math::hypot(cx - self.pose[0], cy - self.pose[1]) - 0.2;
                self.clearance = math::min(self.clearance, away);
            }
            self.avoidance.advance(100_000_000);
        }
        self.avoidance.output("status").unwrap()
    }
}

#[test]
fn a_robot_goes_round_a_column_to_a_target_in_its_own_frame() {
    let mut ride = Ride::new(&[[1.6, 0.1]]);
    ride.avoidance.set("local_target", Pose2 { x: 3.2, y: 0.0, theta: 0.0 });
    let status = ride.drive(160);
    assert!(status.has_arrived.get(), "{status:?} at {:?}", ride.pose);
    assert!(math::hypot(ride.pose[0] - 3.2, ride.pose[1]) < 0.2, "a target stays where it was set");
    // Half the width of the robot is 0.308 m.
    assert!(ride.clearance > 0.3, "{} m", ride.clearance);
}

#[test]
fn a_robot_stands_without_a_target_and_without_a_scan() {
    let mut ride = Ride::new(&[]);
    let speed = |ride: &Ride| ride.avoidance.output::<Twist2>("control_speed").unwrap();
    ride.scan();
    ride.avoidance.tick();
    assert_eq!(speed(&ride), Twist2::ZERO);
    ride.avoidance.set("local_target", Pose2 { x: 2.0, y: 0.0, theta: 0.0 });
    ride.drive(10);
    assert!(speed(&ride).linear > 0.2);
    ride.avoidance.expire("laser_scan");
    ride.avoidance.tick();
    assert_eq!(speed(&ride), Twist2::ZERO);
}
