//! Scenario: the `[world]` table of a configuration with a layout from the seed.

use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::blackboard::interface::Value;
use slate_module::blackboard::nearest_names;
use slate_sorted::{SortedMap, SortedSet};

use crate::door::DoorDescription;
use crate::error::{DocumentStep, key, unknown};
use crate::fault::{self, Fault, FaultySensor};
use crate::geometry::{Point, Polygon, Pose};
pub use crate::layout::{Layout, StartOffset};
use crate::layout::{ObstructedWay, Scattered, placed};
use crate::people::PeopleDescription;
use crate::profile::{ProfileKeys, Profiles};
use crate::robot::{CameraDescription, LaserDescription, RobotDescription};
use crate::scenery::Scenery;
use crate::script::RandomWalk;
use crate::section::misread;
use crate::simulation::{MovingBodies, Placement};
use crate::world::{Body, DescriptionError, World};

/// The `[world]` table.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Name of a built-in world, or path of a file.
    pub arena: String,
    /// Name in `layouts`, or `random`, or `scattered`.
    #[serde(default = "random_layout")]
    pub layout: String,
    /// Rate of physics steps, Hz.
    #[serde(default = "steps_per_second")]
    pub steps_per_second: u32,
    /// Sensor profile of all robots.
    /// It covers sonars, sensor that sees other robots, positioning system and odometry.
    #[serde(default)]
    pub profile: Option<String>,
    /// Sonar profile in place of `profile`; empty for none, as without a `profile`.
    #[serde(default)]
    pub sonar: Option<String>,
    /// Profile of the sensor that sees other robots, in place of `profile`.
    /// By default it is the one with the sonars' name, or the only one.
    #[serde(default)]
    pub robot_sensor: Option<String>,
    /// Number of measuring threads, without influence on results.
    #[serde(default = "one")]
    pub threads: usize,
    /// Goal of the robot, m.
    #[serde(default)]
    pub goal: [f64; 2],
    /// Goals of single robots in place of `goal`, in sequence, m.
    #[serde(default)]
    pub goals: SortedMap<String, Vec<[f64; 2]>>,
    /// Robots by name.
    pub robots: SortedMap<String, RobotEntry>,
    /// Named layouts.
    #[serde(default)]
    pub layouts: SortedMap<String, Layout>,
    /// Parameters of the layout `random`.
    #[serde(default)]
    pub random: Option<ObstructedWay>,
    /// Parameters of the layout `scattered`.
    #[serde(default)]
    pub scattered: Option<Scattered>,
    /// Scenery for cameras, in addition to that of the arena.
    #[serde(default)]
    pub scenery: Scenery,
    /// Faults of the robots' sensors, by name.
    #[serde(default)]
    pub faults: SortedMap<String, serde_json::Value>,
    /// People of the world.
    #[serde(default)]
    pub people: Option<PeopleDescription>,
    /// Doors by name.
    #[serde(default)]
    pub doors: SortedMap<String, DoorDescription>,
}

impl Section {
    fn check(&self) -> Result<(), DescriptionError> {
        self.random.as_ref().map_or(Ok(()), ObstructedWay::check)?;
        self.scattered.as_ref().map_or(Ok(()), Scattered::check)?;
        self.layouts
            .iter()
            .try_for_each(|(name, layout)| layout.check(&format!("world.layouts.{}", key(name))))?;
        if let Some(name) = self.goals.keys().find(|name| !self.robots.contains_key(*name)) {
            let message = unknown("robot", name, self.robots.keys().map(String::as_str));
            return Err(DescriptionError::new(&format!("world.goals.{}", key(name)), message));
        }
        if !(1..=10_000).contains(&self.steps_per_second) {
            let message = format!("expected a number from 1 to 10000, found {}", self.steps_per_second);
            return Err(DescriptionError::new("world.steps_per_second", message));
        }
        if !(1..=256).contains(&self.threads) {
            let message = format!("expected a number from 1 to 256, found {}", self.threads);
            return Err(DescriptionError::new("world.threads", message));
        }
        self.check_scenery()?;
        self.people.as_ref().map_or(Ok(()), PeopleDescription::check)?;
        self.doors.iter().try_for_each(|(name, door)| door.check(&format!("world.doors.{}", key(name))))?;
        self.check_names()
    }

