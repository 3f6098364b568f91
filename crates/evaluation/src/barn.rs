//! Worlds of the BARN challenge.
//! Perille, Truong, Xiao and Stone, 2020, *Benchmarking metric ground navigation*.

use std::fs;
use std::path::Path;

use slate_sorted::SortedMap;

use crate::DataError;

/// Radius of all cylinders, m.
pub const CYLINDER_RADIUS: f64 = 0.075;

/// World of cylinders, which also form its walls.
#[derive(Clone, Debug, PartialEq)]
pub struct BarnWorld {
    /// Number among the 300 worlds.
    pub number: u32,
    /// Middles of the cylinders, m.
    pub cylinders: Vec<[f64; 2]>,
    /// Length of the best path from start to goal, m.
    pub path_length: f64,
}

/// Reads the worlds of a folder, or of `barn` in it.
/// `cylinders.csv` has the columns world, x and y, `path_lengths.json` the length of each world's path.
///
/// # Errors
/// A file is missing, or not what the format says; the error names file and line.
pub fn read_folder(folder: &Path) -> Result<Vec<BarnWorld>, DataError> {
    let inner = folder.join("barn");
    let folder = if inner.is_dir() { &inner } else { folder };
    let file = folder.join("path_lengths.json");
    let lengths: SortedMap<String, f64> =
        serde_json::from_str(&read(&file)?).map_err(|error| DataError::new(&file, error.to_string()))?;
    let cylinders = folder.join("cylinders.csv");
    let mut worlds: SortedMap<u32, BarnWorld> = SortedMap::new();
    for (number, line) in read(&cylinders)?.lines().enumerate().skip(1) {
        let (world, middle) = parse_cylinder(line)
            .ok_or_else(|| DataError::at(&cylinders, number, "expected three columns: world, x, y"))?;
        let path_length = match worlds.get(&world) {
            Some(known) => known.path_length,
            None => {
                lengths.get(&world.to_string()).copied().filter(|length| *length > 0.0).ok_or_else(|| {
                    DataError::at(
                        &cylinders,
                        number,
                        format!("world {world} has no length in {}", file.display()),
                    )
                })?
            }
        };
        worlds
            .entry(world)
            .or_insert(BarnWorld { number: world, cylinders: Vec::new(), path_length })
            .cylinders
            .push(middle);
    }
    if worlds.is_empty() {
        return Err(DataError::new(&cylinders, "no cylinder in it"));
    }
    Ok(worlds.into_values().collect())
}

fn read(file: &Path) -> Result<String, DataError> {
    fs::read_to_string(file).map_err(|error| DataError::unreadable(file, &error))
}

fn parse_cylinder(line: &str) -> Option<(u32, [f64; 2])> {
    let columns: Vec<&str> = line.split(',').collect();
    let [world, x, y] = columns[..] else { return None };
    let coordinate = |text: &str| text.trim().parse::<f64>().ok().filter(|value| value.abs() < 1e3);
    Some((world.trim().parse().ok()?, [coordinate(x)?, coordinate(y)?]))
}
