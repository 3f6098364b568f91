//! Contacts between bodies, their durations, and the bumpers that they press.

use rapier2d_f64::prelude::{ColliderHandle, PhysicsWorld};
use serde::{Deserialize, Serialize};
use slate_sorted::SortedMap;

use crate::contact::{GRAZE, SEPARATION_TIME, TOUCH};
use crate::geometry::{Gap, Point};
use crate::robot::BumperDescription;
use crate::surroundings::Surroundings;

/// Contacts that a robot feels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BumperContacts {
    /// Contact with anything.
    pub anywhere: bool,
    /// Contact at the front bumper.
    pub front: bool,
    /// Contact at the back bumper.
    pub back: bool,
}

impl BumperContacts {
    /// Adds a contact at a point in the robot's frame.
    pub(crate) fn press(&mut self, at: Point, bumper: Option<BumperDescription>) {
        self.anywhere = true;
        if let Some(BumperDescription { front, back }) = bumper {
            self.front |= at.x >= front;
            self.back |= at.x <= back;
        }
    }
}

/// Contacts of robots with other bodies.
/// A pair has the number of the robot that observes the other, and the other's number among all bodies.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct Touching {
    /// Time of the last contact of each pair, ns.
    pairs: SortedMap<(usize, usize), u64>,
    /// Scratch memory for touching pairs.
    /// Each has the contact's normal in the robot's view.
    #[serde(skip)]
    pressing: Vec<((usize, usize), Point)>,
}

impl Touching {
    /// Updates the contacts: those that last, end and begin.
    /// Reports those that begin, with the contact's normal, and those that are felt now, with the point where the
    /// bodies are nearest.
    pub fn update(
        &mut self,
        physics: &PhysicsWorld,
        surroundings: &Surroundings,
        now: u64,
        mut began: impl FnMut((usize, usize), Point, Gap),
        mut bumper_contacts: impl FnMut((usize, usize), Gap),
    ) {
        self.press(physics, surroundings.bodies().len(), surroundings.robot_count());
        let gap = |(i, j): (usize, usize)| surroundings.robots()[i].outline().gap(surroundings.outline(j));
        for (pair, towards) in &self.pressing {
            // The solver also presses on what would meet within the step; where a corner only grazed another, the
            // bodies are still apart afterwards.
            let known = self.pairs.contains_key(pair);
            if !known && gap(*pair).distance > GRAZE {
                continue;
            }
            if self.pairs.insert(*pair, now).is_none() {
                began(*pair, *towards, gap(*pair));
            }
        }
        self.pairs.retain(|pair, last| {
            let between = gap(*pair);
            if *last != now && between.distance < TOUCH {
                *last = now;
            }
            if *last == now {
                bumper_contacts(*pair, between);
            }
            now - *last < SEPARATION_TIME
        });
    }

    /// Collects the touching pairs of robots, in order.
    fn press(&mut self, physics: &PhysicsWorld, statics: usize, robots: usize) {
        self.pressing.clear();
        for pair in physics.narrow_phase.contact_pairs().filter(|pair| pair.has_any_active_contact()) {
            let (impulse, normal) = pair.max_impulse();
            let number = |handle: ColliderHandle| {
                physics.colliders.get(handle).map(|collider| collider.user_data as usize)
            };
            let (Some(first), Some(second)) = (number(pair.collider1), number(pair.collider2)) else {
                continue;
            };
            if impulse > 0.0 {
                let normal = Point::new(normal.x, normal.y);
                // The normal points from the robot, or from the first of two robots, to the other body.
                let is_in_order = first >= statics && (second < statics || first < second);
                let (pair, normal) = match is_in_order {
                    true => ((first - statics, second), normal),
                    false => ((second - statics, first), Point::default().minus(normal)),
                };
                // Of people and doors only contacts with robots matter.
                if pair.0 < robots {
                    self.pressing.push((pair, normal));
                }
            }
        }
        self.pressing.sort_unstable_by_key(|(pair, _)| *pair);
    }
}
