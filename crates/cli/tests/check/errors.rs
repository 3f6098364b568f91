//! Errors of a configuration: each with its place, its code and a hint.

use serde_json::Value;

use super::common::{Running, text};
use super::{EXP1, findings, with_links};

const EXP3: &str = include_str!("../../../../examples/exp3/exp3.toml");
/// The robot that EXP3 includes.
const R3: &str = include_str!("../../../../examples/exp2/robots/r3.toml");

/// How many modules a configuration has, as its text says.
fn modules_of(text: &str) -> usize {
    let document: toml_edit::DocumentMut = text.parse().unwrap();
    let modules = |table: &toml_edit::Item| {
        table.get("modules").and_then(toml_edit::Item::as_table_like).map_or(0, |modules| modules.len())
    };
    let robots = document["robots"].as_table_like().unwrap();
    modules(document.as_item()) + robots.iter().map(|(_, robot)| modules(robot)).sum::<usize>()
}

#[test]
fn what_fits_is_called_good_and_leaves_nothing_behind() {
    let running = Running::new("check-good");
    let said = running.done(&["check", "exp3", "--strict"]);
    // R3's Knowledge has lines in both files.
    let modules = modules_of(EXP3) + modules_of(R3) - 1;
    assert!(said.contains(&format!("exp3 is valid: 1 agent, {modules} modules, ")), "{said}");
    assert!(said.contains(" links, 2 actuators"), "{said}");
    let limits = "r2/wheels: left, right from -12.3 to 12.3, by the RobotModel of a pioneer_p3dx";
    assert!(
        said.contains(limits)
            && said.contains("front_right from -13.64 to 13.64, by the RobotModel of a summit_xl"),
        "{said}"
    );
    let checked = findings(&running, 0, &["check", "exp1"]);
    assert_eq!((&checked["schema"], &checked["ok"]), (&"slate.check/1".into(), &true.into()), "{checked}");
    assert_eq!(checked["counts"]["modules"], modules_of(EXP1), "{checked}");
    // A log that a run is writing is not touched.
    let file = EXP1.replacen("[world]", "[log.targets]\nfile = \"robot.log\"\n[world]", 1);
    std::fs::write(running.folder().join("logged.toml"), file).unwrap();
    running.done(&["check", "logged.toml"]);
    assert!(!running.folder().join("robot.log").exists() && !running.folder().join("runs").exists());
}

#[test]
fn check_opens_no_log_port_and_makes_no_file() {
    let running = Running::new("check-closed");
    // A run listens at that address, so an agent could not.
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap();
    let targets = format!("[log.targets]\nremote = \"{address}\"\nfile = \"robot.log\"\n[world]");
    let file = EXP1.replacen("[world]", &targets, 1);
    std::fs::write(running.folder().join("logged.toml"), file).unwrap();
    running.done(&["check", "logged.toml", "--strict"]);
    running.done(&["graph", "logged.toml", "--json"]);
    let examined: Value =
        serde_json::from_slice(&running.call(&["doctor", "logged.toml", "--json"]).stdout).unwrap();
    let findings = examined["findings"].as_array().unwrap();
    let own = findings.iter().find(|finding| finding["what"] == "configuration").unwrap();
    assert_eq!(own["state"], "good", "{own}");
    let left: Vec<_> = std::fs::read_dir(running.folder()).unwrap().flatten().collect();
    assert!(left.iter().all(|entry| entry.file_name() != "robot.log"), "{left:?}");
}

#[test]
fn all_errors_are_reported_at_once_with_places() {
    let running = Running::new("check-bad");
    let links =
        "\"knowledge/position\" = \"/simulator/r2/sonar\"\n\"pass_range/range\" = \"range_monitr/percept\"";
    let wrong = with_links(links).replacen("time_limit = 120.0", "time_limit = -1.0", 1).replacen(
        "tolerance = 0.1",
        "tolerence = 0.1",
        1,
    );
    std::fs::write(running.folder().join("wrong.toml"), &wrong).unwrap();
    let checked = findings(&running, 7, &["check", "wrong.toml"]);
    let found = checked["findings"].as_array().unwrap();
    for words in ["outside 0 to", "tolerence", "range_monitr", "knowledge/position"] {
        let one = found.iter().find(|one| one["message"].as_str().unwrap().contains(words));
        let one = one.unwrap_or_else(|| panic!("{words}: {checked}"));
        // The line that it names is the line where that stands.
        let line = wrong.lines().nth(one["line"].as_u64().unwrap() as usize - 1).unwrap();
        assert!(line.contains(words.trim_start_matches("outside 0 to")), "{line}: {one}");
        assert_eq!((&one["severity"], &one["file"]), (&"error".into(), &"wrong.toml".into()), "{one}");
    }
    let output = running.call(&["check", "wrong.toml"]);
    assert_eq!(output.status.code(), Some(7));
    assert!(text(&output.stderr).contains("───") && text(&output.stdout).contains("errors"), "{output:?}");
    running.fails(2, &["check", "nothing.toml"], &["no example or file"]);
}

