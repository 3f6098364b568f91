//! Random layouts of robots and obstacles.
//! Either a box near the robot's straight path and a wandering robot between, or robots anywhere.

use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::{cos, sin, wrap_angle};
use slate_sorted::SortedMap;

use crate::error::{DescriptionError, key, unknown};
use crate::geometry::{Point, Polygon, Pose};
use crate::world::{Body, World};

/// Layout of a world.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layout {
    /// Poses of the robots.
    pub robots: SortedMap<String, Pose>,
    /// Bodies in addition to those of the arena.
    #[serde(default)]
    pub bodies: Vec<Body>,
    /// Bounds of the random offset to the pose of each robot.
    #[serde(default)]
    pub start_offset: StartOffset,
}

/// Bounds of a random offset of a pose, uniform to either side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StartOffset {
    /// Bound along x and along y, m.
    pub position: f64,
    /// Bound of the heading, rad.
    pub heading: f64,
}

impl StartOffset {
    fn check(&self, setting: &str) -> Result<(), DescriptionError> {
        for (name, bound) in [("position", self.position), ("heading", self.heading)] {
            if !(0.0..1e6).contains(&bound) {
                let message = format!("expected a number from 0 to 1000000, found {bound}");
                return Err(DescriptionError::new(&format!("{setting}.{name}"), message));
            }
        }
        Ok(())
    }

    fn of(&self, pose: Pose, random: &mut Random) -> Pose {
        let mut add = |value: f64, bound: f64| value + random.uniform(-bound, bound);
        let (x, y) = (add(pose.x, self.position), add(pose.y, self.position));
        Pose { x, y, theta: wrap_angle(add(pose.theta, self.heading)) }
    }
}

impl Layout {
    /// Checks the bounds of the offsets; `setting` is the layout's.
    ///
    /// # Errors
    /// The setting that is out of its range.
    pub fn check(&self, setting: &str) -> Result<(), DescriptionError> {
        self.start_offset.check(&format!("{setting}.start_offset"))
    }

    /// Adds a random offset, drawn from the seed, to the pose of each robot.
    /// A pose in collision is drawn again.
    ///
    /// # Errors
    /// When the offsets leave no room.
    pub fn with_offsets(
        &self,
        setting: &str,
        world: &World,
        outlines: &SortedMap<String, Polygon>,
        seed: u64,
    ) -> Result<Self, DescriptionError> {
        if self.start_offset == StartOffset::default() {
            return Ok(self.clone());
        }
        let bodies = world.bodies.iter().chain(&self.bodies);
        let mut taken: Vec<Polygon> = bodies.filter_map(Body::polygon).collect();
        let mut robots = SortedMap::new();
        for (name, pose) in &self.robots {
            // A stream for each, so that one more robot moves no other.
            let mut random = Random::new(seed, &format!("layout/{name}"));
            // A robot of another configuration takes no room.
            let Some(outline) = outlines.get(name) else { continue };
            let mut draws = (0..MAX_ATTEMPTS).map(|_| self.start_offset.of(*pose, &mut random));
            let fits =
                |pose: &Pose| taken.iter().all(|other| placed(outline, pose).gap(other).distance > 0.0);
            let drawn = draws.find(fits).ok_or_else(|| {
                let message =
                    format!("no room for `{name}` within its offsets; move it, or make them smaller");
                DescriptionError::new(&format!("{setting}.start_offset"), message)
            })?;
            taken.push(placed(outline, &drawn));
            robots.insert(name.clone(), drawn);
        }
        Ok(Self { robots, ..self.clone() })
    }
}

/// Random layout with an obstacle.
/// The robot starts in a strip of the arena, a box is near its straight path to the goal, and a disturber is anywhere
/// else.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObstructedWay {
    /// Robot with the goal.
    pub robot: String,
    /// Robot that disturbs.
    pub disturber: String,
    /// Start area of the robot: minimum x, maximum x, minimum y, maximum y, m.
    pub start: [f64; 4],
    /// Start area of the disturber: minimum x, maximum x, minimum y, maximum y, m.
    pub disturber_start: [f64; 4],
    /// Side of the box, m.
    pub box_size: f64,
    /// Largest distance of the box's center from the straight path, m.
    pub box_offset: f64,
    /// Clearance of the robot at the start, m.
    pub start_clearance: f64,
}

/// Maximum number of attempts to draw a layout.
const MAX_ATTEMPTS: usize = 10_000;

/// Random starts in areas of the robots, clear of each other and of static bodies.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scattered {
    /// Start area of each robot: minimum x, maximum x, minimum y, maximum y, m.
    pub robots: SortedMap<String, [f64; 4]>,
    /// Clearance of a robot at the start, m.
    pub clearance: f64,
    /// Clearance between two robots at the start, m.
    pub apart: f64,
    /// Smallest distance of a robot's start from its first goal, m.
    #[serde(default)]
    pub from_goal: f64,
}

impl Scattered {
    /// Checks that the areas are valid.
    ///
    /// # Errors
    /// The setting with a least value above the greatest, and both.
    pub fn check(&self) -> Result<(), DescriptionError> {
        self.robots
            .iter()
            .try_for_each(|(name, area)| check(&format!("world.scattered.robots.{}", key(name)), area))
    }

