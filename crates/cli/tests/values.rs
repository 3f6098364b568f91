//! Commands that look at values of an agent that runs, and set them.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and times what a person waits for"
)]

use crate::common;

use common::{Running, WORLD, text, wait_for};
use serde_json::Value;

const EXP1: [&str; 6] = ["run", "exp1", "--headless", "--json", "--rate", "0.3"];

fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// The cells of a row of a table.
fn cells(row: &str) -> Vec<String> {
    let (mut cells, mut is_quoted) = (vec![String::new()], false);
    let mut letters = row.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '"' if is_quoted && letters.next_if_eq(&'"').is_some() => cells.last_mut().unwrap().push('"'),
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => cells.push(String::new()),
            letter => cells.last_mut().unwrap().push(letter),
        }
    }
    cells
}

#[test]
fn only_selected_values_are_watched_as_they_come() {
    let mut running = Running::new("watch");
    running.start("exp1", &EXP1);
    let truth = "/simulator/r2/truth";
    let seen = lines(&running.done(&["watch", truth, "-n", "5", "--json"]));
    let numbers: Vec<_> = seen.iter().map(|line| line["sequence"].as_u64().unwrap()).collect();
    assert!(numbers.is_sorted() && numbers.len() == 5, "{numbers:?}");
    assert!(seen.iter().all(|line| line["schema"] == "slate.watch/1" && line["url"] == truth), "{seen:?}");
    assert!(seen.iter().all(|line| line["value"]["x"].is_f64()), "{seen:?}");

    // Slower than they come.
    let slow = lines(&running.done(&["watch", truth, "-n", "3", "--max-hz", "10", "--json"]));
    let times: Vec<_> = slow.iter().map(|line| line["time"].as_u64().unwrap()).collect();
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] >= 100_000_000), "{times:?}");

    let table = running.done(&["watch", truth, "-n", "2", "--csv"]);
    assert_eq!(
        (table.lines().next(), table.lines().count()),
        (Some("time,sequence,theta,x,y"), 3),
        "{table}"
    );

    // All rows of a table have the columns of its head, however long the lists are; times are exact.
    let table = running.done(&["watch", "/r2/execute/status", "-n", "4", "--csv"]);
    let rows: Vec<_> = table.lines().map(cells).collect();
    assert!(rows.iter().all(|row| row.len() == rows[0].len()), "{table}");
    let ended = rows[0].iter().position(|name| name == "ended").unwrap();
    assert!(rows[1..].iter().all(|row| serde_json::from_str::<Vec<Value>>(&row[ended]).is_ok()), "{table}");
    assert!(rows[1..].iter().all(|row| row[0].ends_with("0000000") && row[0].contains('.')), "{table}");

    // Once of each that a pattern is of.
    let states = lines(&running.done(&["watch", "/r2/*/timing", "--once", "--json"]));
    assert!(states.len() > 5, "{states:?}");

    // A field is a property of its own, and what does not change is not shown twice.
    let ticks = lines(&running.done(&[
        "watch",
        "/referee/params/goal_tolerance",
        "--changes",
        "--for",
        "0.3s",
        "--json",
    ]));
    assert_eq!(ticks.len(), 1, "{ticks:?}");
    let far = running.call(&["watch", truth, "--where", "x > 1000", "--for", "0.3s"]);
    assert_eq!((far.status.code(), text(&far.stdout)), (Some(6), String::new()));

    running.fails(4, &["watch", "/simulator/r2/trut"], &["simulator/r2/truth"]);
    running.fails(2, &["watch", truth, "--where", "x ="], &["FIELD OPERATOR VALUE"]);
    running.fails(4, &["watch", truth, "--where", "z > 1"], &["unknown field `z`", "x, y"]);
    running.fails(2, &["watch", "/r2/*/state", "--csv"], &["takes one property"]);
    running.fails(2, &["watch", truth, "--max-hz", "0"], &["positive"]);
}

