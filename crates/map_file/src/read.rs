//! Reading maps.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;

use slate_grid::{Geometry, OccupancyMap};
use slate_interfaces::Pose2;

use crate::image::MapImage;
use crate::metadata::Metadata;
use crate::occupancy::{MapFileOptions, MapMode};
use crate::{MOST_MAP_CELLS, MapFileError, pgm, png_image};

/// Largest size of `map.yaml`, bytes.
const MOST_TEXT: u64 = 1 << 20;

/// Reads `map.yaml` and its image.
///
/// # Errors
/// A file that can't be read or is not what the format says, or a map of more than [`MOST_MAP_CELLS`] cells, which is
/// refused before memory for it is allocated. The error names file, line and what was expected.
pub fn read_map(file: &Path) -> Result<OccupancyMap, MapFileError> {
    let length = fs::metadata(file).map_err(|error| MapFileError::unreadable(file, &error))?.len();
    if length > MOST_TEXT {
        return Err(MapFileError::new(file, format!("{length} bytes: expected a map.yaml of some lines")));
    }
    let text = fs::read_to_string(file).map_err(|error| MapFileError::unreadable(file, &error))?;
    let metadata = Metadata::parse(file, &text)?;
    let path = file.parent().unwrap_or(Path::new("")).join(&metadata.image);
    let opened = File::open(&path).map_err(|error| {
        let reason = format!("image `{}` can't be read: {error}", path.display());
        MapFileError::at(file, metadata.image_line, reason)
    })?;
    let image = image(&path, opened)?.ok_or_else(|| {
        let reason = format!("image `{}`: expected a .pgm or .png file", metadata.image);
        MapFileError::at(file, metadata.image_line, reason)
    })?;
    let size = [image.width, image.height];
    let geometry = Geometry::with_origin(metadata.origin, metadata.resolution, size, MOST_MAP_CELLS);
    // Both files have been checked.
    let geometry = geometry.ok_or_else(|| MapFileError::new(file, "no geometry of a map"))?;
    Ok(OccupancyMap { geometry, cells: cells(&image, &metadata.options) })
}

/// Reads an image without a `map.yaml`.
/// The map has the given width along x, m, and its first cell's corner is the origin.
///
/// # Errors
/// As [`read_map`].
pub fn read_map_image(
    file: &Path,
    width: f64,
    options: &MapFileOptions,
) -> Result<OccupancyMap, MapFileError> {
    let opened = File::open(file).map_err(|error| MapFileError::unreadable(file, &error))?;
    let image =
        image(file, opened)?.ok_or_else(|| MapFileError::new(file, "expected a .pgm or .png file"))?;
    let size = [image.width, image.height];
    let geometry = Geometry::with_origin(Pose2::default(), width / image.width as f64, size, MOST_MAP_CELLS);
    let geometry = geometry
        .ok_or_else(|| MapFileError::new(file, format!("a map of {width} m: expected a width above 0 m")))?;
    Ok(OccupancyMap { geometry, cells: cells(&image, options) })
}

/// Reads an image by its extension; `None` for another one.
fn image(path: &Path, opened: File) -> Result<Option<MapImage>, MapFileError> {
    Ok(match extension(path).as_deref() {
        Some("pgm") => Some(pgm::read(path, BufReader::new(opened))?),
        Some("png") => Some(png_image::read(path, BufReader::new(opened))?),
        _ => None,
    })
}

/// Returns the extension of a file in lower case.
pub(crate) fn extension(file: &Path) -> Option<String> {
    file.extension().map(|extension| extension.to_string_lossy().to_lowercase())
}

fn cells(image: &MapImage, options: &MapFileOptions) -> Vec<i8> {
    let has_alpha = image.channels.is_multiple_of(2);
    // As `map_server` does, which takes alpha for a color of trinary maps.
    let colors =
        if has_alpha && options.mode != MapMode::Trinary { image.channels - 1 } else { image.channels };
    let cell = |pixel: &[u8]| {
        let sum: u32 = pixel[..colors].iter().map(|channel| u32::from(*channel)).sum();
        let is_opaque = !has_alpha || pixel.last() == Some(&u8::MAX);
        options.cell(f64::from(sum) / (255.0 * colors as f64), is_opaque)
    };
    let rows = image.bytes.chunks_exact(image.width * image.channels).rev();
    rows.flat_map(|row| row.chunks_exact(image.channels).map(cell)).collect()
}
