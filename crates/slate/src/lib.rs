//! Slate: a robot software framework.
//! An architecture for autonomous robots that the compiler enforces, all knowledge of the robot at a URL, and runs that
//! repeat bit for bit.
//!
//! This is the crate to depend on; [`prelude`] has what the file of a module imports.

pub use slate_bag as bag;
#[cfg(feature = "console")]
pub use slate_console as console;
pub use slate_control as control;
pub use slate_interfaces as interfaces;
pub use slate_logs as logs;
pub use slate_mapek as mapek;
pub use slate_module as module;
pub use slate_module::blackboard;
pub use slate_record as record;
pub use slate_replay as replay;
pub use slate_report as report;
pub use slate_ros_messages as ros_messages;
#[cfg(feature = "run")]
pub use slate_run as run;
pub use slate_runtime as runtime;
pub use slate_safety as safety;
pub use slate_share as share;
pub use slate_sim as sim;
pub use slate_sorted as sorted;

/// Imports for the file of a module or of a robot in MAPE-K.
/// Ports and macros, the blocks of MAPE-K with their actions, builder and pipeline, the common interfaces, and
/// mathematics.
///
/// ```
/// use slate::prelude::*;
///
/// #[ports]
/// pub struct Sensors {
///     scan: Input<SonarScan>,
/// }
///
/// /// Publishes the distance of the nearest echo.
/// pub struct NearestEcho;
///
/// impl Monitor for NearestEcho {
///     const NAME: &'static str = "nearest_echo";
///     type Sensors = Sensors;
///     type Params = ();
///     type State = ();
///     type Value = Clearance;
///
///     fn interpret(_: &mut (), sensors: &Sensors, _: &(), _: &Tick) -> Option<Clearance> {
///         let scan = sensors.scan.fresh()?;
///         let ranges = scan.echoes.iter().map(|echo| echo.range);
///         Some(Clearance { distance: ranges.fold(scan.range_max, math::min) })
///     }
/// }
///
/// let robot = Robot::new("r2").monitor::<NearestEcho>("nearest_echo").link("scan", "/simulator/r2/sonar");
/// assert_eq!(robot.to_toml()?.lines().nth(1), Some("nearest_echo = {}"));
/// assert_eq!(Pipeline::default().waiting(), (0, 0));
/// # Ok::<(), slate::mapek::RobotErrors>(())
/// ```
pub mod prelude {
    pub use slate_interfaces::prelude::*;
    pub use slate_mapek::prelude::*;
    pub use slate_module::prelude::*;
    #[cfg(feature = "run")]
    pub use slate_run::RunRobot;
    pub use std::process::ExitCode;
}

/// README and book, whose Rust code is compiled and run with the tests.
/// The first chapter's code is that of the documentation of slate-mapek, where it is one program.
#[cfg(doctest)]
mod documents {
    #[doc = include_str!("../../../README.md")]
    mod readme {}
    #[doc = include_str!("../../../book/src/02-modules.md")]
    mod modules {}
    #[doc = include_str!("../../../book/src/coming-from.md")]
    mod coming_from {}
    #[doc = include_str!("../../../book/src/03-configuration.md")]
    mod configuration {}
    #[doc = include_str!("../../../book/src/04-the-blackboard.md")]
    mod the_blackboard {}
    #[doc = include_str!("../../../book/src/05-running.md")]
    mod running {}
    #[doc = include_str!("../../../book/src/06-safety-of-motion.md")]
    mod safety_of_motion {}
    #[doc = include_str!("../../../book/src/07-the-simulator.md")]
    mod the_simulator {}
    #[doc = include_str!("../../../book/src/08-exp1.md")]
    mod exp1 {}
    #[doc = include_str!("../../../book/src/09-plugins.md")]
    mod plugins {}
    #[doc = include_str!("../../../book/src/10-logging.md")]
    mod logging {}
    #[doc = include_str!("../../../book/src/11-isolation.md")]
    mod isolation {}
    #[doc = include_str!("../../../book/src/12-aspects.md")]
    mod aspects {}
    #[doc = include_str!("../../../book/src/13-team-knowledge.md")]
    mod team_knowledge {}
    #[doc = include_str!("../../../book/src/14-sharing.md")]
    mod sharing {}
    #[doc = include_str!("../../../book/src/16-deployment.md")]
    mod deployment {}
    #[doc = include_str!("../../../book/src/22-recording.md")]
    mod recording {}
    #[doc = include_str!("../../../book/src/23-bags.md")]
    mod bags {}
    #[doc = include_str!("../../../book/src/24-replay.md")]
    mod replay {}
    #[doc = include_str!("../../../book/src/25-reports.md")]
    mod reports {}
    #[cfg(feature = "console")]
    #[doc = include_str!("../../../book/src/28-http-api.md")]
    mod http_api {}
}
