use std::sync::OnceLock;

use proptest::prelude::*;
use slate_runtime::snapshot::{Snapshot, SnapshotError};

use crate::snapshot::support::{ROBOT, file, robot, steps};

fn whole() -> &'static [u8] {
    static WHOLE: OnceLock<Vec<u8>> = OnceLock::new();
    WHOLE.get_or_init(|| {
        let mut agent = robot(ROBOT);
        steps(&mut agent, 9);
        let path = file("whole");
        agent.composer().save_snapshot(&path).unwrap();
        std::fs::read(path).unwrap()
    })
}

fn read(name: &str, bytes: &[u8]) -> Result<Snapshot, SnapshotError> {
    let path = file(name);
    std::fs::write(&path, bytes).unwrap();
    let read = Snapshot::read(&path);
    if let Err(error) = &read {
        assert!(error.to_string().contains(&path.display().to_string()), "{error}");
    }
    read
}

proptest! {
    #[test]
    fn a_file_that_is_cut_is_refused(at in any::<prop::sample::Index>()) {
        let whole = whole();
        prop_assert!(read("cut", &whole[..at.index(whole.len())]).is_err());
    }

    #[test]
    fn a_file_with_a_bit_that_is_another_is_refused(at in any::<prop::sample::Index>(), bit in 0..8u32) {
        let mut bytes = whole().to_vec();
        let at = at.index(bytes.len());
        bytes[at] ^= 1u8 << bit;
        prop_assert!(read("flip", &bytes).is_err(), "byte {}", at);
    }

    #[test]
    fn invalid_snapshot_is_refused(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(read("noise", &bytes).is_err());
    }
}

#[test]
fn a_file_with_more_behind_it_is_refused() {
    let mut bytes = whole().to_vec();
    assert!(read("more", &bytes).is_ok());
    bytes.push(0);
    let error = read("more", &bytes).unwrap_err().to_string();
    assert!(error.ends_with("something else follows behind it"), "{error}");
    let error = read("text", b"# text").unwrap_err().to_string();
    assert!(error.ends_with("something else is in it"), "{error}");
}

#[test]
fn other_version_is_reported() {
    let mut bytes = Vec::new();
    let later = [("slate_snapshot", 2)].into_iter().collect::<slate_sorted::SortedMap<_, _>>();
    ciborium::into_writer(&later, &mut bytes).unwrap();
    let error = read("later", &bytes).unwrap_err();
    assert!(matches!(error, SnapshotError::Version { found: 2, expected: 1, .. }), "{error}");
}
