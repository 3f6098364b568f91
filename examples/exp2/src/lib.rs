//! Second experiment of RoCS (section 6.4): another robot with the same task.
//! A Summit XL, which has four wheels, three sonars and a sensor that detects other robots, goes to a place and holds
//! it. All its blocks come from `slate-wheeled`.

mod r3;

pub use r3::r3;

/// Name of the example.
pub const NAME: &str = "exp2";
/// Summary of the example.
pub const ABOUT: &str = "RoCS EXP2: a Summit XL with four wheels reaches (1.2, 1.2) and holds that place";
/// Configuration of the example.
pub const CONFIGURATION: &str = include_str!("../exp2.toml");
/// Files that it includes.
pub const EMBEDDED: &[(&str, &str)] = &[("robots/r3.toml", include_str!("../robots/r3.toml"))];
