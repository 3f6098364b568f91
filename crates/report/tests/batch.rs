//! The statistics over many runs.

use crate::common;

use common::summary;
use proptest::prelude::*;
use slate_report::{Batch, Outcome, Spread, Summary};

/// As many runs, of which so many reached the goal.
fn runs(successes: u64, runs: u64) -> Vec<Summary> {
    let outcome = |seed| if seed < successes { Outcome::GoalReached } else { Outcome::TimedOut };
    (0..runs).map(|seed| Summary { outcome: outcome(seed), ..summary(seed) }).collect()
}

#[test]
fn success_interval_is_that_of_wilson() {
    // Newcombe, Statistics in Medicine 17 (1998), table I, method 3.
    for (successes, count, low, high) in [
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0000, 0.1611),
        (1, 29, 0.0061, 0.1718),
        (29, 29, 0.8830, 1.0000),
    ] {
        let interval = Batch::of(&runs(successes, count)).success_interval;
        assert!((interval[0] - low).abs() < 0.00006, "{successes} of {count}: {interval:?}");
        assert!((interval[1] - high).abs() < 0.00006, "{successes} of {count}: {interval:?}");
    }
    assert_eq!(Batch::of(&runs(0, 20)).success_interval[0], 0.0);
    assert_eq!(Batch::of(&runs(20, 20)).success_interval[1], 1.0);
}

#[test]
fn success_is_weighted_by_path_length() {
    let run = |outcome, length, shortest| Summary {
        outcome,
        path_length_m: Some(length),
        shortest_path_m: Some(shortest),
        ..summary(1)
    };
    let batch = Batch::of(&[
        run(Outcome::GoalReached, 4.0, 2.0),
        // Shorter than the shortest way, by rounding or a wide goal: never more than 1.
        run(Outcome::GoalReached, 1.9, 2.0),
        run(Outcome::TimedOut, 2.0, 2.0),
        // The robot stood on the goal.
        run(Outcome::GoalReached, 0.0, 0.0),
    ]);
    assert_eq!(batch.spl, Some((0.5 + 1.0 + 0.0 + 1.0) / 4.0));
    assert_eq!(batch.success_rate, Some(0.75));
}

#[test]
fn missions_without_a_shortest_way_have_no_spl() {
    let run = |way: Option<f64>| Summary {
        outcome: Outcome::GoalReached,
        path_length_m: way,
        shortest_path_m: way,
        ..summary(1)
    };
    let batch = Batch::of(&[run(None), run(None)]);
    assert_eq!((batch.spl, batch.collisions.kilometers.to_string()), (None, "0".to_owned()));
    assert!(!batch.to_string().contains("SPL") && !batch.to_string().contains("way of all runs"), "{batch}");
    assert!(Batch::of(&[run(None), run(Some(2.0))]).to_string().contains("SPL"));
}

#[test]
fn collisions_are_counted_per_kilometer_of_way() {
    let run = |collisions, collisions_caused, length| Summary {
        collisions,
        collisions_caused,
        path_length_m: Some(length),
        ..summary(1)
    };
    let collisions = Batch::of(&[run(3, 1, 300.0), run(1, 0, 200.0)]).collisions;
    assert_eq!((collisions.collisions, collisions.collisions_caused), (4, 1));
    assert_eq!((collisions.kilometers, collisions.collisions_caused_per_km), (0.5, Some(2.0)));
    let standing = Batch::of(&[run(1, 0, 0.0)]).collisions;
    assert_eq!((standing.collisions_caused_per_km, standing.collisions_caused_per_km_bound), (None, None));
}

#[test]
fn collisions_per_kilometer_have_the_bound_of_poisson() {
    // Half the critical values of the chi-squared distribution, upper tail 0.05, at 2 (n + 1) degrees of freedom: NIST
    // Engineering Statistics Handbook, table 1.3.6.7.4.
    for (collisions_caused, chi_squared) in [
        (0, 5.991),
        (1, 9.488),
        (2, 12.592),
        (3, 15.507),
        (4, 18.307),
        (9, 31.410),
        (19, 55.758),
        (29, 79.082),
        (49, 124.342),
    ] {
        let run = Summary { collisions_caused, path_length_m: Some(2000.0), ..summary(1) };
        let bound = Batch::of(&[run]).collisions.collisions_caused_per_km_bound.unwrap();
        let expected = chi_squared / 2.0 / 2.0;
        assert!((bound - expected).abs() < 0.0003, "{collisions_caused}: {bound} and not {expected}");
    }
}

