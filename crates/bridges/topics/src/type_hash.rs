use std::fmt::Write;

use sha2::{Digest, Sha256};
use slate_ros_messages::{Definition, Error, type_description};

/// Version of hashes, which they begin with.
const VERSION: &str = "RIHS01";

/// Returns the hash by which ROS 2 nodes compare types (REP 2011).
/// Such as `RIHS01_df66...`.
///
/// # Errors
/// The definition is invalid, or lacks a message.
pub fn type_hash(definition: &Definition) -> Result<String, Error> {
    let mut hash = format!("{VERSION}_");
    for byte in Sha256::digest(type_description(definition)?.as_bytes()) {
        // Writing into a string can't fail.
        let _ = write!(hash, "{byte:02x}");
    }
    Ok(hash)
}
