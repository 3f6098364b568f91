//! Pixels of an image.

use std::path::Path;

use crate::{MOST_MAP_CELLS, MapFileError};

/// MapImage of 8 bits per channel, rows from the top.
pub(crate) struct MapImage {
    pub width: usize,
    pub height: usize,
    /// Gray, gray and alpha, RGB, or RGBA: 1 to 4.
    pub channels: usize,
    pub bytes: Vec<u8>,
}

/// Refuses sizes that are not a map's, before memory for them is allocated.
pub(crate) fn check_size(
    file: &Path,
    [width, height]: [usize; 2],
    channels: usize,
) -> Result<(), MapFileError> {
    // The image, and the cells.
    let bytes = width as u128 * height as u128 * (channels as u128 + 1);
    if width == 0 || height == 0 || width as u128 * height as u128 > MOST_MAP_CELLS as u128 {
        let megabytes = bytes / 1_000_000;
        return Err(MapFileError::new(
            file,
            format!(
                "a map of {width} x {height} cells, which takes {megabytes} MB: expected 1 to \
                {MOST_MAP_CELLS} cells"
            ),
        ));
    }
    Ok(())
}