    fn check_scenery(&self) -> Result<(), DescriptionError> {
        let Some((path, message)) = self.scenery.invalid_value() else { return Ok(()) };
        let mut setting = String::from("world.scenery");
        let mut number = String::new();
        for step in path {
            match step {
                DocumentStep::Key(name) => setting.extend([".", name]),
                DocumentStep::Index(index) => number = format!("number {}: ", index + 1),
            }
        }
        Err(DescriptionError::new(&setting, format!("{number}{message}")))
    }

    /// Checks that robots, doors and people have different names.
    /// Outputs of people and doors are beside those of the robots.
    fn check_names(&self) -> Result<(), DescriptionError> {
        let people: Vec<String> = self.people.iter().flat_map(PeopleDescription::names).collect();
        for name in self.robots.keys().chain(self.doors.keys()) {
            let setting = match self.robots.contains_key(name) {
                true => "world.robots",
                false => "world.doors",
            };
            let is_door_too = setting == "world.robots" && self.doors.contains_key(name);
            if is_door_too || people.contains(name) {
                let other = if is_door_too { "a door" } else { "a person" };
                let message = format!("`{name}` is also the name of {other}; expected a name of its own");
                return Err(DescriptionError::new(&format!("{setting}.{}", key(name)), message));
            }
        }
        Ok(())
    }

    /// Returns the descriptions of the robots, with the sensors that they carry.
    fn robots(&self) -> Result<(Descriptions, Devices), DescriptionError> {
        let (mut descriptions, mut devices) = (Descriptions::new(), Devices::default());
        for (name, entry) in &self.robots {
            let place = format!("world.robots.{}", key(name));
            let mut description =
                RobotDescription::load(&entry.model).map_err(|error| error.of(&format!("{place}.model")))?;
            self.profiles(entry, &place).choose(&mut description, entry.imu)?;
            if let Some(laser) = entry.laser.as_ref().filter(|laser| !laser.is_empty()) {
                let own = carried("laser", laser, &description.name, &description.laser, &place)?;
                devices.lasers.insert(name.clone(), own);
            }
            if let Some(camera) = entry.camera.as_ref().filter(|camera| !camera.is_empty()) {
                let own = carried("camera", camera, &description.name, &description.camera, &place)?;
                devices.cameras.insert(name.clone(), own);
            }
            descriptions.insert(name.clone(), description);
        }
        Ok((descriptions, devices))
    }

    /// Returns the sonar profile of a robot; empty for none.
    fn sonar_of(&self, entry: &RobotEntry, description: &RobotDescription) -> String {
        self.profiles(entry, "").sonar_of(description)
    }

    /// Returns the profile keys of a robot whose entry is at `place`.
    fn profiles<'a>(&'a self, entry: &'a RobotEntry, place: &'a str) -> Profiles<'a> {
        Profiles {
            own: ProfileKeys {
                profile: entry.profile.as_deref(),
                sonar: entry.sonar.as_deref(),
                robot_sensor: entry.robot_sensor.as_deref(),
            },
            of_world: ProfileKeys {
                profile: self.profile.as_deref(),
                sonar: self.sonar.as_deref(),
                robot_sensor: self.robot_sensor.as_deref(),
            },
            place,
        }
    }

    /// Returns the layout for a seed.
    fn lay_out(
        &self,
        world: &World,
        descriptions: &Descriptions,
        goals: &SortedMap<String, Vec<Point>>,
        seed: u64,
    ) -> Result<Layout, DescriptionError> {
        let missing = |name: &str| {
            let message =
                format!("missing table [world.{name}]: `layout = \"{name}\"` is drawn by its rules");
            DescriptionError::new("world.layout", message)
        };
        let outlines: SortedMap<_, _> =
            descriptions.iter().map(|(name, description)| (name.clone(), description.outline())).collect();
        if let Some(layout) = self.layouts.get(&self.layout) {
            let setting = format!("world.layouts.{}", key(&self.layout));
            return layout.with_offsets(&setting, world, &outlines, seed);
        }
        let mut random = Random::new(seed, "layout");
        match self.layout.as_str() {
            "random" => {
                let rules = self.random.as_ref();
                let rules = rules.ok_or_else(|| missing("random"))?;
                rules.lay_out(world, &outlines, point(self.goal), &mut random)
            }
            "scattered" => {
                let rules = self.scattered.as_ref();
                let rules = rules.ok_or_else(|| missing("scattered"))?;
                rules.lay_out(world, &outlines, goals, &mut random)
            }
            other => {
                let known = self.layouts.keys().map(String::as_str).chain(["random", "scattered"]);
                Err(DescriptionError::new("world.layout", unknown("layout", other, known)))
            }
        }
    }
}

