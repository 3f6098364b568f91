//! What is said of a configuration that does not run.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

mod common;

use common::{Running, text, text as text_of};
use serde_json::Value;

const EXP1: &str = include_str!("../../../examples/exp1/exp1.toml");
const EXP3: &str = include_str!("../../../examples/exp3/exp3.toml");
/// The robot that EXP3 includes.
const R3: &str = include_str!("../../../examples/exp2/robots/r3.toml");
/// The head of the links of EXP1's robot.
const LINKS: &str = "[robots.r2.links]\n";

/// How many modules a configuration has, as its text says.
fn modules_of(text: &str) -> usize {
    let document: toml_edit::DocumentMut = text.parse().unwrap();
    let modules = |table: &toml_edit::Item| {
        table.get("modules").and_then(toml_edit::Item::as_table_like).map_or(0, |modules| modules.len())
    };
    let robots = document["robots"].as_table_like().unwrap();
    modules(document.as_item()) + robots.iter().map(|(_, robot)| modules(robot)).sum::<usize>()
}

/// EXP1 with further links of its robot.
fn with_links(lines: &str) -> String {
    assert_eq!(EXP1.matches(LINKS).count(), 1);
    EXP1.replacen(LINKS, &format!("{LINKS}{lines}\n"), 1)
}

