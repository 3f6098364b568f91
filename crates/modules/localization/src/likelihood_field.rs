//! Likelihood field of a map.

use slate_grid::{DistanceTransform, Geometry};
use slate_interfaces::Pose2;
use slate_module::{Random, math};

use crate::InvalidParameter;

/// Combination of beam likelihoods to that of a scan, `laser_model_type`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LaserModelType {
    /// 1 + the sum of cubes, so that no single beam decides.
    /// `likelihood_field` of Nav2.
    #[default]
    LikelihoodField,
    /// Product, for independent beams: `likelihood_field_prob` of Nav2.
    LikelihoodFieldProb,
}

/// Measurement model of a range finder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorModel {
    /// Likelihood of a scan, `laser_model_type`.
    pub laser_model_type: LaserModelType,
    /// Standard deviation from a beam's end to its obstacle, `sigma_hit`, m.
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
            laser_model_type: LaserModelType::default(),
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

/// Least likelihood of a beam, so that its logarithm is a number.
const LEAST: f64 = 1e-30;

/// Likelihood field of a map, from exact distances to occupied cells.
/// Likelihood of beams' ends (Thrun, Burgard and Fox, *Probabilistic Robotics*, table 6.3).
#[derive(Clone, Debug)]
pub struct LikelihoodField {
    geometry: Geometry,
    /// Distance of each cell to the nearest occupied one, m; at most `max_distance`.
    distances: Vec<f32>,
    laser_model_type: LaserModelType,
    /// Score of a beam that ends in each cell.
    /// The cube of its likelihood, or the logarithm.
    scores: Vec<f32>,
    outside: f32,
    max_distance: f64,
    /// Cells where the robot may be.
    free: Vec<u32>,
}

impl LikelihoodField {
    /// Computes the field of a grid from its occupied and its free cells.
    /// The robot may be in free cells.
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
        let score = |distance: f64| {
            let hit = math::exp(-distance * distance / (2.0 * model.sigma_hit * model.sigma_hit));
            let likelihood = model.z_hit * hit + model.z_rand / model.laser_max_range;
            match model.laser_model_type {
                LaserModelType::LikelihoodField => (likelihood * likelihood * likelihood) as f32,
                LaserModelType::LikelihoodFieldProb => math::ln(math::max(likelihood, LEAST)) as f32,
            }
        };
        let distances: Vec<f64> = squares.iter().map(|square| distance(*square)).collect();
        Ok(Self {
            laser_model_type: model.laser_model_type,
            scores: distances.iter().map(|distance| score(*distance)).collect(),
            distances: distances.iter().map(|distance| *distance as f32).collect(),
            outside: score(model.laser_likelihood_max_dist),
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

    /// Returns the distance of a beam's end in the map frame to an obstacle, m.
    /// At most the model's `laser_likelihood_max_dist`, also outside of the map.
    pub fn distance(&self, x: f64, y: f64) -> f64 {
        match self.geometry.cell(x, y) {
            Some((column, row)) => f64::from(self.distances[self.geometry.index(column, row)]),
            None => self.max_distance,
        }
    }

    /// Returns score and number of beams of a scan from a pose.
    /// The score is the sum of its beams' scores. Points are ends of beams in the robot's frame, m; those with `counts`
    /// false are left out, where it is long enough.
    pub(crate) fn score(&self, pose: &Pose2, points: &[[f64; 2]], counts: &[bool]) -> ScanScore {
        // Into cells at once: the rotation of pose and grid, and the scale.
        let resolution = self.geometry.resolution;
        let angle = pose.theta - self.geometry.origin().theta;
        let (left, low) = self.geometry.place(pose.x, pose.y);
        let (sine, cosine) = (math::sin(angle) / resolution, math::cos(angle) / resolution);
        let (width, height) = (self.geometry.width as f64, self.geometry.height as f64);
        let (mut sum, mut beams) = (0.0, 0);
        for (at, [x, y]) in points.iter().enumerate() {
            if counts.get(at) == Some(&false) {
                continue;
            }
            let column = left + x * cosine - y * sine;
            let row = low + x * sine + y * cosine;
            let is_inside = column >= 0.0 && row >= 0.0 && column < width && row < height;
            let score = match is_inside {
                true => self.scores[row as usize * self.geometry.width + column as usize],
                false => self.outside,
            };
            sum += f64::from(score);
            beams += 1;
        }
        ScanScore { sum, beams, laser_model_type: self.laser_model_type }
    }
}

/// Fit of a scan from a pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScanScore {
    sum: f64,
    beams: u32,
    laser_model_type: LaserModelType,
}

impl ScanScore {
    /// Returns the logarithm of the scan's likelihood.
    pub fn log_likelihood(&self) -> f64 {
        match self.laser_model_type {
            LaserModelType::LikelihoodField => math::ln(1.0 + self.sum),
            LaserModelType::LikelihoodFieldProb => self.sum,
        }
    }

    /// Returns the likelihood per beam: mean of cubes, or geometric mean.
    /// Scans of different numbers of beams thus compare.
    pub fn per_beam(&self) -> f64 {
        let mean = self.sum / f64::from(self.beams.max(1));
        match self.laser_model_type {
            LaserModelType::LikelihoodField => mean,
            LaserModelType::LikelihoodFieldProb => math::exp(mean),
        }
    }
}
