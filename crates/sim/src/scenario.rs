//! What is simulated: the `[world]` table of a configuration, laid out by the seed.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::blackboard::interface::Value;

use crate::geometry::{Point, Polygon, Pose};
use crate::layout;
use crate::robot::RobotDescription;
use crate::script::RandomWalk;
use crate::simulation::Placement;
use crate::world::{Body, DescriptionError, World};

/// The `[world]` table.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// A world that comes with the simulator.
    pub arena: String,
    /// One of `layouts`, or `random`.
    #[serde(default = "random_layout")]
    pub layout: String,
    /// Physics steps per second.
    #[serde(default = "steps_per_second")]
    pub steps_per_second: u32,
    /// Which sonar profile the robots have.
    #[serde(default)]
    pub sonar: String,
    /// Where the robot shall go, metres.
    #[serde(default)]
    pub goal: [f64; 2],
    /// The robots, by name.
    pub robots: BTreeMap<String, RobotEntry>,
    /// Where things stand, by layout.
    #[serde(default)]
    pub layouts: BTreeMap<String, Layout>,
    /// How `random` places things.
    #[serde(default)]
    pub random: Option<layout::ObstructedWay>,
}

fn random_layout() -> String {
    "random".into()
}

fn steps_per_second() -> u32 {
    100
}

/// A robot of the world.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotEntry {
    /// A type that comes with the simulator.
    pub model: String,
    /// Its script, if it does not obey commands.
    #[serde(default)]
    pub script: Option<RandomWalk>,
}

/// Where things stand.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layout {
    /// Poses of the robots.
    pub robots: BTreeMap<String, Pose>,
    /// Bodies beside those of the arena.
    #[serde(default)]
    pub bodies: Vec<Body>,
}

/// A world that is laid out.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// The arena and what stands in it.
    pub world: World,
    /// The robots where they begin.
    pub placements: Vec<Placement>,
    /// Where the robot shall go, metres.
    pub goal: Point,
    /// The physics step, nanoseconds.
    pub step: u64,
    /// Which sonar profile the robots have.
    pub sonar: String,
}

impl Scenario {
    /// The scenario of a `[world]` table under a seed.
    ///
    /// # Errors
    /// What is missing or does not fit.
    pub fn new(table: &Value, seed: u64) -> Result<Self, DescriptionError> {
        let wrong = |message: String| DescriptionError::new("[world]", message);
        // JSON's numbers are whole or not as they like, as people write them.
        let table = serde_json::to_value(table).map_err(|error| wrong(error.to_string()))?;
        let section: Section = serde_json::from_value(table).map_err(|error| wrong(error.to_string()))?;
        let mut world = World::named(&section.arena)
            .unwrap_or_else(|| Err(wrong(format!("no arena `{}`; there is rocs_arena", section.arena))))?;
        let mut descriptions = BTreeMap::new();
        for (name, entry) in &section.robots {
            let description = RobotDescription::named(&entry.model).unwrap_or_else(|| {
                Err(wrong(format!("no robot model `{}`; there is pioneer_p3dx", entry.model)))
            })?;
            descriptions.insert(name.clone(), description);
        }
        section.random.as_ref().map_or(Ok(()), layout::ObstructedWay::check)?;
        let layout = match section.layouts.get(&section.layout) {
            Some(layout) => layout.clone(),
            None if section.layout == "random" => {
                let rules = section
                    .random
                    .as_ref()
                    .ok_or_else(|| wrong("layout `random` needs a [world.random] table".into()))?;
                let outlines = descriptions
                    .iter()
                    .map(|(name, description)| (name.clone(), description.outline()))
                    .collect();
                rules
                    .lay_out(&world, &outlines, point(section.goal), &mut Random::new(seed, "layout"))
                    .map_err(wrong)?
            }
            None => {
                let mut known: Vec<_> = section.layouts.keys().map(String::as_str).collect();
                known.push("random");
                return Err(wrong(format!("no layout `{}`; there are {}", section.layout, known.join(", "))));
            }
        };
        world.bodies.extend(layout.bodies);
        let mut placements = Vec::new();
        for (name, entry) in &section.robots {
            let pose = layout
                .robots
                .get(name)
                .ok_or_else(|| wrong(format!("layout `{}` does not place `{name}`", section.layout)))?;
            placements.push(Placement {
                name: name.clone(),
                description: descriptions[name].clone(),
                sonar: section.sonar.clone(),
                pose: *pose,
                script: entry.script,
            });
        }
        if !(1..=10_000).contains(&section.steps_per_second) {
            return Err(wrong("steps_per_second is from 1 to 10000".into()));
        }
        let step = 1_000_000_000 / u64::from(section.steps_per_second);
        Ok(Self { world, placements, goal: point(section.goal), step, sonar: section.sonar })
    }

    /// The outlines of what does not move.
    pub fn static_outlines(&self) -> Vec<Polygon> {
        self.world.bodies.iter().filter_map(Body::polygon).collect()
    }
}

fn point([x, y]: [f64; 2]) -> Point {
    Point::new(x, y)
}
