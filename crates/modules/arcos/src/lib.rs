//! Driver of Pioneer robots: the ARCOS protocol over a serial line.
//!
//! The module [`Pioneer`] takes the place of the simulator's robot: its ports carry the same interfaces, so that a
//! configuration links to it instead, and nothing else changes:
//!
//! ```toml
//! [modules.pioneer]
//! kind = "pioneer"
//! params.device = "/dev/serial/by-id/usb-Prolific_USB-Serial-if00-port0"
//! [links]
//! "pioneer/wheels" = "r2/wheels/command"
//! "r2/range_monitor/sonar" = "pioneer/sonar"
//! ```
//!
//! What the robot says is public: MobileRobots, Pioneer 3 Operations Manual, chapter 6 (ARCOS). Its parts are of use
//! without a module, too: [`packet`] finds packets in bytes, [`command`] and [`report`] are what they say, and
//! [`session`] is the conversation, without a device and without a clock.

pub mod command;
mod driver;
pub mod model;
pub mod odometry;
pub mod packet;
mod pioneer;
pub mod port;
pub mod report;
pub mod ring;
pub mod session;
mod status;

pub use pioneer::{Battery, Pioneer, PioneerIo, PioneerParams, PioneerState};
pub use status::{Connection, PioneerStatus};

slate_module::plugin!(Pioneer);
