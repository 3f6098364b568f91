//! Traces that hold all of a time, whatever its length.
#![cfg(not(feature = "shuttle"))]
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and waits for other threads on the wall clock"
)]

use crate::common;
#[path = "common/trace.rs"]
mod file;

use std::io::{self, ErrorKind, Write};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use file::tracks;
use proptest::prelude::*;
use slate_runtime::timing::{Recorder, Span, Trace};
use slate_runtime::{Agent, Options, Rate};

/// A robot of three stages with a module each.
fn robot(name: &str) -> Agent {
    let name = format!("test-{}-{name}", std::process::id());
    let text = format!(
        "agent.name = \"{name}\"\ntime.source = \"counter\"\n[modules.counter]\n[modules.relay]\n[modules.driver]\n\
         [links]\n\"relay/input\" = \"counter/number\"\n\"driver/input\" = \"relay/output\"\n\
         [actuators.wheel]\ncommand = \"driver/wheel\"\n"
    );
    common::load(&text, &[], Options { rate: Rate::Max, armed: true, ..Options::default() }).unwrap()
}

/// Spans of a cycle: itself, three stages and three modules.
const SPANS: u64 = 7;

fn step(agent: &mut Agent, cycles: u64) {
    (0..cycles).for_each(|_| assert!(agent.step()));
}

