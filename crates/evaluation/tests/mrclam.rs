//! Logs as UTIAS publishes them, of a robot that drives in a circle.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use slate_evaluation::mrclam::evaluate;
use slate_module::math;

/// Time of the first odometry, s.
const BEGIN: f64 = 1_248_444_175.0;
const LANDMARKS: [[f64; 2]; 3] = [[3.0, 1.0], [-2.0, 3.0], [1.0, -3.0]];

/// A folder with the log of robot 3, whose camera measures depths, 3 % too large.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).unwrap();
    let [mut odometry, mut truth, mut seen] = ["# Time\n"; 3].map(String::from);
    let (mut x, mut y, mut theta): (f64, f64, f64) = (0.0, 0.0, 0.0);
    for step in 0..2_000 {
        let time = BEGIN + 0.02 * f64::from(step);
        writeln!(odometry, "{time:.3} 0.2 0.2").unwrap();
        writeln!(truth, "{time:.3} {x:.5} {y:.5} {:.5}", math::wrap_angle(theta)).unwrap();
        let [right, up] = LANDMARKS[step as usize % 3];
        let (right, up) = (right - x, up - y);
        let (depth, left) = (
            right * math::cos(theta) + up * math::sin(theta),
            up * math::cos(theta) - right * math::sin(theta),
        );
        if step % 10 == 0 && depth > 0.5 {
            let code = 60 + step % 3;
            writeln!(seen, "{time:.3} {code} {:.3} {:.3}", 1.03 * depth, math::atan2(left, depth)).unwrap();
            // Another robot, and an unknown barcode.
            writeln!(seen, "{time:.3} 5 1.0 0.0\n{time:.3} 99 1.0 0.0").unwrap();
        }
        theta += 0.004;
        x += 0.004 * math::cos(theta);
        y += 0.004 * math::sin(theta);
    }
    let places = LANDMARKS.iter().zip(6..).map(|([x, y], subject)| format!("{subject} {x} {y} 0.0 0.0\n"));
    for (file, text) in [
        ("Robot3_Odometry.dat", odometry),
        ("Robot3_Groundtruth.dat", truth),
        ("Robot3_Measurement.dat", seen),
        ("Barcodes.dat", "1 5\n6 60\n7 61\n8 62\n".into()),
        ("Landmark_Groundtruth.dat", places.collect()),
    ] {
        fs::write(folder.join(file), text).unwrap();
    }
    folder
}

#[test]
fn a_camera_that_measures_depths_is_calibrated() {
    let evaluations = evaluate(&folder("mrclam")).unwrap();
    let [robot] = &evaluations[..] else { unreachable!("one robot has a log") };
    assert_eq!(robot.name, "MRCLAM, robot 3");
    let errors: Vec<f64> = robot
        .figures
        .iter()
        .filter(|figure| figure.name.ends_with("RMSE of the position, m"))
        .map(|figure| figure.value)
        .collect();
    assert!(errors[0] < 0.03 && errors[0] < errors[1] && errors[0] < errors[2], "{errors:?}");
    assert_eq!(robot.figures.iter().filter(|figure| figure.goal.is_some()).count(), 1);
}

#[test]
fn a_line_that_is_no_row_is_named() {
    let folder = folder("mrclam_broken");
    fs::write(folder.join("Robot3_Measurement.dat"), "# Time\n1.0 60 fast 0.0\n").unwrap();
    let error = evaluate(&folder).unwrap_err().to_string();
    assert!(error.ends_with("Robot3_Measurement.dat:2: expected 4 numbers"), "{error}");
}
