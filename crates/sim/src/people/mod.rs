//! Walking people, by the social force model.

mod crowd;
mod description;
mod person;
mod social_force;
mod walk_field;
mod walk_grid;

pub(crate) use crowd::Crowd;
pub use description::{PeopleDescription, PeopleLayout};
