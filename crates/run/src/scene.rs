//! Robots and their surroundings, for the pictures of the report.

use slate_blackboard::interface::Value;
use slate_module::math;
use slate_report::{Bounds, Cone, Goal, Polygon, Robot, Scene};
use slate_runtime::configuration::{Configuration, Value as Setting, Variant};
use slate_sim::geometry::{Point, Pose};
use slate_sim::robot::{DriveDescription, RobotDescription};
use slate_sim::{MovingBodies, Placement, Scenario};
use slate_sorted::{SortedMap, SortedSet};

use crate::RunError;

/// Returns the scene of a configuration.
/// It is the world of `[world]`, and the bodies of `[[report.bodies]]`.
pub fn of(configuration: &Configuration) -> Result<Scene, RunError> {
    let mut scene = world(configuration)?;
    scene.polygons.extend(bodies(configuration)?);
    Ok(scene)
}

/// Returns the bodies of the report that no `[world]` describes.
/// Such as those of a simulator of another kind.
fn bodies(configuration: &Configuration) -> Result<Vec<Polygon>, RunError> {
    let Some(list) = configuration.value("report.bodies") else { return Ok(Vec::new()) };
    let wrong = || {
        let help = "write [[report.bodies]] with `name` and `points = [[x, y], ...]`, meters".to_owned();
        let message = "expected bodies with a name and at least three points".to_owned();
        RunError::Configuration(configuration.diagnostic(list.span, message, Some(help)).into())
    };
    let point = |point: &Setting| match point.as_list()? {
        [x, y] => Some([x.value.as_f64()?, y.value.as_f64()?]),
        _ => None,
    };
    let body = |body: &Setting| {
        let body = body.as_table()?;
        let points = body.get("points")?.value.as_list()?.iter().map(|entry| point(&entry.value));
        let points = points.collect::<Option<Vec<_>>>().filter(|points| points.len() >= 3)?;
        Some(Polygon { name: body.get("name")?.value.as_str()?.to_owned(), points })
    };
    let list_of = list.value.as_list().ok_or_else(wrong)?;
    list_of.iter().map(|entry| body(&entry.value).ok_or_else(wrong)).collect()
}

/// Returns the scene of `[world]`; an empty one without.
fn world(configuration: &Configuration) -> Result<Scene, RunError> {
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
    let own = scenario.goals.iter().map(|(name, goals)| (name.as_str(), goals.as_slice()));
    let mut goals_of: Vec<_> = own.collect();
    if goals_of.is_empty() {
        goals_of.push(("", std::slice::from_ref(&scenario.goal)));
    }
    let scripted = scenario.placements.iter().filter(|placement| placement.script.is_some());
    let scripted = scripted.map(|placement| placement.name.clone());
    let moving = moving(&scenario.moving);
    let scripted = scripted.chain(moving.iter().map(|body| body.name.clone())).collect();
    Ok(Scene {
        bounds: Bounds { minimum: bounds.minimum, maximum: bounds.maximum },
        polygons,
        circles: Vec::new(),
        goals: goals(&goals_of),
        robots: scenario.placements.iter().map(robot).chain(moving).collect(),
        scripted,
    })
}

/// Returns the files that describe the world and its robots.
/// They have the names of the configuration; files that come with the simulator are left out.
pub fn files(configuration: &Configuration) -> Vec<(String, Vec<u8>)> {
    // An empty table is one.
    let settings = configuration.settings("world").unwrap_or_default();
    let names: SortedSet<String> = settings
        .iter()
        .filter_map(|setting| setting.value.as_str())
        .filter(|name| name.ends_with(".toml"))
        .map(str::to_owned)
        .collect();
    // A file that was removed since is reported by its reader.
    names.into_iter().filter_map(|name| std::fs::read(&name).ok().map(|text| (name, text))).collect()
}

/// Returns the labeled goals of robots.
/// A single one is the goal; several of a robot are numbered in their order, and where several robots have goals, the
/// label has the robot's name.
fn goals(of: &[(&str, &[Point])]) -> Vec<Goal> {
    let is_shared = of.iter().filter(|(_, goals)| !goals.is_empty()).count() > 1;
    let labeled = of.iter().flat_map(|(robot, goals)| {
        goals.iter().zip(1..).map(move |(goal, number)| {
            let robot = if is_shared { format!("{robot}: ") } else { String::new() };
            let number = if goals.len() > 1 { format!(" {number}") } else { String::new() };
            Goal { label: format!("{robot}goal{number}"), x: goal.x, y: goal.y }
        })
    });
    labeled.collect()
}

