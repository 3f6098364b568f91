//! Settings that fit and yet keep a robot from doing what it is for: what `check` and `run` say of them.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use common::{Running, text, wait_for};
use serde_json::Value;

const EXP1: &str = include_str!("../../../examples/exp1/exp1.toml");
const SPEED: &str = "speed = \"/r2/planner/params/max_linear_velocity\"\n";

/// EXP1 without some of its lines.
fn without(lines: &[&str]) -> String {
    lines.iter().fold(EXP1.to_owned(), |rest, line| {
        assert!(rest.contains(line), "{line}");
        rest.replacen(line, "", 1)
    })
}

/// The warnings of a configuration as it is, whatever its variants lack, each with its help.
fn warnings(name: &str, configuration: &str) -> Vec<String> {
    let running = Running::new(name);
    std::fs::write(running.folder().join("robot.toml"), configuration).unwrap();
    let output = running.call(&["check", "robot.toml", "--json"]);
    let checked: Value = serde_json::from_str(&text(&output.stdout)).unwrap();
    let words = |one: &Value| {
        assert_eq!(one["severity"], "warning", "{checked}");
        assert!(one["code"].as_str().unwrap().starts_with("S2"), "{checked}");
        format!("{}: {}", one["message"].as_str().unwrap(), one["help"].as_str().unwrap())
    };
    let found = checked["findings"].as_array().unwrap();
    found.iter().filter(|one| one.get("variants").is_none()).map(words).collect()
}

#[test]
fn an_execute_without_a_plan_is_warned_of() {
    let lines = ["planner = { kind = \"go_to_origin_planner\" }\n", SPEED];
    let found = warnings("loose-plan", &without(&lines));
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].starts_with("inbox `r2/execute/plan` has no sender"), "{found:?}");
    assert!(found[0].contains("add a Plan to the robot"), "{found:?}");
    // A robot of reflexes alone says so.
    let links = "[robots.r2.links]\n";
    let plan = format!("{links}\"execute/plan\" = false\n");
    let reactive = without(&lines).replacen(links, &plan, 1);
    assert!(reactive.contains(&plan));
    assert_eq!(warnings("loose-reactive", &reactive), Vec::<String>::new());
}

#[test]
fn a_reflex_without_what_knowledge_has_for_it_is_warned_of() {
    let links = "[robots.r2.links]\n";
    for input in ["rules", "robot"] {
        let text = EXP1.replacen(links, &format!("{links}\"avoid_obstacle/{input}\" = false\n"), 1);
        assert_ne!(text, EXP1);
        let found = warnings("loose-reflex", &text);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(
            found[0].starts_with(&format!("input `r2/avoid_obstacle/{input}` has no source")),
            "{found:?}"
        );
        let line = format!("write \"/r2/avoid_obstacle/{input}\" = \"/r2/knowledge/{input}\"");
        assert!(found[0].contains(&line), "{found:?}");
        // One that is switched off does nothing anyway.
        let module = "avoid_obstacle = { kind = \"avoid_obstacle_model\"";
        let off = text.replacen(module, &format!("{module}, enabled = false"), 1);
        assert_ne!(off, text);
        assert_eq!(warnings("loose-reflex", &off), Vec::<String>::new());
    }
    // One that reads no Sensor stands.
    let deaf = EXP1.replacen(links, &format!("{links}\"avoid_obstacle/sonar\" = false\n"), 1);
    let found = warnings("loose-reflex", &deaf);
    assert_eq!(found.len(), 1, "{found:?}");
    let words = "input `r2/avoid_obstacle/sonar` reads no Sensor";
    let line = "write \"/r2/avoid_obstacle/sonar\" = \"/r2/sonar/value\"";
    assert!(found[0].starts_with(words) && found[0].contains(line), "{found:?}");
    let running = Running::new("loose-reflex-run");
    let limit = ["run", "exp1", "--headless", "--set", "modules.referee.params.time_limit=0.5"];
    let output = running.call(&[&limit[..], &["--set", "links.\"/r2/avoid_obstacle/rules\"=false"]].concat());
    let shown = text(&output.stdout) + &text(&output.stderr);
    assert!(shown.contains("input `r2/avoid_obstacle/rules` has no source"), "{shown}");
}

