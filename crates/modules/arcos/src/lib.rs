//! Driver of Pioneer robots: the ARCOS protocol over a serial line.
//!
//! The module [`Pioneer`] takes the place of the simulator, and the Sensors and the Actuator of [`devices`] that of the
//! simulated ones: nothing else of a robot changes.
//!
//! ```toml
//! [modules.pioneer]
//! params.device = "/dev/serial/by-id/usb-Prolific_USB-Serial-if00-port0"
//! [links]
//! "pioneer/wheels" = "r2/motors/wheels"
//! "r2/sonar/source" = "pioneer/sonar"
//! [robots.r2.modules]
//! sonar = { kind = "pioneer_sonar" }
//! motors = { kind = "pioneer_wheels" }
//! ```
//!
//! The robot's protocol is public: MobileRobots, Pioneer 3 Operations Manual, chapter 6 (ARCOS). Its parts are of use
//! without a module, too: [`packet`] finds packets in bytes, [`command`] and [`report`] are what they say, and
//! [`session`] is the conversation, without a device and without a clock.

pub mod command;
pub mod devices;
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

use slate_mapek::{ActuatorBlock, SensorBlock};

pub use pioneer::{Battery, Pioneer, PioneerIo, PioneerParams, PioneerState};
pub use status::{Connection, PioneerStatus};

slate_module::plugin!(
    Pioneer,
    SensorBlock<devices::PioneerSonar>,
    SensorBlock<devices::PioneerOdometry>,
    SensorBlock<devices::PioneerBumper>,
    ActuatorBlock<devices::PioneerWheels>,
);