/// Descriptions of robots by name.
type Descriptions = SortedMap<String, RobotDescription>;

/// Optional devices of the robots, by robot.
#[derive(Default)]
struct Devices {
    lasers: SortedMap<String, LaserDescription>,
    cameras: SortedMap<String, CameraDescription>,
}

fn random_layout() -> String {
    "random".into()
}

fn steps_per_second() -> u32 {
    100
}

fn one() -> usize {
    1
}

/// Robot of the world.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotEntry {
    /// Name of a built-in type of robot, or path of a file.
    pub model: String,
    /// Sensor profile in place of the world's.
    #[serde(default)]
    pub profile: Option<String>,
    /// Sonar profile in place of `profile`; empty for none.
    #[serde(default)]
    pub sonar: Option<String>,
    /// Laser scanner that it carries; none by default.
    #[serde(default)]
    pub laser: Option<String>,
    /// Camera that it carries; none by default.
    #[serde(default)]
    pub camera: Option<String>,
    /// Profile of the sensor that sees other robots, in place of `profile`.
    /// Empty for none.
    #[serde(default)]
    pub robot_sensor: Option<String>,
    /// Presence of an inertial measurement unit.
    #[serde(default)]
    pub imu: bool,
    /// Script of a robot that ignores commands.
    #[serde(default)]
    pub script: Option<RandomWalk>,
}

/// World with its layout.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Arena with its static bodies.
    pub world: World,
    /// Robots with their start poses.
    pub placements: Vec<Placement>,
    /// Goal of robots without their own goals, m.
    pub goal: Point,
    /// Goals of single robots, in sequence, m.
    pub goals: SortedMap<String, Vec<Point>>,
    /// Physics step, ns.
    pub step: u64,
    /// Number of measuring threads.
    pub threads: usize,
    /// Laser scanners of the robots that carry one.
    pub lasers: SortedMap<String, LaserDescription>,
    /// Cameras of the robots that carry one.
    pub cameras: SortedMap<String, CameraDescription>,
    /// Robots with an inertial measurement unit.
    pub imus: SortedSet<String>,
    /// Faults of the robots' sensors.
    pub faults: SortedMap<String, Vec<Fault>>,
    /// Walking people, and doors.
    pub moving: MovingBodies,
}

