//! Frame tree with history: transforms between frames, present and past.
//!
//! Frames are named as in ROS's REP-105: `map` is fixed to the world, `odom` drifts in it but never jumps, `base_link`
//! is the robot, and its children are the sensors. Each frame has at most one parent. [`FrameTree::set`] adds a transform to the parent;
//! [`FrameTree::lookup`] returns the transform between any two frames of a tree.
//!
//! ```
//! use nalgebra::{Isometry3, Point3, Vector3};
//! use slate_transforms::FrameTree;
//!
//! const SECOND: u64 = 1_000_000_000;
//! let mut frames = FrameTree::default();
//! frames.set_fixed("base_link", "laser", Isometry3::translation(0.2, 0.0, 0.0))?;
//! frames.set("odom", "base_link", 1 * SECOND, Isometry3::translation(0.0, 0.0, 0.0))?;
//! frames.set("odom", "base_link", 2 * SECOND, Isometry3::translation(1.0, 0.0, 0.0))?;
//!
//! // A point 2 m ahead of the laser, half-way in time, is at 2.7 m.
//! let laser = frames.lookup("odom", "laser", 1_500_000_000)?;
//! assert_eq!(laser * Point3::new(2.0, 0.0, 0.0), Point3::new(2.7, 0.0, 0.0));
//!
//! let error = frames.lookup("odom", "laser", 3 * SECOND).unwrap_err();
//! assert_eq!(error.to_string(), "at 3 s: the newest of `odom` -> `base_link` is 2 s");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Why it is written here
//! Of the crates that do this without ROS, `transforms` 2.3 is well kept, but its lookups allocate, its history is bounded
//! by age and not by size, and it knows no tolerance; `schiebung` 0.5 reads a file of its own and brings a graph library
//! and an older nalgebra. A step of a robot may not allocate, so the tree is written on nalgebra, which the simulator's
//! physics uses anyway. Interpolation uses libm and is the same on every machine.

mod error;
mod history;
mod interpolation;
mod stamped;
mod tree;

pub use error::{SetError, TransformError};
pub use stamped::{isometry, stamped};
pub use tree::{Edge, FrameTree, Limits, Placement};
