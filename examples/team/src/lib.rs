//! Team of robots that explore an arena and share their finds.
//! Each explores its part and states the obstacles there, all come to know all of it, and each orders another one to
//! inspect its find.
//!
//! Monitors, knowledge and the ways to drive come from `slate-wheeled`. New are [`finder`] and [`atlas`], which state facts and see
//! what the team states, [`explorer`], which plans, and [`actions`], of which one is a message to another robot.

pub mod actions;
pub mod atlas;
pub mod explorer;
pub mod finder;

use slate_plugin::mapek::{AnalyzeBlock, ExecuteBlock, PlanBlock};
use slate_plugin::prelude::*;

plugin!(
    AnalyzeBlock<finder::Finder>,
    AnalyzeBlock<atlas::Atlas>,
    PlanBlock<explorer::Explorer>,
    ExecuteBlock<actions::ScoutActions>,
);
