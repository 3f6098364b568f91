use serde::{Deserialize, Serialize};

use super::Route;

/// Time for which a route must hold for its change to last, nanoseconds.
const MIN_ROUTE_DURATION: u64 = 200_000_000;

/// Distance within which a robot stays at a place, meters.
const MAX_STAY_DISTANCE: f64 = 0.05;

/// Lasting route changes of a robot, and its share of reactive distance.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RouteTally {
    position: Option<[f64; 2]>,
    /// Distance, meters.
    length: f64,
    /// Distance on the reactive route, meters.
    reactive: f64,
    /// The route of the newest lasting change.
    lasting: Option<Route>,
    /// The present route, and the time of its begin, nanoseconds.
    present: Option<(Route, u64)>,
    changes: u64,
    /// Position where the robot has stayed, and since when, nanoseconds.
    #[serde(default)]
    stays: Option<([f64; 2], u64)>,
}

impl RouteTally {
    /// Adds the position, meters, and the route at a time, nanoseconds.
    /// The time rises from call to call.
    ///
    /// Without a route no action runs: a pause between two actions of one route is no change.
    pub fn add(&mut self, time: u64, position: [f64; 2], route: Option<Route>) {
        let [x, y] = self.position.replace(position).unwrap_or(position);
        let step = libm::hypot(position[0] - x, position[1] - y);
        let step = if step.is_finite() { step } else { 0.0 };
        self.length += step;
        let is_there = |[x, y]: [f64; 2]| libm::hypot(position[0] - x, position[1] - y) <= MAX_STAY_DISTANCE;
        if !self.stays.is_some_and(|(stays, _)| is_there(stays)) {
            self.stays = Some((position, time));
        }
        let Some(route) = route.or(self.present.map(|(route, _)| route)) else { return };
        if route == Route::Reactive {
            self.reactive += step;
        }
        let (present, since) = *self.present.get_or_insert((route, time));
        if self.lasting != Some(present) && time.saturating_sub(since) >= MIN_ROUTE_DURATION {
            self.changes += u64::from(self.lasting.is_some());
            self.lasting = Some(present);
        }
        if present != route {
            self.present = Some((route, time));
        }
    }

    /// Returns the position where the robot stays within 0.05 m, and since when.
    /// The position in meters, the time in nanoseconds.
    pub fn stays(&self) -> Option<([f64; 2], u64)> {
        self.stays
    }

    /// Returns the route of the newest action.
    pub fn route(&self) -> Option<Route> {
        self.present.map(|(route, _)| route)
    }

    /// Returns the number of changes after which the new route held for 0.2 s.
    pub fn lasting_changes(&self) -> u64 {
        self.changes
    }

    /// Returns the distance driven, meters.
    pub fn distance(&self) -> f64 {
        self.length
    }

    /// Returns the share of the distance driven on the reactive route.
    /// `None` for a robot that has not moved.
    pub fn reactive_share(&self) -> Option<f64> {
        (self.length > 0.0).then(|| self.reactive / self.length)
    }
}