fn findings(running: &Running, code: i32, arguments: &[&str]) -> Value {
    let output = running.call(&[arguments, &["--json"]].concat());
    assert_eq!(output.status.code(), Some(code), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn what_fits_is_called_good_and_leaves_nothing_behind() {
    let running = Running::new("check-good");
    let said = running.done(&["check", "exp3", "--strict"]);
    // R3's Knowledge has lines in both files.
    let modules = modules_of(EXP3) + modules_of(R3) - 1;
    assert!(said.contains(&format!("exp3 is good: 1 agent, {modules} modules, ")), "{said}");
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
fn all_mistakes_are_told_at_once_with_their_places() {
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

/// EXP1 with more in it, before its first variant.
fn with_variants(settings: &str) -> String {
    let first = "[choices.controller.slate]\n";
    assert_eq!(EXP1.matches(first).count(), 1);
    EXP1.replacen(first, &format!("{settings}\n{first}"), 1)
}

#[test]
fn a_variant_that_is_not_chosen_is_checked_as_if_it_were() {
    let running = Running::new("check-variants");
    let file = running.folder().join("variants.toml");
    for (settings, words) in [
        ("robots.r2.modules.second = { kind = \"go_to_origin_planner\" }", "a robot has one plan"),
        ("robots.r2.modules.planner.kind = \"no_such_kind\"", "no_such_kind"),
        ("robots.r2.links.\"planner/position\" = \"sonar/value\"", "`/r2/sonar/value`"),
        ("modules.referee.params.time_limit = -1.0", "outside 0 to"),
        ("robots.r2.modules.avoid_obstcle.enabled = false", "avoid_obstcle"),
    ] {
        let text = with_variants(&format!("[choices.controller.x]\n{settings}"));
        std::fs::write(&file, &text).unwrap();
        let checked = findings(&running, 7, &["check", "variants.toml"]);
        let found = checked["findings"].as_array().unwrap();
        assert!(!found.is_empty(), "{checked}");
        for one in found {
            let message = one["message"].as_str().unwrap();
            assert!(message.starts_with("with `controller = \"x\"`: "), "{checked}");
            assert_eq!(one["variants"], serde_json::json!(["controller = \"x\""]), "{checked}");
        }
        let named = found.iter().find(|one| one["message"].as_str().unwrap().contains(words));
        let place = named.unwrap_or_else(|| panic!("{words}: {checked}"))["line"].as_u64().unwrap() as usize;
        assert_eq!(text.lines().nth(place - 1), Some(settings), "{checked}");
        let output = running.call(&["check", "variants.toml"]);
        assert!(text_of(&output.stderr).contains("with `controller = \"x\"`: "), "{output:?}");
    }
}

#[test]
fn what_is_wrong_in_all_variants_is_told_once_and_names_none() {
    let running = Running::new("check-anyhow");
    let text =
        with_variants("[choices.controller.x]\n").replacen("time_limit = 120.0", "time_limit = -1.0", 1);
    std::fs::write(running.folder().join("wrong.toml"), text).unwrap();
    let checked = findings(&running, 7, &["check", "wrong.toml"]);
    let found = checked["findings"].as_array().unwrap();
    assert_eq!(found.len(), 1, "{checked}");
    assert_eq!(found[0].get("variants"), None, "{checked}");
    let output = running.call(&["check", "wrong.toml"]);
    assert_eq!(text_of(&output.stderr).matches("outside 0 to").count(), 1, "{output:?}");
    // What is wrong with one of two names that.
    let wrong = "modules.referee.params.time_limit = -1.0";
    let both = with_variants(&format!("[choices.controller.x]\n[choices.controller.y]\n{wrong}"));
    std::fs::write(running.folder().join("one.toml"), both).unwrap();
    let checked = findings(&running, 7, &["check", "one.toml", "--set", "controller=x"]);
    assert_eq!(checked["findings"].as_array().unwrap().len(), 1, "{checked}");
    assert_eq!(checked["findings"][0]["variants"], serde_json::json!(["controller = \"y\""]));
    // The chosen one is the configuration as it is.
    let checked = findings(&running, 7, &["check", "one.toml", "--set", "controller=y"]);
    assert_eq!(checked["findings"][0].get("variants"), None, "{checked}");
}

#[test]
fn a_robot_without_modules_is_warned_of() {
    let running = Running::new("check-empty");
    std::fs::write(running.folder().join("empty.toml"), format!("{EXP1}\n[robots.r9]\n")).unwrap();
    let checked = findings(&running, 0, &["check", "empty.toml"]);
    let found = checked["findings"].as_array().unwrap();
    assert_eq!(found.len(), 1, "{checked}");
    assert_eq!(
        (&found[0]["message"], &found[0]["severity"]),
        (&"robot `r9` has no modules".into(), &"warning".into())
    );
    assert_eq!(found[0]["line"], EXP1.lines().count() + 2, "{checked}");
    findings(&running, 7, &["check", "empty.toml", "--strict"]);
}

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

#[test]
fn a_mistake_has_the_code_of_its_kind() {
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

#[test]
fn each_agent_of_a_file_is_checked_and_nobody_is_reached() {
    let running = Running::new("check-agents");
    let example = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/sharing");
    let text = std::fs::read_to_string(example.join("team.toml")).unwrap();
    let included = |name: &str| format!("include = {:?}", example.join(name));
    let file = ["robot.toml", "watcher.toml"]
        .into_iter()
        .fold(text, |text, name| text.replace(&format!("include = {name:?}"), &included(name)));
    std::fs::write(running.folder().join("team.toml"), &file).unwrap();
    let checked = findings(&running, 0, &["check", "team.toml"]);
    assert_eq!(checked["counts"]["agents"], 2, "{checked}");
    let wrong = format!("{file}\n[nonsense]\n");
    std::fs::write(running.folder().join("wrong.toml"), wrong).unwrap();
    let checked = findings(&running, 7, &["check", "wrong.toml"]);
    // Once, although both agents have it.
    let found = checked["findings"].as_array().unwrap();
    assert_eq!(
        found.iter().filter(|one| one["message"].as_str().unwrap().contains("nonsense")).count(),
        1,
        "{checked}"
    );
}

#[test]
fn a_plugin_that_no_module_is_of_is_a_warning() {
    let running = Running::new("check-unused");
    let library = common::library("libslate_adaptation.so");
    let file = format!("{EXP1}\n[plugins.slate-adaptation]\nfile = {library:?}\n");
    std::fs::write(running.folder().join("unused.toml"), file).unwrap();
    let checked = findings(&running, 0, &["check", "unused.toml"]);
    assert_eq!(checked["findings"][0]["severity"], "warning", "{checked}");
    findings(&running, 7, &["check", "unused.toml", "--strict"]);
}

#[test]
fn what_is_to_be_recorded_and_is_nowhere_is_a_warning() {
    let running = Running::new("check-select");
    let select = ["check", "exp1", "--set", "record.enabled=true", "--set"];
    let with = |setting: &'static str| [&select[..], &[setting]].concat();
    let checked = findings(&running, 0, &with("record.select=\"/r2/planer/**\""));
    let finding = &checked["findings"][0];
    assert_eq!((&finding["severity"], checked["findings"].as_array().unwrap().len()), (&"warning".into(), 1));
    let (message, help) = (finding["message"].as_str().unwrap(), finding["help"].as_str().unwrap());
    assert!(message.contains("no property fits /r2/planer/** of record.select"), "{checked}");
    assert!(help.contains("/r2/planner/"), "{checked}");
    findings(&running, 7, &[&with("record.select=\"/r2/planer/**\"")[..], &["--strict"]].concat());
    for good in ["record.select=\"/r2/**\"", "record.exclude=\"/nothing/**\""] {
        let checked = findings(&running, 0, &with(good));
        assert_eq!(checked["findings"], serde_json::json!([]), "{good}");
    }
    let rule = "[[record.rules]]\nselect = [\"/r2/plans\", \"/r2/**\"]\nrate = 5.0\n";
    std::fs::write(running.folder().join("ruled.toml"), format!("{EXP1}\n{rule}")).unwrap();
    let checked = findings(&running, 0, &["check", "ruled.toml"]);
    let finding = &checked["findings"][0];
    assert!(finding["message"].as_str().unwrap().contains("/r2/plans of record.rules"), "{checked}");
    assert_eq!(finding["file"].as_str().map(|file| file.ends_with("ruled.toml")), Some(true), "{checked}");
}

#[test]
fn what_is_there_and_no_file_is_not_said_to_be_missing() {
    let running = Running::new("check-folder");
    let folder = running.folder().join("robot");
    std::fs::create_dir(&folder).unwrap();
    running.fails(2, &["check", "robot"], &["`robot` is a folder"]);
    std::fs::write(folder.join("robot.toml"), "").unwrap();
    running.fails(2, &["check", "robot"], &["`robot` is a folder", "robot/robot.toml"]);
    running.fails(2, &["run", "/dev/null", "--headless"], &["`/dev/null` is a pipe or a device"]);
    running.fails(2, &["check", "nothing.toml"], &["no example or file is named `nothing.toml`"]);
}

#[test]
fn a_drawing_has_all_modules_and_links() {
    let mut running = Running::new("graph");
    let svg = running.done(&["graph", "exp3"]);
    let drawing = roxmltree::Document::parse(&svg).unwrap();
    let texts: Vec<_> = drawing.descendants().filter_map(|node| node.text()).collect();
    for name in ["simulator", "r2/planner", "r3/avoid_obstacle", "r2/wheels", "pursuit"] {
        assert!(texts.contains(&name), "{name}");
    }
    let edges = drawing.descendants().filter(|node| node.attribute("marker-end").is_some()).count();
    let graph: Value = serde_json::from_str(&running.done(&["graph", "exp3", "--format", "json"])).unwrap();
    // The links of the configuration, and what commands the two actuators.
    let counts = &findings(&running, 0, &["check", "exp3"])["counts"];
    let number = |what: &str| counts[what].as_u64().unwrap() as usize;
    assert!(number("links") > number("modules"), "{counts}");
    let expected = number("links") + number("actuators");
    assert_eq!((edges, graph["edges"].as_array().unwrap().len()), (expected, expected));
    let reflex = graph["edges"].as_array().unwrap().iter().find(|edge| edge["output"] == "reflex").unwrap();
    assert_eq!((&reflex["flow"], &reflex["input"]), (&"messages".into(), &"reflexes".into()), "{reflex}");

    // A drawing of nothing is one, too.
    let nothing = running.done(&["graph", "exp1", "--hide", "**"]);
    let drawing = roxmltree::Document::parse(&nothing).unwrap();
    let size = |side| drawing.root_element().attribute(side).and_then(|size| size.parse::<u32>().ok());
    assert!(size("width") > Some(0) && size("height") > Some(0), "{nothing}");

    assert!(running.done(&["graph", "exp1", "--format", "mermaid"]).starts_with("flowchart LR"));
    assert!(running.done(&["graph", "exp1", "--format", "dot"]).starts_with("digraph"));
    let hidden = running.done(&["graph", "exp3", "--format", "dot", "--hide", "r3/*", "--hide", "referee"]);
    assert!(
        hidden.contains("r2/planner") && !hidden.contains("r3/planner") && !hidden.contains("referee"),
        "{hidden}"
    );

    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1"]);
    let live: Value = serde_json::from_str(&running.done(&["graph", "--format", "json"])).unwrap();
    let written: Value = serde_json::from_str(&running.done(&["graph", "exp1", "--format", "json"])).unwrap();
    assert_eq!(live["edges"].as_array().unwrap().len(), written["edges"].as_array().unwrap().len());
    assert!(live["nodes"].as_array().unwrap().iter().any(|node| node["note"] == "working"), "{live}");
    running.done(&["graph", "--out", "exp1.svg"]);
    // What is written is what the name says.
    running.done(&["graph", "exp1", "--out", "exp1.dot"]);
    assert!(std::fs::read_to_string(running.folder().join("exp1.dot")).unwrap().starts_with("digraph"));
    running.fails(2, &["graph", "exp1", "--out", "exp1.png"], &["exp1.png", ".svg"]);
    assert!(!running.folder().join("exp1.png").exists());
    // A drawing that can't be written leaves the one that is there.
    let output = running.on_full_disk(&["graph", "exp3", "--out", "exp1.dot"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(std::fs::read_to_string(running.folder().join("exp1.dot")).unwrap().contains("r2/planner"));
    assert!(!running.folder().join("exp1.dot.part").exists());
    let link = running.folder().join("link.dot");
    std::os::unix::fs::symlink("exp1.dot", &link).unwrap();
    running.done(&["graph", "exp3", "--out", "link.dot"]);
    assert!(link.is_symlink() && std::fs::read_to_string(&link).unwrap().contains("r3/planner"));
    let said = running.done(&["unlink", "r2/planner/goal"]);
    assert!(said.ends_with("-> none\n"), "{said}");
    assert!(running.folder().join("exp1.svg").is_file());
}

#[test]
fn limits_wider_than_those_of_the_robot_model_are_warned_of() {
    let running = Running::new("check-limits");
    let checked = |limits: &str| {
        let text = EXP1.replacen("safe = { left", &format!("limits = {{ {limits} }}\nsafe = {{ left"), 1);
        std::fs::write(running.folder().join("robot.toml"), text).unwrap();
        findings(&running, 0, &["check", "robot.toml"])
    };
    let wide = checked("left = [-12.3, 20.0]");
    let message = wide["findings"][0]["message"].as_str().unwrap();
    assert!(
        message.contains("`left` at the gate `r2/wheels`, -12.3 to 20,") && message.contains("-12.3 to 12.3")
    );
    assert_eq!(wide["limits"][0]["limits"], serde_json::json!({ "right": [-12.3, 12.3] }), "{wide}");
    let narrow = checked("left = [-6.0, 6.0], right = [-12.304, 12.304]");
    assert_eq!(
        (narrow["findings"].as_array().unwrap().len(), narrow["limits"].as_array().unwrap().len()),
        (0, 0)
    );
}

#[test]
fn network_that_can_not_be_joined_is_told_before_a_run() {
    let running = Running::new("check-network");
    let table = |lines: &str| format!("{EXP1}\n[network]\n{lines}\n");
    let checked = |code: i32, lines: &str| {
        std::fs::write(running.folder().join("robot.toml"), table(lines)).unwrap();
        findings(&running, code, &["check", "robot.toml"])["findings"].clone()
    };
    let line = EXP1.lines().count() + 3;
    let open = checked(7, "listen = [\"tcp/0.0.0.0:7447\"]");
    assert_eq!((&open[0]["severity"], &open[0]["line"]), (&"error".into(), &line.into()), "{open}");
    assert!(open[0]["message"].as_str().unwrap().contains("clear text"), "{open}");
    let good = checked(
        if cfg!(feature = "zenoh") { 0 } else { 7 },
        "listen = [\"tcp/127.0.0.1:7447\"]\nset = [\"r2/planner/params\"]",
    );
    let input =
        checked(7, "listen = [\"tcp/127.0.0.1:7447\"]\nread.\"r2/planner/place\" = \"zenoh:demo/place\"");
    if cfg!(feature = "zenoh") {
        assert!(
            good.as_array().is_some_and(|all| all.iter().all(|one| one["severity"] != "error")),
            "{good}"
        );
        assert!(input[0]["message"].as_str().unwrap().contains("can't read from the network"), "{input}");
        assert_eq!(input[0]["line"], line + 1, "{input}");
        return;
    }
    for refused in [good, input] {
        assert!(refused[0]["message"].as_str().unwrap().contains("built without Zenoh"), "{refused}");
    }
    let output = running.call(&["run", "robot.toml", "--headless"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(text(&output.stderr).contains("cargo build --release --features zenoh"), "{output:?}");
}
