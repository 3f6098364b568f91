//! Tells how near the nearest thing is that the sonars of a robot hear.
//!
//! `cargo test` tests it without a robot, `slate run PROJECT_NAME.toml` adds it to a robot in the simulator.

use slate_plugin::prelude::*;

/// The nearest thing.
#[interface]
#[derive(PartialEq)]
pub struct Nearest {
    /// How far away it is.
    #[unit("m")]
    pub distance: f64,
}

/// What it reads and writes. What these are linked to is said in the configuration.
#[ports]
pub struct Io {
    /// What the sonars hear.
    #[stale(after = "500ms")]
    sonar: Required<SonarScan>,
    /// The nearest of it, smoothed.
    nearest: Output<Nearest>,
}

#[params]
pub struct Params {
    #[param(default = 0.5, range = 0.0..=1.0, doc = "how much of the last value stays; 0 is no smoothing")]
    inertia: f64,
}

/// The module; its state is beside it, so that the host can save it.
pub struct NearestThing;

/// Finds the nearest echo.
#[module(stage = SensorProcess, name = "MODULE_KIND")]
impl Module for NearestThing {
    type Io = Io;
    type Params = Params;
    // The last distance, metres; it is carried over when the code is exchanged.
    type State = Option<f64>;

    fn tick(last: &mut Option<f64>, io: &Io, params: &Params, _: &Tick) -> Outcome {
        let Some(scan) = io.sonar.fresh() else {
            // Who hears nothing says nothing.
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

plugin!(NearestThing);

#[cfg(test)]
mod tests {
    use slate_plugin::module::testing::Fixture;

    use super::*;

    /// What it says when nothing is heard within so many metres.
    fn nothing_within(module: &mut Fixture<NearestThing>, range: f64) -> f64 {
        module.write("sonar", 0, |scan: &mut SonarScan| scan.range_max = range);
        assert_eq!(module.tick(), Outcome::Ok);
        module.output::<Nearest>("nearest").unwrap().distance
    }

    #[test]
    fn nothing_is_nearer_than_the_sonars_hear() {
        let mut module = Fixture::new();
        assert_eq!(nothing_within(&mut module, 2.0), 2.0);
    }

    #[test]
    fn half_of_the_last_value_stays() {
        let mut module = Fixture::new();
        nothing_within(&mut module, 2.0);
        assert_eq!(nothing_within(&mut module, 1.0), 1.5);
    }

    #[test]
    fn it_says_nothing_while_it_hears_nothing() {
        let mut module = Fixture::<NearestThing>::new();
        assert_eq!(module.tick().waiting_for(), Some("sonar"));
        module.set("sonar", SonarScan::default());
        module.expire("sonar");
        assert_eq!(module.tick(), Outcome::Degraded);
        assert_eq!(module.output::<Nearest>("nearest"), None);
    }
}
