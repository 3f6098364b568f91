//! Histograms against sorted lists, and traces against what was recorded.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use proptest::prelude::*;
use serde_json::Value;
use slate_engine::timing::{Exported, Histogram, Span, TimingHistogram, Trace, TraceError};
use slate_module::Interface;

const PARTS: [f64; 6] = [0.0, 0.5, 0.9, 0.99, 0.999, 1.0];

/// The quantile of a sorted list, by the nearest rank.
fn quantile(sorted: &[u64], part: f64) -> u64 {
    let rank = ((sorted.len() as f64 * part).ceil() as usize).clamp(1, sorted.len());
    sorted[rank - 1]
}

fn histogram(durations: &[u64]) -> Histogram {
    let mut histogram = Histogram::default();
    durations.iter().for_each(|duration| histogram.record(*duration));
    histogram
}

fn is_close(measured: u64, exact: u64) -> bool {
    measured.abs_diff(exact) as f64 <= exact as f64 * 0.03
}

/// Durations of all sizes from 0 to 100 s.
fn durations() -> impl Strategy<Value = Vec<u64>> {
    let duration = (0_u32..37, any::<u64>()).prop_map(|(bits, number)| {
        let low = 1_u64 << bits;
        (low + number % low).min(100_000_000_000)
    });
    prop::collection::vec(prop_oneof![duration, 0_u64..100], 1..300)
}

proptest! {
    #[test]
    fn quantiles_are_those_of_a_sorted_list(durations in durations(), part in 0.0..=1.0_f64) {
        let histogram = histogram(&durations);
        let mut sorted = durations.clone();
        sorted.sort_unstable();
        for part in PARTS.into_iter().chain([part]) {
            let (measured, exact) = (histogram.quantile(part), quantile(&sorted, part));
            prop_assert!(is_close(measured, exact), "{measured} for {exact} at {part}");
        }
        prop_assert_eq!(histogram.max(), sorted[sorted.len() - 1]);
        prop_assert_eq!(histogram.count(), sorted.len() as u64);
        prop_assert_eq!(histogram.mean(), sorted.iter().sum::<u64>() / sorted.len() as u64);
    }

    #[test]
    fn merged_is_as_if_recorded_together(a in durations(), b in durations()) {
        let mut merged = histogram(&a);
        merged.merge(&histogram(&b));
        prop_assert_eq!(merged, histogram(&[a, b].concat()));
    }
}

#[test]
fn nothing_recorded_is_all_zero() {
    let mut empty = Histogram::default();
    assert_eq!(empty.summary(), TimingHistogram::default());
    empty.merge(&Histogram::default());
    empty.record(7);
    empty.clear();
    assert_eq!(empty, Histogram::default());
    assert_eq!(TimingHistogram::DESCRIPTOR.fields.len(), 7);
}

#[test]
fn short_durations_are_exact_and_endless_ones_count() {
    for duration in 0..64 {
        assert_eq!(histogram(&[0, duration, 1_000_000]).quantile(0.5), duration);
    }
    let endless = histogram(&[10, u64::MAX, u64::MAX]);
    assert_eq!((endless.max(), endless.quantile(1.0), endless.count()), (u64::MAX, u64::MAX, 3));
    assert!(endless.quantile(0.5) > 100_000_000_000);
}

#[test]
fn a_full_counter_makes_room_and_keeps_the_proportions() {
    let mut histogram = histogram(&[100, 100, 100, 1000]);
    for _ in 0..40 {
        let same = histogram.clone();
        histogram.merge(&same);
    }
    assert_eq!(histogram.count(), 4 << 40);
    assert_eq!(histogram.mean(), 325);
    assert!(is_close(histogram.quantile(0.74), 100) && is_close(histogram.quantile(0.76), 1000));
    (0..1000).for_each(|_| histogram.record(100));
    assert!(is_close(histogram.quantile(0.74), 100) && is_close(histogram.quantile(0.76), 1000));
}

