//! Tests of global planning.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

mod costmap;
mod hybrid_a_star;
mod searches;
mod steering_paths;
