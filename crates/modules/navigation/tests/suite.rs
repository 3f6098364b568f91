//! All tests of the crate, in one program: each program costs link time.

mod actions;
mod collision_stop;
mod common;
mod costmaps;
mod mission;
mod obstacle_avoidance;
mod referee;
mod route_planner;
