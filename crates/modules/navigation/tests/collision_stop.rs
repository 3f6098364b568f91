//! The reflex that stops before a collision.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_navigation::{CollisionRules, CollisionStop, Halt};
use slate_plugin::interfaces::{LaserScan, Odometry, Pose2, Twist2};
use slate_plugin::mapek::{ReactiveBlock, Reflex};
use slate_plugin::module::math;
use slate_plugin::module::testing::Fixture;
use slate_plugin::prelude::*;

use crate::common::model;

const BEAMS: usize = 181;

struct Scene(Fixture<ReactiveBlock<CollisionStop>>);

impl Scene {
    fn new() -> Self {
        let mut block = Fixture::new();
        block.set("robot", model(Pose2::default()));
        let rules = CollisionRules {
            time_before_collision: 0.6,
            collision_distance: 0.03,
            source_timeout: 0.5,
            min_points: 3,
        };
        block.set("rules", rules);
        Self(block)
    }

    /// Whether it stops at a velocity with a wall ahead at that distance from the laser, m.
    fn stops(&mut self, linear: f64, angular: f64, wall: f64) -> bool {
        self.0.write::<LaserScan>("laser", BEAMS, |scan| {
            scan.angle_min = -std::f64::consts::FRAC_PI_2;
            scan.angle_increment = std::f64::consts::PI / (BEAMS - 1) as f64;
            (scan.range_min, scan.range_max) = (0.05, 20.0);
            for (beam, range) in scan.ranges.iter_mut().enumerate() {
                let cosine = math::cos(scan.angle_min + beam as f64 * scan.angle_increment);
                *range = if cosine > 0.05 { (wall / cosine) as f32 } else { f32::INFINITY };
            }
        });
        self.0.set("odometry", Odometry { twist: Twist2 { linear, angular }, ..Odometry::default() });
        self.ticks()
    }

    fn ticks(&mut self) -> bool {
        self.0.advance(50_000_000);
        self.0.tick();
        let sent = self.0.sent::<Reflex>("reflex");
        sent.last().is_some_and(|reflex| reflex.action == Halt::request(0.25))
    }
}

#[test]
fn a_robot_stops_in_time_before_a_wall() {
    let mut scene = Scene::new();
    // The front is 0.07 m before the laser: 0.6 s at 0.5 m/s and a margin of 3 cm are 0.40 m.
    assert!(!scene.stops(0.5, 0.0, 0.45));
    assert!(scene.stops(0.5, 0.0, 0.38));
    assert!(!scene.stops(0.2, 0.0, 0.38), "slowly it may come nearer");
    assert!(!scene.stops(0.0, 0.0, 0.20), "it may turn away from where it stands");
    assert!(!scene.stops(-0.2, 0.0, 0.20), "it may back away");
}

#[test]
fn a_scan_or_a_velocity_that_stopped_stops_the_robot() {
    for input in ["laser", "odometry"] {
        let mut scene = Scene::new();
        assert!(!scene.stops(0.5, 0.0, 3.0));
        for _ in 0..9 {
            scene.0.set(
                "odometry",
                Odometry { twist: Twist2 { linear: 0.5, angular: 0.0 }, ..Odometry::default() },
            );
            assert!(!scene.ticks());
        }
        // The laser has stopped after half a second; the odometry continues.
        if input == "odometry" {
            assert!(!scene.stops(0.5, 0.0, 3.0));
        }
        for _ in 0..3 {
            if input == "laser" {
                let twist = Twist2 { linear: 0.5, angular: 0.0 };
                scene.0.set("odometry", Odometry { twist, ..Odometry::default() });
            }
            scene.ticks();
        }
        assert_eq!(scene.ticks(), input == "laser", "{input}");
        if input == "odometry" {
            scene.0.advance(600_000_000);
            assert!(scene.ticks());
        }
        assert!(!scene.stops(0.5, 0.0, 3.0), "{input} is well again");
    }
}

#[test]
fn numbers_that_are_none_stop_the_robot() {
    assert!(Scene::new().stops(f64::NAN, 0.0, 3.0));
}