impl Scenario {
    /// Creates the scenario of a `[world]` table for a seed.
    ///
    /// # Errors
    /// An error names the missing or invalid setting.
    pub fn new(table: &Value, seed: u64) -> Result<Self, DescriptionError> {
        // JSON's numbers are whole or not as they like, as people write them.
        let table =
            serde_json::to_value(table).map_err(|error| DescriptionError::new("world", error.to_string()))?;
        let read = |table| serde_json::from_value::<Section>(table).err().map(|error| error.to_string());
        let section: Section = serde_json::from_value(table.clone())
            .map_err(|error| misread(&table, &error.to_string(), read))?;
        section.check()?;
        let mut world = World::load(&section.arena).map_err(|error| error.of("world.arena"))?;
        world.scenery.add(&section.scenery);
        let (descriptions, Devices { lasers, cameras }) = section.robots()?;
        let sensors = section.robots.iter().map(|(name, entry)| {
            let sonar = section.sonar_of(entry, &descriptions[name]);
            let sonar = Some(FaultySensor::Sonar).filter(|_| !sonar.is_empty());
            let laser = lasers.get(name).map(|_| FaultySensor::Laser);
            let camera = cameras.get(name).map(|_| FaultySensor::Camera);
            let robot_sensor =
                descriptions[name].robot_sensor.values().next().map(|_| FaultySensor::RobotSensor);
            let imu = Some(FaultySensor::Imu).filter(|_| entry.imu);
            let each = [FaultySensor::Odometry, FaultySensor::Orientation, FaultySensor::Position];
            (
                name.clone(),
                sonar
                    .into_iter()
                    .chain(laser)
                    .chain(camera)
                    .chain(robot_sensor)
                    .chain(imu)
                    .chain(each)
                    .collect(),
            )
        });
        let faults = fault::read(&section.faults, &sensors.collect())?;
        let goals: SortedMap<String, Vec<Point>> = section
            .goals
            .iter()
            .map(|(name, goals)| (name.clone(), goals.iter().copied().map(point).collect()))
            .collect();
        let layout = section.lay_out(&world, &descriptions, &goals, seed)?;
        world.bodies.extend(layout.bodies);
        let mut placements = Vec::new();
        for (name, entry) in &section.robots {
            let pose =
                layout.robots.get(name).ok_or_else(|| not_placed(&section.layout, &layout.robots, name))?;
            placements.push(Placement {
                name: name.clone(),
                description: descriptions[name].clone(),
                sonar: section.sonar_of(entry, &descriptions[name]),
                pose: *pose,
                script: entry.script,
            });
        }
        let outline = |placement: &Placement| placed(&placement.description.outline(), &placement.pose);
        let outlines: Vec<Polygon> = placements.iter().map(outline).collect();
        let people = section.people.as_ref().map(|people| people.lay_out(&world, &outlines, seed));
        let carries_imu = |(_, entry): &(&String, &RobotEntry)| entry.imu;
        let imus = section.robots.iter().filter(carries_imu).map(|(name, _)| name.clone()).collect();
        let moving = MovingBodies { people: people.transpose()?, doors: section.doors };
        let step = 1_000_000_000 / u64::from(section.steps_per_second);
        Ok(Self {
            world,
            placements,
            goal: point(section.goal),
            goals,
            step,
            threads: section.threads,
            lasers,
            cameras,
            imus,
            faults,
            moving,
        })
    }

    /// Returns the goals of a robot, in sequence.
    pub fn goals_of(&self, robot: &str) -> Vec<Point> {
        self.goals.get(robot).cloned().unwrap_or_else(|| vec![self.goal])
    }

    /// Returns the outlines of static bodies.
    pub fn static_outlines(&self) -> Vec<Polygon> {
        self.world.bodies.iter().filter_map(Body::polygon).collect()
    }
}

/// Returns the error of a robot without a pose in a layout.
fn not_placed(name: &str, poses: &SortedMap<String, Pose>, robot: &str) -> DescriptionError {
    let (setting, table) = match name {
        "random" => ("world.random".into(), "robot"),
        "scattered" => ("world.scattered.robots".into(), "area"),
        other => (format!("world.layouts.{}.robots", key(other)), "pose"),
    };
    let placed: Vec<_> = poses.keys().map(String::as_str).collect();
    let near = nearest_names(robot, placed.iter().copied()).into_iter().next();
    let example = match table {
        "pose" => format!("; expected a pose such as `{} = {{ x = 0.0, y = 0.0, theta = 0.0 }}`", key(robot)),
        _ => String::new(),
    };
    let near = near.map_or_else(String::new, |near| format!(" (`{near}` is similar)"));
    let message =
        format!("missing {table} of the robot `{robot}`{example}, found {}{near}", placed.join(", "));
    DescriptionError::new(&setting, message)
}

/// Returns a device of a robot by its name.
fn carried<T: Clone>(
    kind: &str,
    name: &str,
    robot: &str,
    devices: &SortedMap<String, T>,
    place: &str,
) -> Result<T, DescriptionError> {
    devices.get(name).cloned().ok_or_else(|| {
        let message = unknown(kind, name, devices.keys().map(String::as_str));
        DescriptionError::new(&format!("{place}.{kind}"), format!("{robot}: {message}"))
    })
}

fn point([x, y]: [f64; 2]) -> Point {
    Point::new(x, y)
}
