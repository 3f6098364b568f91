//! Maps and scenarios of the MovingAI benchmarks.
//! Sturtevant, 2012, *Benchmarks for grid-based pathfinding*.

use std::fs;
use std::path::{Path, PathBuf};

use slate_planning::{CostGrid, GridCell, LETHAL};

use crate::DataError;

/// Problem of a scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct PathProblem {
    /// Start.
    pub start: GridCell,
    /// Goal cell.
    pub goal: GridCell,
    /// Length of the shortest 8-connected path without cut corners, cells.
    pub length: f64,
}

/// Map and the problems on it.
#[derive(Clone, Debug)]
pub struct Benchmark {
    /// File of the map.
    pub map: PathBuf,
    /// Cost grid; row 0 is the first line of the file.
    pub grid: CostGrid,
    /// Problems, in the order of the file.
    pub problems: Vec<PathProblem>,
}

/// Reads all maps of a folder that have a scenario, by name.
/// The files are `NAME.map` and `NAME.map.scen`.
///
/// # Errors
/// The folder has none, or a file is not what the format says; the error names file and line.
pub fn read_folder(folder: &Path) -> Result<Vec<Benchmark>, DataError> {
    let entries = fs::read_dir(folder).map_err(|error| DataError::unreadable(folder, &error))?;
    let mut maps: Vec<PathBuf> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "map"))
        .collect();
    maps.sort();
    let mut found = Vec::new();
    for map in maps {
        let scenario = map.with_extension("map.scen");
        if scenario.is_file() {
            let grid = parse_map(&map, &read(&map)?)?;
            let problems = parse_scenario(&scenario, &read(&scenario)?, &grid)?;
            found.push(Benchmark { map, grid, problems });
        }
    }
    if found.is_empty() {
        return Err(DataError::new(folder, "no NAME.map with its NAME.map.scen, as MovingAI has them"));
    }
    Ok(found)
}

fn read(file: &Path) -> Result<String, DataError> {
    fs::read_to_string(file).map_err(|error| DataError::unreadable(file, &error))
}

/// Parses a map, whose characters `.`, `G` and `S` are free cells.
fn parse_map(file: &Path, text: &str) -> Result<CostGrid, DataError> {
    let mut lines = text.lines().enumerate();
    let (mut width, mut height) = (None, None);
    for (number, line) in lines.by_ref() {
        match line.split_once(' ') {
            Some(("width", value)) => width = Some(size(file, number, value)?),
            Some(("height", value)) => height = Some(size(file, number, value)?),
            _ if line.trim() == "map" => break,
            _ => {}
        }
    }
    let (Some(width), Some(height)) = (width, height) else {
        return Err(DataError::new(file, "lines `width N`, `height N` and `map` are missing at the start"));
    };
    let mut rows: Vec<&[u8]> = Vec::new();
    for (number, line) in lines.filter(|(_, line)| !line.is_empty()) {
        if line.len() != width as usize {
            let length = line.len();
            return Err(DataError::at(file, number, format!("{length} cells, expected {width}")));
        }
        rows.push(line.as_bytes());
    }
    if rows.len() != height as usize {
        return Err(DataError::new(file, format!("{} rows, expected {height}", rows.len())));
    }
    let is_free =
        |cell: GridCell| matches!(rows[cell.row as usize][cell.column as usize], b'.' | b'G' | b'S');
    CostGrid::new(width, height, |cell| if is_free(cell) { 0 } else { LETHAL })
        .map_err(|error| DataError::new(file, error.to_string()))
}

/// Parses a size of the map.
/// The largest map is 20 million cells.
fn size(file: &Path, line: usize, text: &str) -> Result<u32, DataError> {
    text.trim()
        .parse()
        .ok()
        .filter(|size| (1..=4_500).contains(size))
        .ok_or_else(|| DataError::at(file, line, format!("`{text}` is not a size: expected 1 to 4500 cells")))
}

fn parse_scenario(file: &Path, text: &str, grid: &CostGrid) -> Result<Vec<PathProblem>, DataError> {
    let mut problems = Vec::new();
    for (number, line) in text.lines().enumerate().skip(1).filter(|(_, line)| !line.trim().is_empty()) {
        let problem = parse_problem(line).ok_or_else(|| {
            DataError::at(
                file,
                number,
                "expected nine columns: bucket, map, width, height, start x, y, goal x, y, length",
            )
        })?;
        for cell in [problem.start, problem.goal] {
            if !grid.is_passable(cell) {
                let (column, row) = (cell.column, cell.row);
                return Err(DataError::at(
                    file,
                    number,
                    format!("cell {column} {row} is not free in the map"),
                ));
            }
        }
        problems.push(problem);
    }
    if problems.is_empty() {
        return Err(DataError::new(file, "no problem in it"));
    }
    Ok(problems)
}

fn parse_problem(line: &str) -> Option<PathProblem> {
    let columns: Vec<&str> = line.split_whitespace().collect();
    let [_, _, _, _, start_x, start_y, goal_x, goal_y, length] = columns[..] else { return None };
    let cell = |x: &str, y: &str| Some(GridCell::new(x.parse().ok()?, y.parse().ok()?));
    Some(PathProblem {
        start: cell(start_x, start_y)?,
        goal: cell(goal_x, goal_y)?,
        length: length.parse().ok()?,
    })
}
