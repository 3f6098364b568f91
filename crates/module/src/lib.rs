//! Library for authors of modules: ports, parameters, state, and a step.
//!
//! A [`Module`] is a pure step over inputs, outputs and parameters that the host owns, and a state that the host
//! can save, restore and fork. Its code names no URL and no topic: which property an input reads is said by
//! configuration, so a module is reused unchanged.
//!
//! ```
//! use slate_module::prelude::*;
//!
//! /// A place and a heading in the plane, in the map frame.
//! #[interface]
//! pub struct Pose {
//!     /// Meters.
//!     #[unit("m")] pub x: f64,
//!     /// Meters.
//!     #[unit("m")] pub y: f64,
//!     /// Radians, counter-clockwise.
//!     #[unit("rad")] pub theta: f64,
//! }
//!
//! /// A speed forward and a turn.
//! #[interface]
//! #[derive(PartialEq)]
//! pub struct Twist {
//!     /// Meters per second, forward.
//!     #[unit("m/s")] pub linear: f64,
//!     /// Radians per second, counter-clockwise.
//!     #[unit("rad/s")] pub angular: f64,
//! }
//!
//! #[ports]
//! pub struct Io {
//!     pose: Required<Pose>,
//!     #[stale(after = "200ms")] target: Input<Pose>,
//!     #[safe(Twist { linear: 0.0, angular: 0.0 })] velocity: Output<Twist>,
//! }
//!
//! #[params]
//! pub struct Params {
//!     #[param(default = 0.8, range = 0.0..=5.0, unit = "1/s", doc = "gain on the distance")]
//!     gain: f64,
//! }
//!
//! /// Drives towards its target.
//! pub struct Follower;
//!
//! #[module(stage = Act, on = pose)]
//! impl Module for Follower {
//!     type Io = Io;
//!     type Params = Params;
//!     type State = ();
//!
//!     fn tick(_: &mut (), io: &Io, params: &Params, _: &Tick) -> Outcome {
//!         // Without a target it commands nothing.
//!         let Some(target) = io.target.fresh() else { return Outcome::Degraded };
//!         let distance = target.x - io.pose.x;
//!         io.velocity.set(Twist { linear: params.gain * distance, angular: 0.0 });
//!         Outcome::Ok
//!     }
//! }
//!
//! // The plugin with the modules of the crate, for the program that links it in.
//! plugin!(Follower);
//! assert_eq!(plugin().kinds()[0].name(), "follower");
//!
//! // No agent and no thread is needed to test it.
//! let mut follower = slate_module::testing::Fixture::<Follower>::new();
//! follower.set("target", Pose { x: 2.0, y: 0.0, theta: 0.0 });
//! assert_eq!(follower.tick().waiting_for(), Some("pose"));
//! follower.set("pose", Pose { x: 0.0, y: 0.0, theta: 0.0 });
//! assert_eq!(follower.tick(), Outcome::Ok);
//! assert_eq!(follower.output::<Twist>("velocity"), Some(Twist { linear: 1.6, angular: 0.0 }));
//! ```
#![allow(unsafe_code, reason = "the plugin table hands memory of the host to the module")]

extern crate self as slate_module;

pub mod aspect;
mod codec;
mod description;
mod export;
mod frame;
mod hardware;
mod instance;
mod invalid_parameter;
pub mod math;
mod module;
mod outline;
mod panics;
mod parameters;
mod plugin;
mod port;
mod port_list;
mod portable;
mod random;
pub mod role;
mod service_hash;
mod setup;
pub mod table;
pub mod testing;
mod tick;

