//! `trajectory.csv`.

use crate::common;

use common::sample;
use proptest::prelude::*;
use slate_record::{Route, Sample, Trajectory};

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
