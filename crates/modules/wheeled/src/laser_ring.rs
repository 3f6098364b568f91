//! A laser scanner in the place of a ring of sonars: whatever hears sonars can see by it.

use slate_plugin::interfaces::{Echo, LaserScan, SonarPlacement, SonarScan};
use slate_plugin::mapek::prelude::*;
use slate_plugin::prelude::*;

/// The laser scanner.
#[ports]
pub struct Laser {
    laser: Input<LaserScan>,
}

/// Where it sits.
#[params]
pub struct LaserRingParams {
    #[param(default = 0.0, range = -10.0..=10.0, unit = "m", doc = "how far in front of the robot's reference point it sits")]
    x: f64,
    #[param(default = 0.0, range = -10.0..=10.0, unit = "m", doc = "how far left of the robot's reference point it sits")]
    y: f64,
    #[param(default = 0.0, range = -3.2..=3.2, unit = "rad", doc = "where its middle looks")]
    theta: f64,
}

/// As many as a ring has sonars.
const SECTORS: usize = 16;

/// Shows a laser's scan as that of a ring of sonars: of each sixteenth of its field of view, the nearest thing in it.
pub struct LaserRing;

impl Sensor for LaserRing {
    const NAME: &'static str = "laser_ring";
    const DOC: &'static str = "Shows a laser's scan as that of a ring of sonars.";
    type Io = Laser;
    type Params = LaserRingParams;
    type State = ();
    type Value = SonarScan;

    fn get_data(_: &mut (), io: &Laser, params: &LaserRingParams, _: &Tick) -> Option<SonarScan> {
        let scan = io.laser.new()?;
        let beams = scan.ranges.len();
        if beams < SECTORS {
            return None;
        }
        let width = scan.angle_increment * (beams - 1) as f64 / SECTORS as f64;
        let mut echoes = [Echo::default(); SECTORS];
        let mut placements = [SonarPlacement::default(); SECTORS];
        for (sector, (echo, placement)) in echoes.iter_mut().zip(&mut placements).enumerate() {
            let part = &scan.ranges[sector * beams / SECTORS..(sector + 1) * beams / SECTORS];
            // What is no number must stay none: a laser that fails must not look like one that sees nothing.
            let nearest = part.iter().map(|range| f64::from(*range)).fold(f64::INFINITY, |nearest, range| {
                if range.is_nan() || nearest.is_nan() { f64::NAN } else { math::min(nearest, range) }
            });
            let sees = nearest.is_nan() || nearest < scan.range_max;
            let range = if sees { nearest } else { scan.range_max };
            *echo = Echo { range, heard: sees.into(), reserved: [0; 7] };
            let theta = params.theta + scan.angle_min + width * (sector as f64 + 0.5);
            *placement = SonarPlacement { x: params.x, y: params.y, theta };
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
