//! What stands around the robots, for the pictures of the report.

use std::collections::BTreeMap;

use slate::blackboard::interface::Value;
use slate::record::{Bounds, Goal, Polygon, Scene};
use slate::runtime::configuration::Configuration;
use slate::sim::Scenario;

use crate::failure::Failure;

/// The scene of a configuration with a `[world]`; an empty one without.
pub fn of(configuration: &Configuration) -> Result<Scene, Failure> {
    let Some(scenario) = scenario(configuration)? else { return Ok(Scene::default()) };
    let bounds = scenario.world.bounds;
    let polygons = scenario
        .world
        .bodies
        .iter()
        .filter_map(|body| {
            let outline = body.polygon()?;
            Some(Polygon {
                name: body.name.clone(),
                points: outline.points.iter().map(|p| [p.x, p.y]).collect(),
            })
        })
        .collect();
    let scripted = scenario.placements.iter().filter(|placement| placement.script.is_some());
    Ok(Scene {
        bounds: Bounds { minimum: bounds.minimum, maximum: bounds.maximum },
        polygons,
        circles: Vec::new(),
        goals: vec![Goal { label: "goal".into(), x: scenario.goal.x, y: scenario.goal.y }],
        scripted: scripted.map(|placement| placement.name.clone()).collect(),
    })
}

/// Under which conditions a run is made: figures mean nothing without them.
pub fn conditions(configuration: &Configuration) -> BTreeMap<String, String> {
    let mut conditions = BTreeMap::new();
    let text =
        |path: &str| configuration.value(path).and_then(|value| value.value.as_str()).map(str::to_owned);
    if let Some(layout) = text("world.layout") {
        conditions.insert("layout".into(), layout);
    }
    if let Ok(Some(scenario)) = scenario(configuration) {
        let noisy = scenario.placements.iter().any(|placement| {
            placement.description.sonar.get(&scenario.sonar).is_some_and(|sonar| sonar.noise_constant > 0.0)
        });
        if !scenario.sonar.is_empty() {
            conditions.insert("sensor_profile".into(), scenario.sonar);
        }
        conditions.insert("noise".into(), if noisy { "ranges and odometry" } else { "odometry only" }.into());
    }
    conditions
}

fn scenario(configuration: &Configuration) -> Result<Option<Scenario>, Failure> {
    let Some(table) = configuration.table("world") else { return Ok(None) };
    let scenario = Scenario::new(&Value::from(table), configuration.seed().value);
    scenario.map(Some).map_err(|error| {
        let text = error.to_string();
        match configuration.value(&error.source_name) {
            Some(wrong) => Failure::Configuration(configuration.diagnostic(wrong.span, text, None).into()),
            None => Failure::World(text),
        }
    })
}
