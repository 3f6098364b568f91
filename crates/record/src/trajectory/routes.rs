use super::{Route, Sample};

/// How a robot used its two routes, from samples of its trajectory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RouteUse {
    /// Time from the first sample to the last, seconds.
    pub duration: f64,
    /// Distance driven, metres.
    pub distance: f64,
    /// Number of route changes, as sampled.
    pub changes: usize,
    /// Number of changes to a route that then held for [`RouteUse::HOLD`].
    pub held_changes: usize,
    /// Share of the samples with a route whose route is the reactive one.
    pub reactive_samples: f64,
    /// Share of the distance driven on the reactive route.
    pub reactive_distance: f64,
}

/// A part of a trajectory on one route.
struct Stretch {
    route: Route,
    start: u64,
    end: u64,
}

impl RouteUse {
    /// Time for which a route must hold to count as changed, nanoseconds.
    pub const HOLD: u64 = 200_000_000;

    /// Returns the use of the routes in the samples of one robot, which are in order of time.
    pub fn of(samples: &[&Sample]) -> Self {
        let mut result = Self::default();
        let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return result };
        result.duration = last.time.saturating_sub(first.time) as f64 / 1e9;
        let mut reactive = 0.0;
        for pair in samples.windows(2) {
            let way = libm::hypot(pair[1].x - pair[0].x, pair[1].y - pair[0].y);
            if way.is_finite() {
                result.distance += way;
                reactive += if pair[0].route == Some(Route::Reactive) { way } else { 0.0 };
            }
        }
        result.reactive_distance = share(reactive, result.distance);
        let count = |route| samples.iter().filter(|sample| sample.route == Some(route)).count() as f64;
        let (planned, reflexes) = (count(Route::Deliberative), count(Route::Reactive));
        result.reactive_samples = share(reflexes, planned + reflexes);
        let stretches = stretches(samples);
        result.changes = stretches.len().saturating_sub(1);
        let mut held = stretches
            .iter()
            .filter(|stretch| stretch.end.saturating_sub(stretch.start) >= Self::HOLD)
            .map(|stretch| stretch.route);
        if let Some(mut route) = held.next() {
            for next in held {
                result.held_changes += usize::from(next != route);
                route = next;
            }
        }
        result
    }
}

/// The stretches of a trajectory; samples without a route belong to the one before.
fn stretches(samples: &[&Sample]) -> Vec<Stretch> {
    let mut stretches: Vec<Stretch> = Vec::new();
    for sample in samples {
        if let Some(last) = stretches.last_mut() {
            last.end = sample.time;
        }
        if let Some(route) = sample.route
            && stretches.last().is_none_or(|last| last.route != route)
        {
            stretches.push(Stretch { route, start: sample.time, end: sample.time });
        }
    }
    stretches
}

fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}
