//! Maps of a running agent as files.

use std::path::{Path, PathBuf};

use clap::Subcommand;
use clap_complete::ArgValueCompleter;
use serde::Deserialize;
use slate::interfaces::Pose2;
use slate_grid::{Geometry, OccupancyMap};
use slate_map_file::{MOST_MAP_CELLS, MapFileOptions, write_map};

use crate::complete;
use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::{output, urls};

/// Interface of maps.
const MAP_INTERFACE: &str = "OccupancyGrid";

#[derive(Debug, Subcommand)]
pub enum MapVerb {
    /// Save a map of a running agent as map.yaml with its image
    Save {
        /// File in `.yaml`; its image is written beside it
        file: PathBuf,
        /// URL of the map, such as `/r2/slam/map` [default: the only one]
        #[arg(add = ArgValueCompleter::new(complete::of_properties))]
        url: Option<String>,
        #[command(flatten)]
        agent: AgentOption,
    },
}

/// Runs the command; returns true, as a refusal is a failure.
pub fn map(verb: &MapVerb) -> Result<bool, Failure> {
    let MapVerb::Save { file, url, agent } = verb;
    save(agent, file, url.as_deref())?;
    Ok(true)
}

/// Occupancy grid as JSON has it.
#[derive(Deserialize)]
struct GridReading {
    origin: OriginReading,
    resolution: f64,
    width: usize,
    height: usize,
    data: Vec<i8>,
}

#[derive(Deserialize)]
struct OriginReading {
    x: f64,
    y: f64,
    theta: f64,
}

fn save(agent: &AgentOption, file: &Path, url: Option<&str>) -> Result<(), Failure> {
    let mut client = match url {
        Some(url) => agent.connect_for(url)?,
        None => agent.connect()?,
    };
    let url = match url {
        Some(url) => url.to_owned(),
        None => {
            let properties = client.properties(Some("/**"))?;
            let maps =
                properties.into_iter().filter(|own| own.interface == MAP_INTERFACE && own.access == "output");
            only_map(maps.map(|own| format!("/{}", own.path)).collect())?
        }
    };
    let reading = client.read(&url).map_err(|error| urls::unknown(&mut client, &url, error))?;
    let reading = reading.ok_or_else(|| Failure::NoValue(format!("{url} has no map yet")))?;
    let no_map = || Failure::NoValue(format!("{url} is not a map: expected a valid `{MAP_INTERFACE}`"));
    let grid: GridReading = serde_json::from_value(reading.value).map_err(|_| no_map())?;
    let OriginReading { x, y, theta } = grid.origin;
    let size = [grid.width, grid.height];
    let geometry = Geometry::with_origin(Pose2 { x, y, theta }, grid.resolution, size, MOST_MAP_CELLS);
    let geometry = geometry.filter(|geometry| geometry.cells() == grid.data.len()).ok_or_else(no_map)?;
    write_map(file, &OccupancyMap { geometry, cells: grid.data }, &MapFileOptions::default())?;
    let [width, height] = size.map(|cells| cells as f64 * grid.resolution);
    output::line(format_args!("{} has {url}, {width:.1} m by {height:.1} m", file.display()));
    Ok(())
}

/// Returns the only map of an agent.
fn only_map(mut urls: Vec<String>) -> Result<String, Failure> {
    match (urls.pop(), urls.is_empty()) {
        (Some(url), true) => Ok(url),
        (Some(last), false) => {
            urls.push(last);
            Err(Failure::NoValue(format!("the agent has several maps; name one: {}", urls.join(", "))))
        }
        (None, _) => Err(Failure::NoValue(format!("the agent has no map: no output of `{MAP_INTERFACE}`"))),
    }
}
