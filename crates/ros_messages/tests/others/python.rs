//! Programs of others, from PyPI.

use std::path::{Path, PathBuf};

pub use slate_test_tools::run;

/// A Python that has readers of messages.
pub fn python() -> PathBuf {
    let packages = ["mcap-ros2-support==0.6.0", "rosbags==0.11.9"];
    slate_test_tools::python(&Path::new(env!("CARGO_TARGET_TMPDIR")).join("message-python"), &packages)
}
