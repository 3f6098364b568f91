//! Exploration of unknown space: next goals of a robot.
//!
//! [`FrontierDetector`] keeps the frontiers of a map as it changes, [`InformationGain`] counts the unknown cells that a
//! sensor would see from a cell, and [`Exploration`] chooses the next goal by both and by the way there. None of them
//! needs an agent.
//!
//! ```
//! use slate_exploration::{Exploration, ExplorationParameters};
//! use slate_grid::{Geometry, OccupancyMap};
//! use slate_planning::{CostGrid, GridCell, LETHAL, UNKNOWN};
//!
//! // A corridor of 4 m, of which the robot at its left end knows the first half.
//! let geometry = Geometry::new([0.0, 0.0], [4.0, 0.3], 0.1, 1_000).unwrap();
//! let cells = (0..geometry.cells()).map(|cell| if cell % 40 < 20 { 0 } else { -1 }).collect();
//! let map = OccupancyMap { geometry, cells };
//! let costs = CostGrid::new(40, 3, |cell| if cell.column < 20 { 0 } else { UNKNOWN }).unwrap();
//! let mut exploration = Exploration::new(ExplorationParameters::default());
//! let goal = exploration.next_goal(&map, &costs, GridCell::new(2, 1)).unwrap();
//! assert!(goal.information_gain > 0.4);
//! ```

mod exploration;
mod exploration_referee;
mod explorer;
mod frontier;
mod information_gain;
mod parameters;
mod unknown_counts;

pub use exploration::{Exploration, ExplorationGoal};
pub use exploration_referee::{
    ExplorationCoverage, ExplorationReferee, ExplorationRefereeIo, ExplorationRefereeParams,
    ExplorationRefereeState,
};
pub use explorer::{
    ExplorationProgress, FrontierExplorer, FrontierExplorerIo, FrontierExplorerParams, FrontierExplorerState,
    FrontierPoints,
};
pub use frontier::{Frontier, FrontierDetector};
pub use information_gain::InformationGain;
pub use parameters::{ExplorationParameters, GoalSelection};

use slate_mapek::{AnalyzeBlock, PlainAnalyze, PlainModule};

impl PlainAnalyze for FrontierExplorer {
    const KIND: &'static str = "frontier_finder";
}

slate_module::plugin!(AnalyzeBlock<FrontierExplorer>, ExplorationReferee, PlainModule<FrontierExplorer>);

#[cfg(doctest)]
#[doc = include_str!("../../../../book/src/38-exploration.md")]
mod book {}