#[test]
fn a_second_plan_is_told_of_where_it_is_added() {
    let running = Running::new("check-second");
    std::fs::write(running.folder().join("exp1.toml"), EXP1).unwrap();
    let text =
        "include = [\"exp1.toml\"]\n[robots.r2.modules]\nplanner2 = { kind = \"go_to_origin_planner\" }\n";
    std::fs::write(running.folder().join("more.toml"), text).unwrap();
    let checked = findings(&running, 7, &["check", "more.toml"]);
    let [found] = &checked["findings"].as_array().unwrap()[..] else { panic!("{checked}") };
    assert_eq!((&found["file"], &found["line"]), (&"more.toml".into(), &3.into()), "{checked}");
    assert!(found["message"].as_str().unwrap().contains("`r2/planner` (exp1.toml:"), "{checked}");
}

#[test]
fn wrong_settings_are_told_of_where_they_are_written() {
    let running = Running::new("check-set");
    let told = |set: &str| {
        let checked = findings(&running, 7, &["check", "exp1", "--set", set]);
        let found = checked["findings"].as_array().unwrap();
        assert!(found.len() == 1 && found[0]["file"] == "--set", "{checked}");
        found[0].clone()
    };
    told("world.profile=nonsense");
    told("world.profile=5");
    for (rules, help) in [
        ("[]", "disable the reflex"),
        ("[{sensor=\"sonar\",distance=-1.0}]", "such as 0.1"),
        ("[{sensor=\"sonar\",distanc=0.1}]", "did you mean `distance`, not `distanc`?"),
    ] {
        let told = told(&format!("robots.r2.modules.knowledge.params.sensor_rules={rules}"));
        assert_eq!(told["code"], "S015", "{told}");
        assert!(told["help"].as_str().unwrap().contains(help), "{told}");
    }
}

#[test]
fn rules_of_reflexes_are_told_of_in_their_lines() {
    let running = Running::new("check-rules");
    let both = "sensor_rules = [{ sensor = \"sonar\", distance = 0.3 }, { sensor = \"robot_sensor\", distance = 0.25 }]";
    assert_eq!(R3.matches(both).count(), 1);
    let file = running.folder().join("r3.toml");
    let exp3 = EXP3.replacen("../exp2/robots/r3.toml", "r3.toml", 1);
    std::fs::write(running.folder().join("rules.toml"), exp3).unwrap();
    let found = |rules: &str, words: &[&str], line: &str| {
        let text = R3.replacen(both, rules, 1);
        std::fs::write(&file, &text).unwrap();
        let checked = findings(&running, 7, &["check", "rules.toml"]);
        let found = checked["findings"].as_array().unwrap();
        assert_eq!(found.len(), 1, "{checked}");
        let message = found[0]["message"].as_str().unwrap();
        assert!(words.iter().all(|word| message.contains(word)), "{words:?}: {message}");
        let place = found[0]["line"].as_u64().unwrap() as usize;
        let told = text.lines().nth(place - 1).unwrap();
        assert!(told.contains(line) && found[0]["file"] == "r3.toml", "{told}: {checked}");
    };
    let with =
        |second: &str| format!("sensor_rules = [\n{{ sensor = \"sonar\", distance = 0.3 }},\n{second}\n]");
    // Knowledge has an input for it, and the robot no such Sensor.
    let bumper = "{ sensor = \"bumper\", distance = 0.3 }";
    found(&with(bumper), &["`sensor_rules` of `r3/knowledge`", "`bumper`", "lists"], bumper);
    let twice = "{ sensor = \"sonar\", distance = 0.2 }";
    found(
        &with(twice),
        &["`r3/knowledge`", "params.sensor_rules.1: `sensor_rules.0` is of the sensor `sonar`"],
        twice,
    );
    let far = "{ sensor = \"robot_sensor\", distance = 30.0 }";
    found(&with(far), &["from 0 to 10 m", "found 30"], far);
    // No item has what another one of the default says.
    let unnamed = "{ distance = 0.1 }";
    found(&with(unnamed), &["`sensor_rules.1` has no `sensor`"], unnamed);
    let endless = "{ sensor = \"robot_sensor\" }";
    found(&with(endless), &["`sensor_rules.1` has no `distance`"], endless);
    found("sensor_rules = [{ distance = 0.3 }]", &["`sensor_rules.0` has no `sensor`"], "distance");
    found("sensor_rules = []", &["expected a rule such as", "found none"], "sensor_rules = []");
    // A threshold of another reflex.
    let fast = "give_way_velocity = 9.0";
    found(&format!("{both}\n{fast}"), &["`give_way_velocity` is 9, outside 0 to 5"], fast);
    // Another parameter of Knowledge.
    let text = R3.replacen("robot = \"summit_xl\"", "robot = \"summit\"", 1);
    std::fs::write(&file, &text).unwrap();
    let checked = findings(&running, 7, &["check", "rules.toml"]);
    let place = checked["findings"][0]["line"].as_u64().unwrap() as usize;
    assert_eq!(text.lines().nth(place - 1).unwrap(), "robot = \"summit\"", "{checked}");
}

