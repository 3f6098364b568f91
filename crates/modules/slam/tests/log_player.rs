//! Laser logs, and their player.

use std::fs;
use std::path::{Path, PathBuf};

use slate_interfaces::{LaserScan, MissionState, Odometry, Verdict};
use slate_module::testing::Fixture;
use slate_module::{Outcome, Text};
use slate_slam::carmen::{LogFormat, read_log};
use slate_slam::{LogPlayer, LogPlayerParams, LogProgress, LogReferee, SlamStatus};

const LOG: &str = "PARAM robot_frontlaser_offset 0.1
ODOM 0 0 0 0 0 0 10 host 10
ODOM 0.1 0 0 0 0 0 11 host 11
FLASER 3 1.0 2.0 3.0 0.2 0 0 0.15 0 0 11.5 host 11.5
ODOM 0.2 0 0 0 0 0 12 host 12
FLASER 3 1.5 2.5 3.5 0.3 0 0 0.25 0 0 12.1 host 12.1
FLASER 3 1.5 2.5 3.5 0.3 0 0 0.30 0 0 12.2 host 12.2
ODOM 0.4 0 0 0 0 0 13 host 13
";

fn file(name: &str, text: &str) -> PathBuf {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::write(&file, text).unwrap();
    file
}

fn player(file: &Path, speed: f64) -> Fixture<LogPlayer> {
    let log_file = Text::new(file.to_str().unwrap());
    Fixture::with(LogPlayerParams { log_file, speed, ..LogPlayerParams::default() }).unwrap()
}

/// First range of a scan, and odometry, of the newest tick.
fn played(player: &Fixture<LogPlayer>) -> (Option<f32>, Option<f64>) {
    let range = player.read::<LaserScan, f32>("scan", |scan| scan.ranges[0]);
    (range, player.output::<Odometry>("odometry").map(|odometry| odometry.pose.x))
}

#[test]
fn raw_logs_have_the_odometry_of_each_scan() {
    let log = read_log(&file("raw.log", LOG), &LogFormat::default()).unwrap();
    assert_eq!((log.scans.len(), log.odometry.len()), (3, 4));
    let scan = &log.scans[0];
    assert_eq!((scan.time, scan.odometry.x, scan.corrected.x), (11.5, 0.15, 0.2));
    assert_eq!((scan.points().len(), scan.points()[1][1] < 0.0), (3, true));
}

#[test]
fn scans_come_with_the_odometry_at_them() {
    let mut player = player(&file("play.log", LOG), 2.0);
    assert_eq!((player.tick().outcome().unwrap(), played(&player)), (Outcome::Ok, (None, Some(0.0))));
    let mut next = || {
        player.advance(250_000_000);
        player.tick();
        played(&player)
    };
    assert_eq!(next(), (None, None));
    assert_eq!(next(), (None, Some(0.1)));
    assert_eq!(next(), (Some(1.0), Some(0.15)));
    assert_eq!(next(), (None, Some(0.2)));
    // None of two that are due is left out.
    assert_eq!(next(), (Some(1.5), Some(0.25)));
    assert_eq!(next(), (Some(1.5), Some(0.3)));
    assert_eq!(next(), (None, Some(0.4)));
    assert_eq!(next(), (None, Some(0.4)));
    let progress: LogProgress = player.output("progress").unwrap();
    assert_eq!((progress.scans, progress.all_scans, progress.has_ended.get()), (3, 3, true));
}

#[test]
fn a_restored_player_goes_on_where_it_was() {
    let file = file("restored.log", LOG);
    let (mut first, mut second) = (player(&file, 1.0), player(&file, 1.0));
    first.tick();
    first.advance(1_600_000_000);
    first.tick();
    second.advance(1_600_000_000);
    second.restore(&first.save().unwrap()).unwrap();
    for _ in 0..8 {
        first.advance(250_000_000);
        second.advance(250_000_000);
        first.tick();
        second.tick();
        assert_eq!(played(&first), played(&second));
    }
}

#[test]
fn a_file_that_is_no_log_degrades_the_player() {
    let mut player = player(Path::new("nowhere.log"), 1.0);
    assert_eq!(player.tick(), Outcome::Degraded);
    player.params().log_file = Text::new(file("another.log", LOG).to_str().unwrap());
    assert_eq!(player.tick(), Outcome::Ok);
    let wrong = read_log(&file("wrong.log", "\nODOM 1 2\n"), &LogFormat::default()).unwrap_err().to_string();
    assert!(wrong.ends_with("wrong.log:2: expected CARMEN's `ODOM` or `FLASER` with its columns"), "{wrong}");
}

#[test]
fn a_run_ends_when_the_log_is_in_the_map() {
    let mut referee = Fixture::<LogReferee>::new();
    let mut judge = |has_ended: bool, is_settled: bool| {
        referee.advance(1_000_000_000);
        let ended = LogProgress { scans: 3, all_scans: 3, time: 1.0, has_ended: has_ended.into() };
        referee.set("progress", ended);
        referee.set("status", SlamStatus { scans: 3, loop_closures: 0, is_settled: is_settled.into() });
        referee.tick();
        referee.output::<Verdict>("verdict").map(|verdict| verdict.state)
    };
    assert_eq!(judge(false, true), Some(MissionState::RUNNING));
    // That status may be of before the end.
    assert_eq!(judge(true, true), Some(MissionState::RUNNING));
    assert_eq!(judge(true, false), Some(MissionState::RUNNING));
    assert_eq!(judge(true, true), Some(MissionState::SUCCEEDED));
    assert_eq!(judge(true, true), None);
}
