//! Writing maps.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use slate_grid::{OccupancyMap, UNKNOWN_CELL};

use crate::image::{MapImage, check_size};
use crate::metadata::Metadata;
use crate::occupancy::{MapFileOptions, MapMode};
use crate::read::extension;
use crate::{MapFileError, pgm, png_image};

/// Writes `map.yaml`, and before it its image with the same name beside it.
/// The image is a PGM, or a PNG if `mode` is `scale`, where unknown cells are transparent. Each file is written beside
/// the one that it then replaces.
///
/// # Errors
/// A file with another extension than `yaml` or `yml`, cells that do not match the geometry, thresholds of no map, or a
/// file that can't be written.
pub fn write_map(file: &Path, map: &OccupancyMap, options: &MapFileOptions) -> Result<(), MapFileError> {
    check(file, map, options)?;
    let path = file.with_extension(if options.mode == MapMode::Scale { "png" } else { "pgm" });
    let name = path.file_name().and_then(OsStr::to_str);
    let name = name.ok_or_else(|| MapFileError::new(file, "expected a name in UTF-8"))?;
    let image = image(map, options);
    replace(&path, |target| match options.mode {
        MapMode::Scale => png_image::write(&image, target).map_err(io::Error::from),
        _ => pgm::write(&image, target),
    })?;
    let metadata = Metadata {
        image: name.to_owned(),
        image_line: 1,
        resolution: map.geometry.resolution,
        origin: map.geometry.origin(),
        options: *options,
    };
    replace(file, |target| target.write_all(metadata.text().as_bytes()))
}

fn check(file: &Path, map: &OccupancyMap, options: &MapFileOptions) -> Result<(), MapFileError> {
    // The image's name is that of the file but for the extension: with its own it would replace the image.
    if !matches!(extension(file).as_deref(), Some("yaml" | "yml")) {
        return Err(MapFileError::new(
            file,
            "expected a .yaml or .yml file, whose image is written beside it",
        ));
    }
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
    Ok(())
}

/// Replaces a file by one written beside it.
/// No reader sees half of it.
fn replace(
    file: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), MapFileError> {
    let mut name = file.as_os_str().to_owned();
    name.push(".tmp");
    let beside = PathBuf::from(name);
    let written = File::create(&beside).and_then(|opened| {
        let mut target = BufWriter::new(opened);
        write(&mut target)?;
        target.flush()?;
        fs::rename(&beside, file)
    });
    written.map_err(|error| {
        // The rest of a failed attempt is of no use; the first error is the one to report.
        let _ = fs::remove_file(&beside);
        MapFileError::unwritable(file, error)
    })
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
