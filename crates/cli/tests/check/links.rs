//! Reports on links: wrong ones, missing ones, and several that are possible.

use super::common::{Running, text as text_of};
use super::{EXP1, findings, with_links};

#[test]
fn a_plugin_that_nobody_knows_hides_no_wrong_link() {
    let running = Running::new("check-round");
    let wrong = with_links("\"pass_range/rang\" = \"range_monitor/percept\"")
        .replacen(
            "knowledge = { kind = \"wheeled_knowledge\"",
            "knowledge = { kind = \"wheeled_knowlege\"",
            1,
        )
        .replacen("time_limit = 120.0", "time_limit = -1.0", 1)
        .replacen(
            "\"referee/truth\" = \"simulator/r2/truth\"",
            "\"referee/truth\" = \"simulator/r2/trut\"",
            1,
        );
    std::fs::write(running.folder().join("wrong.toml"), &wrong).unwrap();
    let checked = findings(&running, 7, &["check", "wrong.toml"]);
    let found: Vec<&str> =
        checked["findings"].as_array().unwrap().iter().map(|one| one["message"].as_str().unwrap()).collect();
    // Nothing is said of links to the one whose ports are not known.
    assert_eq!(found.len(), 4, "{found:#?}");
    for words in ["wheeled_knowlege", "outside 0 to", "`simulator` has no output", "`rang`"] {
        assert!(found.iter().any(|message| message.contains(words)), "{words}: {found:#?}");
    }
}

#[test]
fn what_leads_nowhere_is_warned_of_and_fails_a_strict_check() {
    let running = Running::new("check-loose");
    let missing = EXP1.replacen("\"simulator/r2/wheels\" = \"r2/motors/wheels\"\n", "", 1).replacen(
        "range_monitor = {}\n",
        "",
        1,
    );
    std::fs::write(running.folder().join("loose.toml"), &missing).unwrap();
    let checked = findings(&running, 0, &["check", "loose.toml"]);
    let found = checked["findings"].as_array().unwrap();
    let about =
        |words: &str| found.iter().find(|one| one["message"].as_str().unwrap().contains(words)).unwrap();
    let wheels = about("`r2/motors/wheels` reaches nothing");
    assert_eq!(wheels["severity"], "warning", "{wheels}");
    assert_eq!(wheels["help"], "write \"/simulator/r2/wheels\" = \"/r2/motors/wheels\"", "{wheels}");
    assert_eq!(about("input `r2/pass_range/range` has no source")["severity"], "warning");
    // The local planner's map has no Monitor either.
    assert_eq!(about("input `r2/map_obstacles/range` has no source")["variants"][0], "planner = \"local\"");
    assert_eq!(found.len(), 3, "{checked}");
    findings(&running, 7, &["check", "loose.toml", "--strict"]);
    // A port may be without a link on purpose.
    let meant = ["check", "loose.toml", "--set", "robots.r2.links.\"pass_range/range\"=false"];
    assert_eq!(findings(&running, 0, &meant)["findings"].as_array().unwrap().len(), 2);
}

#[test]
fn several_possible_sources_are_an_error_with_lines_to_write() {
    let running = Running::new("check-ambiguous");
    let second =
        EXP1.replacen("range_monitor = {}", "range_monitor = {}\nother = { kind = \"range_monitor\" }", 1);
    std::fs::write(running.folder().join("second.toml"), &second).unwrap();
    let checked = findings(&running, 7, &["check", "second.toml"]);
    let found = checked["findings"].as_array().unwrap();
    assert_eq!(found.len(), 1, "one for all ports with the same choice: {checked}");
    let message = found[0]["message"].as_str().unwrap();
    let line = second.lines().position(|line| line.starts_with("other = ")).unwrap() + 1;
    for words in [
        "a port without a written link has exactly one possible source; `r2/map_obstacles/range`, `r2/pass_range/range`",
        &format!(
            "could read `r2/other/percept` (second.toml:{line}) or `r2/range_monitor/percept` (second.toml:"
        ),
    ] {
        assert!(message.contains(words), "{words}: {checked}");
    }
    assert_eq!(found[0]["line"], line, "{checked}");
    let help = found[0]["help"].as_str().unwrap();
    let inputs = ["r2/map_obstacles/range", "r2/pass_range/range"];
    for input in inputs {
        assert!(help.contains(&format!("\"/{input}\" = \"/r2/other/percept\"")), "{help}");
    }
    // Each of them is settled by one line.
    let sets = inputs.map(|input| format!("links.\"{input}\"=r2/other/percept"));
    let settled: Vec<_> = sets.iter().flat_map(|set| ["--set", set]).collect();
    running.done(&[&["check", "second.toml", "--strict"], &settled[..]].concat());
}

#[test]
fn a_second_sensor_or_plan_is_one_error_with_its_code() {
    let running = Running::new("check-second");
    for (kind, code, words) in [
        ("simulated_sonar", "S006", ["`r2/sonar/value` (exp1.toml:", "`r2/second/value` (the command line)"]),
        ("go_to_origin_planner", "S010", ["a robot has one plan", "`r2/planner` (exp1.toml:"]),
        ("differential_execute", "S010", ["a robot has one execute", "`r2/execute` (exp1.toml:"]),
    ] {
        let set = format!("robots.r2.modules.second={{kind={kind:?}}}");
        let checked = findings(&running, 7, &["check", "exp1", "--set", &set]);
        assert_eq!(checked["findings"].as_array().unwrap().len(), 1, "{checked}");
        let message = checked["findings"][0]["message"].as_str().unwrap();
        assert!(words.iter().all(|words| message.contains(words)), "{words:?}: {checked}");
        // The text says the code, too.
        let output = running.call(&["check", "exp1", "--set", &set]);
        let (text, code_in_text) = (text_of(&output.stderr), format!("error[{code}]: a "));
        assert!(text.contains(&code_in_text), "{code_in_text}: {text}");
    }
}

#[test]
fn a_forgotten_slash_and_a_wrong_name_get_the_right_hint() {
    let running = Running::new("check-hints");
    for (from, message, help) in [
        (
            "simulator/r2/sonar",
            "nothing is called `/r2/simulator/r2/sonar`",
            "did you mean /simulator/r2/sonar?",
        ),
        ("/simulator/r2/sonnar", "`simulator` has no output `r2/sonnar`", "did you mean r2/sonar"),
        ("wheels/comand", "nothing is called `/r2/wheels/comand`", "did you mean r2/wheels/command"),
        (
            "pass_range/change",
            "an Analyze reads another one only as a fact of Knowledge",
            "make it a fact of Knowledge",
        ),
    ] {
        let port = if from.starts_with("pass") { "pass_range/range" } else { "range_monitor/sonar" };
        let set = format!("robots.r2.links.\"{port}\"=\"{from}\"");
        let checked = findings(&running, 7, &["check", "exp1", "--set", &set]);
        let one = &checked["findings"][0];
        assert!(one["message"].as_str().unwrap().contains(message), "{checked}");
        assert!(one["help"].as_str().unwrap().contains(help), "{checked}");
    }
    let set = "robots.r2.links.\"simulator/r2/wheels\"=\"motors/wheels\"";
    running.fails(7, &["check", "exp1", "--set", set], &["did you mean /simulator/r2/wheels?"]);
}
