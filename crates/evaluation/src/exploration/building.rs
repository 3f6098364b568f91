//! Buildings that a robot explores.

use std::fs;
use std::path::{Path, PathBuf};

use slate_grid::{DistanceTransform, Geometry, OccupancyMap};
use slate_interfaces::Pose2;
use slate_map_file::{MapFileOptions, read_map_image};
use slate_module::Random;
use slate_planning::GridCell;

use crate::DataError;

/// Explore-Bench's buildings are 25 m wide, in cells of 0.1 m.
const WIDTH: f64 = 25.0;
/// Width of Stage's hospital, m.
/// Three of its cells are one here, which makes 0.11 m.
const HOSPITAL_WIDTH: f64 = 40.0;
const HOSPITAL_CELLS: usize = 3;

/// Building with its visible area.
pub struct UnknownBuilding {
    /// Name of its file.
    pub name: String,
    /// Free and occupied cells; unknown ones are walls.
    pub map: OccupancyMap,
    /// Cells in which the robot can start.
    starts: Vec<GridCell>,
    /// Free cells that are connected to those.
    area: Vec<usize>,
}

impl UnknownBuilding {
    /// Reads the buildings of a folder.
    /// Those of Explore-Bench by name, then Stage's hospital.
    pub fn read_folder(folder: &Path, robot_radius: f64) -> Result<Vec<Self>, DataError> {
        let entries = fs::read_dir(folder).map_err(|error| DataError::unreadable(folder, &error))?;
        let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
        files.sort();
        let mut found = Vec::new();
        for file in files {
            let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let map = match name.as_str() {
                "hospital_section" => hospital(&file)?,
                _ if name.starts_with("explorebench_") => read(&file, WIDTH)?,
                _ => continue,
            };
            found.push(Self::new(name, map, robot_radius).ok_or_else(|| {
                DataError::new(&file, "no free cell in which a robot fits: expected a map of a building")
            })?);
        }
        if found.is_empty() {
            return Err(DataError::new(folder, "no explorebench_NAME.pgm or hospital_section.png in it"));
        }
        Ok(found)
    }

    /// Creates a building; a robot starts in its largest room, or rooms with doors.
    /// `None` if the robot fits nowhere.
    pub fn new(name: String, mut map: OccupancyMap, robot_radius: f64) -> Option<Self> {
        map.cells.iter_mut().filter(|cell| **cell < 0).for_each(|cell| *cell = 100);
        let Geometry { width, height, resolution, .. } = map.geometry;
        let mut transform = DistanceTransform::default();
        let squares = transform.squares(width, height, |cell| map.cells[cell] > 50);
        let least = robot_radius / resolution + 1.0;
        let fits: Vec<bool> = squares.iter().map(|square| *square as f64 > least * least).collect();
        let rooms = regions([width, height], |cell| fits[cell]);
        let room = rooms.into_iter().max_by_key(Vec::len)?;
        let is_free = |cell: usize| map.cells[cell] <= 50;
        let area = regions([width, height], is_free).into_iter().find(|area| area.contains(&room[0]))?;
        let cell = |cell: usize| GridCell::new((cell % width) as u32, (cell / width) as u32);
        Some(Self { name, starts: room.into_iter().map(cell).collect(), area, map })
    }

    /// Returns the start of a seed.
    pub fn start(&self, seed: u64) -> GridCell {
        let mut random = Random::new(seed, "start");
        self.starts[(random.unit() * self.starts.len() as f64) as usize]
    }

    /// Returns the share of the free area that a map knows, 0 to 1.
    pub fn known_share(&self, map: &OccupancyMap) -> f64 {
        let known = self.area.iter().filter(|cell| map.cells[**cell] >= 0).count();
        known as f64 / self.area.len() as f64
    }
}

fn read(file: &Path, width: f64) -> Result<OccupancyMap, DataError> {
    read_map_image(file, width, &MapFileOptions::default())
        .map_err(|error| DataError::new(file, error.to_string()))
}

fn hospital(file: &Path) -> Result<OccupancyMap, DataError> {
    let fine = read(file, HOSPITAL_WIDTH)?;
    let side = HOSPITAL_CELLS;
    let size = [fine.geometry.width / side, fine.geometry.height / side];
    let resolution = fine.geometry.resolution * side as f64;
    let geometry = Geometry::with_origin(Pose2::default(), resolution, size, fine.cells.len())
        .ok_or_else(|| DataError::new(file, format!("{} x {} cells are no building", size[0], size[1])))?;
    let most = |cell: usize| {
        let (column, row) = (cell % size[0] * side, cell / size[0] * side);
        let parts = (0..side * side).map(|k| fine.geometry.index(column + k % side, row + k / side));
        parts.map(|part| fine.cells[part]).max().unwrap_or(100)
    };
    Ok(OccupancyMap { geometry, cells: (0..size[0] * size[1]).map(most).collect() })
}

/// Returns the connected regions of cells of a kind, in their order of discovery.
fn regions([width, height]: [usize; 2], is_member: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
    let mut seen = vec![false; width * height];
    let mut regions = Vec::new();
    for first in 0..width * height {
        if seen[first] || !is_member(first) {
            continue;
        }
        seen[first] = true;
        let mut region = vec![first];
        let mut next = 0;
        while let Some(&cell) = region.get(next) {
            next += 1;
            let (column, row) = (cell % width, cell / width);
            let sides = [
                (column > 0).then(|| cell - 1),
                (column + 1 < width).then(|| cell + 1),
                (row > 0).then(|| cell - width),
                (row + 1 < height).then(|| cell + width),
            ];
            for side in sides.into_iter().flatten() {
                if is_member(side) && !std::mem::replace(&mut seen[side], true) {
                    region.push(side);
                }
            }
        }
        regions.push(region);
    }
    regions
}
