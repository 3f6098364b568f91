//! Rules of attachment, for links of every kind.

mod actuation;
mod external;
mod known;
mod scene;
mod services;

use slate_blackboard::interface::Descriptor;
use slate_composition::{LinkedConfiguration, RemotePath, RemoteProperty, unlinked_warnings};
use slate_interfaces::Twist2;
use slate_module::prelude::*;

use crate::robot::{Near, links};
use scene::{allowed, catalogue, check, read, refused};

const PLAN: &str = "a Plan reads Analyzes, Knowledge and Execute's status";

#[test]
fn plan_reads_analyzes_knowledge_and_execute_alone() {
    for link in [
        r#"links."/r2/planner/aim"="/r2/compare/change""#,
        r#"links."/r2/planner/aim"="/r2/way/change""#,
        r#"links."/r2/planner/aim"="/r2/knowledge/rule""#,
        r#"links."/r2/planner/aim"="/r2/knowledge/fact""#,
        r#"links."/r2/planner/past"="/r2/knowledge/rule""#,
        r#"links."/r2/planner/aim/distance"="/r2/compare/change/distance""#,
        r#"links."/r2/planner/params/gain"="/r2/knowledge/rule/distance""#,
        r#"robots.r2.modules.planner.inputs.aim.distance=1.0"#,
    ] {
        allowed(link);
    }
    let wants = [PLAN, "give it a Sensor, a Monitor and an Analyze", "`/simulator/near`"];
    for link in [
        r#"links."/r2/planner/aim"="/simulator/near""#,
        r#"links."/r2/planner/aim"={from="/simulator/near",previous=true}"#,
        r#"links."/r2/planner/aim"={from="/simulator/near",every=2}"#,
        r#"links."/r2/planner/past"="/simulator/near""#,
        r#"links."/r2/planner/past"={from="/simulator/near",when="distance > 1"}"#,
    ] {
        refused(link, &wants);
    }
    refused(
        r#"links."/r2/planner/aim/distance"="/simulator/near/distance""#,
        &[PLAN, "`/r2/planner/aim/distance`"],
    );
    refused(r#"links."/r2/planner/params/gain"="/simulator/near/distance""#, &[PLAN]);
    refused(
        r#"links."/r2/planner/aim"="/r2/sonar/value""#,
        &[PLAN, "of a Sensor", "a Monitor and an Analyze"],
    );
    refused(r#"links."/r2/planner/aim"="/r2/front/percept""#, &[PLAN, "of a Monitor", "give it an Analyze"]);
    refused(r#"links."/r2/planner/orders"="/plain/say""#, &[PLAN, "`/plain/say`"]);
}

#[test]
fn inputs_of_others_hide_nothing_from_the_rules() {
    // Another module's input leads to its source, and a part of one to what fills it.
    let hop = |to: &str| [r#"links."/plain/input"="/simulator/near""#.to_owned(), to.to_owned()];
    let by = |links: &[String]| {
        let links: Vec<_> = links.iter().map(String::as_str).collect();
        check(&links, &catalogue())
    };
    assert!(by(&hop(r#"links."/r2/planner/aim"="/plain/input""#)).unwrap_err().contains(PLAN));
    let part = [
        r#"links."/plain/input/distance"="/simulator/near/distance""#.to_owned(),
        r#"links."/r2/planner/aim"="/plain/input""#.to_owned(),
    ];
    assert!(by(&part).unwrap_err().contains(PLAN));
    let parameter = [
        r#"links."/plain/params/gain"="/simulator/near/distance""#.to_owned(),
        r#"links."/r2/planner/aim/distance"="/plain/params/gain""#.to_owned(),
    ];
    assert!(by(&parameter).unwrap_err().contains(PLAN));
    // What a person sets there is no bypass.
    by(&[r#"links."/r2/planner/aim"="/plain/input""#.to_owned()]).unwrap();
    by(&[r#"links."/r2/planner/aim/distance"="/plain/params/gain""#.to_owned()]).unwrap();
}

#[test]
fn reading_an_input_of_another_block_does_not_cut_it() {
    // Both ranges are linked by their types and roles alone.
    let says = [
        "a ReactiveModel reads Sensors, and of Knowledge its rules and RobotModel: `/r3/avoid/range` can't read `/r3/",
    ];
    for from in ["/r3/way/range", "/r3/compare/range"] {
        refused(&format!(r#"links."/r3/avoid/range"="{from}""#), &says);
        refused(&format!(r#"links."/r3/avoid/range/distance"="{from}/distance""#), &["of a Monitor"]);
        let watch = format!(r#"links."/plain/input"="{from}""#);
        let configuration = read(&[&watch]);
        let found = links(LinkedConfiguration::new(&configuration, &catalogue(), &|_| false).configuration());
        let line = format!("{} <- /r3/front/percept inferred", &from[1..]);
        assert!(found.contains(&line), "no `{line}` in {found:?}");
    }
}

#[test]
fn monitor_reads_sensors_and_knowledge() {
    allowed(r#"links."/r2/front/range"="/r2/knowledge/rule""#);
    for from in ["/r2/compare/change", "/r3/front/percept", "/r2/planner/goal"] {
        refused(
            &format!(r#"links."/r2/front/range"="{from}""#),
            &["a Monitor reads Sensors and Knowledge: `/r2/front/range`", "let Knowledge have it"],
        );
    }
}

#[test]
fn analyze_reads_monitors_and_another_one_by_a_fact() {
    allowed(r#"links."/r2/compare/other"="/r2/listen/percept""#);
    allowed(r#"links."/r2/compare/other"="/r2/knowledge/rule""#);
    let rule = "an Analyze reads Monitors and Knowledge";
    refused(r#"links."/r2/compare/other"="/r2/way/change""#, &[rule, "make it a fact of Knowledge"]);
    refused(r#"links."/r2/compare/other"="/r2/sonar/value""#, &[rule, "give it a Monitor"]);
    refused(r#"links."/r2/compare/other"="/simulator/near""#, &[rule, "give it a Sensor and a Monitor"]);
    refused(r#"links."/r2/compare/range"="/simulator/near""#, &["an Analyze reads Monitors"]);
    let fact = [
        r#"links."/r2/knowledge/fact"="/r2/way/change""#,
        r#"links."/r2/compare/other"="/r2/knowledge/fact""#,
    ];
    let (configuration, catalogue) = (read(&fact), catalogue());
    let linked = LinkedConfiguration::new(&configuration, &catalogue, &|_| false);
    let survey = linked.check(&catalogue).unwrap();
    // It reads the origin itself, in the cycle in which that is written.
    let path =
        |resolved: &slate_composition::ResolvedLink<'_>| survey.path(linked.configuration(), resolved.target);
    let read = survey
        .links
        .iter()
        .find(|resolved| survey.end_path(resolved.port.0, resolved.port.1) == "r2/compare/other");
    assert_eq!(path(read.unwrap()), "r2/way/change");
    let place = |name: &str| {
        let levels = survey.order.iter().flatten();
        levels
            .enumerate()
            .find(|(_, level)| level.iter().any(|module| survey.modules[*module].module.name.value == name))
    };
    assert!(place("r2/way").unwrap().0 < place("r2/compare").unwrap().0);
}

#[test]
fn fact_with_a_bad_origin_is_refused_at_knowledge() {
    refused(r#"links."/r2/knowledge/fact"="/simulator/truth""#, &["only ports of referees"]);
    for from in ["/r2/compare/change", "/r2/front/percept", "/r2/sonar/value", "/r2/planner/goal"] {
        allowed(&format!(r#"links."/r2/knowledge/learn"="{from}""#));
    }
}

#[test]
fn a_fact_is_no_way_for_measurements_to_a_plan() {
    let says = ["Knowledge learns from", "`/r2/knowledge/fact", "a Plan reads facts"];
    for from in ["/r2/sonar/value", "/r2/front/percept"] {
        refused(&format!(r#"links."/r2/knowledge/fact"="{from}""#), &says);
        refused(&format!(r#"links."/r2/knowledge/fact/distance"="{from}/distance""#), &says);
    }
    for from in ["/r2/compare/change", "/r2/planner/goal", "/r3/knowledge/goal"] {
        allowed(&format!(r#"links."/r2/knowledge/fact"="{from}""#));
    }
}

#[test]
fn reflex_reads_sensors_and_knowledge() {
    allowed(r#"links."/r2/avoid/range"="/r2/knowledge/rule""#);
    for from in ["/r2/planner/goal", "/r2/compare/change", "/r2/front/percept"] {
        let rule =
            "a ReactiveModel reads Sensors, and of Knowledge its rules and RobotModel: `/r2/avoid/range`";
        refused(&format!(r#"links."/r2/avoid/range"="{from}""#), &[rule, "a reflex maps measurements"]);
    }
}

#[test]
fn reflex_knows_no_goal_and_no_map() {
    let says = ["`/r2/avoid/range", "can't read `/r2/", "of Knowledge", "a reflex knows no goal and no map"];
    for from in ["/r2/knowledge/goal", "/r2/knowledge/fact", "/r3/knowledge/goal"] {
        refused(&format!(r#"links."/r2/avoid/range"="{from}""#), &says[..1]);
        refused(&format!(r#"links."/r2/avoid/range/distance"="{from}/distance""#), &says[..1]);
    }
    // A fact is one wherever its link leads.
    for origin in ["/r2/compare/change", "/r2/knowledge/rule"] {
        let fact = [
            format!(r#"links."/r2/knowledge/fact"="{origin}""#),
            r#"links."/r2/avoid/range"="/r2/knowledge/fact""#.to_owned(),
        ];
        refused_scene(&fact.each_ref().map(String::as_str), &says);
    }
    let hop = [r#"links."/plain/input"="/r2/knowledge/goal""#, r#"links."/r2/avoid/range"="/plain/input""#];
    refused_scene(&hop, &says[..1]);
    // Other blocks read them.
    for to in ["compare/other", "planner/aim", "front/range"] {
        allowed(&format!(r#"links."/r2/{to}"="/r2/knowledge/goal""#));
    }
    // Also of the Knowledge in another agent.
    assert!(from_other("/r3/avoid/range", "knowledge").is_some_and(|mismatch| mismatch.contains("no goal")));
    assert_eq!(from_other("/r3/avoid/range", "rule"), None);
}

#[test]
fn truth_is_for_referees() {
    allowed(r#"links."/judge/truth"="/simulator/truth""#);
    for to in ["/plain/input", "/r2/sonar/near", "/r2/front/range", "/r2/planner/aim", "/r2/avoid/range"] {
        let parts = ["only ports of referees read ground truth", "`/simulator/truth`", "Sensors"];
        refused(&format!(r#"links."{to}"="/simulator/truth""#), &parts);
        refused(&format!(r#"links."{to}/distance"="/simulator/truth/distance""#), &parts);
    }
    // Also through the port of a referee.
    let both = [r#"links."/judge/truth"="/simulator/truth""#, r#"links."/plain/input"="/judge/truth""#];
    assert!(check(&both, &catalogue()).unwrap_err().contains("only ports of referees"));
}

#[test]
fn execute_alone_reaches_actuators() {
    allowed(r#"links."/simulator/wheels"="/r2/wheels/command""#);
    allowed(r#"links."/simulator/wheels"="/r2/motors/moved""#);
    let only = "only Execute reaches actuators";
    refused(r#"links."/simulator/wheels"="/r2/planner/twist""#, &[only, "to its gate"]);
    let commands = r#"robots.r2.actuators.wheels.command="/plain/wheels""#;
    refused(commands, &["Execute alone commands", "`/plain/wheels`", "`r2/wheels`"]);
    let guest = r#"robots.r2.actuators.wheels.modules=["/plain"]"#;
    refused(guest, &["Execute alone commands", "`/plain` can't command `r2/wheels`"]);
    refused(
        r#"links."/plain/hear"="/r2/planner/call""#,
        &["only Execute sends to other agents and to modules"],
    );
    refused(
        r#"links."slate://other/x/hear"="/r2/planner/call""#,
        &["only Execute sends to other agents", "let an action send it"],
    );
    refused(
        r#"links."/r2/motors/command"="/r2/planner/twist""#,
        &["an Actuator reads the command that passed the gate", "link it to a gate"],
    );
    let inferred = links(LinkedConfiguration::new(&read(&[]), &catalogue(), &|_| false).configuration());
    assert!(
        inferred.contains(&"r2/motors/command <- /r2/wheels/command inferred".to_owned()),
        "{inferred:?}"
    );
}

#[test]
fn an_actuator_with_a_guarded_driver_is_not_warned_of() {
    let sets =
        [r#"links."/simulator/wheels"="/r2/motors/moved""#, r#"links."/plain/input"="/r2/motors/felt""#];
    let (configuration, catalogue) = (read(&sets), catalogue());
    let linked = LinkedConfiguration::new(&configuration, &catalogue, &|_| false);
    let survey = linked.check(&catalogue).unwrap();
    let found = unlinked_warnings(linked.configuration(), &survey);
    assert!(found.iter().all(|one| !one.message().contains("actuation")), "{found:?}");
}

#[test]
fn nothing_against_the_rules_is_inferred() {
    let free = [
        r#"links."/r2/knowledge/fact"="/r2/way/change""#,
        "robots.r2.links.\"compare/other\"=\"knowledge/fact\"",
    ];
    let configuration = read(&free);
    let found = links(LinkedConfiguration::new(&configuration, &catalogue(), &|_| false).configuration());
    let inferred: Vec<_> =
        found.iter().filter(|line| line.ends_with(" inferred")).map(String::as_str).collect();
    let expected = [
        "r2/execute/plan <- /r2/planner/plan inferred",
        "r2/execute/reflexes <- /r2/avoid/reflex inferred",
        "r2/motors/command <- /r2/wheels/command inferred",
        "r2/motors/gate <- /r2/wheels/gate inferred",
        "r2/planner/situation <- /r2/execute/status inferred",
        "r3/compare/range <- /r3/front/percept inferred",
        "r3/execute/reflexes <- /r3/avoid/reflex inferred",
        "r3/way/range <- /r3/front/percept inferred",
    ];
    assert_eq!(inferred, expected);
}

/// A link to another agent, whose property is written by such a part.
fn from_other(to: &str, part: &str) -> Option<String> {
    mismatch(to, part, <Near as Interface>::DESCRIPTOR)
}

/// An Actuator that takes its command from there.
fn commanded_by_other(part: &str) -> Option<String> {
    mismatch("/r2/motors/command", part, <Twist2 as Interface>::DESCRIPTOR)
}

fn mismatch(to: &str, part: &str, descriptor: &'static Descriptor) -> Option<String> {
    let link = format!(r#"links."{to}"="slate://other/x/value""#);
    let mut catalogue = catalogue();
    let found = RemoteProperty { path: "x/value".into(), descriptor, part: part.into(), epoch: 1 };
    catalogue.remote.insert(RemotePath { agent: "other".into(), path: "x/value".into() }, found);
    let configuration = read(&[&link]);
    let linked = LinkedConfiguration::new(&configuration, &catalogue, &|_| false);
    let survey = linked.check(&catalogue).unwrap();
    survey.mismatches.values().next().map(|mismatch| format!("{} ({})", mismatch.message, mismatch.help))
}

#[test]
fn links_to_other_agents_wait_when_they_are_against_the_rules() {
    for to in ["/r2/planner/aim", "/r2/planner/past"] {
        assert_eq!(from_other(to, "analyze"), None);
        assert_eq!(from_other(to, "knowledge"), None);
        for part in ["", "sensor", "monitor", "truth"] {
            let mismatch = from_other(to, part).unwrap_or_else(|| panic!("{to} should not read {part}"));
            let rule = if part == "truth" { "only ports of referees" } else { PLAN };
            assert!(mismatch.contains(rule) && mismatch.contains("slate://other/x/value"), "{mismatch}");
        }
    }
    assert_eq!(from_other("/judge/truth", "truth"), None);
    assert!(from_other("/plain/input", "truth").unwrap().contains("only ports of referees"));
    assert_eq!(from_other("/plain/input", "monitor"), None);
}

/// The scene with more in it; the complaint has all those parts.
#[track_caller]
fn refused_scene(sets: &[&str], parts: &[&str]) {
    let complaint = check(sets, &catalogue()).err().unwrap_or_else(|| panic!("{sets:?} should be refused"));
    for part in parts {
        assert!(complaint.contains(part), "no `{part}` for {sets:?} in\n{complaint}");
    }
}

#[test]
fn execute_takes_the_actions_of_one_plan() {
    // Of no robot, and so one that no other rule speaks of.
    let both = [
        r#"modules.pilot.kind="rover""#,
        r#"links."/pilot/past"=false"#,
        r#"links."/r2/execute/plan"=["/r2/planner/plan","/pilot/plan"]"#,
    ];
    let says = [
        "a robot has one Plan",
        "`/r2/execute/plan` can't take the actions of both `/pilot/plan` and `/r2/planner/plan`",
        "remove one of the two senders",
    ];
    refused_scene(&both, &says);
    let one = [both[0], both[1], r#"links."/r2/execute/plan"=["/pilot/plan",false]"#];
    check(&one, &catalogue()).unwrap();
}

#[test]
fn blocks_act_through_the_execute_of_their_own_robot() {
    let reflex = [
        r#"robots.r3.modules.avoid.kind="avoid""#,
        r#"links."/r3/avoid/range"="/r2/sonar/value""#,
        r#"links."/r2/execute/reflexes"=["/r3/avoid/reflex"]"#,
    ];
    let says = [
        "a ReactiveModel acts through the Execute of its own robot",
        "`/r3/avoid/reflex` of robot `r3` can't send to `/r2/execute/reflexes` of robot `r2`",
        "send to the Execute of `r3`",
    ];
    refused_scene(&reflex, &says);
    let plan = [
        r#"robots.r3.modules.scout.kind="rover""#,
        r#"links."/r2/execute/plan"=["/r3/scout/plan"]"#,
        r#"links."/r2/planner/plan"=false"#,
    ];
    refused_scene(&plan, &["a Plan acts through the Execute of its own robot", "`/r3/scout/plan`"]);
    // Also in another agent.
    let other = [r#"links."slate://other/r3/execute/reflexes"="/r2/avoid/reflex""#];
    refused_scene(
        &other,
        &["a ReactiveModel acts through", "slate://other/r3/execute/reflexes` of robot `r3`"],
    );
    check(&[r#"links."slate://other/r2/execute/reflexes"="/r2/avoid/reflex""#], &catalogue()).unwrap();
    let command = r#"robots.r3.actuators.legs.command="/r2/execute/wheels""#;
    refused_scene(
        &[reflex[0], reflex[1], command],
        &["its own Execute alone commands a robot with blocks", "`/r2/execute/wheels`", "`r3/legs`"],
    );
}

#[test]
fn execute_takes_plans_of_a_plan_and_reflexes_of_reflexes() {
    let tool = r#"modules.tool.kind="plain_caller""#;
    for (inbox, outbox, only) in [
        ("reflexes", "reflex", "a ReactiveModel alone sends Reflex to `slate://other/r2/execute/reflexes`"),
        ("plan", "planned", "a Plan alone sends Planned to `slate://other/r2/execute/plan`"),
    ] {
        let own = format!(r#"links."/r2/execute/{inbox}"=["/tool/{outbox}"]"#);
        refused_scene(&[tool, &own], &["is plain but `/r2/execute/", "is an Execute's inbox"]);
        let abroad = format!(r#"links."slate://other/r2/execute/{inbox}"="/tool/{outbox}""#);
        refused_scene(&[tool, &abroad], &[only, "`/tool/", "can't"]);
    }
}

#[test]
fn a_block_reads_blocks_of_its_own_robot() {
    let rule = "a block reads blocks of its own robot: `/r3/";
    for (to, from, of) in [
        ("front/range", "sonar/value", "of a Sensor"),
        ("front/range", "knowledge/rule", "of Knowledge"),
        ("avoid/range", "sonar/value", "of a Sensor"),
        ("avoid/range", "knowledge/rule", "of Knowledge"),
        ("way/range", "front/percept", "of a Monitor"),
        ("compare/other", "knowledge/fact", "of Knowledge"),
        ("knowledge/learn", "sonar/value", "of a Sensor"),
        ("knowledge/fact", "way/change", "of an Analyze"),
    ] {
        let wants = [rule, &format!("can't read `/r2/{from}`, {of} of robot `r2`"), "`r3`"];
        refused(&format!(r#"links."/r3/{to}"="/r2/{from}""#), &wants);
        refused(&format!(r#"links."/r3/{to}/distance"="/r2/{from}/distance""#), &[rule]);
        refused(&format!(r#"links."/r3/{to}"={{from="/r2/{from}",previous=true}}"#), &[rule]);
    }
    // Also through the input of a block, and of a plain module.
    refused(r#"links."/r3/front/range"="/r2/avoid/range""#, &[rule, "of a Sensor of robot `r2`"]);
    let hop = [r#"links."/plain/input"="/r2/sonar/value""#, r#"links."/r3/front/range"="/plain/input""#];
    refused_scene(&hop, &[rule, "give `r3` a Sensor that reads it"]);
    refused(
        r#"links."/r3/avoid/range"="/r2/knowledge/rule""#,
        &["link a port of the Knowledge of `r3` to it"],
    );
    let told = ["`/r2/planner/call` of robot `r2` can't send to `/r3/knowledge/heard` of robot `r3`"];
    refused(r#"links."/r3/knowledge/heard"="/r2/planner/call""#, &told);
    allowed(r#"links."/r2/knowledge/heard"="/r2/planner/call""#);
}

#[test]
fn robots_know_each_other_by_sensors_and_knowledge() {
    for from in ["sonar/value", "front/percept", "compare/change", "knowledge/rule", "planner/goal"] {
        allowed(&format!(r#"links."/r3/sonar/near"="/r2/{from}""#));
    }
    let knowledge = [
        r#"links."/r3/knowledge/fact"="/r2/knowledge/rule""#,
        r#"links."/r3/knowledge/learn"="/r2/knowledge/fact""#,
        r#"links."/r3/compare/other"="/r3/knowledge/fact""#,
    ];
    check(&knowledge, &catalogue()).unwrap();
    // A module of no robot, and one of a robot that is divided among agents.
    let plain = [r#"modules.watch.kind="front""#, r#"links."/watch/range"="/r2/sonar/value""#];
    check(&plain, &catalogue()).unwrap();
    assert_eq!(from_other("/r3/avoid/range", "sensor"), None);
    assert_eq!(from_other("/r3/compare/other", "knowledge"), None);
}

#[test]
fn sensor_reads_devices_and_no_block_of_its_own_robot() {
    for from in ["/simulator/near", "/plain/output", "/r2/motors/felt", "/r3/front/percept"] {
        allowed(&format!(r#"links."/r2/sonar/near"="{from}""#));
    }
    let second = [
        r#"robots.r2.modules.filter.kind="distance""#,
        r#"links."/r2/filter/near"="/r2/sonar/value""#,
        r#"links."/r2/front/range"="/r2/filter/value""#,
        r#"links."/r2/avoid/range"="/r2/sonar/value""#,
    ];
    check(&second, &catalogue()).unwrap();
    let rule = "a Sensor reads devices, other Sensors and what Actuators report: `/r2/sonar/near` can't read";
    for (from, of) in [
        ("/r2/planner/goal", "of a Plan"),
        ("/r2/knowledge/rule", "of Knowledge"),
        ("/r2/knowledge/fact", "of Knowledge"),
        ("/r2/front/percept", "of a Monitor"),
        ("/r2/compare/change", "of an Analyze"),
    ] {
        let parts = [rule, &format!("`{from}`, {of}"), "link it to a driver, a simulator"];
        refused(&format!(r#"links."/r2/sonar/near"="{from}""#), &parts);
        refused(&format!(r#"links."/r2/sonar/near/distance"="{from}/distance""#), &[of]);
    }
    // Also by messages, and through the input of a module that hides it.
    refused(r#"links."/r2/sonar/more"="/r2/planner/call""#, &["a Sensor reads devices", "can't send to"]);
    let hop = [r#"links."/plain/input"="/r2/planner/goal""#, r#"links."/r2/sonar/near"="/plain/input""#];
    refused_scene(&hop, &[rule, "of a Plan"]);
}

#[test]
fn output_of_referee_is_ground_truth() {
    for to in ["/plain/input", "/r2/sonar/near", "/r2/front/range", "/r2/planner/aim", "/r2/knowledge/fact"] {
        let parts =
            ["only ports of referees read ground truth", "`/judge/opinion`, which a referee makes of it"];
        refused(&format!(r#"links."{to}"="/judge/opinion""#), &parts);
    }
    refused(r#"links."/r2/sonar/more"="/judge/tell""#, &["`/judge/tell`, of a referee", "can't send to"]);
    let second = [r#"modules.second.kind="judge""#, r#"links."/second/other"="/judge/opinion""#];
    check(&second, &catalogue()).unwrap();
    assert!(from_other("/plain/input", "truth").is_some());
}

#[test]
fn a_command_comes_from_a_gate_alone() {
    let says = ["an Actuator reads the command that passed the gate", "link it to a gate"];
    // Knowledge is for all blocks, and what a person sets is for most ports; a command is neither.
    refused(r#"links."/r2/motors/command"="/r2/knowledge/advice""#, &says);
    refused(r#"links."/r2/motors/command"="/plain/speed""#, &says);
    allowed(r#"links."/r2/motors/command"="/r2/wheels/command""#);
}

#[test]
fn a_sensed_port_reads_a_sensor_alone() {
    allowed(r#"links."/r2/listen/near"="/r3/sonar/value""#.replace("r3", "r2").as_str());
    let says = ["a Monitor reads Sensors and Knowledge: `/r2/listen/near`", "make it an `Input`"];
    refused(r#"links."/r2/listen/near"="/r2/knowledge/rule""#, &says);
    refused(r#"links."/r2/listen/near"="/plain/input""#, &says);
    refused(r#"links."/r2/listen/near"="/simulator/near""#, &["give it a Sensor"]);
}

#[test]
fn percept_that_is_handed_on_is_that_of_its_monitor() {
    let pass = r#"robots.r2.modules.pass.kind="pass""#;
    let observes = [pass, r#"links."/r2/compare/range"="/r2/pass/percept""#];
    let (configuration, catalogue) = (read(&observes), catalogue());
    let linked = LinkedConfiguration::new(&configuration, &catalogue, &|_| false);
    let survey = linked.check(&catalogue).unwrap();
    // The Analyze reads the Sensor's value.
    let path =
        |resolved: &slate_composition::ResolvedLink<'_>| survey.path(linked.configuration(), resolved.target);
    for (to, from) in [("r2/pass/percept", "r2/sonar/value"), ("r2/compare/range", "r2/sonar/value")] {
        let found =
            survey.links.iter().find(|resolved| survey.end_path(resolved.port.0, resolved.port.1) == to);
        assert_eq!(path(found.unwrap()), from, "{to}");
    }
    for (link, says) in [
        (r#"links."/r2/planner/aim"="/r2/pass/percept""#, "`/r2/pass/percept`, of a Monitor"),
        (r#"links."/r2/avoid/range"="/r2/pass/percept""#, "`/r2/pass/percept`, of a Monitor"),
        (r#"links."/r2/avoid/range/distance"="/r2/pass/percept/distance""#, "of a Monitor"),
        (r#"links."/r3/compare/range"="/r2/pass/percept""#, "a block reads blocks of its own robot"),
        (r#"links."/r2/compare/range"="/r2/sonar/value""#, "only Monitor -> Analyze -> Plan"),
        (r#"links."/r2/pass/percept"="/simulator/near""#, "give it a Sensor"),
        (r#"links."/r2/pass/percept"="/r2/knowledge/rule""#, "link it to a Sensor"),
        (r#"links."/r2/pass/percept"="/r2/front/percept""#, "a Monitor reads Sensors and Knowledge"),
    ] {
        refused_scene(&[pass, link], &[says]);
    }
}

#[test]
fn roles_of_ports_bind_links_to_other_agents() {
    assert_eq!(from_other("/r2/listen/near", "sensor"), None);
    for part in ["", "knowledge", "gate"] {
        let mismatch = from_other("/r2/listen/near", part).unwrap_or_else(|| panic!("{part} is no Sensor"));
        assert!(mismatch.contains("a Monitor reads Sensors and Knowledge"), "{mismatch}");
    }
    assert_eq!(commanded_by_other("gate"), None);
    for part in ["", "knowledge", "execute", "sensor"] {
        let mismatch = commanded_by_other(part).unwrap_or_else(|| panic!("{part} is not a gate"));
        assert!(mismatch.contains("an Actuator reads the command that passed the gate"), "{mismatch}");
    }
}
