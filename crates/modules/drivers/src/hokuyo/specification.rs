//! Specification that a scanner reports in its response to `PP`.

use super::response::ScipResponse;

/// Parameters of a scanner.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ScannerSpecification {
    /// Name of the model.
    pub model: String,
    /// Minimum distance, millimeters.
    pub least: u32,
    /// Maximum distance, millimeters.
    pub most: u32,
    /// Steps in a turn.
    pub resolution: u16,
    /// First step with a measurement.
    pub first: u16,
    /// Last step with a measurement.
    pub last: u16,
    /// Step to the front.
    pub front: u16,
    /// Turns in a minute.
    pub speed: u32,
}

impl ScannerSpecification {
    /// Parses the response to `PP`; `None` for a missing or invalid value.
    pub fn read(response: &ScipResponse<'_>) -> Option<Self> {
        let number = |key: &str| response.value(key)?.parse::<u32>().ok();
        let step = |key: &str| {
            number(key).and_then(|number| u16::try_from(number).ok()).filter(|step| *step < 10_000)
        };
        let model = response.value("MODL")?;
        // The manufacturer follows in brackets.
        let model = model.split_once('(').map_or(model, |(model, _)| model).trim();
        let specification = Self {
            model: model.chars().filter(|character| !character.is_control()).take(32).collect(),
            least: number("DMIN")?,
            most: number("DMAX")?,
            resolution: step("ARES")?,
            first: step("AMIN")?,
            last: step("AMAX")?,
            front: step("AFRT")?,
            speed: number("SCAN")?,
        };
        let makes_sense = specification.resolution > 0
            && specification.first < specification.last
            && specification.least < specification.most
            && (1..=60_000).contains(&specification.speed);
        makes_sense.then_some(specification)
    }

    /// Returns the angle between steps, radians.
    pub fn increment(&self) -> f64 {
        std::f64::consts::TAU / f64::from(self.resolution)
    }

    /// Returns the direction of a step, counter-clockwise from the front, radians.
    pub fn angle(&self, step: u16) -> f64 {
        (f64::from(step) - f64::from(self.front)) * self.increment()
    }

    /// Returns the steps between two directions, as far as the scanner measures there.
    pub fn steps(&self, from: f64, to: f64) -> (u16, u16) {
        // Beyond all steps the nearest one; a millionth of a step is no step less.
        let step = |angle: f64, round: fn(f64) -> f64| {
            let step = round(f64::from(self.front) + angle / self.increment());
            step.clamp(f64::from(self.first), f64::from(self.last)) as u16
        };
        let first = step(from, |step| (step - 1e-6).ceil());
        (first, step(to, |step| (step + 1e-6).floor()).max(first))
    }
}
