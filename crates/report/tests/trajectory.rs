//! `trajectory.csv`.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use crate::common;

use common::sample;
use proptest::prelude::*;
use slate_report::{Route, Sample, ThinnedTrajectory, Trajectory, TrajectoryPosition, TrajectoryStream};
use std::fs;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Duration;

const HEADER: &str = "time_s,robot,x_m,y_m,theta_rad,route,action\n";

#[test]
fn header_and_rows_are_as_promised() {
    let samples = vec![
        sample(0, "R1", 1.0, -2.5, None, ""),
        sample(50_000_000, "R2", 0.25, 0.1, Some(Route::Deliberative), "GoToOrigin"),
        sample(12_345_678_901, "R2", 0.0, 0.0, Some(Route::Reactive), "AvoidObstacle(left, 0.3)"),
    ];
    let rows = "0,R1,1,-2.5,0.5,none,\n\
                0.05,R2,0.25,0.1,0.5,deliberative,GoToOrigin\n\
                12.345678901,R2,0,0,0.5,reactive,\"AvoidObstacle(left, 0.3)\"\n";
    assert_eq!(Trajectory { samples }.csv(), format!("{HEADER}{rows}"));
}

#[test]
fn without_samples_there_is_the_header() {
    assert_eq!(Trajectory::default().csv(), HEADER);
}

/// The samples of two robots at times of a run, until it has so many.
fn grow(trajectory: &mut ThinnedTrajectory, times: std::ops::Range<u64>) {
    for time in times.map(|number| number * ThinnedTrajectory::SAMPLE_PERIOD) {
        let robots = ["r1", "r2"].map(|robot| sample(time, robot, time as f64 * 1e-9, 0.5, None, ""));
        trajectory.add(time, false, robots);
    }
}

#[test]
fn thinned_trajectory_is_bounded_and_even() {
    let mut trajectory = ThinnedTrajectory::default();
    grow(&mut trajectory, 0..100_000);
    let samples = trajectory.samples();
    assert!((ThinnedTrajectory::MAX_SAMPLES / 2..=ThinnedTrajectory::MAX_SAMPLES).contains(&samples.len()));
    assert!(samples.chunks(2).all(|both| both[0].time == both[1].time), "the robots have the same times");
    let step = samples[2].time - samples[0].time;
    assert_eq!(step, 16 * ThinnedTrajectory::SAMPLE_PERIOD);
    assert!(samples.windows(3).all(|three| three[2].time - three[0].time == step), "no gap is left");
    let mut again = ThinnedTrajectory::default();
    grow(&mut again, 0..100_000);
    assert_eq!(again, trajectory, "the same run has the same samples");
}

#[test]
fn reader_of_thinned_trajectory_gets_what_is_new() {
    let mut trajectory = ThinnedTrajectory::default();
    let mut position = TrajectoryPosition::default();
    grow(&mut trajectory, 0..10);
    assert_eq!(trajectory.read(&mut position).len(), 20);
    assert!(trajectory.read(&mut position).is_empty());
    grow(&mut trajectory, 10..11);
    let before = position;
    assert_eq!(trajectory.read(&mut position).len(), 2);
    assert!(position.follows(before));
    grow(&mut trajectory, 11..10_001);
    let mut again = trajectory.read(&mut position).to_vec();
    assert!(!position.follows(before));
    while again.len() < trajectory.samples().len() {
        let more = trajectory.read(&mut position);
        assert!((1..=ThinnedTrajectory::BATCH_SIZE).contains(&more.len()));
        again.extend_from_slice(more);
    }
    assert_eq!(again, trajectory.samples(), "all again, as some were removed");
}

/// An empty folder for one test.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("trajectory-{name}"));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Waits until a file has the text of a trajectory.
#[allow(clippy::disallowed_methods, reason = "the file is written on the wall clock")]
fn wait_for(path: &std::path::Path, trajectory: &Mutex<ThinnedTrajectory>) {
    let samples = trajectory.lock().unwrap().samples().to_vec();
    let wanted = Trajectory { samples }.csv();
    let end = std::time::Instant::now() + Duration::from_secs(60);
    while !fs::read_to_string(path).is_ok_and(|text| text == wanted) {
        assert!(std::time::Instant::now() < end, "{} rows wanted", wanted.lines().count());
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn trajectory_file_follows_the_run() {
    let path = folder("stream").join("trajectory.csv");
    fs::write(&path, "of an earlier run").unwrap();
    let trajectory = Arc::new(Mutex::new(ThinnedTrajectory::default()));
    let own = Arc::clone(&trajectory);
    let read = move |position: &mut TrajectoryPosition| own.lock().unwrap().read(position).to_vec();
    let stream = TrajectoryStream::start(&path, read).unwrap();
    grow(&mut trajectory.lock().unwrap(), 0..100);
    wait_for(&path, &trajectory);
    grow(&mut trajectory.lock().unwrap(), 100..101);
    wait_for(&path, &trajectory);
    // Half of it is removed.
    grow(&mut trajectory.lock().unwrap(), 101..10_100);
    wait_for(&path, &trajectory);
    grow(&mut trajectory.lock().unwrap(), 10_100..10_300);
    let samples = trajectory.lock().unwrap().samples().to_vec();
    drop(stream);
    assert_eq!(fs::read_to_string(&path).unwrap(), Trajectory { samples }.csv(), "nothing is left out");
    assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1, "nothing else is left");
}

proptest! {
    #[test]
    fn any_sample_is_read_back_as_it_was(
        time in 0..1_000_000_000_000_000_u64,
        robot in any::<String>(),
        pose in any::<[f64; 3]>(),
        route in proptest::option::of(prop_oneof![Just(Route::Deliberative), Just(Route::Reactive)]),
        action in "[ -~\n\r\"',;]{0,40}",
    ) {
        let [x, y, theta] = pose;
        let sample = Sample { time, robot, x, y, theta, route, action };
        let text = Trajectory { samples: vec![sample.clone()] }.csv();
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let records: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
        prop_assert_eq!(records.len(), 1);
        let fields: Vec<&str> = records[0].iter().collect();
        let [seconds, robot, x, y, theta, route, action] = fields[..] else {
            panic!("seven fields in {text:?}");
        };
        prop_assert_eq!((seconds.parse::<f64>().unwrap() * 1e9).round() as u64, sample.time);
        prop_assert_eq!(robot, &sample.robot);
        for (text, value) in [(x, sample.x), (y, sample.y), (theta, sample.theta)] {
            prop_assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits());
        }
        prop_assert_eq!(route, sample.route.map_or("none", Route::name));
        prop_assert_eq!(action, &sample.action);
    }
}
