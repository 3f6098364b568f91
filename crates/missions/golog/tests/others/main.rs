//! Offline execution against SWI-Prolog (`apt-get install swi-prolog-nox`).
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

#[path = "../common/random.rs"]
mod random;

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use random::{Problem, Random};
use slate_golog::*;

/// The most transitions of a path.
const DEPTH: usize = 6;

/// Action sequences of a problem; `None` if they are too many.
fn own(problem: &Problem) -> Option<Vec<String>> {
    let text = problem.golog();
    let theory = ActionTheory::parse(&text).unwrap_or_else(|error| panic!("{}\n{text}", error.render()));
    let limits = SolutionLimits { most_depth: DEPTH, most_transitions: 3000 };
    let mut paths = Vec::new();
    let report = solutions(&theory, &limits, |actions| {
        paths.push(actions.iter().map(|action| format!("{action} ")).collect::<String>());
        true
    })
    .unwrap_or_else(|error| panic!("{error}\n{text}"));
    (report.transitions < limits.most_transitions).then_some(paths)
}

/// Problems of seeds with their action sequences; `GOLOG_PROGRAMS` is their number.
fn problems() -> Vec<(Problem, Vec<String>)> {
    let count = std::env::var("GOLOG_PROGRAMS").ok().and_then(|count| count.parse().ok()).unwrap_or(200);
    let random = (1..).map(|seed| Random::new(seed).problem());
    random.filter_map(|problem| own(&problem).map(|paths| (problem, paths))).take(count).collect()
}

#[test]
fn random_programs_have_the_action_sequences_of_prolog() {
    let problems = problems();
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let facts: String =
        problems.iter().enumerate().map(|(number, (problem, _))| problem.prolog(number)).collect();
    let file = folder.join(format!("problems-{}.pl", std::process::id()));
    fs::write(&file, format!(":- style_check(-singleton).\n{facts}")).unwrap();
    let output = Command::new("swipl")
        .args(["-q", "-f", "none", "-g", "consult(user:'golog.pl')", "-g"])
        .arg(format!("consult('{}'), run({DEPTH})", file.display()))
        .args(["-t", "halt"])
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/others"))
        .output();
    let output = output.unwrap_or_else(|error| panic!("apt-get install swi-prolog-nox: {error}"));
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let parts: Vec<&str> = said.split("problem ").skip(1).collect();
    assert_eq!(parts.len(), problems.len(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut paths_of_all = 0;
    let mut with_paths = 0;
    for (part, (problem, expected)) in parts.iter().zip(&problems) {
        let paths: Vec<&str> = part.split_terminator('\n').skip(1).collect();
        assert_eq!(paths, *expected, "{}", problem.golog());
        paths_of_all += paths.len();
        with_paths += usize::from(!paths.is_empty());
    }
    fs::remove_file(file).unwrap();
    assert!(with_paths * 3 > problems.len(), "the programs are too hard");
    println!("{} programs, {with_paths} with action sequences, {paths_of_all} sequences", problems.len());
}
