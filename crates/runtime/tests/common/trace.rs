//! Reads the files that Perfetto opens.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]
#![allow(dead_code, reason = "each test uses a part of it")]

use std::collections::BTreeMap;

use serde_json::Value;

/// What is on a track.
#[derive(Debug, Default)]
pub struct Track {
    /// What each span is called, when it begins and how long it takes, nanoseconds, and the cycle.
    pub spans: Vec<(String, u64, u64, u64)>,
    /// Where spans are missing, nanoseconds, and what is said of them.
    pub gaps: Vec<(u64, String)>,
}

impl Track {
    /// How many spans have that name.
    pub fn count(&self, name: &str) -> usize {
        self.spans.iter().filter(|span| span.0 == name).count()
    }

    /// The cycles of the spans that have that name.
    pub fn cycles(&self, name: &str) -> Vec<u64> {
        self.spans.iter().filter(|span| span.0 == name).map(|span| span.3).collect()
    }
}

/// Microseconds as nanoseconds.
fn nanoseconds(value: &Value) -> u64 {
    let time = value.as_f64().unwrap();
    assert!(time >= 0.0);
    (time * 1000.0).round() as u64
}

/// The tracks of a file by their names; every event must be well formed.
pub fn tracks(file: &[u8]) -> BTreeMap<String, Track> {
    let file: Value = serde_json::from_slice(file).unwrap();
    let mut names = BTreeMap::new();
    let mut tracks: BTreeMap<String, Track> = BTreeMap::new();
    for event in file["traceEvents"].as_array().unwrap() {
        assert_eq!(event["pid"], 1, "{event}");
        let (thread, name) = (event["tid"].as_u64().unwrap(), event["name"].as_str().unwrap());
        match (event["ph"].as_str().unwrap(), name) {
            ("M", "process_name") => assert_eq!(event["args"]["name"], "slate"),
            ("M", "thread_name") => {
                let name = event["args"]["name"].as_str().unwrap().to_owned();
                assert!(names.insert(thread, name.clone()).is_none(), "one name for a track");
                assert!(tracks.insert(name, Track::default()).is_none(), "one track for a name");
            }
            ("X", name) => {
                let times = (nanoseconds(&event["ts"]), nanoseconds(&event["dur"]));
                let cycle = event["args"]["cycle"].as_u64().unwrap();
                let track = tracks.get_mut(&names[&thread]).unwrap();
                track.spans.push((name.into(), times.0, times.1, cycle));
            }
            ("i", name) => {
                assert_eq!(event["s"], "t");
                tracks.get_mut(&names[&thread]).unwrap().gaps.push((nanoseconds(&event["ts"]), name.into()));
            }
            _ => unreachable!("{event}"),
        }
    }
    tracks
}