#[test]
fn a_script_waits_for_a_value() {
    let mut running = Running::new("wait");
    running.start("exp1", &EXP1);
    let said = running.done(&["wait", "/loop/histogram/count", "> 10", "--json"]);
    let value: Value = serde_json::from_str(&said).unwrap();
    assert!(value["value"].as_u64() > Some(10), "{said}");
    // What does not change any more stays so.
    running.done(&["wait", "/referee/enabled", "== true", "--for", "200ms", "--timeout", "5s"]);
    let output = running.call(&["wait", "/simulator/r2/truth", "x > 1000", "--timeout", "300ms"]);
    assert_eq!(output.status.code(), Some(6), "{output:?}");
    assert!(
        text(&output.stderr).contains("the condition did not hold within 0.3 s: it is theta="),
        "{output:?}"
    );
    // One error has one code, whichever verb meets it.
    let has = ["theta", "x", "y"];
    running.fails(4, &["wait", "/simulator/r2/truth", "foo == 1"], &has);
    running.fails(4, &["get", "/simulator/r2/truth/foo"], &has);
    running.fails(4, &["watch", "/simulator/r2/truth/foo", "--once"], &has);
    running.fails(4, &["watch", "/simulator/r2/truth", "--where", "foo == 1", "--once"], &has);
    running.fails(4, &["stat", "/simulator/r2/truth/foo", "--for", "10ms"], &has);
    running.fails(4, &["set", "/r2/planner/params/foo", "1"], &["careful_linear_velocity"]);
    running.fails(2, &["wait", "/simulator/r2/truth", "x"], &["FIELD OPERATOR VALUE"]);
}

#[test]
fn settable_inputs_differ_from_linked_ones_and_conversions_show() {
    let mut running = Running::new("settable");
    running.start("exp1", &EXP1);
    let tree = running.done(&["--agent", "exp1", "tree", "/r2/planner/*"]);
    let row = |name: &str| tree.lines().find(|line| line.contains(name)).unwrap();
    assert!(row(" params ").ends_with("can be set") && row(" other ").ends_with("takes a link"), "{tree}");
    let words = ["/r2/planner/other is a queue", "slate link r2/planner/other"];
    running.fails(5, &["set", "/r2/planner/other", "{\"x\": 1.0}"], &words);

    let input = "r2/planner/goal";
    running.done(&["wait", "/loop/histogram/count", "> 10"]);
    let links = running.done(&["link"]);
    assert!(links.lines().any(|line| line.starts_with(input) && line.ends_with(" old")), "{links}");
    let said = running.done(&["link", input, "/r2/estimate_pose/change", "--dry-run"]);
    assert!(said.contains("dry run") && said.contains("Point2 of Pose2, field by field"), "{said}");
    let refused = ["link", "r2/position/source", "/r2/estimate_pose/change", "--dry-run"];
    running.fails(5, &refused, &["Pose2 has no field `z`, which Position has"]);

    // What says the same as the file, or as the default, is no difference.
    running.done(&["set", "/r2/planner/params/max_linear_velocity", "0.35"]);
    assert!(running.done(&["config", "diff"]).contains("max_linear_velocity = 0.35"));
    running.done(&["set", "/r2/planner/params/max_linear_velocity", "0.4"]);
    assert_eq!(running.done(&["config", "diff"]), "");
}

