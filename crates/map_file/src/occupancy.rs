//! Occupancy of cells, and the shades of the image.

use slate_grid::UNKNOWN_CELL;

/// Occupancy of an unknown cell as `map_saver` writes it: shade 205.
const UNKNOWN_OCCUPANCY: f64 = 50.0 / 255.0;
/// Occupancy of a free cell as `map_saver` writes it: shade 254.
const FREE_OCCUPANCY: f64 = 1.0 / 255.0;

/// Mapping from shades of the image to occupancy, `mode`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MapMode {
    /// Occupied above `occupied_thresh`, free below `free_thresh`, else unknown.
    #[default]
    Trinary,
    /// [`Trinary`](Self::Trinary) with percents between the thresholds.
    /// Transparent pixels are unknown.
    Scale,
    /// Shades from 0 to 100 are percents; others are unknown.
    Raw,
}

/// Fields of `map.yaml` beside geometry and image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapFileOptions {
    /// Mapping from shades to occupancy, `mode`.
    pub mode: MapMode,
    /// Negation: true if light pixels are occupied, `negate`.
    pub negate: bool,
    /// Occupancy above which a cell is occupied, `occupied_thresh`, 0 to 1.
    pub occupied_thresh: f64,
    /// Occupancy below which a cell is free, `free_thresh`, 0 to 1.
    pub free_thresh: f64,
}

/// Values of `map_saver`.
impl Default for MapFileOptions {
    fn default() -> Self {
        Self { mode: MapMode::Trinary, negate: false, occupied_thresh: 0.65, free_thresh: 0.196 }
    }
}

impl MapMode {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Trinary => "trinary",
            Self::Scale => "scale",
            Self::Raw => "raw",
        }
    }

    pub(crate) fn parse(text: &str) -> Option<Self> {
        [Self::Trinary, Self::Scale, Self::Raw].into_iter().find(|mode| mode.name() == text)
    }
}

impl MapFileOptions {
    /// Returns the cell of a pixel.
    /// `shade` is from 0 (black) to 1; `is_opaque` is false for a transparent pixel.
    pub(crate) fn cell(&self, shade: f64, is_opaque: bool) -> i8 {
        if self.mode == MapMode::Raw {
            let percent = (shade * 255.0).round();
            return if percent <= 100.0 { percent as i8 } else { UNKNOWN_CELL };
        }
        if self.mode == MapMode::Scale && !is_opaque {
            return UNKNOWN_CELL;
        }
        let occupancy = if self.negate { shade } else { 1.0 - shade };
        if occupancy > self.occupied_thresh {
            100
        } else if occupancy < self.free_thresh {
            0
        } else if self.mode == MapMode::Scale {
            let share = (occupancy - self.free_thresh) / (self.occupied_thresh - self.free_thresh);
            (100.0 * share).round() as i8
        } else {
            UNKNOWN_CELL
        }
    }

    /// Returns the pixel of a cell: shade from 0 (black) to 255, and opacity.
    pub(crate) fn pixel(&self, cell: i8) -> (u8, bool) {
        let is_known = (0..=100).contains(&cell);
        if self.mode == MapMode::Raw {
            return (if is_known { cell as u8 } else { u8::MAX }, true);
        }
        let span = self.occupied_thresh - self.free_thresh;
        let occupancy = match (self.mode, cell) {
            _ if !is_known => self.unknown_occupancy(),
            (MapMode::Scale, 1..100) => self.free_thresh + span * f64::from(cell) / 100.0,
            (_, cell) if f64::from(cell) <= 100.0 * self.free_thresh => self.free_occupancy(),
            (_, cell) if f64::from(cell) >= 100.0 * self.occupied_thresh => 1.0,
            _ => self.unknown_occupancy(),
        };
        let shade = if self.negate { occupancy } else { 1.0 - occupancy };
        ((255.0 * shade).round() as u8, is_known || self.mode == MapMode::Trinary)
    }

    /// Returns the occupancy of unknown cells: shade 205 if it is read as unknown.
    /// Else it is the mean of the thresholds, as with Nav2's `free_thresh` of 0.25, which reads 205 as free.
    fn unknown_occupancy(&self) -> f64 {
        let is_between = (self.free_thresh..=self.occupied_thresh).contains(&UNKNOWN_OCCUPANCY);
        if is_between { UNKNOWN_OCCUPANCY } else { (self.free_thresh + self.occupied_thresh) / 2.0 }
    }

    fn free_occupancy(&self) -> f64 {
        if FREE_OCCUPANCY < self.free_thresh { FREE_OCCUPANCY } else { 0.0 }
    }
}
