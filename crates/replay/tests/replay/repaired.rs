//! Runs that are made again from recordings that were cut off, damaged and repaired.

use std::path::Path;

use slate_bag::{Reader, repair, verify};
use slate_replay::{Comparison, Verdict};
use slate_runtime::{Agent, Options, RecordedTimes};

use crate::replay::support::{file, plugins, recorded, times};

/// What comes of the run of a recording, made again.
pub fn verdict(path: &Path) -> Verdict {
    let comparison = Comparison::open(path).unwrap();
    let database = comparison.run().configuration(Vec::new()).unwrap();
    let options = Options {
        time_source: Some(Box::new(RecordedTimes::new(times()))),
        recording: Some(comparison.recording()),
        ..Options::default()
    };
    let agent = Agent::load_with(&database, &plugins(), options).unwrap();
    comparison.compare(agent).unwrap()
}

/// A message without a checksum may be damaged, so a difference in it is no divergence.
#[test]
fn garbage_in_a_repaired_file_is_no_difference_of_the_run() {
    let whole = recorded("unvouched.mcap");
    assert!(matches!(verdict(&whole), Verdict::Identical { values: 100.., whole: true, .. }));
    let bytes = std::fs::read(&whole).unwrap();
    let (path, mended) = (file("unvouched-cut.mcap"), file("unvouched-mended.mcap"));
    // In the middle of a chunk, so of what is before it in there nothing says that it is right.
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let chunk = summary.chunk_indexes.iter().max_by_key(|chunk| chunk.chunk_length).unwrap();
    let cut = (chunk.chunk_start_offset + chunk.chunk_length) as usize - 5;
    let (mut doubted, mut fields) = (0, 0);
    for place in (cut - 900..cut - 100).step_by(7) {
        let mut damaged = bytes[..cut].to_vec();
        damaged[place] ^= 0x24;
        std::fs::write(&path, damaged).unwrap();
        let told = repair(&path, Some(&mended)).unwrap();
        assert!(told.unfinished > 0, "{told:?}");
        verify(&mut Reader::open(&mended).unwrap()).unwrap();
        match verdict(&mended) {
            Verdict::NotCovered(why) => {
                assert!(why.contains("have no checksum") || why.contains("values are missing"), "{why}");
                // Time, property, field, and what both have there.
                let is_field =
                    why.contains("/sum/value: recorded ") || why.contains("/number/value: recorded ");
                fields += u32::from(is_field && why.contains(" s: /") && why.contains(", replayed "));
                doubted += 1;
            }
            Verdict::Identical { whole, .. } => assert!(!whole, "it was cut off"),
            other => panic!("byte {place}: {other:?}"),
        }
    }
    assert!(doubted > 20 && fields > 3, "{doubted} {fields}");
}
