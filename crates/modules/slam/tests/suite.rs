//! Tests of SLAM.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

mod block;
mod graph_slam;
mod log_player;
mod particle_slam;
mod pose_graph;
mod world;
