//! First experiment of RoCS (section 6.3): a Pioneer P3-DX goes to the origin.
//! Its plan knows no obstacle; reflexes alone react to the box beside its path and the robot that wanders there. All
//! its blocks come from `slate-wheeled`.

mod r2;

pub use r2::r2;

/// Name of the example.
pub const NAME: &str = "exp1";
/// Summary of the example.
pub const ABOUT: &str = "RoCS EXP1: a Pioneer P3-DX reaches the origin past a box and a wandering robot";
/// Configuration of the example.
pub const CONFIGURATION: &str = include_str!("../exp1.toml");

/// Configuration of the same robot at its serial line, without the simulator.
pub const PIONEER: &str = include_str!("../pioneer.toml");