#[test]
fn a_robot_without_sonars_offers_none_to_its_monitors() {
    let model = "robots.r2 = { model = \"pioneer_p3dx\"";
    let deaf = EXP1.replacen(model, &format!("{model}, sonar = \"\""), 1);
    assert_ne!(deaf, EXP1);
    let found = warnings("loose-sonar", &deaf);
    assert_eq!(found.len(), 1, "{found:?}");
    let words = "input `r2/sonar/source` has no source, and nothing else feeds `r2/sonar`";
    assert!(found[0].starts_with(words), "{found:?}");
}

#[test]
fn a_sensor_that_reads_the_device_of_another_robot_is_refused() {
    let links = "[robots.r2.links]\n";
    let text = EXP1.replacen(links, &format!("{links}\"position/source\" = \"/simulator/r1/position\"\n"), 1);
    let running = Running::new("loose-abroad");
    std::fs::write(running.folder().join("abroad.toml"), text).unwrap();
    let said = running.fails(7, &["check", "abroad.toml"], &["S016", "abroad.toml"]);
    // However it is wrapped.
    let dense = |text: &str| text.split([' ', '\n', '│']).collect::<String>();
    let rule = "a Sensor measures by the devices of its own robot: `/r2/position/source` can't read `/simulator/r1/position`";
    let help = "write \"/r2/position/source\" = \"/simulator/r2/position\", or leave the link out";
    assert!(dense(&said).contains(&dense(rule)) && dense(&said).contains(&dense(help)), "{said}");
}

#[test]
fn a_run_names_required_inputs_that_still_wait() {
    let running = Running::new("loose-waits");
    let limit = ["run", "exp1", "--headless", "--set", "modules.referee.params.time_limit=3.0"];
    let waits = |set: &str| -> Vec<String> {
        let output = running.call(&[&limit[..], &["--set", set]].concat());
        let shown = text(&output.stdout) + &text(&output.stderr);
        shown.lines().filter(|line| line.contains("wait for required inputs")).map(str::to_owned).collect()
    };
    let [line] = &waits("robots.r2.modules.knowledge.enabled=false")[..] else { panic!("one line") };
    assert!(line.contains("`r2/execute/robot` (source `/r2/knowledge/robot`)"), "{line}");
    let [line] = &waits("robots.r2.links.\"execute/robot\"=false")[..] else { panic!("one line") };
    assert!(line.contains("`r2/execute/robot` (no source)"), "{line}");
    assert_eq!(waits("agent.seed=0"), Vec::<String>::new());
}

#[test]
fn a_run_names_disarmed_actuators_and_how_to_arm_them() {
    let running = Running::new("loose-disarmed");
    let limit = ["run", "exp1", "--headless", "--set", "modules.referee.params.time_limit=0.5"];
    let said = |more: &[&str]| text(&running.call(&[&limit[..], more].concat()).stderr);
    let shown = said(&["--disarmed"]);
    assert_eq!(
        shown.matches("the actuators are disarmed, so no command reaches r2/wheels").count(),
        1,
        "{shown}"
    );
    assert!(shown.contains("arm them: slate arm --agent exp1"), "{shown}");
    assert!(!said(&[]).contains("disarmed"));
}

#[test]
fn stay_without_time_says_why_it_has_no_effect() {
    let mut running = Running::new("loose-stay");
    let real = without(&["[time]\nsource = \"simulator\"\n"]);
    std::fs::write(running.folder().join("robot.toml"), real).unwrap();
    running.start("exp1", &["run", "robot.toml", "--headless", "--stay"]);
    running.interrupt();
    let output = running.finish();
    let said = text(&output.stderr);
    assert!(said.contains("slate arm --agent exp1"), "{said}");
    assert!(said.contains("--stay has no effect without [time]"), "{said}");
}

#[test]
fn a_link_that_is_taken_away_live_is_warned_of_once() {
    let mut running = Running::new("loose-live");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1"]);
    let warned = |running: &Running| {
        running.done(&["log"]).matches("`r2/motors/wheels` reaches nothing: no link reads").count()
    };
    assert_eq!(warned(&running), 0);
    running.done(&["unlink", "simulator/r2/wheels"]);
    wait_for("the warning", || warned(&running) == 1);
    // What was said is not said again with the next change.
    running.done(&["unlink", "referee/contacts"]);
    wait_for("the other change", || running.done(&["log"]).contains("referee/contacts"));
    assert_eq!(warned(&running), 1);
}

