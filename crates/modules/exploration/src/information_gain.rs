//! Information gain: the unknown area in view of a sensor.

use slate_grid::{LineCells, OccupancyMap, UNKNOWN_CELL};
use slate_module::math;
use slate_planning::GridCell;

use crate::frontier::is_free;

/// Number of beams that are followed.
const BEAMS: usize = 120;

/// Unknown cells in view of an omnidirectional sensor, by ray casting.
#[derive(Clone, Debug)]
pub struct InformationGain {
    /// Ends of the beams from the sensor, m.
    ends: Vec<[f64; 2]>,
    /// Count in which each cell was seen last.
    counted: Vec<u32>,
    count: u32,
}

impl InformationGain {
    /// Returns the gain of a sensor with a range, m.
    pub fn new(sensor_range: f64) -> Self {
        let end = |beam: usize| {
            let angle = std::f64::consts::TAU * beam as f64 / BEAMS as f64;
            [sensor_range * math::cos(angle), sensor_range * math::sin(angle)]
        };
        Self { ends: (0..BEAMS).map(end).collect(), counted: Vec::new(), count: 0 }
    }

    /// Returns the unknown area in view from the middle of a cell, m².
    /// Obstacles occlude what is behind them, unknown cells do not.
    pub fn area(&mut self, map: &OccupancyMap, from: GridCell) -> f64 {
        if self.counted.len() != map.cells.len() || self.count == u32::MAX {
            self.counted.clear();
            self.counted.resize(map.cells.len(), 0);
            self.count = 0;
        }
        self.count += 1;
        let geometry = &map.geometry;
        let start = (f64::from(from.column) + 0.5, f64::from(from.row) + 0.5);
        let mut unknown = 0.0;
        for [x, y] in &self.ends {
            let end = (start.0 + x / geometry.resolution, start.1 + y / geometry.resolution);
            for (column, row) in LineCells::new(start, end) {
                let inside = usize::try_from(column).ok().zip(usize::try_from(row).ok());
                let Some((column, row)) =
                    inside.filter(|(column, row)| *column < geometry.width && *row < geometry.height)
                else {
                    break;
                };
                let cell = geometry.index(column, row);
                if map.cells[cell] == UNKNOWN_CELL {
                    if std::mem::replace(&mut self.counted[cell], self.count) != self.count {
                        unknown += 1.0;
                    }
                } else if !is_free(map.cells[cell]) {
                    break;
                }
            }
        }
        unknown * geometry.resolution * geometry.resolution
    }
}
