//! The actuator gate: every command to an actuator passes here, in the caller's thread.
//!
//! A [`Gate`] lets one commander at a time through, checks that its command is finite, holds it within limits,
//! forgets it when its time to live ends, and refuses everything while stopped or disarmed. Whenever there is no
//! command to pass, the actuator gets its safe command. A [`StopLatch`] is the software stop that all gates of an
//! agent share.
//!
//! Neither [`Gate::offer`] nor [`Gate::output`] allocates, locks, waits, or does input or output; the host tells
//! them the time.
//!
//! **Slate makes no claim of certification.** The gate and the software stop are ordinary software on an ordinary
//! operating system. They are no emergency stop in the sense of ISO 13850 and no safety function in the sense of
//! ISO 13849 or IEC 61508. A robot that can hurt somebody needs a stop in hardware that works without them.
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
//! let forward = Wheels { left: 4.0, right: 40.0 };
//! let back = Wheels { left: -2.0, right: -2.0 };
//! assert_eq!(gate.offer(PLANNER, Priority::Plan, View::of(&forward).bytes(), 0), Verdict::Limited);
//! assert_eq!(gate.offer(BUMPER, Priority::Reflex, View::of(&back).bytes(), 0), Verdict::Passed);
//! let leased = Reason::Leased { by: BUMPER, priority: Priority::Reflex };
//! assert_eq!(gate.offer(PLANNER, Priority::Plan, View::of(&forward).bytes(), 0), Verdict::Refused(leased));
//! assert_eq!(gate.output(99 * MILLISECOND).command, View::of(&back).bytes());
//!
//! let late = gate.output(100 * MILLISECOND);
//! assert_eq!(late.command, View::of(&Wheels::default()).bytes());
//! assert_eq!(late.state.mode, GateMode::ARMED);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bound;
mod configuration;
mod frozen;
mod gate;
mod state;
mod stop;
mod verdict;

pub use configuration::{ConfigurationError, GateConfiguration};
pub use frozen::{FrozenGate, FrozenLease};
pub use gate::{Gate, Output, StillStopped};
pub use state::{GateMode, GateState, LeasePriority, RefusalReason};
pub use stop::StopLatch;
pub use verdict::{Reason, Verdict};