/// Returns people and doors as bodies that move without commands.
fn moving(moving: &MovingBodies) -> Vec<Robot> {
    let body = |name: &str, pose: Pose, outline: &slate_sim::geometry::Polygon| Robot {
        name: name.into(),
        x: pose.x,
        y: pose.y,
        theta: pose.theta,
        outline: outline.points.iter().map(|corner| [corner.x, corner.y]).collect(),
        ..Robot::default()
    };
    let people = moving.people.iter().flat_map(|people| {
        let outline = people.outline();
        people.starts().map(move |(name, pose)| body(name, pose, &outline))
    });
    let doors = moving
        .doors
        .iter()
        .map(|(name, door)| body(name, door.leaf(door.opening_at_start()), &door.outline()));
    people.chain(doors).collect()
}

fn robot(placement: &Placement) -> Robot {
    let Placement { name, description, sonar, pose, .. } = placement;
    let sonar = description.sonar.get(sonar);
    let cones = sonar.into_iter().flat_map(|sonar| {
        sonar.placements.iter().map(|[x, y, degrees]| Cone {
            x: *x,
            y: *y,
            direction: degrees.to_radians(),
            opening: sonar.field_of_view,
            range: sonar.range_max,
        })
    });
    Robot {
        name: name.clone(),
        x: pose.x,
        y: pose.y,
        theta: pose.theta,
        outline: description.footprint.clone(),
        wheels: match description.drive.wheelbase {
            Some(wheelbase) => wheels(description, &[wheelbase / 2.0, -wheelbase / 2.0]),
            None => wheels(description, &[0.0]),
        },
        cones: cones.collect(),
    }
}

/// Returns the wheels of a robot with axles at these x.
/// Their width is not described: they end where the body does.
fn wheels(description: &RobotDescription, axles: &[f64]) -> Vec<[[f64; 2]; 2]> {
    let DriveDescription { wheel_radius, track, .. } = description.drive;
    let half_width = description.footprint.iter().map(|[_, y]| *y).fold(0.0, math::max);
    let half = math::clamp(half_width - track / 2.0, wheel_radius / 4.0, wheel_radius / 2.0);
    let wheel = |x: f64, y: f64| [[x - wheel_radius, y - half], [x + wheel_radius, y + half]];
    axles.iter().flat_map(|x| [wheel(*x, track / 2.0), wheel(*x, -track / 2.0)]).collect()
}

/// Returns the conditions of a run, without which its figures have no meaning.
pub fn conditions(configuration: &Configuration) -> SortedMap<String, String> {
    let mut conditions = SortedMap::new();
    let text =
        |path: &str| configuration.value(path).and_then(|value| value.value.as_str()).map(str::to_owned);
    if let Some(layout) = text("world.layout") {
        conditions.insert("layout".into(), layout);
    }
    if let Ok(Some(scenario)) = scenario(configuration) {
        let profiles: SortedSet<_> = scenario.placements.iter().map(|placement| &placement.sonar).collect();
        let named: Vec<_> = profiles.into_iter().filter(|name| !name.is_empty()).cloned().collect();
        if !named.is_empty() {
            conditions.insert("sensor_profile".into(), named.join(", "));
        }
        conditions.insert("noise".into(), noise(&scenario));
        let detects = scenario.placements.iter().any(|placement| placement.robot_sensor().is_some());
        let profile = text("world.robot_sensor").or_else(|| text("world.profile").filter(|_| detects));
        if let Some(profile) = profile {
            conditions.insert("robot_sensor".into(), profile);
        }
    }
    let others = Variant::chosen(configuration).filter(|variant| variant.has_settings);
    conditions.extend(others.map(|variant| (variant.choice.into(), variant.name.into())));
    conditions
}

