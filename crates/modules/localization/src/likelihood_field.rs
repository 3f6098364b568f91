//! Likelihood field of a map.

use slate_grid::{DistanceTransform, Geometry};
use slate_interfaces::Pose2;
use slate_module::{Random, math};

use crate::parameters::InvalidParameter;

/// How a range finder measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorModel {
    /// Standard deviation of the distance between a beam's end and the obstacle that it hits, `sigma_hit`, m.
    pub sigma_hit: f64,
    /// Share of beams that end at an obstacle of the map, `z_hit`.
    pub z_hit: f64,
    /// Share of beams that end anywhere, `z_rand`.
    pub z_rand: f64,
    /// Range within which a beam may end anywhere, `laser_max_range`, m.
    pub laser_max_range: f64,
    /// Distance to an obstacle from which all ends of beams are equally unlikely, m.
    pub laser_likelihood_max_dist: f64,
}

impl Default for SensorModel {
    fn default() -> Self {
        Self {
            sigma_hit: 0.2,
            z_hit: 0.5,
            z_rand: 0.5,
            laser_max_range: 100.0,
            laser_likelihood_max_dist: 2.0,
        }
    }
}

impl SensorModel {
    fn check(&self) -> Result<(), InvalidParameter> {
        let lengths = [
            ("sigma_hit", self.sigma_hit),
            ("laser_max_range", self.laser_max_range),
            ("laser_likelihood_max_dist", self.laser_likelihood_max_dist),
        ];
        for (name, value) in lengths {
            InvalidParameter::unless(value.is_finite() && value > 0.0, name, "a length above 0 m")?;
        }
        [("z_hit", self.z_hit), ("z_rand", self.z_rand)].into_iter().try_for_each(|(name, share)| {
            InvalidParameter::unless((0.0..=1.0).contains(&share), name, "a share from 0 to 1")
        })
    }
}

/// Likelihood of beams' ends in a map (Thrun, Burgard and Fox, *Probabilistic Robotics*, table 6.3), from each cell's
/// exact distance to the nearest occupied one.
#[derive(Clone, Debug)]
pub struct LikelihoodField {
    geometry: Geometry,
    /// Distance of each cell to the nearest occupied one, m; at most `max_distance`.
    distances: Vec<f32>,
    /// Cube of the likelihood of a beam that ends in each cell.
    likelihoods: Vec<f32>,
    outside: f32,
    max_distance: f64,
    /// Cells where the robot may be.
    free: Vec<u32>,
}

impl LikelihoodField {
    /// Makes the field of a grid from which of its cells are occupied, and in which the robot may be.
    ///
    /// # Errors
    /// A parameter of the model that no sensor has.
    pub fn new(
        geometry: Geometry,
        is_occupied: impl Fn(usize) -> bool,
        is_free: impl Fn(usize) -> bool,
        model: SensorModel,
    ) -> Result<Self, InvalidParameter> {
        model.check()?;
        let mut transform = DistanceTransform::default();
        let squares = transform.squares(geometry.width, geometry.height, &is_occupied);
        let distance = |square: i64| {
            let distance = (square as f64).sqrt() * geometry.resolution;
            if distance < model.laser_likelihood_max_dist {
                distance
            } else {
                model.laser_likelihood_max_dist
            }
        };
        let likelihood = |distance: f64| {
            let hit = math::exp(-distance * distance / (2.0 * model.sigma_hit * model.sigma_hit));
            let likelihood = model.z_hit * hit + model.z_rand / model.laser_max_range;
            (likelihood * likelihood * likelihood) as f32
        };
        let distances: Vec<f64> = squares.iter().map(|square| distance(*square)).collect();
        Ok(Self {
            likelihoods: distances.iter().map(|distance| likelihood(*distance)).collect(),
            distances: distances.iter().map(|distance| *distance as f32).collect(),
            outside: likelihood(model.laser_likelihood_max_dist),
            max_distance: model.laser_likelihood_max_dist,
            free: (0..geometry.cells())
                .filter(|cell| is_free(*cell) && !is_occupied(*cell))
                .map(|cell| cell as u32)
                .collect(),
            geometry,
        })
    }

    /// Returns whether there is a cell where the robot may be.
    pub fn has_free_cells(&self) -> bool {
        !self.free.is_empty()
    }

    /// Returns a random pose in a free cell; `None` if no cell is free.
    pub fn random_pose(&self, random: &mut Random) -> Option<Pose2> {
        let at = (random.unit() * self.free.len() as f64) as usize;
        let cell = *self.free.get(at)? as usize;
        let center = self.geometry.center(cell % self.geometry.width, cell / self.geometry.width);
        let half = 0.5 * self.geometry.resolution;
        Some(Pose2 {
            x: center.x + random.uniform(-half, half),
            y: center.y + random.uniform(-half, half),
            theta: random.uniform(-std::f64::consts::PI, std::f64::consts::PI),
        })
    }

    /// Returns the distance of a beam's end in the map frame to the nearest obstacle, m; at most the model's
    /// `laser_likelihood_max_dist`, also outside of the map.
    pub fn distance(&self, x: f64, y: f64) -> f64 {
        match self.geometry.cell(x, y) {
            Some((column, row)) => f64::from(self.distances[self.geometry.index(column, row)]),
            None => self.max_distance,
        }
    }

    /// Returns the likelihood of a scan from a pose: 1 + the sum of its beams' cubed ones, as Nav2 weighs them, so
    /// that no single beam decides.
    ///
    /// Points are ends of beams in the robot's frame, m; those with `counts` false are left out, where it is long
    /// enough.
    pub fn likelihood(&self, pose: &Pose2, points: &[[f64; 2]], counts: &[bool]) -> f64 {
        // Into cells at once: the rotation of pose and grid, and the scale.
        let resolution = self.geometry.resolution;
        let origin = self.geometry.origin();
        let (left, low) = self.geometry.place(pose.x, pose.y);
        let angle = pose.theta - origin.theta;
        let (sine, cosine) = (math::sin(angle) / resolution, math::cos(angle) / resolution);
        let (width, height) = (self.geometry.width as f64, self.geometry.height as f64);
        let mut sum = 1.0;
        for (at, [x, y]) in points.iter().enumerate() {
            if counts.get(at) == Some(&false) {
                continue;
            }
            let column = left + x * cosine - y * sine;
            let row = low + x * sine + y * cosine;
            let is_inside = column >= 0.0 && row >= 0.0 && column < width && row < height;
            let likelihood = match is_inside {
                true => self.likelihoods[row as usize * self.geometry.width + column as usize],
                false => self.outside,
            };
            sum += f64::from(likelihood);
        }
        sum
    }
}
