//! Links to and from programs that are not agents.

use slate_composition::{LinkedConfiguration, unlinked_warnings};

use super::scene::{allowed, catalogue, check, read, refused};

#[test]
fn inputs_follow_programs_by_name_port_and_field() {
    for link in [
        r#"links."/plain/input"="ros2:/near""#,
        r#"links."/plain/input/distance"={from="zenoh:demo/near",rate="10Hz"}"#,
        r#"links."/plain/speed"="zenoh:demo/speed""#,
    ] {
        allowed(link);
    }
    for (link, words) in [
        (r#"links."/plane/input"="ros2:/near""#, ["no module owns `plane/input`", "plain"]),
        (r#"links."/plain/inputs"="ros2:/near""#, ["`plain` has no input `inputs`", "input"]),
        (r#"links."/plain/input/far"="ros2:/near""#, ["has no field `far`", "distance"]),
        (
            r#"links."/plain/output"="ros2:/near""#,
            ["is an output", r#"write "ros2:/near" = "/plain/output""#],
        ),
        (r#"links."/plain/params/gain"="ros2:/near""#, ["`plain/params/gain` can't follow", "link an input"]),
        (r#"links."/plain/enabled"="ros2:/near""#, ["`plain/enabled` can't follow", "link an input"]),
        (r#"links."/plain/hear"="ros2:/near""#, ["is not an input with values", "link an input"]),
    ] {
        refused(link, &words);
    }
}

#[test]
fn an_input_has_one_source_whichever_bridge_brings_it() {
    let whole = r#"links."/plain/input"="ros2:/near""#;
    let own = r#"links."/plain/input/distance"="/simulator/near/distance""#;
    let complaint = check(&[whole, own], &catalogue()).unwrap_err();
    assert!(complaint.contains("`plain/input` is linked already, by `plain/input/distance`"), "{complaint}");
    let field = r#"links."/plain/input/distance"="zenoh:demo/near""#;
    let complaint = check(&[whole, field], &catalogue()).unwrap_err();
    assert!(complaint.contains("`plain/input/distance` is linked already, by `plain/input`"), "{complaint}");
    // Fields of their own are no contradiction.
    let speed = [r#"links."/plain/speed/linear"="zenoh:a""#, r#"links."/plain/speed/angular"="ros2:/b""#];
    check(&speed, &catalogue()).unwrap();
}

#[test]
fn a_robot_reads_a_program_through_its_sensor() {
    allowed(r#"links."/r2/sonar/near"="ros2:/near""#);
    refused(
        r#"links."/r2/listen/near"="ros2:/near""#,
        &["a Monitor reads Sensors and Knowledge", "give it a Sensor"],
    );
    refused(r#"links."/r2/planner/aim"="ros2:/near""#, &["a Plan reads Analyzes", "`ros2:/near`"]);
    refused(r#"links."/r2/planner/range"="ros2:/near""#, &["the Plan reads Analyzes", "`ros2:/near`"]);
    // Nor by the input of another module.
    let hop = [r#"links."/plain/input"="ros2:/near""#, r#"links."/r2/planner/aim"="/plain/input""#];
    assert!(check(&hop, &catalogue()).unwrap_err().contains("a Plan reads Analyzes"));
}

#[test]
fn properties_leave_as_wholes_and_commands_through_their_gate() {
    allowed(r#"links."ros2:/near"="/simulator/near""#);
    allowed(r#"links."ros2:/cmd_vel"={from="/r2/wheels/command",depth=1}"#);
    for (link, words) in [
        (r#"links."ros2:/near"="/simulator/nearer""#, "`simulator` has no output `nearer`"),
        (r#"links."ros2:/near"="/simulator/near/distance""#, "receives whole values"),
        (r#"links."ros2:/near"="/plain/hear""#, "receives messages"),
        (r#"links."ros2:/near"="/plain/say""#, "sends messages"),
        (r#"links."ros2:/cmd_vel"="/plain/wheels""#, "a command that has not passed its gate"),
        (r#"links."ros2:/near"="/nothing/near""#, "nothing is called"),
    ] {
        refused(link, &[words]);
    }
}

#[test]
fn ends_outside_of_the_agent_are_no_loose_ends() {
    let warnings = |sets: &[&str]| {
        let configuration = read(sets);
        let linked = LinkedConfiguration::new(&configuration, &catalogue(), &|_| false);
        let survey = linked.check(&catalogue()).unwrap();
        unlinked_warnings(linked.configuration(), &survey)
            .iter()
            .map(|found| found.message().to_owned())
            .collect::<Vec<_>>()
    };
    let has = |warnings: &[String], words: &str| warnings.iter().any(|warning| warning.contains(words));
    assert!(has(&warnings(&[]), "`r2/motors/moved` reaches nothing"), "{:?}", warnings(&[]));
    let sent = warnings(&[r#"links."ros2:/moved"="/r2/motors/moved""#]);
    assert!(!has(&sent, "`r2/motors/moved` reaches nothing"), "{sent:?}");
    let idle = [r#"robots.r2.links."sonar/near"=false"#];
    let read = [r#"robots.r2.links."sonar/near"="ros2:/near""#];
    assert!(!has(&warnings(&read), "r2/sonar/near"), "{:?} {:?}", warnings(&idle), warnings(&read));
}
