//! State of the simulator's physics, for `#[serde(with = "slate_sim_state")]`.
//! A crate of its own, as code for all types of rapier is a third of what the compiler would make of the simulator, and
//! need not be optimized.

use rapier2d_f64::prelude::PhysicsWorld;
use serde::de::Error as _;
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use slate_module::{Embedded, Refusal};

/// Encodes the physics inside of the state of a simulation.
///
/// # Errors
/// Those of the serializer.
pub fn serialize<S: Serializer>(physics: &PhysicsWorld, serializer: S) -> Result<S::Ok, S::Error> {
    embedded(physics).map_err(S::Error::custom)?.serialize(serializer)
}

/// Decodes the physics of a simulation.
///
/// # Errors
/// When it is not a state of physics.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<PhysicsWorld, D::Error> {
    decoded(&Embedded::deserialize(deserializer)?).map_err(D::Error::custom)
}

// Without type parameters, so that they are compiled here.

fn embedded(physics: &PhysicsWorld) -> Result<Embedded, Refusal> {
    Embedded::of(physics)
}

fn decoded(physics: &Embedded) -> Result<PhysicsWorld, Refusal> {
    physics.decode()
}
