//! Links to and from programs that are not agents.

use slate_configuration::ExternalDirection;

use super::*;

fn links(configuration: &Configuration) -> Vec<String> {
    let links = configuration.external_links().iter().map(|link| {
        let ((to, from), options) = (link.ends(), link.option_texts());
        let options: Vec<_> = options.iter().map(|(name, value)| format!(" {name}={value}")).collect();
        format!("{to} <- {from}{}", options.concat())
    });
    links.collect()
}

#[test]
fn links_with_a_scheme_are_read_in_each_form() {
    let text = r#"
[modules.planner]
[links]
"planner/scan" = "ros2:/scan"
"planner/target/x" = { from = "zenoh:demo/x", rate = "10Hz" }
"planner/pose" = "localizer/pose"
"zenoh:demo/speed" = "slate://exp1/planner/speed"
"planner/notes" = ["ros2:notes", "sender/notes"]
[robots.r2.modules.base]
[robots.r2.links]
"base/odometry" = "ros2:odom"
"ros2:/cmd_vel" = { from = "wheels/command", depth = 1 }
[robots.r2.actuators.wheels]
command = "base/wheels"
"#;
    let configuration = read(text).unwrap();
    assert_eq!(
        links(&configuration),
        [
            "planner/notes <- ros2:notes",
            "planner/scan <- ros2:/scan",
            "planner/target/x <- zenoh:demo/x rate=\"10Hz\"",
            "r2/base/odometry <- ros2:odom",
            "ros2:/cmd_vel <- /r2/wheels/command depth=1",
            "zenoh:demo/speed <- /planner/speed",
        ]
    );
    let own: Vec<_> = configuration.links().iter().map(|link| link.to.as_str()).collect();
    assert_eq!(own, ["planner/notes", "planner/pose"]);
    let topics =
        configuration.links_of_scheme("ros2").filter(|link| link.direction == ExternalDirection::Out);
    assert_eq!(topics.map(|link| link.path.value.as_str()).collect::<Vec<_>>(), ["r2/wheels/command"]);
    let settings = configuration.settings("links").unwrap();
    let topic = settings.iter().find(|setting| setting.path == "links.\"planner/scan\"").unwrap();
    assert_eq!(
        (topic.value.as_str(), topic.origin.to_string()),
        (Some("ros2:/scan"), "exp1.toml:4".to_owned())
    );
    assert!(configuration.is_filled("planner/target") && !configuration.is_filled("planner/speed"));
    assert!(configuration.says_of_port("planner/scan") && configuration.is_sent_outside("r2/wheels/command"));
}

#[test]
fn later_layers_replace_and_remove_links_with_a_scheme() {
    let text = "[modules.a]\n[links]\n\"a/in\" = \"ros2:/scan\"\n\"ros2:/out\" = \"a/out\"";
    let of = |sets: &[&str]| links(&with_sets(text, sets).unwrap());
    assert_eq!(of(&[]), ["a/in <- ros2:/scan", "ros2:/out <- /a/out"]);
    assert_eq!(
        of(&["links.'a/in'=\"zenoh:scan\"", "links.'ros2:/out'.from=\"a/other\""]),
        ["a/in <- zenoh:scan", "ros2:/out <- /a/other"]
    );
    assert_eq!(of(&["links.'a/in'=\"b/out\"", "links.'ros2:/out'=false"]), [""; 0]);
    // An input has a link or a value: what the later layer says.
    let valued = with_sets(text, &["modules.a.inputs.in=1"]).unwrap();
    assert_eq!(links(&valued), ["ros2:/out <- /a/out"]);
    let both = error("[modules.a]\ninputs.in = 1\n[links]\n\"a/in\" = \"ros2:/scan\"");
    assert!(both.contains("input `a/in` has both a link and a value"), "{both}");
}

#[test]
fn links_with_a_scheme_and_no_end_here_are_refused() {
    let line = |link: &str| error(&format!("[modules.a]\n[links]\n{link}"));
    for (link, words) in [
        ("\"ros2:/a\" = \"zenoh:b\"", "neither `ros2:/a` nor `zenoh:b` is of this agent"),
        ("\"slate://base/a/in\" = \"ros2:/a\"", "nor `ros2:/a` is of this agent"),
        ("\"ros2:/a\" = \"slate://base/a/out\"", "`slate://base/a/out` is of `base`"),
        ("\"ros2:/a\" = [\"a/out\", \"a/other\"]", "receives the values of one property"),
        ("\"ros2:/a\" = 1", "receives the values of one property"),
        ("\"ros2:/a\" = { depth = 1 }", "receives the values of one property"),
        ("\"ros2:/a\" = \"a\"", "names no property, only a module"),
        ("\"a/in\" = \"ROS:/a\"", "is not a property's URL"),
    ] {
        let text = line(link);
        assert!(text.contains("exp1.toml:3:") && text.contains(words), "{text}");
    }
}

#[test]
fn the_agent_that_has_a_property_carries_it_out() {
    let text = r#"
[modules.laser]
[robots.r2.modules.base]
[links]
"r2/base/goal" = "ros2:/goal"
"ros2:/scan" = "laser/scan"
"ros2:/odom" = { from = "r2/base/odometry" }
[agents.bench]
[agents.rover]
runs = ["r2"]
"#;
    let of = |agent: &str| {
        let options = Options { agent: Some(agent.into()), ..options(&[]) };
        links(&Configuration::from_text("exp1.toml", text, &options).unwrap())
    };
    assert_eq!(of("bench"), ["ros2:/scan <- /laser/scan"]);
    assert_eq!(of("rover"), ["r2/base/goal <- ros2:/goal", "ros2:/odom <- /r2/base/odometry"]);
}
