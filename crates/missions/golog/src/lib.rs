//! Golog: action theories in the situation calculus, and programs over them.
//!
//! [`ActionTheory`] reads a theory with its procedures from text. [`solutions`] executes the main procedure offline, as
//! `Do` of Golog, and [`GologExecutor`] online, tick by tick: a [`GologHost`] performs the actions. [`check_theory`]
//! finds defects before it runs. None of them needs an agent; nothing reads a clock.
//!
//! Transitions and final programs are those of ConGolog (De Giacomo, Lespérance and Levesque, Artificial Intelligence
//! 121, 2000), online execution and search those of IndiGolog (De Giacomo, Lespérance, Levesque and Sardina, 2009).
//! Choices are tried in the order of the text. Deviations and additions:
//!
//! - Domains are finite, and fluents are functions. A fluent may be unknown: what depends on it is unknown, a test of it
//!   does not pass, and an action whose precondition is unknown is not possible.
//! - An interrupt may end while its condition does not hold; it needs no program that stops interrupts.
//! - Online, an action of the robot takes time: its effects come with its end, and concurrent programs continue meanwhile.
//!   In `a >> b`, actions of `b` are stopped while `a` performs one, and started again afterwards.
//! - Searches find linear plans. They assume that actions succeed, and that what they sense stays unknown.
//!
//! ```
//! use slate_golog::*;
//!
//! let text = "
//!     domain place = hall, kitchen
//!     fluent at: place = hall
//!     fluent has_cup = false
//!     action go(p: place) possible if at != p at becomes p
//!     action grasp possible if at == kitchen has_cup becomes true
//!     procedure main { repeat { pick p: place { go(p) } | grasp }; test has_cup and at == hall }
//! ";
//! let theory = ActionTheory::parse(text)?;
//! let limits = SolutionLimits { most_depth: 4, most_transitions: 1000 };
//! let mut plans = Vec::new();
//! solutions(&theory, &limits, |actions| {
//!     plans.push(actions.join(" "));
//!     true
//! })?;
//! assert_eq!(plans, ["go(kitchen) grasp go(hall)"]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod analysis;
mod build;
mod error;
mod executor;
mod interpreter;
mod solutions;
mod text;
mod theory;

pub use analysis::{GologFinding, GologFindingKind, ProgramRow, check_theory, outline};
pub use error::{GologError, GologRunError, GologStateError};
pub use executor::{
    GologExecutor, GologHost, GologOutcome, GologProgress, GologState, MOST_ACTIONS, MOST_TRACED,
    RemainingRow, RobotAction, SearchLimits, TracedEvent,
};
pub use solutions::{SolutionLimits, SolutionReport, solutions};
pub use theory::{ActionTheory, PerformedAction};

#[cfg(doctest)]
#[doc = include_str!("../../../../book/src/44-golog.md")]
mod book {}
