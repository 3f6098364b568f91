//! Finds of the robot.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Orientation, Position, SonarScan};
use slate_plugin::mapek::{FactTable, Statements};
use slate_plugin::prelude::*;

/// Obstacle in the arena.
#[interface]
#[derive(PartialEq, Serialize, Deserialize)]
pub struct Obstacle {
    /// Position to the east.
    #[unit("m")]
    pub x: f64,
    /// Position to the north.
    #[unit("m")]
    pub y: f64,
}

/// Pose, sonars, and statements.
#[ports]
pub struct Finding {
    range: Observed<SonarScan>,
    position: Observed<Position>,
    orientation: Observed<Orientation>,
    /// Finds of this robot.
    #[capacity(512)]
    found: Output<FactTable<Obstacle>>,
}

/// Parameters of the finder.
#[params]
pub struct FinderParams {
    #[param(default = 1.0, range = 0.0..=5.0, unit = "m", doc = "maximum range of a find")]
    max_range: f64,
    #[param(default = 0.5, range = 0.1..=5.0, unit = "m", doc = "edge length of a cell; finds of a cell are one")]
    cell_size: f64,
}

/// States the positions of obstacles, and reports new ones to the Plan.
pub struct Finder;

impl Analyze for Finder {
    const NAME: &'static str = "finder";
    const DOC: &'static str = "States the positions of obstacles, and reports new ones.";
    type Observed = Finding;
    type Params = FinderParams;
    type State = Statements<Obstacle>;
    type Value = Obstacle;

    fn process(
        found: &mut Statements<Obstacle>,
        observed: &Finding,
        params: &FinderParams,
        now: &Tick,
    ) -> Option<Obstacle> {
        let (position, orientation) = (observed.position.fresh()?, observed.orientation.fresh()?);
        let scan = observed.range.updated()?;
        let mut new = None;
        for (placement, echo) in scan.placements.iter().zip(scan.echoes.iter()) {
            if !echo.heard.get() || echo.range > params.max_range {
                continue;
            }
            // The sonars sit on the hull, which is small against a square.
            let direction = orientation.theta + placement.theta;
            // The arena is small against the range of these integers.
            let square =
                |start: f64, way: f64| ((start + way * echo.range) / params.cell_size).round() as i32;
            let (column, row) =
                (square(position.x, math::cos(direction)), square(position.y, math::sin(direction)));
            let obstacle =
                Obstacle { x: f64::from(column) * params.cell_size, y: f64::from(row) * params.cell_size };
            let key = format!("{column},{row}");
            if found.get(&key).is_none() && found.state(now.now(), &key, 0.8, obstacle) {
                new = Some(obstacle);
            }
        }
        found.write(now.now(), &observed.found);
        new
    }
}
