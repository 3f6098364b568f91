//! Values that never came, which a writer counts.
#![cfg(not(any(loom, feature = "shuttle")))]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::sync::Arc;

use proptest::prelude::*;
use slate_blackboard::Shape;
use slate_blackboard::channel::{Budget, Channel, Policy, Start};

fn channel(depth: usize) -> Arc<Channel> {
    Channel::new(Shape::fixed(8, 8), depth, Budget { latest: 2, queues: 2, window: 8 })
}

proptest! {
    /// Whatever is written, left out and read: a reader gets the values in order, and what it did not get is counted.
    #[test]
    fn every_reader_counts_what_it_has_missed(
        depth in 2..20_usize,
        steps in proptest::collection::vec((0..4_u8, 0..40_u64), 1..200),
    ) {
        let channel = channel(depth);
        let mut writer = channel.writer().unwrap();
        let mut reader = channel.queue(Policy::Skip, Start::Oldest).unwrap();
        let (mut seen, mut last) = (0, 0);
        let mut check = |reader: &mut slate_blackboard::channel::QueueReader| {
            while reader.pull().unwrap() > 0 {
                for loan in reader.window() {
                    prop_assert!(loan.stamp().sequence > last);
                    last = loan.stamp().sequence;
                    prop_assert_eq!(loan.bytes(), last.to_ne_bytes());
                    seen += 1;
                }
            }
            prop_assert_eq!(seen + reader.skipped(), last);
            Ok(())
        };
        for (what, count) in steps {
            match what {
                0 => writer.skip(count),
                1 => check(&mut reader)?,
                _ => {
                    let number = writer.last().sequence + 1;
                    let stamp = writer.write(&number.to_ne_bytes(), 0, 0).unwrap();
                    prop_assert_eq!(stamp.sequence, number);
                }
            }
        }
        let number = writer.last().sequence + 1;
        writer.write(&number.to_ne_bytes(), 0, 0).unwrap();
        check(&mut reader)?;
        prop_assert_eq!(seen + reader.skipped(), number);
    }
}

#[test]
fn a_lossless_reader_is_not_blocked_by_a_value_that_never_came() {
    let channel = channel(4);
    let mut writer = channel.writer().unwrap();
    let mut reader = channel.queue(Policy::Block, Start::Oldest).unwrap();
    for _ in 0..3 {
        writer.skip(1000);
        writer.write(&[1; 8], 0, 0).unwrap();
        assert_eq!(reader.pull(), Ok(1));
    }
    assert!(reader.skipped() >= 3, "{}", reader.skipped());
}
