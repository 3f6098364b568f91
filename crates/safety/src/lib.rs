//! Actuator gate: checks each command to an actuator, in the caller's thread.
//!
//! A [`Gate`] passes the commands of one commander at a time: finite, within limits, within their time to live, and only while armed and not
//! stopped. Without a valid command the actuator gets its safe command. A [`StopLatch`] is the software stop of all gates of an agent.
//!
//! [`Gate::offer`] and [`Gate::output`] neither allocate, lock, wait, nor do input or output; the host passes the time.
//!
//! **Slate makes no claim of certification.** The gate and the software stop are ordinary software on an ordinary
//! operating system. They are no emergency stop in the sense of ISO 13850 and no safety function in the sense of
//! ISO 13849 or IEC 61508. A robot that can hurt people needs a stop in hardware that works without them.
//!
//! ```
//! use slate_module::blackboard::interface::{Interface, View};
//! use slate_module::{Priority, interface};
//! use slate_safety::{Gate, GateConfiguration, GateMode, Reason, Verdict};
//!
//! /// The speeds of two wheels.
//! #[interface]
//! pub struct Wheels {
//!     /// Left side, forward.
//!     #[unit("rad/s")] pub left: f64,
//!     /// Right side, forward.
//!     #[unit("rad/s")] pub right: f64,
//! }
//!
//! const PLANNER: u32 = 1;
//! const BUMPER: u32 = 2;
//! const MILLISECOND: u64 = 1_000_000;
//!
//! let configuration = GateConfiguration::new("drive", Wheels::DESCRIPTOR)
//!     .limit("left", -10.0, 10.0)?
//!     .limit("right", -10.0, 10.0)?
//!     .time_to_live(100 * MILLISECOND);
//! let mut gate = Gate::new(configuration);
//! gate.arm()?;
//!
//! let mut forward = Wheels { left: 4.0, right: 40.0 };
//! let mut back = Wheels { left: -2.0, right: -2.0 };
//! assert_eq!(gate.offer(PLANNER, Priority::Plan, View::of(&mut forward).bytes(), 0), Verdict::Limited);
//! assert_eq!(gate.offer(BUMPER, Priority::Reflex, View::of(&mut back).bytes(), 0), Verdict::Passed);
//! let leased = Reason::Leased { by: BUMPER, priority: Priority::Reflex };
//! assert_eq!(gate.offer(PLANNER, Priority::Plan, View::of(&mut forward).bytes(), 0), Verdict::Refused(leased));
//! assert_eq!(gate.output(99 * MILLISECOND).command, View::of(&mut back).bytes());
//!
//! let late = gate.output(100 * MILLISECOND);
//! assert_eq!(late.command, View::of(&mut Wheels::default()).bytes());
//! assert_eq!(late.state.mode, GateMode::ARMED);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bound;
mod configuration;
mod gate;
mod snapshot;
mod state;
mod stop;
mod verdict;

pub use configuration::{ConfigurationError, GateConfiguration};
pub use gate::{Gate, Output, StillStopped};
pub use slate_interfaces::{GateMode, GateState, LeasePriority, RefusalReason};
pub use snapshot::{GateSnapshot, LeaseSnapshot};
pub use stop::StopLatch;
pub use verdict::{Reason, Verdict};
