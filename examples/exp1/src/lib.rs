//! The first experiment of RoCS (section 6.3): a Pioneer P3-DX goes to the origin. Its plan knows no obstacle; the box
//! beside its way and the robot that wanders there are met by reflexes alone. All its blocks come from `slate-wheeled`.

mod r2;

pub use r2::r2;

/// Name of the example.
pub const NAME: &str = "exp1";
/// Summary of the example.
pub const ABOUT: &str = "RoCS EXP1: a Pioneer P3-DX reaches the origin past a box and a wandering robot";
/// Its configuration.
pub const CONFIGURATION: &str = include_str!("../exp1.toml");

/// The same robot at its serial line instead of in the simulator.
pub const PIONEER: &str = include_str!("../pioneer.toml");