fn eventually(mut so: impl FnMut() -> bool) {
    let start = Instant::now();
    while !so() {
        assert!(start.elapsed() < Duration::from_secs(60), "it never was");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Makes many cycles, and lets the recording keep up.
fn step_in_time(agent: &mut Agent, cycles: u64, mut spans: impl FnMut() -> u64) {
    let before = spans();
    for made in 1..=cycles {
        assert!(agent.step());
        if made.is_multiple_of(2000) || made == cycles {
            eventually(|| spans() == before + made * SPANS);
        }
    }
}

#[test]
fn a_long_recording_has_every_span() {
    const CYCLES: u64 = 50_000;
    let mut agent = robot("long");
    step(&mut agent, 10);
    let recording = agent.trace().record(Vec::new()).unwrap();
    step_in_time(&mut agent, CYCLES, || recording.recorded().unwrap().spans());
    let (recorded, file) = recording.end().unwrap();
    assert!(!agent.trace().is_on());
    step(&mut agent, 10);
    assert_eq!((recorded.spans(), recorded.missing()), (CYCLES * SPANS, 0));
    assert!(recorded.to > recorded.from && recorded.to <= agent.trace().now());
    let tracks = tracks(&file);
    assert_eq!(tracks.keys().collect::<Vec<_>>(), ["counter", "driver", "main loop", "relay"]);
    // Of the loop's ring that is three times what it holds, of the others twelve times.
    assert_eq!(tracks["main loop"].spans.len() as u64, 4 * CYCLES);
    assert!(tracks["main loop"].cycles("cycle").into_iter().eq(11..=CYCLES + 10), "each cycle, once");
    for module in ["counter", "relay", "driver"] {
        assert!(tracks[module].cycles(module).into_iter().eq(11..=CYCLES + 10), "{module}");
    }
    assert!(tracks.values().all(|track| track.gaps.is_empty()));
    let within = |span: &(String, u64, u64, u64)| span.1 + span.2 >= recorded.from && span.1 <= recorded.to;
    assert!(tracks.values().flat_map(|track| &track.spans).all(within));
}

#[test]
fn two_recordings_and_the_program_end_one_another_never() {
    let mut agent = robot("two");
    let trace = agent.trace();
    assert!(!trace.is_on());
    trace.stop();
    let first = trace.record(Vec::new()).unwrap();
    step(&mut agent, 10);
    trace.start();
    trace.start();
    let second = trace.record(Vec::new()).unwrap();
    step(&mut agent, 20);
    trace.stop();
    let (recorded, file) = first.end().unwrap();
    assert_eq!((recorded.spans(), tracks(&file)["main loop"].count("cycle")), (30 * SPANS, 30));
    step(&mut agent, 5);
    let (recorded, file) = second.end().unwrap();
    assert_eq!((recorded.spans(), tracks(&file)["main loop"].count("cycle")), (25 * SPANS, 25));
    assert!(trace.is_on(), "for the program, which has started it twice");
    step(&mut agent, 1);
    trace.stop();
    trace.stop();
    assert!(!trace.is_on());
    drop(trace.record(Vec::new()).unwrap());
    assert!(!trace.is_on());
    let mut past = Vec::new();
    assert_eq!(trace.export(0, u64::MAX, &mut past).unwrap().spans, 36 * SPANS);
    assert_eq!(tracks(&past)["relay"].count("relay"), 36);
}

/// Writes when it may.
struct Gate {
    open: Receiver<()>,
    written: Vec<u8>,
}

impl Gate {
    /// One that passes the beginning of the file, and its opening.
    fn new() -> (Self, Sender<()>) {
        let (sender, open) = channel();
        sender.send(()).unwrap();
        (Self { open, written: Vec::new() }, sender)
    }
}

impl Write for Gate {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        // Once its sender is gone it is open for good.
        let _ = self.open.recv();
        self.written.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn values_faster_than_the_file_are_reported_per_track() {
    const CYCLES: u64 = 30_000;
    let mut agent = robot("missing");
    let (gate, opener) = Gate::new();
    let recording = agent.trace().record(gate).unwrap();
    // The writer stands still from when the first quarter of a megabyte is full; the loop never does.
    step(&mut agent, CYCLES);
    drop(opener);
    let (recorded, gate) = recording.end().unwrap();
    let tracks = tracks(&gate.written);
    assert_eq!(recorded.spans() + recorded.missing(), CYCLES * SPANS);
    for track in &recorded.tracks {
        let written = &tracks[&track.name];
        assert_eq!(written.spans.len() as u64, track.spans, "{}", track.name);
        let said = |(_, text): &(u64, String)| {
            text.strip_suffix(" spans are missing until here").unwrap().parse::<u64>().unwrap()
        };
        assert_eq!(written.gaps.iter().map(said).sum::<u64>(), track.missing, "{}", track.name);
        if track.name != "main loop" {
            assert!(track.missing > 0 && track.spans + track.missing == CYCLES, "{track:?}");
            // What is missing is missing where the file says so.
            for gap in &written.gaps {
                let after = written.spans.iter().position(|span| span.1 + span.2 == gap.0).unwrap();
                let before = after.checked_sub(1).map_or(0, |before| written.spans[before].3);
                assert_eq!(written.spans[after].3 - before - 1, said(gap), "{}", track.name);
            }
        }
    }
}

/// Has no room.
#[derive(Debug)]
struct Full(usize);

impl Write for Full {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.0 == 0 {
            return Err(ErrorKind::StorageFull.into());
        }
        let written = bytes.len().min(self.0);
        self.0 -= written;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_ends_the_recording_and_nothing_else() {
    let mut agent = robot("full");
    let trace = agent.trace();
    assert_eq!(trace.record(Full(10)).unwrap_err().kind(), ErrorKind::StorageFull, "at once");
    assert!(!trace.is_on());
    let recording = trace.record(Full(100_000)).unwrap();
    let other = trace.record(Vec::new()).unwrap();
    step_in_time(&mut agent, 10_000, || other.recorded().unwrap().spans());
    eventually(|| recording.recorded().is_err());
    assert_eq!(recording.recorded().unwrap_err().kind(), ErrorKind::StorageFull);
    assert_eq!(recording.end().unwrap_err().kind(), ErrorKind::StorageFull);
    assert_eq!(other.end().unwrap().0.spans(), 10_000 * SPANS);
    assert!(!trace.is_on());
}

/// A writer that panics.
#[derive(Debug)]
struct Wild;

impl Write for Wild {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        assert!(bytes.len() < 1000, "as the test wants");
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_writer_that_panics_ends_its_recording_with_an_error() {
    let mut agent = robot("wild");
    let recording = agent.trace().record(Wild).unwrap();
    step(&mut agent, 4000);
    eventually(|| recording.recorded().is_err());
    assert!(recording.end().is_err());
    assert!(!agent.trace().is_on());
}

#[test]
fn modules_that_come_and_go_are_in_it() {
    let mut agent = robot("come");
    let recording = agent.trace().record(Vec::new()).unwrap();
    step(&mut agent, 3);
    for _ in 0..5 {
        agent.composer().unload("relay").unwrap();
        step(&mut agent, 2);
        agent.composer().load("relay").unwrap();
        step(&mut agent, 2);
    }
    let (recorded, file) = recording.end().unwrap();
    let tracks = tracks(&file);
    assert_eq!(recorded.missing(), 0);
    assert_eq!(tracks["driver"].count("driver"), 23);
    let with_relay = (1..=23_u64).filter(|cycle| *cycle <= 3 || (cycle - 4) % 4 >= 2);
    assert!(tracks["relay"].cycles("relay").into_iter().eq(with_relay), "{:?}", tracks["relay"]);
}

proptest! {
    /// Whatever is recorded before a track's ring has gone round is in the file; of the rest is said how much it is.
    #[test]
    fn spans_are_in_the_file_or_counted(batches in prop::collection::vec((0_u64..12, 0_u64..40), 1..20)) {
        let trace = Arc::new(Trace::new(16));
        let (step, cycle) = (trace.label("step").unwrap(), trace.label("cycle").unwrap());
        let (wide, narrow) = (trace.track("wide").unwrap(), trace.track("narrow").unwrap());
        narrow.record(Span { label: step, start: 0, duration: 1, cycle: 0 });
        let mut recorder = Recorder::begin(&trace, 0, Vec::new()).unwrap();
        let (mut now, mut number, mut lost) = (10, 0, 0);
        for (cycles, steps) in &batches {
            // A cycle begins with its step and ends after it, often in another batch.
            for part in 0..*cycles {
                let record = |label, duration| wide.record(Span { label, start: now, duration, cycle: number });
                record(step, 3);
                if part == 3 {
                    recorder.drain().unwrap();
                }
                record(cycle, 5);
                (now, number) = (now + 10, number + 1);
            }
            for at in 0..*steps {
                narrow.record(Span { label: step, start: now + at, duration: 1, cycle: number });
            }
            now += steps;
            lost += steps.saturating_sub(16);
            recorder.drain().unwrap();
        }
        let (recorded, file) = recorder.end(now).unwrap();
        let tracks = tracks(&file);
        let steps: u64 = batches.iter().map(|batch| batch.1).sum();
        let of = |name: &str| recorded.tracks.iter().find(|track| track.name == name).cloned();
        let narrow = of("narrow").map_or((0, 0), |track| (track.spans, track.missing));
        prop_assert_eq!(narrow, (steps - lost, lost));
        prop_assert_eq!(tracks.get("narrow").map_or(0, |track| track.gaps.len()), batches.iter().filter(|batch| batch.1 > 16).count());
        // Eleven cycles are 22 spans, and after the fourth they are drained.
        prop_assert_eq!(of("wide").map_or(0, |track| track.spans), 2 * number);
        let mut open = 0;
        for (name, start, duration, _) in tracks.get("wide").map_or(&[][..], |track| &track.spans) {
            match name.as_str() {
                "cycle" => open = start + duration,
                _ => prop_assert!(start + duration <= open, "what is in a cycle stands behind it"),
            }
        }
    }
}
