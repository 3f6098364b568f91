//! Scans of any laser scanner, from the thread to the tick.

use slate_interfaces::LaserScan;
use slate_module::Sequence;
use slate_module::prelude::*;

use crate::driver::reading;

/// Maximum number of beams of a scan.
pub const MOST_BEAMS: usize = 2048;

/// Scan of a laser scanner, of fixed size.
#[interface]
#[derive(PartialEq)]
pub struct LaserSweep {
    /// Direction of the first beam, counter-clockwise from the scanner's front.
    #[unit("rad")]
    pub angle_min: f64,
    /// Angle between beams.
    #[unit("rad")]
    pub angle_increment: f64,
    /// Minimum range.
    #[unit("m")]
    pub range_min: f64,
    /// Maximum range.
    #[unit("m")]
    pub range_max: f64,
    /// Ranges, counter-clockwise; infinite without an echo.
    #[unit("m")]
    pub ranges: Sequence<f32, 2048>,
}

reading!(SweepReading, LaserSweep);

/// Ports of a driver of a laser scanner.
#[ports]
pub struct LaserScannerIo {
    /// Scans of the laser scanner.
    #[capacity(2048)]
    scan: Output<LaserScan>,
}

impl LaserScannerIo {
    /// Publishes a scan.
    pub(crate) fn publish(&self, sweep: &LaserSweep) {
        self.scan.write(sweep.ranges.len(), |scan| {
            scan.angle_min = sweep.angle_min;
            scan.angle_increment = sweep.angle_increment;
            scan.range_min = sweep.range_min;
            scan.range_max = sweep.range_max;
            scan.ranges.copy_from_slice(&sweep.ranges);
        });
    }
}
