//! Sonars with a median filter over time, as the firmware of sonars has one.

use slate_plugin::interfaces::{SensorAccuracy, SonarScan};
use slate_plugin::prelude::*;

use crate::median::MedianRing;

/// Driver or simulator of the sonars.
#[ports]
pub struct MedianSonarPorts {
    source: Input<SonarScan>,
    /// Errors of the sensors, from their data sheets; exact sensors without.
    accuracy: Input<SensorAccuracy>,
}

/// Parameters of [`MedianSonar`].
#[params]
pub struct MedianSonarParams {
    #[param(default = 5, range = 1..=9, doc = "scans over which the median of each range is taken, if the sonars err: an echo counts when most of them have it")]
    median_scans: u32,
}

/// Measures ranges as medians over the newest scans.
/// This drops single echoes without an obstacle, and single missing ones.
///
/// Ranges of exact sonars pass as they are.
pub struct MedianSonar;

impl Sensor for MedianSonar {
    const NAME: &'static str = "median_sonar";
    const DOC: &'static str = "Sonars with a median filter over time.";
    type Io = MedianSonarPorts;
    type Params = MedianSonarParams;
    type State = MedianRing;
    type Value = SonarScan;

    fn get_data(
        ring: &mut MedianRing,
        io: &MedianSonarPorts,
        params: &MedianSonarParams,
        _: &Tick,
    ) -> Option<SonarScan> {
        let scan = io.source.updated()?;
        let errs = io.accuracy.get().is_some_and(|accuracy| accuracy.sonar_outliers > 0.0);
        Some(if errs { ring.filter(scan, params.median_scans as usize) } else { *scan })
    }
}