#[test]
fn an_input_that_the_mission_is_judged_by_needs_a_source() {
    let found = warnings("loose-judge", &without(&["\"referee/truth\" = \"simulator/r2/truth\"\n"]));
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(
        found[0]
            .starts_with("input `referee/truth` has no source, and its module decides the mission's outcome"),
        "{found:?}"
    );
}

#[test]
fn exchanged_ends_and_misspelt_robots_get_the_line_to_write() {
    let running = Running::new("loose-hints");
    let refused = |from: &str, to: &str, words: &[&str]| {
        let text = EXP1.replacen(from, to, 1);
        assert_ne!(text, EXP1);
        std::fs::write(running.folder().join("robot.toml"), text).unwrap();
        running.fails(7, &["check", "robot.toml"], words);
    };
    refused(
        "\"simulator/r2/wheels\" = \"r2/motors/wheels\"",
        "\"r2/motors/wheels\" = \"simulator/r2/wheels\"",
        &["names its destination first", "write \"simulator/r2/wheels\" = \"r2/motors/wheels\""],
    );
    refused("[robots.r2.modules]", "[robots.rr2.modules]", &["did you mean rr2/motors?"]);
}

#[test]
fn shipped_examples_are_free_of_warnings() {
    let running = Running::new("loose-examples");
    let examples = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let mut count = 0;
    for folder in std::fs::read_dir(examples).unwrap() {
        let folder = folder.unwrap().path();
        if !folder.is_dir() {
            continue;
        }
        for file in std::fs::read_dir(&folder).unwrap() {
            let file = file.unwrap().path();
            let name = file.file_name().unwrap().to_str().unwrap();
            let needs_ros = || std::fs::read_to_string(&file).unwrap().contains("\n[ros2]\n");
            if name.ends_with(".toml") && name != "Cargo.toml" && (cfg!(feature = "ros2") || !needs_ros()) {
                running.done(&["check", file.to_str().unwrap(), "--strict"]);
                count += 1;
            }
        }
    }
    assert!(count > 10, "{count}");
}

#[test]
fn a_plan_without_its_analyze_is_warned_of() {
    for (analyze, input, interface) in
        [("pass_position", "position", "Position"), ("pass_orientation", "orientation", "Orientation")]
    {
        let text = without(&[&format!("{analyze} = {{}}\n")]);
        let found = warnings("loose-notice", &text);
        let own: Vec<_> = found.iter().filter(|one| one.contains(&format!("`r2/planner/{input}`"))).collect();
        let [one] = own[..] else { panic!("{found:?}") };
        assert!(one.starts_with(&format!("input `r2/planner/{input}` has no source, although")), "{one}");
        assert!(one.contains(&format!("add an Analyze whose change is a {interface}")), "{one}");
        let links = "[robots.r2.links]\n";
        let left = text.replacen(links, &format!("{links}\"planner/{input}\" = false\n"), 1);
        let found = warnings("loose-notice", &left);
        assert!(!found.iter().any(|one| one.contains(&format!("`r2/planner/{input}`"))), "{found:?}");
    }
    // What the Plan may do without.
    assert_eq!(warnings("loose-notice", &without(&["pass_range = {}\n"])), Vec::<String>::new());
}

#[test]
fn a_block_that_is_switched_off_and_missed_is_warned_of() {
    let running = Running::new("loose-off");
    let found = |more: &[&str]| {
        let sets = more.iter().flat_map(|set| ["--set", set]);
        let output = running.call(&["check", "exp1", "--json"].into_iter().chain(sets).collect::<Vec<_>>());
        let checked: Value = serde_json::from_str(&text(&output.stdout)).unwrap();
        let message = |one: &Value| one["message"].as_str().unwrap().to_owned();
        checked["findings"].as_array().unwrap().iter().map(message).collect::<Vec<_>>()
    };
    for (block, lack) in [
        ("execute", "nothing commands the actuators of robot `r2`"),
        ("planner", "`r2/execute` gets no plan, and only reflexes move robot `r2`"),
        ("motors", "no command reaches `simulator/r2/wheels`"),
        ("sonar", "robot `r2` lacks its measurements"),
        ("knowledge", "robot `r2` has no Knowledge"),
    ] {
        let off = found(&[&format!("robots.r2.modules.{block}.enabled=false")]);
        assert_eq!(off, [format!("`r2/{block}` is switched off: {lack}")]);
    }
    // A reflex, and blocks of a variant that is not chosen, are off by intention; a link may switch a block on.
    assert_eq!(found(&["robots.r2.modules.avoid_obstacle.enabled=false"]), Vec::<String>::new());
    let switch = [
        "robots.r2.modules.planner.enabled=false",
        "links.\"/r2/planner/enabled\"=\"/r2/knowledge/params/has_goal\"",
    ];
    assert_eq!(found(&switch), Vec::<String>::new());
}