#[test]
fn other_figures_are_spread_by_name_and_robot() {
    let run = |seed, gap: f64, lap: Option<f64>| Summary {
        figures: [("gap_in_band".to_owned(), gap)].into(),
        robots: [("r3".to_owned(), {
            let mut figures: slate_sorted::SortedMap<String, f64> =
                [("path_length".to_owned(), 500.0), ("collisions_caused".to_owned(), 1.0)].into();
            figures.extend(lap.map(|lap| ("time_to_goal".to_owned(), lap)));
            figures
        })]
        .into(),
        units: [("time_to_goal".to_owned(), "s".to_owned())].into(),
        ..summary(seed)
    };
    let batch = Batch::of(&[run(1, 0.5, None), run(2, 1.0, Some(12.0)), summary(3)]);
    assert_eq!(batch.figures["gap_in_band"].median, 0.75);
    let other = &batch.robots["r3"];
    assert_eq!((other.collisions.kilometers, other.collisions.collisions_caused_per_km), (1.0, Some(2.0)));
    assert_eq!((other.figures["time_to_goal"].minimum, other.figures["time_to_goal"].maximum), (12.0, 12.0));
    assert_eq!(batch.collisions.collisions_caused, 0, "those of the first robot alone");
    let text = batch.to_string();
    for label in ["gap in band ", "r3: time to goal [s] ", "r3: caused by the robot "] {
        assert!(text.contains(label), "{label} is missing: {text}");
    }
    let read: Batch = serde_json::from_str(&batch.json_line().unwrap()).unwrap();
    assert_eq!(read, batch);
}

#[test]
fn percentiles_interpolate_between_ranks() {
    let spread = Spread::of([40.0, 10.0, 30.0, 20.0].into_iter());
    // numpy.percentile([10, 20, 30, 40], [50, 95]) is [25, 38.5].
    assert_eq!(spread, Some(Spread { minimum: 10.0, median: 25.0, p95: 38.5, maximum: 40.0 }));
    let whole_rank = Spread::of((0..=20).map(f64::from));
    assert_eq!(whole_rank, Some(Spread { minimum: 0.0, median: 10.0, p95: 19.0, maximum: 20.0 }));
    assert_eq!(Spread::of([7.0].into_iter()).map(|spread| (spread.median, spread.p95)), Some((7.0, 7.0)));
    assert_eq!(Spread::of([f64::NAN, f64::INFINITY].into_iter()), None);
}

#[test]
fn no_runs_have_no_figures() {
    let batch = Batch::of(&[]);
    assert_eq!((batch.runs, batch.success_rate, batch.spl), (0, None, None));
    assert_eq!(batch.success_interval, [0.0, 1.0]);
    assert_eq!(batch.sim_time_s, None);
    assert_eq!(batch.to_string(), "no runs\n");
}

#[test]
fn different_conditions_are_reported() {
    let mut other = summary(2);
    other.conditions.insert("noise".to_owned(), "real".to_owned());
    let batch = Batch::of(&[summary(1), other]);
    assert_eq!(batch.example, "exp1");
    assert_eq!(batch.conditions["noise"], "various");
}

#[test]
fn json_is_one_line_with_the_promised_fields() {
    let line = Batch::of(&runs(3, 4)).json_line().unwrap();
    assert!(!line.contains('\n'));
    let value: serde_json::Value = serde_json::from_str(&line).unwrap();
    assert_eq!(value["runs"], 4);
    assert_eq!(value["success_rate"], 0.75);
    assert_eq!(value["failed_seeds"], serde_json::json!([3]));
    assert_eq!(value["failures"], serde_json::json!({ "timed out": [3] }));
    for field in [
        "success_interval",
        "kilometres",
        "collisions",
        "collisions_caused",
        "collisions_caused_per_km",
        "collisions_caused_per_km_bound",
        "spl",
    ] {
        assert!(!value[field].is_null(), "{field}");
    }
    for figure in ["sim_time_s", "path_length_m", "min_clearance_m", "route_switches", "reflexes"] {
        assert!(value[figure]["median"].is_f64() && value[figure]["p95"].is_f64(), "{figure}");
    }
}

#[test]
fn table_tells_what_happened_first() {
    let text = Batch::of(&runs(3, 4)).to_string();
    let first = text.lines().next().unwrap();
    assert_eq!(first, "exp1: 3 of 4 runs succeeded, 75.0 % (95 % interval 30.1 to 95.4 %)");
    assert!(
        text.lines()
            .any(|line| line.trim_start().starts_with("failed seeds") && line.ends_with(" 3: timed out"))
    );
    assert!(text.contains("least clearance [m]"));
}

