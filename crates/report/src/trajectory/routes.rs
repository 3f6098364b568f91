use super::{Route, RouteTally, Sample};

/// Use of the two routes by a robot, from samples of its trajectory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RouteUse {
    /// Time from the first sample to the last, seconds.
    pub duration: f64,
    /// Distance driven, meters.
    pub distance: f64,
    /// Number of route changes, as sampled.
    pub changes: usize,
    /// Number of lasting route changes, as [`RouteTally`] counts them.
    pub lasting_changes: u64,
    /// Share of the samples with a route whose route is the reactive one.
    pub reactive_samples: f64,
    /// Share of the distance driven on the reactive route.
    pub reactive_distance: f64,
}

impl RouteUse {
    /// Returns the use of the routes in the samples of one robot, ordered by time.
    pub fn of(samples: &[&Sample]) -> Self {
        let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return Self::default() };
        let mut tally = RouteTally::default();
        samples.iter().for_each(|sample| tally.add(sample.time, [sample.x, sample.y], sample.route));
        let routes: Vec<Route> = samples.iter().filter_map(|sample| sample.route).collect();
        let reflexes = routes.iter().filter(|route| **route == Route::Reactive).count();
        Self {
            duration: last.time.saturating_sub(first.time) as f64 / 1e9,
            distance: tally.distance(),
            changes: routes.windows(2).filter(|pair| pair[0] != pair[1]).count(),
            lasting_changes: tally.lasting_changes(),
            reactive_samples: reflexes as f64 / routes.len().max(1) as f64,
            reactive_distance: tally.reactive_share().unwrap_or_default(),
        }
    }
}
