//! Recorded numbers read back from a file, one after the other.
//! The time goes from before the file is opened until the last number is read.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use cu29::prelude::{UnifiedLogType, UnifiedLoggerIOReader, UnifiedLoggerRead};
use slate_bag::Reader;

use super::caterpillar::{MODULES, copper_on};
use super::record::Mcap;
use crate::machine::pin;
use crate::measure::{Contest, Effort, Samples};
use crate::table::{Role, Table};

const WORK: &str = "replay";

const FILE: &str = "floor.mcap";

/// Measures all lines.
pub fn run(effort: Effort, table: &mut Table) {
    pin(0);
    let cycles = effort.count(20_000);
    let folder = super::folder();
    let mut file = Mcap::create(folder.path(), MODULES);
    for cycle in 0..cycles as u64 {
        (0..MODULES).for_each(|place| file.write(place, cycle, &cycle.to_le_bytes()));
    }
    drop(file);
    let mut step = copper_on::start(folder.path()).expect("there is room for a log");
    (0..cycles).for_each(|_| step());
    // It is whole when the application is gone.
    drop(step);
    let count = cycles * MODULES;
    let path = folder.path().join(FILE);
    let log = folder.path().join(copper_on::FILE);
    let mut contest = Contest::new(WORK, "a number of a file, read back");
    contest.with("Slate, which reads only what it has checked", Role::Slate, |samples| {
        passes(effort, count, samples, || slate(&path));
    });
    contest.with("Copper (cu29), of its own log", Role::Lesser, |samples| {
        passes(effort, cycles * (MODULES - 1), samples, || copper(&log));
    });
    contest.with("mcap crate alone, of a file in memory", Role::Floor, |samples| {
        passes(effort, count, samples, || crate_alone(&path));
    });
    contest.run(effort, table);
}

/// Reads the whole file some times; the mean time of a number is a sample.
fn passes(effort: Effort, count: usize, samples: &mut Samples, mut read: impl FnMut() -> usize) {
    for _ in 0..effort.count(10) {
        let start = Instant::now();
        let read = read();
        samples.add_mean(start.elapsed(), count as u32);
        assert_eq!(read, count, "everything is read");
    }
}

fn slate(path: &Path) -> usize {
    let mut reader = Reader::open(path).expect("the file is whole");
    let mut count = 0;
    while let Some(message) = reader.next_message().expect("the file is whole") {
        black_box(message.data);
        count += 1;
    }
    count
}

/// Reads Copper's log as its own tools do, a cycle at a time.
/// Its last task writes nothing.
fn copper(path: &Path) -> usize {
    let log = UnifiedLoggerRead::new(path).expect("the log is whole");
    let mut cycles = UnifiedLoggerIOReader::new(log, UnifiedLogType::CopperList);
    let mut count = 0;
    while let Ok(cycle) =
        bincode::decode_from_std_read::<copper_on::Cycle, _, _>(&mut cycles, bincode::config::standard())
    {
        black_box(cycle);
        count += MODULES - 1;
    }
    count
}

fn crate_alone(path: &Path) -> usize {
    let bytes = std::fs::read(path).expect("the file was written");
    let stream = mcap::MessageStream::new(&bytes).expect("the file is whole");
    stream.map(|message| drop(black_box(message.expect("the file is whole").data))).count()
}