proptest! {
    #[test]
    fn the_order_of_the_runs_changes_no_bit(
        figures in proptest::collection::vec((0.0..100.0_f64, 0.1..10.0_f64, any::<bool>()), 1..30),
        turn in 0_usize..30,
    ) {
        let mut runs: Vec<Summary> = (0..).zip(figures).map(|(seed, (time, length, reached))| Summary {
            sim_time_s: time,
            path_length_m: Some(length),
            outcome: if reached { Outcome::GoalReached } else { Outcome::TimedOut },
            ..summary(seed)
        }).collect();
        let line = Batch::of(&runs).json_line().unwrap();
        let middle = turn % runs.len();
        runs.rotate_left(middle);
        runs[middle..].reverse();
        prop_assert_eq!(Batch::of(&runs).json_line().unwrap(), line);
    }

    #[test]
    fn the_bound_grows_with_the_collisions_and_stays_above_them(collisions_caused in 0_u64..1_000_000) {
        let bound = |collisions_caused| {
            let run = Summary { collisions_caused, path_length_m: Some(1000.0), ..summary(1) };
            Batch::of(&[run]).collisions.collisions_caused_per_km_bound.unwrap()
        };
        let (own, next) = (bound(collisions_caused), bound(collisions_caused + 1));
        prop_assert!(collisions_caused as f64 + 1.0 < own && own < next, "{own}, {next}");
        // The normal approximation of Wilson and Hilferty is that good from some collisions on.
        let events = collisions_caused as f64 + 1.0;
        let cube = 1.0 - 1.0 / (9.0 * events) + 1.644_853_626_951_472 / (3.0 * libm::sqrt(events));
        prop_assert!((own / (events * cube * cube * cube) - 1.0).abs() < 0.01, "{own}");
    }

    #[test]
    fn the_rate_lies_in_its_interval(successes in 0_u64..40, failures in 0_u64..40) {
        prop_assume!(successes + failures > 0);
        let batch = Batch::of(&runs(successes, successes + failures));
        let [low, high] = batch.success_interval;
        let rate = batch.success_rate.unwrap();
        prop_assert!(0.0 <= low && low <= rate && rate <= high && high <= 1.0);
        prop_assert_eq!(batch.failed_seeds.len() as u64, failures);
    }
}

#[test]
fn run_with_caused_collisions_is_no_success() {
    let collided = Summary {
        outcome: Outcome::Collided,
        message: Some("goal reached, with 12 collisions caused".to_owned()),
        collisions: 14,
        collisions_caused: 12,
        ..summary(2)
    };
    assert!(!collided.succeeded() && collided.reached_goal());
    let headline = "exp1, seed 2: collided after 20.0 s: goal reached, with 12 collisions caused";
    assert_eq!(collided.headline(), headline);
    let kept = Summary { verdict: Some("gap_kept".into()), ..summary(3) };
    assert!(kept.succeeded() && kept.headline().starts_with("exp1, seed 3: gap kept after"));
    let left = Summary { outcome: Outcome::TimedOut, verdict: Some("gap_left".into()), ..summary(5) };
    let late = Summary { outcome: Outcome::TimedOut, time_to_goal_s: None, ..summary(4) };
    assert!(!late.succeeded() && !late.reached_goal());
    let batch = Batch::of(&[summary(1), collided, kept, late, left]);
    assert_eq!((batch.goals_reached, batch.success_rate), (4, Some(0.4)));
    assert_eq!(batch.failed_seeds, [2, 4, 5]);
    let seeds = |cause: &str| batch.failures[cause].as_slice();
    assert_eq!((seeds("collided"), seeds("timed out"), seeds("gap left")), (&[2][..], &[4][..], &[5][..]));
    let json: serde_json::Value = serde_json::from_str(&batch.json_line().unwrap()).unwrap();
    assert_eq!(json["outcomes"], serde_json::json!({ "collided": 1, "goal_reached": 2, "timed_out": 2 }));
    assert_eq!(json["verdicts"], serde_json::json!({ "gap_kept": 1, "gap_left": 1 }));
    let text = batch.to_string();
    assert!(text.starts_with("exp1: 2 of 5 runs succeeded, 40.0 %"), "{text}");
    assert!(text.contains("2 goal reached, 1 collided, 2 timed out"), "{text}");
    assert!(text.contains("1 gap kept, 1 gap left") && text.contains("5: gap left"), "{text}");
}

#[test]
fn run_without_a_judge_has_no_path_length() {
    let (path_length_m, shortest_path_m) = (None, None);
    let (route_switches, reflexes) = (0, 0);
    let run = Summary { path_length_m, shortest_path_m, route_switches, reflexes, ..summary(1) };
    let text = run.to_string();
    assert!(!text.contains("path length") && !text.contains("collisions"), "{text}");
    assert!(text.contains("simulated time"), "{text}");
    let json: serde_json::Value = serde_json::from_str(&run.json_line().unwrap()).unwrap();
    assert!(json["path_length_m"].is_null());
    assert_eq!(Batch::of(&[run]).path_length_m, None);
}
