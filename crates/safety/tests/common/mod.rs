//! Helpers of the tests of the gate.
#![allow(dead_code, missing_docs, reason = "each test file uses a part")]
#![allow(clippy::expect_used, reason = "a test's error ends the test")]

use slate_module::blackboard::interface::{Interface, View};
use slate_module::{Sequence, interface};
use slate_safety::{Gate, GateConfiguration};

/// The speeds of two wheels.
#[interface]
#[derive(PartialEq)]
pub struct Wheels {
    /// Left side, forward.
    #[unit("rad/s")]
    pub left: f64,
    /// Right side, forward.
    #[unit("rad/s")]
    pub right: f64,
}

/// A number of every width, and what can't be limited.
#[interface]
pub struct Mixed {
    pub wheels: Wheels,
    pub joints: [f64; 3],
    pub large: u64,
    pub negative: i64,
    pub spare: Sequence<f64, 2>,
    pub single: f32,
    pub count: i32,
    pub word: u16,
    pub short: i16,
    pub byte: u8,
    pub tiny: i8,
}

pub const MILLISECOND: u64 = 1_000_000;
/// The time to live that gates have by default, nanoseconds.
pub const TIME_TO_LIVE: u64 = 100 * MILLISECOND;
/// Commanders.
pub const PLANNER: u32 = 1;
pub const PERSON: u32 = 2;
pub const BUMPER: u32 = 3;

pub fn wheels(left: f64, right: f64) -> Wheels {
    Wheels { left, right }
}

pub fn bytes<T: Interface + Copy>(value: &T) -> &'static [u8] {
    View::of(Box::leak(Box::new(*value))).bytes()
}

pub fn configuration() -> GateConfiguration {
    GateConfiguration::new("drive", Wheels::DESCRIPTOR)
}

pub fn armed(configuration: GateConfiguration) -> Gate {
    let mut gate = Gate::new(configuration);
    gate.arm().expect("nothing is stopped");
    gate
}

/// What the actuator gets from a gate for [`Wheels`].
pub fn given(gate: &mut Gate, now: u64) -> Wheels {
    let command = gate.output(now).command;
    let number = |bytes: &[u8]| f64::from_ne_bytes(bytes.try_into().expect("eight bytes"));
    wheels(number(&command[..8]), number(&command[8..]))
}
