//! All tests of the crate that share a process, in one program: each program costs link time.

mod faults;
mod pioneer;
mod published;
mod robot;