#[test]
fn rates_are_measured_in_the_agent() {
    let mut running = Running::new("stat");
    running.start("exp1", &EXP1);
    let sonar = "/simulator/r2/sonar";
    let said = running.done(&["stat", sonar, "--for", "1s", "--min", "49", "--max", "51", "--json"]);
    let measured: Value = serde_json::from_str(&said).unwrap();
    let one = &measured["properties"][0];
    // In lockstep it is exact, however busy the machine is.
    assert!((one["rate"].as_f64().unwrap() - 50.0).abs() < 1e-6, "{said}");
    assert_eq!((&one["interval"]["p50"], &one["interval"]["max"]), (&20_000_000.into(), &20_000_000.into()));
    assert_eq!((&measured["schema"], &one["interface"]), (&"slate.stat/1".into(), &"SonarScan".into()));
    running.fails(2, &["stat", sonar, "--for", "-1s"], &["a time is from 0"]);
    let output = running.call(&["hz", sonar, "--for", "300ms", "--min", "100"]);
    assert_eq!(output.status.code(), Some(7), "{output:?}");
    assert!(text(&output.stderr).contains("expected at least 100 Hz"), "{output:?}");
    assert!(text(&output.stdout).contains("50.00 Hz"), "{output:?}");
    assert!(running.done(&["bw", "/referee/params", "--for", "200ms"]).contains("no new value came"));
    running.fails(2, &["stat", sonar, "--for", "60s"], &["at most 50 s"]);
}