    /// Draws a layout.
    ///
    /// # Errors
    /// When the rules leave no room, or name a robot that is not there.
    pub fn lay_out(
        &self,
        world: &World,
        outlines: &SortedMap<String, Polygon>,
        goals: &SortedMap<String, Vec<Point>>,
        random: &mut Random,
    ) -> Result<Layout, DescriptionError> {
        if let Some(name) = self.robots.keys().find(|name| !outlines.contains_key(*name)) {
            let setting = format!("world.scattered.robots.{}", key(name));
            return Err(no_robot(&setting, name, outlines));
        }
        let walls: Vec<Polygon> = world.bodies.iter().filter_map(Body::polygon).collect();
        for _ in 0..MAX_ATTEMPTS {
            let mut robots = SortedMap::new();
            let mut bodies: Vec<Polygon> = Vec::new();
            for (name, [west, east, south, north]) in &self.robots {
                let pose = Pose {
                    x: random.uniform(*west, *east),
                    y: random.uniform(*south, *north),
                    theta: heading(random),
                };
                let own = placed(&outlines[name], &pose);
                let goal = goals.get(name).and_then(|goals| goals.first());
                let fits = walls.iter().all(|wall| own.gap(wall).distance >= self.clearance)
                    && bodies.iter().all(|other| own.gap(other).distance >= self.apart)
                    && goal.is_none_or(|goal| goal.minus(pose.point()).norm() >= self.from_goal);
                if !fits {
                    break;
                }
                robots.insert(name.clone(), pose);
                bodies.push(own);
            }
            if robots.len() == self.robots.len() {
                return Ok(Layout { robots, ..Layout::default() });
            }
        }
        Err(DescriptionError::new("world.scattered", "no room for the robots"))
    }
}

/// Checks that an area is valid.
fn check(setting: &str, [west, east, south, north]: &[f64; 4]) -> Result<(), DescriptionError> {
    for (axis, least, greatest) in [("x", west, east), ("y", south, north)] {
        if least.is_nan() || greatest.is_nan() || least > greatest {
            let message = format!(
                "the least {axis}, {least}, is above the greatest, {greatest}; write least x, greatest x, least y, \
                 greatest y"
            );
            return Err(DescriptionError::new(setting, message));
        }
    }
    Ok(())
}

impl ObstructedWay {
    /// Checks that the strips are valid.
    ///
    /// # Errors
    /// The setting with a least value above the greatest, and both.
    pub fn check(&self) -> Result<(), DescriptionError> {
        check("world.random.start", &self.start)?;
        check("world.random.disturber_start", &self.disturber_start)
    }

    /// Draws a layout.
    ///
    /// # Errors
    /// When the rules leave no room.
    pub fn lay_out(
        &self,
        world: &World,
        outlines: &SortedMap<String, Polygon>,
        goal: Point,
        random: &mut Random,
    ) -> Result<Layout, DescriptionError> {
        let outline = |setting: &str, name: &str| {
            outlines.get(name).ok_or_else(|| no_robot(&format!("world.random.{setting}"), name, outlines))
        };
        let robot = outline("robot", &self.robot)?;
        let disturber = outline("disturber", &self.disturber)?;
        let walls: Vec<Polygon> = world.bodies.iter().filter_map(Body::polygon).collect();
        for _ in 0..MAX_ATTEMPTS {
            let [west, east, south, north] = self.start;
            let start = Pose {
                x: random.uniform(west, east),
                y: random.uniform(south, north),
                theta: heading(random),
            };
            let own = placed(robot, &start);
            if walls.iter().any(|wall| own.gap(wall).distance < self.start_clearance) {
                continue;
            }
            // The box: beside a point of the straight way, with room at both ends.
            let way = goal.minus(start.point());
            let length = way.norm();
            let along = random.uniform(0.25, 0.75);
            let aside = random.uniform(-self.box_offset, self.box_offset);
            let center = start.point().plus(way, along).plus(Point::new(-way.y, way.x), aside / length);
            let obstacle = Polygon::rectangle(center, self.box_size, self.box_size);
            let goal_at = placed(robot, &Pose { x: goal.x, y: goal.y, theta: 0.0 });
            if obstacle.gap(&own).distance < 0.2 || obstacle.gap(&goal_at).distance < 0.2 {
                continue;
            }
            let [west, east, south, north] = self.disturber_start;
            let [x, y] = [random.uniform(west, east), random.uniform(south, north)];
            let other = Pose { x, y, theta: heading(random) };
            let theirs = placed(disturber, &other);
            let near_wall = walls.iter().any(|wall| theirs.gap(wall).distance < 0.1);
            let near_goal = other.point().minus(goal).norm() < 0.6;
            if near_wall
                || near_goal
                || theirs.gap(&own).distance < 0.5
                || theirs.gap(&obstacle).distance < 0.2
            {
                continue;
            }
            let robots = SortedMap::from([(self.robot.clone(), start), (self.disturber.clone(), other)]);
            let bodies = vec![Body::rectangle("box", [center.x, center.y], [self.box_size; 2])];
            return Ok(Layout { robots, bodies, ..Layout::default() });
        }
        Err(DescriptionError::new("world.random", "no room for the robots and the box"))
    }
}

fn no_robot(setting: &str, name: &str, outlines: &SortedMap<String, Polygon>) -> DescriptionError {
    DescriptionError::new(setting, unknown("robot", name, outlines.keys().map(String::as_str)))
}

fn heading(random: &mut Random) -> f64 {
    random.uniform(-std::f64::consts::PI, std::f64::consts::PI)
}

/// Returns an outline at a robot's pose.
pub(crate) fn placed(outline: &Polygon, pose: &Pose) -> Polygon {
    let mut result = Polygon::default();
    let frame = crate::geometry::Frame { origin: pose.point(), cos: cos(pose.theta), sin: sin(pose.theta) };
    outline.place(&frame, &mut result);
    result
}
