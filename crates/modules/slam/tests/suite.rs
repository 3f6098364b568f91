//! Tests of SLAM.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

mod graph_slam;
mod particle_slam;
mod pose_graph;
mod world;