/// Returns the sensor conditions of the scenario.
fn noise(scenario: &Scenario) -> String {
    let any = |noisy: fn(&Placement) -> bool| scenario.placements.iter().any(noisy);
    let echoes = any(|Placement { description, sonar, .. }| {
        description
            .sonar
            .get(sonar)
            .is_some_and(|it| it.noise_constant + it.noise_proportional + it.dropout + it.crosstalk > 0.0)
    });
    let beams = scenario
        .lasers
        .values()
        .any(|laser| laser.noise_constant + laser.noise_proportional + laser.dropout > 0.0);
    let sightings = any(|placement| {
        placement
            .robot_sensor()
            .is_some_and(|it| it.noise_constant + it.noise_proportional + it.noise_bearing + it.dropout > 0.0)
    });
    let places = any(|placement| {
        let positioning = placement.positioning();
        positioning.noise_position + positioning.noise_orientation + positioning.dropout > 0.0
    });
    let noisy = [(echoes || beams, "ranges"), (sightings, "sightings"), (places, "places")];
    let names: Vec<_> = noisy.iter().filter(|(noisy, _)| *noisy).map(|(_, name)| *name).collect();
    if names.is_empty() { "odometry only".into() } else { format!("{} and odometry", names.join(", ")) }
}

fn scenario(configuration: &Configuration) -> Result<Option<Scenario>, RunError> {
    // The real world has a profile of sensors and nothing to simulate.
    let world = configuration.table("world");
    let Some(table) = world.filter(|world| world.iter().any(|(key, _)| key != "profile")) else {
        return Ok(None);
    };
    let scenario = Scenario::new(&Value::from(table), configuration.seed().value);
    scenario.map(Some).map_err(|error| {
        let text = error.to_string();
        match configuration.value(&error.source_name) {
            Some(wrong) => RunError::Configuration(configuration.diagnostic(wrong.span, text, None).into()),
            None => RunError::World(text),
        }
    })
}

#[cfg(test)]
mod tests {
    use slate_runtime::configuration::Options;

    use crate::RunError;

    use super::{Configuration, Point, Scene, goals, of};

    #[allow(clippy::unwrap_used, reason = "a test that fails panics")]
    fn scene(points: &str) -> Result<Scene, RunError> {
        let text = format!("[[report.bodies]]\nname = \"pipe\"\npoints = {points}\n");
        let options = Options { extra_tables: vec!["report".into()], ..Options::default() };
        of(&Configuration::from_text("bodies.toml", &text, &options).unwrap())
    }

    #[test]
    fn a_world_of_a_profile_alone_is_the_real_one() {
        let world = |text: &str| {
            let options = Options { extra_tables: vec!["world".into()], ..Options::default() };
            Configuration::from_text("robot.toml", text, &options).map(|world| of(&world))
        };
        assert!(matches!(world("[world]\nprofile = \"real\"\n"), Ok(Ok(scene)) if scene.polygons.is_empty()));
        assert!(matches!(world("[world]\nprofile = \"real\"\nrobots.r2 = {}\n"), Ok(Err(_))));
    }

    #[test]
    fn bodies_of_the_report_are_shown_or_refused() {
        let shown = scene("[[0, 0], [2.5, 0.0], [0.0, 1.0]]").map(|scene| scene.polygons);
        let polygons = shown.unwrap_or_default();
        assert_eq!(polygons.len(), 1);
        assert_eq!((&*polygons[0].name, polygons[0].points[1]), ("pipe", [2.5, 0.0]));
        for wrong in ["[[0.0, 0.0], [1.0, 0.0]]", "[[0.0], [1.0, 0.0], [2.0, 0.0]]", "3"] {
            assert!(matches!(scene(wrong), Err(RunError::Configuration(_))), "{wrong}");
        }
    }

    #[test]
    fn goals_are_numbered_and_named_where_there_are_several() {
        let (one, corners) = ([Point::new(0.0, 0.0)], [Point::new(2.0, 2.0), Point::new(2.0, -2.0)]);
        let labels =
            |of: &[(&str, &[Point])]| goals(of).into_iter().map(|goal| goal.label).collect::<Vec<_>>();
        assert_eq!(labels(&[("r2", &one)]), ["goal"]);
        assert_eq!(labels(&[("r2", &corners), ("r3", &[])]), ["goal 1", "goal 2"]);
        assert_eq!(labels(&[("r2", &corners), ("r3", &one)]), ["r2: goal 1", "r2: goal 2", "r3: goal"]);
    }
}
