//! Distance of the nearest obstacle in the sonar ranges of a robot.
//!
//! `cargo test` tests it without a robot, `slate run PROJECT_NAME.toml` adds it to a robot in the simulator.

use slate_plugin::prelude::*;

/// Nearest obstacle.
#[interface]
#[derive(PartialEq)]
pub struct Nearest {
    /// Distance from the sonar.
    #[unit("m")]
    pub distance: f64,
}

/// Ports of the module; the configuration links them.
#[ports]
pub struct Io {
    /// Ranges of the sonars.
    #[stale(after = "500ms")]
    sonar: Required<SonarScan>,
    /// Nearest obstacle, smoothed.
    nearest: Output<Nearest>,
}

#[params]
pub struct Params {
    #[param(default = 0.5, range = 0.0..=1.0, doc = "weight of the previous value; 0 is no smoothing")]
    inertia: f64,
}

/// Module; the host owns its state and can save it.
pub struct NearestObstacle;

/// Finds the nearest echo.
#[module(stage = SensorProcess, name = "MODULE_KIND")]
impl Module for NearestObstacle {
    type Io = Io;
    type Params = Params;
    // The last distance, meters, which a reload of the code keeps.
    type State = Option<f64>;

    fn tick(last: &mut Option<f64>, io: &Io, params: &Params, _: &Tick) -> Outcome {
        let Some(scan) = io.sonar.fresh() else {
            // No output without a fresh scan.
            *last = None;
            return Outcome::Degraded;
        };
        let heard = scan.echoes.iter().map(|echo| echo.range);
        let heard = heard.fold(scan.range_max, math::min);
        let before = last.unwrap_or(heard);
        let distance = params.inertia * before + (1.0 - params.inertia) * heard;
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

    /// Returns the distance when no obstacle is within `range` meters.
    fn nothing_within(module: &mut Fixture<NearestObstacle>, range: f64) -> f64 {
        module.write("sonar", 0, |scan: &mut SonarScan| scan.range_max = range);
        assert_eq!(module.tick(), Outcome::Ok);
        module.output::<Nearest>("nearest").unwrap().distance
    }

    #[test]
    fn distance_is_at_most_the_range_of_the_sonars() {
        let mut module = Fixture::new();
        assert_eq!(nothing_within(&mut module, 2.0), 2.0);
    }

    #[test]
    fn previous_value_has_half_the_weight() {
        let mut module = Fixture::new();
        nothing_within(&mut module, 2.0);
        assert_eq!(nothing_within(&mut module, 1.0), 1.5);
    }

    #[test]
    fn writes_nothing_without_a_fresh_scan() {
        let mut module = Fixture::<NearestObstacle>::new();
        assert_eq!(module.tick().waiting_for(), Some("sonar"));
        module.set("sonar", SonarScan::default());
        module.expire("sonar");
        assert_eq!(module.tick(), Outcome::Degraded);
        assert_eq!(module.output::<Nearest>("nearest"), None);
    }
}
