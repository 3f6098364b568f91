//! Writing maps.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

use slate_grid::{OccupancyMap, UNKNOWN_CELL};

use crate::image::{MapImage, check_size};
use crate::metadata::Metadata;
use crate::occupancy::{MapFileOptions, MapMode};
use crate::{MapFileError, pgm, png_image};

/// Writes `map.yaml`, and its image beside it with the same name: a PGM, or a PNG if `mode` is `scale`, where unknown
/// cells are transparent.
///
/// # Errors
/// Cells that do not match the geometry, thresholds of no map, or a file that can't be written.
pub fn write_map(file: &Path, map: &OccupancyMap, options: &MapFileOptions) -> Result<(), MapFileError> {
    let geometry = &map.geometry;
    check_size(file, [geometry.width, geometry.height], 1)?;
    if map.cells.len() != geometry.cells() {
        let (found, expected) = (map.cells.len(), geometry.cells());
        return Err(MapFileError::new(file, format!("{found} cells: expected {expected}")));
    }
    let thresholds = [0.0, options.free_thresh, options.occupied_thresh, 1.0];
    if !thresholds.is_sorted() || options.free_thresh >= options.occupied_thresh {
        let reason = "invalid thresholds: expected 0 <= free_thresh < occupied_thresh <= 1";
        return Err(MapFileError::new(file, reason));
    }
    let name = file.with_extension(if options.mode == MapMode::Scale { "png" } else { "pgm" });
    let image = image(map, options);
    let opened = File::create(&name).map_err(|error| MapFileError::unwritable(&name, error))?;
    let mut target = BufWriter::new(opened);
    match options.mode {
        MapMode::Scale => {
            png_image::write(&image, &mut target).map_err(|error| MapFileError::unwritable(&name, error))?;
        }
        _ => pgm::write(&image, &mut target).map_err(|error| MapFileError::unwritable(&name, error))?,
    }
    target.flush().map_err(|error| MapFileError::unwritable(&name, error))?;
    let metadata = Metadata {
        image: name.file_name().map(Into::into).unwrap_or_default(),
        image_line: 1,
        resolution: geometry.resolution,
        origin: geometry.origin(),
        options: *options,
    };
    fs::write(file, metadata.text()).map_err(|error| MapFileError::unwritable(file, error))
}

fn image(map: &OccupancyMap, options: &MapFileOptions) -> MapImage {
    let has_alpha = options.mode == MapMode::Scale && map.cells.contains(&UNKNOWN_CELL);
    let channels = if has_alpha { 2 } else { 1 };
    let mut bytes = Vec::with_capacity(map.cells.len() * channels);
    for cell in map.cells.chunks_exact(map.geometry.width).rev().flatten() {
        let (shade, is_opaque) = options.pixel(*cell);
        bytes.push(shade);
        if has_alpha {
            bytes.push(if is_opaque { u8::MAX } else { 0 });
        }
    }
    MapImage { width: map.geometry.width, height: map.geometry.height, channels, bytes }
}
