use std::time::Duration;

use slate_device_line::simulated::DeviceFirmware;

use super::PeriodClock;
use crate::gps::message::GeographicPoint;
use crate::sentence;

/// Simulated satellite receiver.
#[derive(Clone, Debug)]
pub struct SimulatedGps {
    /// Position; `None` without a fix.
    point: Option<GeographicPoint>,
    /// Kind of the fix, as GGA numbers it.
    quality: u8,
    /// Standard deviations north, east and up (meters), of a receiver with GST.
    stddev: Option<[f64; 3]>,
    rate: f64,
    beat: PeriodClock,
}

impl Default for SimulatedGps {
    fn default() -> Self {
        let point = GeographicPoint { latitude: 48.117_3, longitude: 11.516_667 };
        Self { point: Some(point), quality: 1, stddev: None, rate: 1.0, beat: PeriodClock::default() }
    }
}

impl SimulatedGps {
    /// Sets the position, degrees; `None` for no fix.
    pub fn set_point(&mut self, point: Option<GeographicPoint>) {
        self.point = point;
    }

    /// Sets the fix quality of GGA.
    /// 1: satellites alone; 2: corrections of satellites; 4: RTK.
    pub fn set_quality(&mut self, quality: u8) {
        self.quality = quality;
    }

    /// Sets standard deviations to the north, to the east and up, meters.
    pub fn set_stddev(&mut self, stddev: Option<[f64; 3]>) {
        self.stddev = stddev;
    }

    /// Sets the number of fixes in a second.
    pub fn set_rate(&mut self, rate: f64) {
        self.rate = rate;
    }

    /// Returns the sentences of a fix at that time of the day, seconds.
    fn sentences(&self, time: f64, bytes: &mut Vec<u8>) {
        let whole = time as u64;
        let clock = format!("{:02}{:02}{:02}.00", whole / 3600 % 24, whole / 60 % 60, whole % 60);
        let place = self.point.map_or(",,,".into(), |point| {
            let north = coordinate(point.latitude, 2, ["N", "S"]);
            format!("{north},{}", coordinate(point.longitude, 3, ["E", "W"]))
        });
        if let Some([north, east, up]) = self.stddev {
            sentence::append(&format!("GPGST,{clock},1.2,,,,{north:.2},{east:.2},{up:.2}"), bytes);
        }
        let (mode, satellites) =
            if self.point.is_some() { ("3", "04,05,09,12,,,,,,,,") } else { ("1", ",,,,,,,,,,,") };
        sentence::append(&format!("GPGSA,A,{mode},{satellites},2.5,1.0,2.0"), bytes);
        let (quality, count) = if self.point.is_some() { (self.quality, 8) } else { (0, 2) };
        sentence::append(&format!("GPGGA,{clock},{place},{quality},{count:02},1.0,545.4,M,46.9,M,,"), bytes);
        let status = if self.point.is_some() { "A" } else { "V" };
        sentence::append(&format!("GPRMC,{clock},{status},{place},000.0,084.4,230394,003.1,W"), bytes);
    }
}

/// Degrees as ddmm.mmmmmm with a letter.
fn coordinate(degrees: f64, digits: usize, letters: [&str; 2]) -> String {
    let magnitude = degrees.abs();
    let whole = magnitude.floor();
    let letter = if degrees < 0.0 { letters[1] } else { letters[0] };
    format!("{whole:0digits$}{:010.7},{letter}", (magnitude - whole) * 60.0)
}

impl DeviceFirmware for SimulatedGps {
    fn receive(&mut self, _: &[u8]) {}

    fn advance(&mut self, now: Duration, outgoing: &mut Vec<u8>) {
        if self.beat.due(now, Duration::from_secs_f64(1.0 / self.rate)) {
            self.sentences(now.as_secs_f64(), outgoing);
        }
    }
}
