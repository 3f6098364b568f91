//! Robots that follow a script: the disturbers of the experiments.

use serde::{Deserialize, Serialize};
use slate_module::Random;

use crate::drive::Wheels;
use crate::sonar::Echo;

/// Wanders: straight on, a new heading now and then, away from what its front sonars hear.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RandomWalk {
    /// Speed of the wheels when it goes straight, radians per second.
    pub wheel_speed: f64,
    /// Seconds until it turns again, at least and at most.
    pub interval: [f64; 2],
    /// It turns away from what is nearer than this, metres.
    pub clearance: f64,
    /// Whether it does not listen to its sonars.
    pub blind: bool,
}

impl Default for RandomWalk {
    fn default() -> Self {
        Self { wheel_speed: 1.2, interval: [1.0, 5.0], clearance: 0.35, blind: false }
    }
}

/// Where a wanderer stands in its script.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Wanderer {
    walk: RandomWalk,
    random: Random,
    /// Seconds until the present leg ends.
    left: f64,
    /// The present leg: 1 turns left, -1 right, 0 goes straight.
    turn: f64,
}

impl Wanderer {
    /// A wanderer that decides by that stream.
    pub fn new(walk: RandomWalk, random: Random) -> Self {
        Self { walk, random, left: 0.0, turn: 0.0 }
    }

    /// What it does for the next `step` seconds.
    pub fn decide(&mut self, sonar: &[Echo], step: f64) -> Wheels {
        let speed = self.walk.wheel_speed;
        let near = |range: std::ops::Range<usize>| {
            sonar
                .get(range)
                .into_iter()
                .flatten()
                .filter(|echo| echo.heard)
                .map(|echo| echo.range)
                .fold(f64::INFINITY, slate_module::math::min)
        };
        // The front half of the ring: the first four look left, the next four right.
        let (on_left, on_right) = (near(1..4), near(4..7));
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
