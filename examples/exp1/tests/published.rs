//! The authors' program in the authors' scene.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate::module::math;

#[path = "../examples/published.rs"]
#[allow(dead_code, reason = "the example prints a table")]
mod program;

#[test]
fn published_program_reaches_its_goals_and_none_beside_the_box() {
    let reached = |name: &str| {
        let trial = program::trials().into_iter().find(|trial| trial.name == name).unwrap();
        let runs: Vec<_> = (1..=3).map(|seed| program::run(&trial, seed).unwrap()).collect();
        let nearest = runs.iter().map(|run| run.nearest).fold(f64::INFINITY, math::min);
        (runs.iter().filter(|run| run.reached.is_some()).count(), nearest)
    };
    assert_eq!(reached("none").0, 3);
    assert_eq!(reached("and neither").0, 3);
    let (count, nearest) = reached("the paper's goal");
    assert!(count == 0 && nearest > 0.15, "{count} reached it, {nearest} m");
}
