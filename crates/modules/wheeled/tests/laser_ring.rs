//! A laser scanner in the place of a ring of sonars.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate::interfaces::{LaserScan, Position, Quaternion, SonarScan, Transform};
use slate::mapek::SensorBlock;
use slate::module::math;
use slate::module::testing::Fixture;
use slate_wheeled::laser_ring::LaserRing;

/// What the ring shows of 33 beams over half a turn, all of 2 m but for those.
fn ring(others: &[(usize, f32)]) -> SonarScan {
    ring_of(&mut Fixture::new(), others)
}

fn ring_of(ring: &mut Fixture<SensorBlock<LaserRing>>, others: &[(usize, f32)]) -> SonarScan {
    ring.write::<LaserScan>("laser", 33, |scan| {
        scan.angle_min = -std::f64::consts::FRAC_PI_2;
        scan.angle_increment = std::f64::consts::PI / 32.0;
        scan.range_min = 0.1;
        scan.range_max = 4.0;
        scan.ranges.fill(2.0);
        for (beam, range) in others {
            scan.ranges[*beam] = *range;
        }
    });
    ring.tick();
    ring.output("value").unwrap()
}

#[test]
fn each_sixteenth_shows_the_nearest_thing_in_it() {
    let scan = ring(&[(16, 1.0), (17, 0.5)]);
    assert_eq!((scan.placements.len(), scan.echoes.len()), (16, 16));
    let ranges: Vec<_> = scan.echoes.iter().map(|echo| echo.range).collect();
    let mut expected = [2.0; 16];
    // Beam 16 is the one straight ahead, and the ninth sector begins there.
    expected[8] = 0.5;
    assert_eq!(ranges, expected);
    let ahead = scan.placements[8].theta;
    assert!((ahead - scan.field_of_view / 2.0).abs() < 1e-12, "just left of straight ahead: {ahead}");
    assert!((scan.field_of_view - std::f64::consts::PI / 16.0).abs() < 1e-12);
}

#[test]
fn no_return_is_no_echo_and_nan_stays_nan() {
    let scan = ring(&[(0, f32::INFINITY), (1, f32::INFINITY), (32, f32::NAN)]);
    let (first, last) = (scan.echoes[0], scan.echoes[15]);
    assert!(!first.heard.get() && first.range == 4.0, "{first:?}");
    assert!(last.range.is_nan() && last.heard.get(), "{last:?}");
    assert!(scan.echoes[1..15].iter().all(|echo| echo.heard.get() && echo.range == 2.0));
}

#[test]
fn the_mount_is_that_of_the_driver_or_else_of_the_parameters() {
    let mut with = Fixture::<SensorBlock<LaserRing>>::new();
    let quarter = std::f64::consts::FRAC_PI_4;
    with.set(
        "mount",
        Transform {
            translation: Position { x: 0.12, y: -0.1, z: 0.3 },
            rotation: Quaternion { z: math::sin(quarter), w: math::cos(quarter), ..Quaternion::IDENTITY },
            ..Transform::default()
        },
    );
    let (turned, plain) = (ring_of(&mut with, &[]), ring(&[]));
    for (turned, plain) in turned.placements.iter().zip(plain.placements.iter()) {
        assert_eq!((turned.x, turned.y, plain.x, plain.y), (0.12, -0.1, 0.0, 0.0));
        assert!((turned.theta - plain.theta - 2.0 * quarter).abs() < 1e-12);
    }
}