fn events(trace: &Trace, from: u64, to: u64) -> (Exported, Vec<Value>) {
    let mut file = Vec::new();
    let exported = trace.export(from, to, &mut file).unwrap();
    let json: Value = serde_json::from_slice(&file).unwrap();
    (exported, json["traceEvents"].as_array().unwrap().clone())
}

fn spans(events: &[Value]) -> Vec<&Value> {
    events.iter().filter(|event| event["ph"] == "X").collect()
}

/// Microseconds as nanoseconds.
fn nanoseconds(value: &Value) -> u64 {
    (value.as_f64().unwrap() * 1000.0).round() as u64
}

#[test]
fn an_export_is_what_was_recorded() {
    let trace = Trace::new(16);
    let strange = "näme \"with\" \\ and \n\u{1}";
    let (stage, module) = (trace.label("Act").unwrap(), trace.label(strange).unwrap());
    let main = trace.track("main loop").unwrap();
    let worker = trace.track(strange).unwrap();
    // A stage ends after its modules, and began before.
    main.record(Span { label: module, start: 1_100, duration: 99, cycle: 7 });
    main.record(Span { label: stage, start: 1_100, duration: 800, cycle: 7 });
    worker.record(Span { label: module, start: 1_234_567, duration: 1, cycle: u64::MAX });
    let (exported, events) = events(&trace, 0, u64::MAX);
    assert_eq!(exported, Exported { spans: 3, ..Exported::default() });
    let names: Vec<_> = events
        .iter()
        .filter(|event| event["name"] == "thread_name")
        .map(|event| (event["tid"].as_u64().unwrap(), event["args"]["name"].as_str().unwrap()))
        .collect();
    assert_eq!(names, [(1, "main loop"), (2, strange)]);
    let spans = spans(&events);
    assert_eq!((&spans[0]["name"], &spans[1]["name"]), (&"Act".into(), &strange.into()));
    assert_eq!((&spans[1]["tid"], &spans[2]["tid"]), (&1.into(), &2.into()));
    assert_eq!(spans[2]["ts"].to_string(), "1234.567");
    assert_eq!(spans[2]["dur"].to_string(), "0.001");
    assert_eq!(spans[2]["args"]["cycle"].as_u64(), Some(u64::MAX));
}

#[test]
fn an_export_has_what_was_under_way_in_its_time() {
    let trace = Trace::new(64);
    let label = trace.label("step").unwrap();
    let track = trace.track("loop").unwrap();
    for start in (0..1000).step_by(100) {
        track.record(Span { label, start, duration: 50, cycle: 0 });
    }
    let starts = |from, to| -> Vec<u64> {
        spans(&events(&trace, from, to).1).iter().map(|span| nanoseconds(&span["ts"])).collect()
    };
    assert_eq!(starts(300, 500), [300, 400]);
    assert_eq!(starts(349, 501), [300, 400, 500]);
    assert_eq!(starts(350, 400), [0; 0], "one that ends with the beginning is out");
    assert_eq!(starts(500, 300), [0; 0]);
    track.record(Span { label, start: 2000, duration: 0, cycle: 0 });
    assert_eq!(starts(2000, 2001), [2000], "no time at all is a time too");
}

#[test]
fn a_full_ring_keeps_the_newest() {
    let trace = Trace::new(8);
    let label = trace.label("step").unwrap();
    let track = trace.track("loop").unwrap();
    for cycle in 0..20 {
        track.record(Span { label, start: cycle * 10, duration: 10, cycle });
    }
    let (exported, events) = events(&trace, 0, u64::MAX);
    // What is missing has ended before the thirteenth has, at the latest.
    assert_eq!(exported, Exported { spans: 8, torn: 0, overwritten: 12, complete_from: 130 });
    let gap = events.iter().find(|event| event["ph"] == "i").unwrap();
    assert_eq!((nanoseconds(&gap["ts"]), &gap["tid"]), (130, &1.into()), "{gap}");
    let cycles: Vec<_> = spans(&events).iter().map(|span| span["args"]["cycle"].as_u64().unwrap()).collect();
    assert!(cycles.into_iter().eq(12..20));
    let (exported, events) = self::events(&trace, 130, u64::MAX);
    assert_eq!((exported.spans, exported.complete_from), (7, 130), "nothing is missing of that time");
    assert!(events.iter().all(|event| event["ph"] != "i"));
}

