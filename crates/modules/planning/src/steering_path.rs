//! Paths of arcs and straight lines.

use slate_interfaces::Pose2;
use slate_module::math;

/// Position of the steering on a segment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SteeringPosition {
    /// Counter-clockwise while driving forward.
    Left,
    /// No turn.
    #[default]
    Straight,
    /// Clockwise while driving forward.
    Right,
}

impl SteeringPosition {
    /// Returns the curvature with a turning radius of 1.
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Straight => 0.0,
            Self::Right => -1.0,
        }
    }
}

/// Part of a [`SteeringPath`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SteeringSegment {
    /// SteeringPosition, at the turning radius of the path.
    pub steering: SteeringPosition,
    /// Length along the segment, m; negative in reverse.
    pub length: f64,
}

/// Costs of a meter beside its length, and of a change of direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PathPenalties {
    /// Factor on the length in reverse.
    pub reverse: f64,
    /// Factor on the length of an arc.
    pub non_straight: f64,
    /// Cost of a change between forward and reverse, m.
    pub change: f64,
}

/// Largest number of segments of a path.
const MOST_SEGMENTS: usize = 5;

/// Path of arcs of one radius and of straight lines, for a car-like robot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SteeringPath {
    segments: [SteeringSegment; MOST_SEGMENTS],
    turning_radius: f64,
}

impl SteeringPath {
    /// Returns a path of segments with lengths in turning radii.
    pub(crate) fn new(word: &[(SteeringPosition, f64)], turning_radius: f64) -> Self {
        let mut segments = [SteeringSegment::default(); MOST_SEGMENTS];
        for (segment, (steering, length)) in segments.iter_mut().zip(word) {
            *segment = SteeringSegment { steering: *steering, length: length * turning_radius };
        }
        Self { segments, turning_radius }
    }

    /// Segments that have a length, in their order.
    pub fn segments(&self) -> impl Iterator<Item = &SteeringSegment> {
        self.segments.iter().filter(|segment| segment.length != 0.0)
    }

    /// Returns the length of the path, in reverse as well, m.
    pub fn length(&self) -> f64 {
        self.segments.iter().map(|segment| segment.length.abs()).sum()
    }

    pub(crate) fn cost(&self, penalties: &PathPenalties) -> f64 {
        let mut cost = 0.0;
        let mut is_reverse = None;
        for segment in self.segments() {
            let arc =
                if segment.steering == SteeringPosition::Straight { 1.0 } else { penalties.non_straight };
            let reverse = if segment.length < 0.0 { penalties.reverse } else { 1.0 };
            let is_change =
                is_reverse.replace(segment.length < 0.0).is_some_and(|was| was != (segment.length < 0.0));
            cost += segment.length.abs() * arc * reverse + if is_change { penalties.change } else { 0.0 };
        }
        cost
    }

    /// Returns the poses along the path from `start`, without the start.
    /// They are at most `spacing` apart (m), each with true if it is reached in reverse. The last one is the end.
    pub fn poses(&self, start: Pose2, spacing: f64) -> impl Iterator<Item = (Pose2, bool)> + '_ {
        let mut from = start;
        self.segments().flat_map(move |segment| {
            let steps = math::max((segment.length.abs() / spacing).ceil(), 1.0);
            let begin = from;
            from = drive(&begin, segment.steering, segment.length, self.turning_radius);
            let pose = move |step: u32| {
                let length = segment.length * f64::from(step) / steps;
                (drive(&begin, segment.steering, length, self.turning_radius), segment.length < 0.0)
            };
            (1..=steps as u32).map(pose)
        })
    }
}

/// Returns the pose after a length from a pose, m; negative in reverse.
pub(crate) fn drive(from: &Pose2, steering: SteeringPosition, length: f64, turning_radius: f64) -> Pose2 {
    let turn = steering.sign() * length / turning_radius;
    // The chord of the arc.
    let half = 0.5 * turn;
    let chord = if half == 0.0 { length } else { length * math::sin(half) / half };
    let direction = from.theta + half;
    Pose2 {
        x: from.x + chord * math::cos(direction),
        y: from.y + chord * math::sin(direction),
        theta: math::wrap_angle(from.theta + turn),
    }
}

/// Returns the equal angle in [0, 2 pi).
pub(crate) fn positive(angle: f64) -> f64 {
    let wrapped = math::wrap_angle(angle);
    // A full turn up to rounding is no turn.
    if wrapped < -1e-10 { wrapped + std::f64::consts::TAU } else { math::max(wrapped, 0.0) }
}

/// Returns the end of a path in the frame of its start, in turning radii.
pub(crate) fn normalized(start: &Pose2, end: &Pose2, turning_radius: f64) -> [f64; 3] {
    let (sine, cosine) = (math::sin(start.theta), math::cos(start.theta));
    let (right, up) = ((end.x - start.x) / turning_radius, (end.y - start.y) / turning_radius);
    [right * cosine + up * sine, up * cosine - right * sine, math::angle_between(start.theta, end.theta)]
}
