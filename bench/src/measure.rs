//! Measurement of contestants in turns, round after round; every sample counts.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::hint::black_box;
use std::time::{Duration, Instant};

use hdrhistogram::Histogram;

use crate::table::{Role, Row, Table};

/// System allocator that counts the allocations of each thread.
/// Own code: `allocation-counter` counts within closures, with a cost in each allocation that a bench would measure.
pub struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

fn count() {
    // A thread that ends may free and allocate after its counter is gone.
    let _ = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
}

// SAFETY: all is left to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: as the caller promises.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: as the caller promises.
        unsafe { System.realloc(memory, layout, size) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(memory, layout) }
    }
}

/// Returns the number of allocations of this thread.
pub fn allocations() -> u64 {
    ALLOCATIONS.with(Cell::get)
}

/// Takes a value whose making must not be left out.
#[inline]
pub fn consume<T>(value: T) {
    black_box(value);
}

/// Amount of measuring.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Little, so that all is done in three minutes.
    pub quick: bool,
}

impl Effort {
    /// In how many rounds contestants take turns.
    pub fn rounds(self) -> usize {
        if self.quick { 2 } else { 7 }
    }

    /// Returns the number of operations of a round: `full`, or a part of it.
    pub fn count(self, full: usize) -> usize {
        if self.quick { full.div_ceil(10) } else { full }
    }

    /// Returns the duration of a round: `full`, or a part of it.
    pub fn time(self, full: Duration) -> Duration {
        if self.quick { full / 10 } else { full }
    }
}

/// Longest time that a histogram distinguishes: 1000 s, in picoseconds.
const LONGEST: u64 = 1_000_000_000_000_000;

/// Samples of one contestant.
pub struct Samples {
    picoseconds: Histogram<u64>,
    operations: u64,
    allocations: u64,
}

impl Samples {
    /// Creates an empty set.
    pub fn new() -> Self {
        let picoseconds = Histogram::new_with_bounds(1, LONGEST, 3);
        Self {
            picoseconds: picoseconds.expect("the bounds are constant and valid"),
            operations: 0,
            allocations: 0,
        }
    }

    /// Does something `count` times; the mean time of one is a sample.
    #[inline]
    pub fn burst(&mut self, count: u32, mut operation: impl FnMut(u64)) {
        let before = allocations();
        let start = Instant::now();
        for i in 0..u64::from(count) {
            operation(black_box(i));
        }
        let took = start.elapsed();
        self.add_mean(took, count);
        self.allocated(count.into(), allocations() - before);
    }

    /// Does something once; the time that it takes is a sample.
    #[inline]
    pub fn time<T>(&mut self, operation: impl FnOnce() -> T) -> T {
        let before = allocations();
        let start = Instant::now();
        let result = operation();
        let took = start.elapsed();
        self.add_mean(took, 1);
        self.allocated(1, allocations() - before);
        result
    }

    /// The time of one of `count` that took so long together.
    pub fn add_mean(&mut self, took: Duration, count: u32) {
        let picoseconds = (took.as_nanos() as f64 * 1000.0 / f64::from(count)) as u64;
        self.picoseconds.saturating_record(picoseconds.max(1));
    }

    /// A sample of so many nanoseconds.
    pub fn add(&mut self, nanoseconds: u64) {
        self.picoseconds.saturating_record((nanoseconds * 1000).max(1));
    }

    /// Adds the allocations of a number of operations.
    pub fn allocated(&mut self, operations: u64, allocations: u64) {
        self.operations += operations;
        self.allocations += allocations;
    }

    /// Adds the samples of another thread for the same contestant.
    pub fn join(&mut self, other: &Samples) {
        self.picoseconds.add(&other.picoseconds).expect("all have the same bounds");
        self.allocated(other.operations, other.allocations);
    }

    /// Returns the number of samples.
    pub fn len(&self) -> u64 {
        self.picoseconds.len()
    }

    /// The median, nanoseconds.
    pub fn median(&self) -> f64 {
        self.at(0.5)
    }

    fn at(&self, share: f64) -> f64 {
        self.picoseconds.value_at_quantile(share) as f64 * 1e-3
    }

    fn row(&self, contest: &Contest<'_>, name: &str, role: Role, slate: Option<f64>) -> Row {
        Row {
            work: contest.work.clone(),
            line: contest.line.clone(),
            contestant: name.to_owned(),
            role,
            p50: self.at(0.5),
            p99: self.at(0.99),
            p999: self.at(0.999),
            max: self.picoseconds.max() as f64 * 1e-3,
            samples: self.len(),
            allocations: (self.operations > 0).then(|| self.allocations as f64 / self.operations as f64),
            ratio: slate.filter(|slate| *slate > 0.0).map(|slate| self.at(0.5) / slate),
            provenance: crate::machine::provenance(),
        }
    }
}

type Round<'a> = Box<dyn FnMut(&mut Samples) + 'a>;

/// Contestants that do the same work: a line of the table for each.
pub struct Contest<'a> {
    work: String,
    line: String,
    contestants: Vec<(String, Role, Round<'a>)>,
}

impl<'a> Contest<'a> {
    /// Creates a comparison: the work and its variant.
    pub fn new(work: &str, line: impl Into<String>) -> Self {
        Self { work: work.into(), line: line.into(), contestants: Vec::new() }
    }

    /// Adds one with what it does in a round.
    pub fn with(&mut self, name: &str, role: Role, round: impl FnMut(&mut Samples) + 'a) {
        self.contestants.push((name.into(), role, Box::new(round)));
    }

    /// Runs the contestants in turns.
    /// The first one changes from round to round, and only a warm-up round is left out, of which no samples count.
    pub fn run(mut self, effort: Effort, table: &mut Table) {
        let mut samples: Vec<_> = self.contestants.iter().map(|_| Samples::new()).collect();
        let mut contestants = std::mem::take(&mut self.contestants);
        for (_, _, round) in &mut contestants {
            round(&mut Samples::new());
        }
        for round in 0..effort.rounds() {
            for turn in 0..contestants.len() {
                let place = (round + turn) % contestants.len();
                contestants[place].2(&mut samples[place]);
            }
        }
        let slate = contestants.iter().zip(&samples).find(|((_, role, _), _)| *role == Role::Slate);
        let slate = slate.map(|(_, samples)| samples.median());
        for ((name, role, _), samples) in contestants.iter().zip(&samples) {
            table.add(samples.row(&self, name, *role, slate));
        }
    }
}
