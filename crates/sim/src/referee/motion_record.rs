use serde::{Deserialize, Serialize};
use slate_interfaces::{Clearance, Contacts, Pose2};
use slate_module::{Queue, math};

use crate::geometry::Point;

/// Path, clearance and contacts of a robot.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct MotionRecord {
    last: Option<Point>,
    /// Path length, m.
    pub length: f64,
    /// Smallest clearance, m.
    pub clearance: f64,
    pub collisions: u64,
    /// Collisions that it caused.
    pub caused: u64,
}

impl Default for MotionRecord {
    fn default() -> Self {
        Self { last: None, length: 0.0, clearance: f64::MAX, collisions: 0, caused: 0 }
    }
}

impl MotionRecord {
    /// Adds the path to the present position, if it `counts`.
    pub fn add_position(&mut self, truth: &Pose2, counts: bool) -> Point {
        let place = Point::new(truth.x, truth.y);
        if let Some(last) = self.last.replace(place)
            && counts
        {
            self.length += place.minus(last).norm();
        }
        place
    }

    /// Adds clearance and contacts.
    pub fn add_contacts(&mut self, robot: &str, clearance: &Clearance, contacts: &Queue<Contacts>) {
        self.clearance = math::min(self.clearance, clearance.distance);
        for contacts in contacts.iter() {
            for contact in contacts.list.iter() {
                let own = contact.robot.as_str() == robot;
                if own || contact.other.as_str() == robot {
                    self.collisions += 1;
                    let caused = if own { contact.caused } else { contact.caused_by_other };
                    self.caused += u64::from(caused.get());
                }
            }
        }
    }
}
