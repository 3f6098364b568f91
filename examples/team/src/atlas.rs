//! Knowledge of the team about the arena.

use slate_plugin::mapek::{FactTable, MostCertain, WorldModel};
use slate_plugin::prelude::*;

use crate::finder::Obstacle;

/// Known part of the arena.
#[interface]
#[derive(PartialEq)]
pub struct Known {
    /// Obstacles, each counted once.
    pub obstacles: u32,
    /// Robots that have found one.
    pub robots: u32,
}

/// Statements of the team.
#[ports]
pub struct Heard {
    obstacles: Required<FactTable<Obstacle>>,
}

/// Reports new knowledge of the team.
pub struct Atlas;

impl Analyze for Atlas {
    const NAME: &'static str = "atlas";
    const DOC: &'static str = "Reports new facts of the team.";
    type Observed = Heard;
    type Params = ();
    type State = WorldModel<String, Obstacle>;
    type Value = Known;

    fn process(world: &mut WorldModel<String, Obstacle>, heard: &Heard, _: &(), _: &Tick) -> Option<Known> {
        let changed = world.replace(&heard.obstacles);
        if changed.is_empty() {
            return None;
        }
        let obstacles = world.view::<MostCertain>().filter(|(_, fact)| fact.is_some()).count();
        let mut robots: Vec<u32> = heard.obstacles.iter().map(|fact| fact.head.origin).collect();
        robots.sort_unstable();
        robots.dedup();
        Some(Known { obstacles: obstacles as u32, robots: robots.len() as u32 })
    }
}
