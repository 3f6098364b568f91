//! Map files of ROS: an occupancy grid as `map.yaml` with an image.
//! `map_server` and Nav2 read and write them.
//!
//! [`read_map`] and [`write_map`] need no agent. The image is a binary PGM (`P5`) or a PNG; its first row has the
//! largest y of the map.
//!
//! ```
//! use slate_grid::{Geometry, OccupancyMap};
//! use slate_map_file::{MapFileOptions, read_map, write_map};
//!
//! let folder = std::env::temp_dir().join("slate-map-file-example");
//! std::fs::create_dir_all(&folder)?;
//! let geometry = Geometry::new([-1.0, -2.0], [0.1, 0.15], 0.05, 1_000).unwrap();
//! let map = OccupancyMap { geometry, cells: vec![0, 100, -1, 0, 0, 100] };
//! write_map(&folder.join("map.yaml"), &map, &MapFileOptions::default())?;
//! assert_eq!(read_map(&folder.join("map.yaml"))?, map);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod image;
mod metadata;
mod occupancy;
mod pgm;
mod png_image;
mod quotes;
mod read;
mod write;

pub use error::MapFileError;
pub use occupancy::{MapFileOptions, MapMode};
pub use read::{read_map, read_map_image};
pub use write::write_map;

/// Largest number of cells of a map.
pub const MOST_MAP_CELLS: usize = 1 << 26;
