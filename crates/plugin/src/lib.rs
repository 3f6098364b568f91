//! Dependencies of a Slate plugin: modules, interfaces and the blocks of MAPE-K.
//! It has no run time, so that a plugin builds in seconds.
//!
//! ```toml
//! [lib]
//! crate-type = ["cdylib"]
//!
//! [dependencies]
//! slate-plugin = "0.1"
//! ```
//! ```
//! use slate_plugin::prelude::*;
//!
//! /// A number.
//! #[interface]
//! pub struct Number {
//!     /// The number.
//!     pub value: f64,
//! }
//!
//! #[ports]
//! pub struct Io {
//!     input: Required<Number>,
//!     doubled: Output<Number>,
//! }
//!
//! /// Doubles a number.
//! pub struct Doubler;
//!
//! #[module(stage = Think)]
//! impl Module for Doubler {
//!     type Io = Io;
//!     type Params = ();
//!     type State = ();
//!
//!     fn tick(_: &mut (), io: &Io, _: &(), _: &Tick) -> Outcome {
//!         io.doubled.set(Number { value: 2.0 * io.input.value });
//!         Outcome::Ok
//!     }
//! }
//!
//! plugin!(Doubler);
//! # assert_eq!(plugin().kinds()[0].name(), "doubler");
//! ```

pub use slate_interfaces as interfaces;
pub use slate_mapek as mapek;
pub use slate_module as module;

/// Imports for the file of a module or of a robot in MAPE-K.
/// Ports and macros, the blocks of MAPE-K with their actions, builder and pipeline, the common interfaces, and
/// mathematics.
pub mod prelude {
    pub use slate_interfaces::prelude::*;
    pub use slate_mapek::prelude::*;
    pub use slate_module::prelude::*;
}
