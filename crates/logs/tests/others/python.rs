//! Programs of others, from PyPI.

use std::path::{Path, PathBuf};

pub use slate_test_tools::run;

/// Read by these, of which others are made.
const PACKAGES: [&str; 3] = ["mcap==1.6.0", "mcap-ros2-support==0.6.0", "rosbags==0.11.9"];

/// A Python that has the packages.
pub fn python() -> PathBuf {
    slate_test_tools::python(&Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros-python"), &PACKAGES)
}
