//! Saved knowledge of a robot, with damage that its checksum does not show.

use crate::knowledge::LIMITS;
use crate::memory::within;
use slate_share::knowledge::Replica;

/// Restores what was saved, without its checksum.
pub fn run(content: &[u8]) {
    let _ = Replica::restore(1, 77, LIMITS, content);
    let mut saved = content.to_vec();
    saved.extend(xxhash_rust::xxh3::xxh3_64(content).to_le_bytes());
    within((1 << 20) + 8 * content.len(), || match Replica::restore(1, 77, LIMITS, &saved) {
        Ok(replica) => {
            let limits = LIMITS;
            assert!(replica.memory() <= limits.memory(), "{} bytes", replica.memory());
            let saved = replica.save();
            let again = Replica::restore(1, 78, LIMITS, &saved).expect("what is saved is restored");
            assert!(replica.versions().eq(again.versions()), "what is saved is not what is restored");
        }
        Err(error) => drop(error.to_string()),
    });
}
