//! Scripted robots: the disturbers of the experiments.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::min;

use crate::drive::Wheels;
use crate::robot::SonarDescription;
use crate::sonar::Echo;

/// Largest direction of a sonar that counts as ahead, degrees.
const MAX_BEARING_AHEAD: f64 = 60.0;

/// Random walk: straight, with random new headings, away from obstacles ahead.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RandomWalk {
    /// Wheel speed on straight legs, rad/s.
    pub wheel_speed: f64,
    /// Shortest and longest time until the next turn, s.
    pub interval: [f64; 2],
    /// Clearance below which it turns away, m.
    pub clearance: f64,
    /// Blind walk, which ignores the sonars.
    pub blind: bool,
}

impl Default for RandomWalk {
    fn default() -> Self {
        Self { wheel_speed: 1.2, interval: [1.0, 5.0], clearance: 0.35, blind: false }
    }
}

/// State of a wanderer's script.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Wanderer {
    walk: RandomWalk,
    random: Random,
    /// Bit masks of the sonars that look ahead, on either side.
    ahead: (u16, u16),
    /// Time until the current leg ends, s.
    left: f64,
    /// Current leg: 1 turns left, -1 right, 0 goes straight.
    turn: f64,
}

impl Wanderer {
    /// Creates a wanderer with a random stream and the sonars that it uses.
    ///
    /// # Errors
    /// If it uses its sonars and none looks ahead.
    pub fn new(walk: RandomWalk, ring: Option<&SonarDescription>, random: Random) -> Result<Self, String> {
        let placements = ring.map_or(&[][..], |ring| &ring.placements);
        let among = |range: RangeInclusive<f64>| {
            let directions = placements.iter().enumerate().map(|(i, [_, _, degrees])| (i, degrees));
            directions.filter(|(_, degrees)| range.contains(*degrees)).fold(0, |mask, (i, _)| mask | 1 << i)
        };
        // One that looks straight ahead looks to both sides.
        let ahead = (among(0.0..=MAX_BEARING_AHEAD), among(-MAX_BEARING_AHEAD..=0.0));
        if !walk.blind && (ahead.0 == 0 || ahead.1 == 0) {
            return Err(format!(
                "its script needs sonars ahead on both sides within {MAX_BEARING_AHEAD} degrees; choose a \
                 sonar profile that has them, or write script = {{ blind = true }}"
            ));
        }
        Ok(Self { walk, random, ahead, left: 0.0, turn: 0.0 })
    }

    /// Returns the command of the next `step` seconds.
    pub fn decide(&mut self, sonar: &[Echo], step: f64) -> Wheels {
        let speed = self.walk.wheel_speed;
        let near = |mut sonars: u16| {
            let mut nearest = f64::INFINITY;
            while sonars != 0 {
                let echo = sonar.get(sonars.trailing_zeros() as usize).filter(|echo| echo.heard);
                nearest = echo.map_or(nearest, |echo| min(nearest, echo.range));
                sonars &= sonars - 1;
            }
            nearest
        };
        let (on_left, on_right) = (near(self.ahead.0), near(self.ahead.1));
        self.left -= step;
        if !self.walk.blind && (on_left < self.walk.clearance || on_right < self.walk.clearance) {
            if self.turn == 0.0 {
                self.turn = if on_left < on_right { -1.0 } else { 1.0 };
            }
            self.left = 0.3;
        } else if self.left <= 0.0 {
            let [shortest, longest] = self.walk.interval;
            if self.turn == 0.0 {
                self.turn = if self.random.unit() < 0.5 { 1.0 } else { -1.0 };
                self.left = self.random.uniform(0.2, 1.5);
            } else {
                self.turn = 0.0;
                self.left = self.random.uniform(shortest, longest);
            }
        }
        Wheels {
            left: speed * if self.turn > 0.0 { -1.0 } else { 1.0 },
            right: speed * if self.turn < 0.0 { -1.0 } else { 1.0 },
        }
    }
}
