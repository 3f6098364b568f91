//! SLAM on a log of CARMEN.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use slate_evaluation::slam::{SlamMethod, evaluate, is_one_line};
use slate_module::math;
use slate_slam::carmen::{LogFormat, read_log};

/// Seconds by which times of relations are later.
const OFFSET: f64 = 976_052_857.337;

/// A robot that drives along x in a room of 6 m by 4 m, 0.3 m from scan to scan; its odometry says 0.27 m.
fn log() -> String {
    let mut log = String::from("ODOM 0 0 0 0 0 0 1 host 1\n");
    for scan in 0..10 {
        let (x, time) = (0.3 * f64::from(scan), 2.0 * f64::from(scan) + 3.0);
        for half in 1..=2 {
            let (before, step) = (x - 0.3, 0.135 * f64::from(half));
            let at = if scan == 0 { 0.0 } else { before + step };
            let _ = writeln!(log, "ODOM {at} 0 0 0 0 0 {} host 1", time - 2.0 + f64::from(half));
        }
        log.push_str("FLASER 180");
        for beam in 0..180 {
            let bearing: f64 = (f64::from(beam) - 90.0) * 0.99_f64.to_radians();
            let (ahead, left) = (math::cos(bearing), math::sin(bearing));
            let side = if left == 0.0 { 9.0 } else { 2.0 / left.abs() };
            let end = if ahead > 0.0 { (5.0 - x) / ahead } else { (1.0 + x) / -ahead };
            let _ = write!(log, " {:.3}", math::min(side, end));
        }
        let _ = writeln!(log, " {x} 0 0 {x} 0 0 {time} host {time}\nODOM {x} 0 0 0 0 0 0 host 0\nNEFF 1");
    }
    log
}

fn relations() -> String {
    let line =
        |from: f64, to: f64, x: f64| format!("{:.6} {:.6} {x} 0 0 0 0 0\n", from + OFFSET, to + OFFSET);
    line(3.0, 21.0, 2.7) + &line(5.0, 9.0, 0.6) + &line(4.0, 6.0, 0.3)
}

fn folder(name: &str, log: &str, relations: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(folder.join("intel")).unwrap();
    fs::write(folder.join("intel/intel.gfs.log"), log).unwrap();
    fs::write(folder.join("intel/intel.relations"), relations).unwrap();
    folder
}

#[test]
fn methods_are_compared_with_the_relations() {
    let folder = folder("slam", &log(), &relations());
    for method in [SlamMethod::Graph, SlamMethod::ParticleFilter] {
        let map = folder.join("map.yaml");
        let found = evaluate(&folder, method, Some(&map)).unwrap();
        let value = |name: &str| found.figures.iter().find(|figure| figure.name == name).unwrap().value;
        assert_eq!((value("scans"), value("relations")), (10.0, 3.0));
        let raw = value("raw odometry: absolute translational error, m");
        assert!((raw - 0.12).abs() < 0.001, "{raw}");
        let error = value("absolute translational error, m");
        assert!(error < 0.03, "{method:?}: {error}");
        let map = slate_map_file::read_map(&map).unwrap();
        assert!(map.cells.contains(&100) && map.cells.contains(&0));
    }
}

#[test]
fn raw_odometry_is_rebuilt_between_corrections() {
    let folder = folder("raw", &log(), &relations());
    let log = read_log(&folder.join("intel/intel.gfs.log"), &LogFormat::INTEL).unwrap();
    assert_eq!((log.scans.len(), log.odometry.len()), (10, 21));
    let last = log.scans.last().unwrap();
    assert!((last.odometry.x - 9.0 * 0.27).abs() < 1e-9 && (last.corrected.x - 2.7).abs() < 1e-9);
    assert!(is_one_line(&log, 5.000001) && !is_one_line(&log, 5.5));
}

#[test]
fn wrong_lines_are_named() {
    let refused = |name: &str, log: &str, relations: &str| {
        let folder = folder(name, log, relations);
        let error = evaluate(&folder, SlamMethod::Graph, None).unwrap_err().to_string();
        error.replace(&format!("{}/intel/", folder.display()), "")
    };
    let expected = "intel.gfs.log:1: expected CARMEN's `ODOM` or `FLASER` with its columns";
    assert_eq!(refused("odom", "ODOM 0 0 nowhere\n", &relations()), expected);
    assert_eq!(refused("flaser", "FLASER 180 1.0 2.0\n", &relations()), expected);
    assert_eq!(refused("empty", "\n", &relations()), "intel.gfs.log: expected lines `ODOM` and `FLASER`");
    assert_eq!(
        refused("columns", &log(), "1 2 3\n"),
        "intel.relations:1: expected eight numbers: two times, x, y, z, roll, pitch, yaw"
    );
    assert_eq!(refused("none", &log(), "\n"), "intel.relations: no relation in it");
    let missing = evaluate(Path::new("nowhere"), SlamMethod::Graph, None).unwrap_err().to_string();
    assert!(missing.starts_with("nowhere/intel/intel.gfs.log: can't be read"), "{missing}");
}
