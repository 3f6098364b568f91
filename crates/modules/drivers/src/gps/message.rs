//! Messages of a GNSS receiver: GGA, RMC, GSA and GST of NMEA 0183.
//! Any talker is accepted.

use slate_interfaces::FixStatus;

use crate::sentence::number;

/// Position in WGS 84, degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeographicPoint {
    /// Positive to the north.
    pub latitude: f64,
    /// Positive to the east.
    pub longitude: f64,
}

/// Message of a receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GpsMessage {
    /// Fix, with height.
    Gga {
        /// Time of the day in UTC, seconds, if known.
        time: Option<f64>,
        /// Position, if the receiver has a fix.
        point: Option<GeographicPoint>,
        /// Kind of the fix.
        status: FixStatus,
        /// Number of satellites in use.
        satellites: u32,
        /// Horizontal dilution of precision.
        horizontal_dilution: Option<f64>,
        /// Height above the ellipsoid, meters.
        altitude: Option<f64>,
    },
    /// Recommended minimum data.
    Rmc {
        /// Time of the day in UTC, seconds, if known.
        time: Option<f64>,
        /// Position, if it is valid.
        point: Option<GeographicPoint>,
    },
    /// Dilution of precision.
    Gsa {
        /// Horizontal dilution of precision.
        horizontal_dilution: Option<f64>,
        /// Vertical dilution of precision.
        vertical_dilution: Option<f64>,
    },
    /// Standard deviations of the position to the north, to the east and up, meters.
    Gst {
        /// Time of the day in UTC, seconds, if known.
        time: Option<f64>,
        /// Standard deviations of latitude, longitude and altitude.
        stddev: [f64; 3],
    },
}

impl GpsMessage {
    /// Parses the body of a sentence.
    /// `None` for other messages, and for an invalid field.
    pub fn parse(body: &str) -> Option<Self> {
        let mut fields = body.split(',');
        let address = fields.next()?;
        // Two letters of the talker, such as GP, GL, GA, GB or GN for several systems.
        if address.len() != 5 || !address.is_ascii() || address.starts_with('P') {
            return None;
        }
        let fields = MessageFields(fields);
        match &address[2..] {
            "GGA" => fields.gga(),
            "RMC" => fields.rmc(),
            "GSA" => fields.gsa(),
            "GST" => fields.gst(),
            _ => None,
        }
    }
}

/// Fields that are left.
struct MessageFields<'a>(std::str::Split<'a, char>);

impl<'a> MessageFields<'a> {
    fn next(&mut self) -> Option<&'a str> {
        self.0.next()
    }

    /// Returns a number, which may be missing.
    fn number(&mut self) -> Option<Option<f64>> {
        let field = self.next()?;
        if field.is_empty() { Some(None) } else { number(field).map(Some) }
    }

    /// Parses hhmmss.ss to seconds of the day.
    fn time(&mut self) -> Option<Option<f64>> {
        let Some(number) = self.number()? else { return Some(None) };
        if !(0.0..=235_961.0).contains(&number) {
            return None;
        }
        let (hours, minutes) = ((number / 10_000.0).floor(), (number / 100.0).floor() % 100.0);
        Some(Some(hours * 3600.0 + minutes * 60.0 + number % 100.0))
    }

    /// Parses a point: ddmm.mmmm and a letter, twice.
    fn point(&mut self) -> Option<Option<GeographicPoint>> {
        let latitude = self.coordinate("N", "S", 90.0)?;
        let longitude = self.coordinate("E", "W", 180.0)?;
        Some(latitude.zip(longitude).map(|(latitude, longitude)| GeographicPoint { latitude, longitude }))
    }

    fn coordinate(&mut self, positive: &str, negative: &str, most: f64) -> Option<Option<f64>> {
        let (number, letter) = (self.number()?, self.next()?);
        let Some(number) = number else { return Some(None) };
        let (degrees, minutes) = ((number / 100.0).floor(), number % 100.0);
        let magnitude = degrees + minutes / 60.0;
        if !(0.0..60.0).contains(&minutes) || !(0.0..=most).contains(&magnitude) {
            return None;
        }
        match letter {
            letter if letter == positive => Some(Some(magnitude)),
            letter if letter == negative => Some(Some(-magnitude)),
            _ => None,
        }
    }

    fn gga(mut self) -> Option<GpsMessage> {
        let (time, point) = (self.time()?, self.point()?);
        let status = match self.next()? {
            "1" | "3" | "8" => FixStatus::FIX,
            "2" => FixStatus::SATELLITE_AUGMENTED,
            "4" | "5" | "9" => FixStatus::GROUND_AUGMENTED,
            // No fix, dead reckoning, and manual input.
            "" | "0" | "6" | "7" => FixStatus::NO_FIX,
            _ => return None,
        };
        let satellites = self.number()?.unwrap_or(0.0).clamp(0.0, 99.0) as u32;
        let horizontal_dilution = self.number()?;
        let (above_sea, _, geoid) = (self.number()?, self.next()?, self.number()?);
        let altitude = above_sea.map(|height| height + geoid.unwrap_or(0.0));
        let status = if point.is_some() { status } else { FixStatus::NO_FIX };
        Some(GpsMessage::Gga { time, point, status, satellites, horizontal_dilution, altitude })
    }

    fn rmc(mut self) -> Option<GpsMessage> {
        let time = self.time()?;
        let is_valid = self.next()? == "A";
        let point = self.point()?.filter(|_| is_valid);
        Some(GpsMessage::Rmc { time, point })
    }

    fn gsa(mut self) -> Option<GpsMessage> {
        // Mode, kind of fix, twelve satellites, dilution in space.
        for _ in 0..15 {
            self.next()?;
        }
        Some(GpsMessage::Gsa { horizontal_dilution: self.number()?, vertical_dilution: self.number()? })
    }

    fn gst(mut self) -> Option<GpsMessage> {
        let time = self.time()?;
        // Residuals and the ellipse of errors.
        for _ in 0..4 {
            self.next()?;
        }
        let stddev = [self.number()??, self.number()??, self.number()??];
        stddev.iter().all(|stddev| *stddev >= 0.0).then_some(GpsMessage::Gst { time, stddev })
    }
}
