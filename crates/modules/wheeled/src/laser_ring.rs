//! Laser scanner as a ring of sonars, for blocks that read sonars.

use slate_plugin::interfaces::{Echo, LaserScan, Pose2, SonarPlacement, SonarScan, Transform};
use slate_plugin::prelude::*;

/// Laser scanner.
#[ports]
pub struct Laser {
    #[capacity(2048)]
    laser: Input<LaserScan>,
    /// Mount of the laser on the robot, if its driver or the simulator publishes it.
    mount: Input<Transform>,
}

/// Mount of a laser whose driver does not publish it.
#[params]
pub struct LaserRingParams {
    #[param(default = 0.0, range = -10.0..=10.0, unit = "m", doc = "x of the laser in the robot's frame")]
    mount_x: f64,
    #[param(default = 0.0, range = -10.0..=10.0, unit = "m", doc = "y of the laser in the robot's frame")]
    mount_y: f64,
    #[param(default = 0.0, range = -3.2..=3.2, unit = "rad", doc = "heading of the laser in the robot's frame")]
    mount_theta: f64,
}

/// Returns the mount of the laser in the plane of the robot.
fn mount(io: &Laser, params: &LaserRingParams) -> Pose2 {
    let written = Pose2 { x: params.mount_x, y: params.mount_y, theta: params.mount_theta };
    io.mount.get().map_or(written, |mount| Pose2 {
        x: mount.translation.x,
        y: mount.translation.y,
        theta: 2.0 * math::atan2(mount.rotation.z, mount.rotation.w),
    })
}

/// Sonars of a ring.
const SECTORS: usize = 16;

/// Converts a laser scan to a sonar scan of sixteen sectors.
/// A range is the shortest one of each sixteenth of the field of view.
pub struct LaserRing;

impl Sensor for LaserRing {
    const NAME: &'static str = "laser_ring";
    const DOC: &'static str = "Converts a laser scan to a scan of sonars.";
    type Io = Laser;
    type Params = LaserRingParams;
    type State = ();
    type Value = SonarScan;

    fn get_data(_: &mut (), io: &Laser, params: &LaserRingParams, _: &Tick) -> Option<SonarScan> {
        let scan = io.laser.updated()?;
        let beams = scan.ranges.len();
        if beams < SECTORS {
            return None;
        }
        let width = scan.angle_increment * (beams - 1) as f64 / SECTORS as f64;
        let mount = mount(io, params);
        let mut echoes = [Echo::default(); SECTORS];
        let mut placements = [SonarPlacement::default(); SECTORS];
        for (sector, (echo, placement)) in echoes.iter_mut().zip(&mut placements).enumerate() {
            let part = &scan.ranges[sector * beams / SECTORS..(sector + 1) * beams / SECTORS];
            // NaN stays NaN: a failed laser must not look like free space.
            let nearest = part.iter().map(|range| f64::from(*range)).fold(f64::INFINITY, |nearest, range| {
                if range.is_nan() || nearest.is_nan() { f64::NAN } else { math::min(nearest, range) }
            });
            let sees = nearest.is_nan() || nearest < scan.range_max;
            let range = if sees { nearest } else { scan.range_max };
            *echo = Echo { range, heard: sees.into() };
            let theta = mount.theta + scan.angle_min + width * (sector as f64 + 0.5);
            *placement = SonarPlacement { x: mount.x, y: mount.y, theta };
        }
        Some(SonarScan {
            field_of_view: width,
            range_min: scan.range_min,
            range_max: scan.range_max,
            placements: Sequence::new(&placements),
            echoes: Sequence::new(&echoes),
        })
    }
}