pub use codec::{CodecError, Embedded, decode, encode, from_cbor, to_cbor};
pub use description::{Description, Direction, PortDescription, Stage, Trigger, parse_duration};
#[doc(hidden)]
pub use export::write_robot;
pub use frame::{Entry, Flags, Frame, Host, Level, PortSlot};
pub use hardware::{Hardware, HardwareDevice, HardwareDrive};
pub use instance::{Instance, read_params};
pub use invalid_parameter::InvalidParameter;
pub use module::{Module, Outcome, Refusal, Spec};
pub use outline::{ModuleOutline, Outline, PluginOutline};
pub use parameters::{Parameter, Params};
pub use plugin::{InstanceFactory, ModuleKind, Plugin, read_robot};
pub use port::{
    Command, Debug, Delivery, HasPort, Inbox, Input, Outbox, Output, Port, PortCursor, Ports, Priority,
    Queue, Received, Required, StaleInput,
};
pub use port_list::{PortList, PortOutline};
pub use portable::{PortableDescription, decode_interface, encode_interface};
pub use random::Random;
pub use setup::Setup;
pub use slate_blackboard as blackboard;
pub use slate_blackboard::Stamp;
pub use slate_blackboard::interface::{Bool, Interface, Optional, Plain, Sequence, Text};
pub use slate_module_macros::{interface, module, params, ports};
pub use table::{ModuleTable, PluginTable};
pub use tick::{FieldValue, Tick};

/// Imports of a module's source file.
pub mod prelude {
    pub use crate::{
        Bool, Command, Debug, Inbox, Input, Interface, Module, Optional, Outbox, Outcome, Output, Ports,
        Priority, Queue, Refusal, Required, Sequence, Setup, Text, Tick, interface, math, module, params,
        plugin, ports,
    };
}

/// Makes a crate a plugin with the given modules: `plugin!(Follower, Mapper)`.
/// If it needs other plugins, `plugin!(Follower; depends = ["drivers"])`.
///
/// A program that links the crate in gets it from the function `plugin` that this makes. Built as a shared library
/// (`crate-type = ["cdylib"]`) the crate can be loaded by an agent that runs; its outline is in the section
/// `.slate` of the file, where it is read before the library is opened.
///
/// With `plugin!(Follower; robot = rover)` the library also contains the robot that the function `rover` builds, and
/// `slate run` runs the library.
#[macro_export]
macro_rules! plugin {
    ($($module:ty),+ $(,)? $(; depends = [$($depends:literal),* $(,)?])? $(; robot = $robot:path)?) => {
        /// Returns the plugin with the modules of this crate.
        pub fn plugin() -> $crate::Plugin {
            $crate::Plugin::new(env!("CARGO_PKG_NAME"), [$($crate::ModuleKind::linked::<$module>()),+])
                .version(env!("CARGO_PKG_VERSION"))
                .depends(&[$($($depends),*)?])
        }

        #[allow(unsafe_code)]
        const _: () = {
            static MODULES: &[$crate::ModuleTable] = &[$($crate::ModuleTable::of::<$module>()),+];

            #[used]
            #[unsafe(export_name = concat!("slate_plugin_", env!("CARGO_CRATE_NAME")))]
            static PLUGIN: $crate::PluginTable = $crate::PluginTable::new(MODULES);

            const OUTLINES: &[$crate::ModuleOutline] = &[$($crate::ModuleOutline::of::<$module>()),+];
            const OUTLINE: $crate::Outline = $crate::Outline::of(&$crate::PluginOutline {
                symbol: concat!("slate_plugin_", env!("CARGO_CRATE_NAME")),
                name: env!("CARGO_PKG_NAME"),
                version: env!("CARGO_PKG_VERSION"),
                panic: if cfg!(panic = "unwind") { "unwind" } else { "abort" },
                depends: &[$($($depends),*)?],
                modules: OUTLINES,
            });

            $(
                #[unsafe(export_name = concat!("slate_robot_", env!("CARGO_CRATE_NAME")))]
                unsafe extern "C" fn __slate_robot(sink: *const $crate::table::Sink) -> i32 {
                    // SAFETY: the host passes a sink that lives during the call.
                    unsafe { $crate::write_robot(sink, || $robot().to_toml()) }
                }
            )?

            #[used]
            #[unsafe(link_section = ".slate")]
            static SECTION: [u8; OUTLINE.length()] = OUTLINE.bytes();
        };
    };
}
