//! Distance to the nearest obstacle that the sonars of a robot detect.
//!
//! `cargo test` tests it without a robot, `slate run PROJECT_NAME.toml` adds it to a robot in the simulator.

use slate_plugin::prelude::*;

/// The nearest obstacle.
#[interface]
#[derive(PartialEq)]
pub struct Nearest {
    /// Distance to it.
    #[unit("m")]
    pub distance: f64,
}

/// Ports; the configuration links them.
#[ports]
pub struct Io {
    /// Ranges of the sonars.
    #[stale(after = "500ms")]
    sonar: Required<SonarScan>,
    /// The smallest range, smoothed.
    nearest: Output<Nearest>,
}

#[params]
pub struct Params {
    #[param(default = 0.5, range = 0.0..=1.0, doc = "weight of the last value; 0 is no smoothing")]
    inertia: f64,
}

/// The module; the host keeps its state.
pub struct NearestObstacle;

/// Finds the nearest echo.
#[module(stage = SensorProcess, name = "MODULE_KIND")]
impl Module for NearestObstacle {
    type Io = Io;
    type Params = Params;
    // The last distance, metres; a reload keeps it.
    type State = Option<f64>;

    fn tick(last: &mut Option<f64>, io: &Io, params: &Params, _: &Tick) -> Outcome {
        let Some(scan) = io.sonar.fresh() else {
            // Without a fresh scan there is no distance.
            *last = None;
            return Outcome::Degraded;
        };
        let ranges = scan.echoes.iter().map(|echo| echo.range);
        let nearest = ranges.fold(scan.range_max, math::min);
        let before = last.unwrap_or(nearest);
        let distance = params.inertia * before + (1.0 - params.inertia) * nearest;
        *last = Some(distance);
        io.nearest.set(Nearest { distance });
        Outcome::Ok
    }
}

plugin!(NearestObstacle);

#[cfg(test)]
mod tests {
    use slate_plugin::module::testing::Fixture;

    use super::*;

    /// The output for a scan without echoes and this maximum range.
    fn distance_without_echoes(module: &mut Fixture<NearestObstacle>, range: f64) -> f64 {
        module.write("sonar", 0, |scan: &mut SonarScan| scan.range_max = range);
        assert_eq!(module.tick(), Outcome::Ok);
        module.output::<Nearest>("nearest").unwrap().distance
    }

    #[test]
    fn distance_without_echoes_is_the_maximum_range() {
        let mut module = Fixture::new();
        assert_eq!(distance_without_echoes(&mut module, 2.0), 2.0);
    }

    #[test]
    fn output_is_smoothed_by_the_last_value() {
        let mut module = Fixture::new();
        distance_without_echoes(&mut module, 2.0);
        assert_eq!(distance_without_echoes(&mut module, 1.0), 1.5);
    }

    #[test]
    fn output_stops_without_a_fresh_scan() {
        let mut module = Fixture::<NearestObstacle>::new();
        assert_eq!(module.tick().waiting_for(), Some("sonar"));
        module.set("sonar", SonarScan::default());
        module.expire("sonar");
        assert_eq!(module.tick(), Outcome::Degraded);
        assert_eq!(module.output::<Nearest>("nearest"), None);
    }
}
