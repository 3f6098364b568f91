//! Third experiment of RoCS (section 6.5): other tasks for the same robots.
//! R2, a Pioneer, visits the four corners, R3, a Summit XL, follows it at a safe distance, and R1 wanders. New are the
//! two Plans, [`patrol`] and [`follow`]; all other blocks are those of EXP1 and EXP2.

pub mod follow;
pub mod patrol;

use slate_plugin::mapek::PlanBlock;
use slate_plugin::prelude::*;

/// Name of the example.
pub const NAME: &str = "exp3";
/// Summary of the example.
pub const ABOUT: &str = "RoCS EXP3: a Pioneer visits the four corners, a Summit XL follows it";
/// Configuration of the example.
pub const CONFIGURATION: &str = include_str!("../exp3.toml");
/// Files that it includes.
pub const EMBEDDED: &[(&str, &str)] =
    &[("../exp2/robots/r3.toml", include_str!("../../exp2/robots/r3.toml"))];

plugin!(PlanBlock<patrol::PatrolPlanner>, PlanBlock<follow::FollowPlanner>);