#[test]
fn an_error_has_the_code_of_its_kind() {
    let running = Running::new("check-codes");
    for (set, code) in [
        ("loop.perod=1ms", "S002"),
        ("robots.r2.modules.planner.params.sped=1", "S003"),
        ("robots.r2.links.\"planner/range\"=\"nobody/x\"", "S004"),
        ("robots.r2.modules.planner.kind=planer", "S005"),
        ("robots.r2.links.\"planner/range\"=\"/simulator/r2/position\"", "S016"),
        ("robots.r2.links.\"planner/goal\"=\"planner/goal\"", "S007"),
        ("robots.r2.modules.second={kind=\"go_to_origin_planner\"}", "S010"),
        ("links.\"simulator/r2/wheels\"=\"r2/execute/wheels\"", "S011"),
        ("time.source=simulater", "S012"),
        ("links.\"referee/truth\"=\"slate://team/x\"", "S013"),
        ("loop.period=fast", "S015"),
        ("robots.r2.links.\"planner/goal\"=\"/simulator/r2/position\"", "S016"),
        ("robots.r2.modules.planner.params.max_linear_velocity=99", "S015"),
        ("robots.r2.modules.knowledge.params.robot=summit_xl", "S017"),
    ] {
        let checked = findings(&running, 7, &["check", "exp1", "--set", set]);
        assert_eq!(checked["findings"][0]["code"], code, "{set}: {checked}");
    }
    std::fs::write(running.folder().join("text.toml"), "[loop\nperiod").unwrap();
    assert_eq!(findings(&running, 7, &["check", "text.toml"])["findings"][0]["code"], "S001");
}

#[test]
fn a_robot_model_of_another_robot_is_refused_with_both_places() {
    let running = Running::new("check-robot");
    let line_of =
        |text: &str, words: &str| text.lines().position(|line| line.contains(words)).unwrap_or_default() + 1;
    let knows = "knowledge = { kind = \"wheeled_knowledge\", params = { robot = \"pioneer_p3dx\" } }";
    let other = EXP1.replacen(knows, &knows.replace("pioneer_p3dx", "summit_xl"), 1);
    let none = EXP1.replacen(knows, "knowledge = { kind = \"wheeled_knowledge\" }", 1);
    let model = line_of(EXP1, "robots.r2 = { model = ");
    for (name, text, code, words) in [
        (
            "other.toml",
            &other,
            "S017",
            format!("`simulator` has a `pioneer_p3dx` there (other.toml:{model})"),
        ),
        ("none.toml", &none, "S019", "no robot is named; expected one of pioneer_p3dx, summit_xl".into()),
    ] {
        std::fs::write(running.folder().join(name), text).unwrap();
        let checked = findings(&running, 7, &["check", name]);
        let found = checked["findings"].as_array().unwrap();
        assert_eq!(found.len(), 1, "{checked}");
        assert!(found[0]["message"].as_str().unwrap().contains(&words), "{checked}");
        assert_eq!((&found[0]["code"], &found[0]["line"]), (&code.into(), &line_of(EXP1, knows).into()));
        running.fails(2, &["run", name, "--headless"], &["knowledge"]);
    }
    // The driver of a real Pioneer knows its robot, too.
    let pioneer = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/exp1/pioneer.toml");
    let pioneer = pioneer.to_str().unwrap();
    findings(&running, 0, &["check", pioneer]);
    let set = "robots.r2.modules.knowledge.params.robot=summit_xl";
    let checked = findings(&running, 7, &["check", pioneer, "--set", set]);
    let message = checked["findings"][0]["message"].as_str().unwrap();
    assert!(message.contains("`r2/pioneer` has a `pioneer_p3dx` there"), "{checked}");
}