#[test]
fn settable_values_are_set_and_others_have_remedy() {
    let mut running = Running::new("set");
    running.start("exp1", &EXP1);
    let said = running.done(&["set", "/r2/planner/params/max_linear_velocity", "0.3"]);
    assert!(said.contains("0.4 (default) -> 0.3"), "{said}");
    assert_eq!(running.read("exp1", "/r2/planner/params/max_linear_velocity"), 0.3);
    running.done(&["set", "/r2/avoid_wall/rank", r#"{"rank": 3}"#]);
    assert_eq!(running.read("exp1", "/r2/avoid_wall/rank/rank"), 3);
    running.done(&["set", "/r2/avoid_wall/rank/rank", "-4"]);
    assert_eq!(running.read("exp1", "/r2/avoid_wall/rank/rank"), -4);
    // It is a setting like others: it is known what has changed, and it can be taken back.
    assert!(running.done(&["config", "diff"]).contains("inputs"));
    running.done(&["config", "revert", "robots.r2.modules.planner"]);
    assert_eq!(running.read("exp1", "/r2/planner/params/max_linear_velocity"), 0.4);
    let off = running.done(&["set", "/referee/enabled", "false"]);
    assert_eq!(off.trim(), "modules.referee.enabled: true -> false");
    assert_eq!(running.read("exp1", "/referee/enabled/value"), false);
    running.done(&["set", "/referee/enabled", "true"]);

    running.done(&["set", "/r2/planner/params", "{ max_linear_velocity = 0.25 }"]);
    assert_eq!(running.read("exp1", "/r2/planner/params/max_linear_velocity"), 0.25);
    let diff = running.done(&["config", "diff"]);
    assert!(diff.contains("robots.r2.modules.planner.params.max_linear_velocity = 0.25"), "{diff}");
    let help =
        ["`slate set /r2/planner/params '{ ", "max_linear_velocity = 0.25", "`slate get /r2/planner/params`"];
    running.fails(5, &["set", "/r2/planner/params", "fast"], &help);

    running.fails(5, &["set", "/r2/planner/params/max_linear_velocity", "99"], &["99, outside 0 to 3"]);
    running.fails(5, &["set", "/r2/planner/params/max_linear_velocity", "fast"], &["max_linear_velocity"]);
    running.fails(
        4,
        &["set", "/r2/planner/params/elephant", "1"],
        &["`slate get /r2/planner/params` prints the fields"],
    );
    let near = ["did you mean /r2/planner/params/max_linear_velocity?"];
    running.fails(4, &["set", "/r2/planner/params/max_linear_velocty", "1"], &near);
    running.fails(
        4,
        &["set", "/r2/plannr/params/max_linear_velocity", "1"],
        &["`slate list` lists the properties"],
    );
    running.fails(5, &["set", "/simulator/r2/truth", "1"], &["written by module `simulator`", "slate link"]);
    running.fails(5, &["set", "/r2/planner/position", "1"], &["is linked, from", "slate unlink"]);
    running.fails(5, &["set", "/r2/execute/plan", "1"], &["takes messages"]);
    running.fails(5, &["set", "/loop/state", "1"], &["the host's own", "slate config set"]);
}

#[test]
fn tree_of_a_path_shows_what_is_below_it() {
    let mut running = Running::new("subtree");
    running.start("exp1", &EXP1);
    let tree = running.done(&["tree", "/r2"]);
    assert!(tree.starts_with("/r2\n") && tree.contains("\n├─ planner\n│  ├─ "), "{tree}");
    assert!(!tree.contains("simulator"), "{tree}");
    let whole = running.done(&["tree", "slate://exp1/r2/planner/params", "--values"]);
    assert!(whole.starts_with("slate://exp1/r2/planner/params  GoToOriginParams  can be set"), "{whole}");
    assert!(running.done(&["list", "/r2"]).contains("/r2/planner/params"));

    running.fails(4, &["tree", "/r3"], &["`/r3`", "/ contains: ", "r2", "simulator"]);
    running.fails(4, &["tree", "/r2/planer"], &["did you mean `planner`? /r2 contains: "]);
    running.fails(4, &["tree", "/simulator/r2/truth/x"], &["/simulator/r2/truth is a property", "slate get"]);
    running.fails(4, &["list", "/r3/**"], &["no property", "r2"]);
}

#[test]
fn the_tree_the_modules_and_the_agents_are_shown() {
    let mut running = Running::new("tree");
    running.start("exp1", &EXP1);
    running.done(&["wait", "/loop/histogram/count", "> 5"]);
    let tree = running.done(&["tree", "/r2/planner/*", "--values"]);
    assert!(tree.contains("└─ planner") && tree.contains("max_linear_velocity=0.4"), "{tree}");
    assert!(!running.done(&["tree", "--depth", "1"]).contains("planner"));
    let tree: Value = serde_json::from_str(&running.done(&["tree", "--json"])).unwrap();
    let planner = &tree["tree"]["below"]["r2"]["below"]["planner"]["below"];
    assert_eq!(planner["params"]["value"]["max_linear_velocity"], 0.4, "{planner}");
    assert_eq!(
        (&planner["params"]["access"], &planner["state"]["access"]),
        (&"setting".into(), &"output".into())
    );

    let top: Value = serde_json::from_str(&running.done(&["top", "--json"])).unwrap();
    let modules = top["modules"].as_array().unwrap();
    let simulator = modules.iter().find(|module| module["module"] == "simulator").unwrap();
    assert_eq!(simulator["period"], 20_000_000, "{simulator}");
    assert!(simulator["p50"].as_u64() > Some(0) && simulator["p50"].as_u64() <= simulator["max"].as_u64());
    assert!(running.done(&["top", "--once", "--sort", "name"]).contains("overruns"));

    running.start("exp1-2", &EXP1);
    let agents: Value = serde_json::from_str(&running.done(&["ps", "--json"])).unwrap();
    let agents = agents["agents"].as_array().unwrap();
    assert_eq!(agents.iter().map(|agent| &agent["agent"]).collect::<Vec<_>>(), ["exp1", "exp1-2"]);
    assert!(agents.iter().all(|agent| agent["process"]["memory"].as_u64() > Some(1 << 20)), "{agents:?}");
    assert!(running.done(&["ps"]).contains("exp1-2"));
}

#[test]
fn hanging_agent_delays_no_query_of_others() {
    let mut running = Running::new("hangs");
    running.start("exp1", &EXP1);
    running.start("exp1-2", &EXP1);
    let second = std::fs::read_to_string(running.sockets().join("slate/exp1-2.lock")).unwrap();
    let signal = |name: &str| {
        let done = std::process::Command::new("kill").args([name, &second]).status().unwrap();
        assert!(done.success());
    };
    signal("-STOP");
    let begin = std::time::Instant::now();
    let listed = running.call(&["ps"]);
    let read = running.call(&["get", "/referee/params/goal_tolerance"]);
    let took = begin.elapsed();
    signal("-CONT");
    assert!(text(&listed.stdout).contains("no answer"), "{listed:?}");
    assert_eq!(text(&read.stdout).trim(), "0.1", "{read:?}");
    assert!(took < std::time::Duration::from_secs(4), "{took:?}");
}

#[test]
fn rules_of_reflexes_are_checked_when_set_and_when_relinked() {
    let mut running = Running::new("set-rules");
    running.start("exp1", &EXP1);
    let rules = "/r2/knowledge/params/sensor_rules";
    let set = |code: i32, list: &str, words: &[&str]| {
        running.fails(code, &["set", rules, list], words);
    };
    set(
        4,
        "[{ sensor = \"bumper\", distance = 0.1 }]",
        &["a rule for the sensor `bumper`", "add a Sensor of Bumper"],
    );
    set(5, "[{ sensor = \"sonar\", distance = 11.0 }]", &["params.sensor_rules.0", "from 0 to 10 m"]);
    set(5, "[]", &["expected a rule such as", "found none"]);
    set(5, "[{ distance = 0.2 }]", &["`sensor_rules.0` has no `sensor`", "distance"]);
    running.done(&["set", rules, "[{ sensor = \"sonar\", distance = 0.15 }]"]);
    running.done(&[
        "wait",
        "/r2/knowledge/rules/avoid_obstacle/sensors/0/distance",
        "== 0.15",
        "--timeout",
        "20s",
    ]);
    let timeout = "/r2/knowledge/params/release_timeout";
    running.fails(5, &["set", timeout, "0.0"], &["release_timeout", "0.1 to 60"]);
    running.done(&["set", timeout, "5.0"]);
    running.done(&["wait", "/r2/knowledge/rules/bumper_release/timeout", "== 5.0", "--timeout", "20s"]);
    // What is wrong at the next start, too, has no help to start anew.
    let second = running.call(&["config", "set", "robots.r2.modules.planner2.kind=go_to_origin_planner"]);
    let said = text(&second.stderr);
    assert!(said.contains("a robot has one plan") && !said.contains("next start"), "{said}");
    // A link that the rule needs is not removed.
    running.fails(5, &["unlink", "r2/knowledge/sonar"], &["a rule for the sensor `sonar`"]);
}

#[test]
fn an_unlinked_input_of_the_simulator_is_set() {
    let mut running = Running::new("set-wheels");
    // A robot without blocks and gates.
    let text =
        format!("{WORLD}\n[agent]\nname = \"yard\"\n[time]\nsource = \"simulator\"\n[modules.simulator]\n");
    std::fs::write(running.folder().join("yard.toml"), text).unwrap();
    running.start("yard", &["run", "yard.toml", "--headless", "--rate", "1"]);
    running.done(&["set", "simulator/r2/wheels", "{ left = 1.0, right = 2.0 }"]);
    running.done(&["set", "simulator/r2/wheels/left", "1.5"]);
    let read = |side: &str| running.done(&["get", &format!("simulator/r2/wheels/{side}")]);
    assert!(read("left").contains("1.5") && read("right").contains('2'), "{}", read("left"));
}

#[test]
fn a_monitor_that_loses_its_sensor_says_how_old_its_value_is() {
    let mut running = Running::new("set-monitor");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1"]);
    // A sensor that has never measured has not stopped.
    running.done(&["wait", "/r2/position_monitor/percept/x", "> -10", "--timeout", "20s"]);
    running.done(&["unlink", "r2/position_monitor/position"]);
    let stopped = || {
        let log = running.done(&["log"]);
        let lines = log.lines().filter(|line| line.contains("the sensor `position` has stopped"));
        lines.map(str::to_owned).collect::<Vec<_>>()
    };
    wait_for("the warning", || !stopped().is_empty());
    let [line] = &stopped()[..] else { panic!("{:?}", stopped()) };
    assert!(line.contains("its newest value is 1.0"), "{line}");
}
