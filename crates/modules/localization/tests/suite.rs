//! Tests of localization.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

mod amcl;
mod ekf;
mod map_server;
mod monte_carlo;
mod planar_filter;