#[test]
fn a_track_has_one_writer_and_outlives_it() {
    let trace = Trace::new(8);
    let label = trace.label("step").unwrap();
    assert_eq!(trace.label("step").unwrap(), label);
    let first = trace.track("loop").unwrap();
    first.record(Span { label, start: 1, duration: 1, cycle: 1 });
    assert_eq!(trace.track("loop").unwrap_err(), TraceError::Taken { name: "loop".into() });
    drop(first);
    let second = trace.track("loop").unwrap();
    second.record(Span { label, start: 2, duration: 1, cycle: 2 });
    assert_eq!(events(&trace, 0, 10).0.spans, 2);
}

proptest! {
    /// Steps within stages within cycles: whatever overlaps on a track is within the other, and comes after it.
    #[test]
    fn spans_nest_per_track(tracks in prop::collection::vec(prop::collection::vec(1_u64..5000, 1..20), 1..4)) {
        let trace = Trace::new(256);
        let names = ["cycle", "stage", "step"].map(|name| trace.label(name).unwrap());
        for (index, lengths) in tracks.iter().enumerate() {
            let track = trace.track(&format!("thread {index}")).unwrap();
            let mut now = 0;
            for (cycle, length) in (0..).zip(lengths) {
                let record = |label, start, duration| track.record(Span { label, start, duration, cycle });
                record(names[2], now, length / 3);
                record(names[2], now + length / 3, length / 3);
                record(names[1], now, 2 * (length / 3));
                record(names[0], now, *length);
                now += length;
            }
        }
        let (exported, events) = events(&trace, 0, u64::MAX);
        prop_assert_eq!(exported.spans, 4 * tracks.iter().map(Vec::len).sum::<usize>() as u64);
        let mut open: Vec<(u64, u64, u64)> = Vec::new();
        for span in spans(&events) {
            let (thread, start) = (span["tid"].as_u64().unwrap(), nanoseconds(&span["ts"]));
            let end = start + nanoseconds(&span["dur"]);
            open.retain(|(other, _, their_end)| *other == thread && *their_end > start);
            if let Some((_, their_start, their_end)) = open.last() {
                prop_assert!(*their_start <= start && end <= *their_end, "{span} crosses another one");
            }
            open.push((thread, start, end));
        }
    }
}

/// A writer that laps the reader all the time: what is exported is whole, and what was torn is counted.
#[test]
fn a_reader_neither_stops_the_writer_nor_sees_half_a_span() {
    let trace = Arc::new(Trace::new(64));
    let label = trace.label("step").unwrap();
    let track = trace.track("loop").unwrap();
    let is_over = Arc::new(AtomicBool::new(false));
    let writer = {
        let is_over = Arc::clone(&is_over);
        thread::spawn(move || {
            let mut cycle = 0;
            while !is_over.load(Ordering::Relaxed) {
                cycle += 1;
                track.record(Span { label, start: cycle * 1000, duration: cycle * 1000, cycle });
            }
            cycle
        })
    };
    let mut last = Exported::default();
    for _ in 0..300 {
        let (exported, events) = events(&trace, 0, u64::MAX);
        for span in spans(&events) {
            let cycle = span["args"]["cycle"].as_u64().unwrap();
            assert_eq!((nanoseconds(&span["ts"]), nanoseconds(&span["dur"])), (cycle * 1000, cycle * 1000));
        }
        assert!(exported.spans + exported.torn <= 64);
        assert!(exported.overwritten >= last.overwritten);
        last = exported;
    }
    is_over.store(true, Ordering::Relaxed);
    let written = writer.join().unwrap();
    let (exported, _) = events(&trace, 0, u64::MAX);
    assert_eq!((exported.torn, exported.spans + exported.overwritten), (0, written));
}
