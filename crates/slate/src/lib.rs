//! Slate: a robot software framework. An architecture for autonomous robots that the compiler enforces, everything the
//! robot knows at a URL, and runs that replay bit for bit.
//!
//! This is the crate to depend on; [`prelude`] has what the file of a module imports.

pub use slate_interfaces as interfaces;
pub use slate_mapek as mapek;
pub use slate_module as module;
pub use slate_module::blackboard;
pub use slate_record as record;
pub use slate_runtime as runtime;
pub use slate_safety as safety;
pub use slate_sim as sim;

/// What a module's file imports.
pub mod prelude {
    pub use slate_module::prelude::*;
}