#[test]
fn a_gate_is_not_linked_to_the_driver_of_another_robot() {
    let links = "[robots.r2.links]\n";
    let text = EXP1.replacen(links, &format!("{links}\"motors/command\" = false\n"), 1);
    let found = warnings("loose-driver", &text);
    let gate = found.iter().find(|one| one.starts_with("`r2/wheels` reaches nothing")).unwrap();
    assert!(gate.ends_with("write \"/r2/motors/command\" = \"/r2/wheels/command\""), "{gate}");
}

#[test]
fn a_second_plan_is_marked_where_it_is_written() {
    let running = Running::new("loose-second");
    for name in ["a_plan", "plan2", "second_plan"] {
        let set = format!("robots.r2.modules.{name}.kind=\"go_to_origin_planner\"");
        let output = running.call(&["check", "exp1", "--set", &set]);
        let said = text(&output.stderr);
        assert!(said.contains("`r2/planner` (exp1.toml:"), "{said}");
        assert!(said.contains(&format!("remove `r2/{name}`")), "{said}");
    }
}

#[test]
fn a_goal_that_is_no_number_is_refused() {
    let running = Running::new("loose-number");
    for number in ["nan", "inf"] {
        let set = format!("robots.r2.modules.knowledge.params.goal_x={number}");
        let output = running.call(&["check", "exp1", "--set", &set]);
        assert_eq!(output.status.code(), Some(7), "{output:?}");
        let said = text(&output.stderr);
        assert!(
            said.contains("`goal_x` is not a finite number") && said.contains("the default is 0"),
            "{said}"
        );
    }
}

#[test]
fn false_is_no_link_in_drawings_and_expanded_files() {
    let mut running = Running::new("left-out");
    let links = "\"execute/reflexes\" = false\n\"execute/robot\" = false\n";
    let head = "[robots.r2.links]\n";
    let robot = EXP1.replacen(head, &format!("{head}{links}\n"), 1);
    let file = running.folder().join("robot.toml");
    std::fs::write(&file, &robot).unwrap();
    let inputs = |arguments: &[&str]| -> Vec<String> {
        let graph: Value = serde_json::from_str(&running.done(&[arguments, &["--json"]].concat())).unwrap();
        let edges = graph["edges"].as_array().unwrap().iter();
        let own = edges.filter(|edge| edge["to"] == "r2/execute" && edge["inferred"] == true);
        own.map(|edge| edge["input"].as_str().unwrap().to_owned()).collect()
    };
    let all = inputs(&["graph", "exp1"]);
    let left = inputs(&["graph", "robot.toml"]);
    assert!(["plan", "reflexes", "robot"].iter().all(|input| all.iter().any(|own| own == input)), "{all:?}");
    assert!(left.contains(&"plan".to_owned()), "{left:?}");
    assert!(left.iter().all(|input| input != "reflexes" && input != "robot"), "{left:?}");
    running.start("exp1", &["run", "robot.toml", "--headless", "--rate", "1"]);
    let inputs = |arguments: &[&str]| running.done(arguments).matches("execute/reflexes").count();
    assert_eq!(inputs(&["link"]), 0);
    wait_for("Execute waits", || {
        let listed = running.done(&["module", "list"]);
        listed.lines().any(|line| line.starts_with("r2/execute") && line.contains("WAITING for robot"))
    });
    running.done(&["config", "save", "--expanded"]);
    let saved = std::fs::read_to_string(&file).unwrap();
    assert!(saved.contains("planner/plan") && links.lines().all(|line| saved.contains(line)), "{saved}");
    assert!(!saved.contains("/reflex\""), "{saved}");
}
