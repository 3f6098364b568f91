//! Which of two settings counts.

use super::*;

#[test]
fn settings_of_the_command_line_are_toml_or_bare_words() {
    let value = |set: &str| {
        let configuration = with_sets("", &[set]).unwrap();
        interface::Value::from(configuration.table("world").unwrap()).to_string()
    };
    assert_eq!(value("world.layout=authors"), r#"{ layout = "authors" }"#);
    assert_eq!(value("world.layout=\"authors\""), r#"{ layout = "authors" }"#);
    assert_eq!(value(" world . layout =  two words "), r#"{ layout = "two words" }"#);
    assert_eq!(value("world.size=3"), "{ size = 3 }");
    assert_eq!(value("world.size=-2.5"), "{ size = -2.5 }");
    assert_eq!(value("world.walls=false"), "{ walls = false }");
    assert_eq!(value("world.box={ x = 1, at = [1, 2] }"), "{ box = { at = [1, 2], x = 1 } }");
    assert_eq!(value("world.day=2026-01-01"), r#"{ day = "2026-01-01" }"#);
    assert_eq!(value("world.empty=\"\""), r#"{ empty = "" }"#);
}

#[test]
fn each_layer_overrides_the_earlier_ones_setting_by_setting() {
    let folder = Folder::new(
        "layers",
        &[
            ("common/base.toml", "[loop]\nperiod = \"1ms\"\nhang = \"1s\"\n[modules.a]\nkind = \"base\"\n"),
            ("common/all.toml", "include = [\"base.toml\"]\n[modules.a]\nparams = { x = 1, y = 1, z = 1 }\n"),
            (
                "exp1.toml",
                "include = [\"common/all.toml\"]\n[loop]\nperiod = \"2ms\"\n[modules.a.params]\ny = 2\nz = 2\nw = 2\n",
            ),
            ("host.toml", "[modules.a]\nparams.z = 3\nparams.w = 3\n"),
        ],
    );
    let options = Options {
        sets: vec!["modules.a.params.w=4".into(), "modules.a.params.w=5".into()],
        host: Some(folder.path("host.toml")),
        ..Options::default()
    };
    let configuration = Configuration::load(folder.path("exp1.toml"), &options).unwrap();
    assert_eq!(configuration.agent_name(), "exp1");
    assert_eq!((configuration.period().value, configuration.hang().value), (2_000_000, 1_000_000_000));
    let params = interface::Value::from(&configuration.modules()[0].params).to_string();
    assert_eq!(params, "{ w = 5, x = 1, y = 2, z = 3 }");

    let origin = |path: &str| folder.plain(configuration.origin(path).unwrap());
    assert_eq!(origin("log.level"), "built-in defaults");
    assert_eq!(origin("loop.hang"), "common/base.toml:3");
    assert_eq!(origin("modules.a.params.x"), "common/all.toml:3");
    assert_eq!(origin("modules.a.params.y"), "exp1.toml:5");
    assert_eq!(origin("modules.a.params.z"), "host.toml:2");
    assert_eq!(origin("modules.a.params.w"), "--set modules.a.params.w=5");
    assert_eq!(configuration.origin("modules.a.params.v"), None);
    assert_eq!(configuration.origin("not a path"), None);
}

#[test]
fn a_setting_of_a_robot_can_be_named_either_way_in_any_layer() {
    let text = "[modules.\"r2/a\"]\nparams = { x = 1, y = 1 }\n[links]\n\"r2/a/pose\" = \"b/pose\"\n";
    let sets = [
        "robots.r2.modules.a.params.x=2",
        "modules.\"r2/a\".params.y=3",
        "robots.r2.links.\"a/pose\"=\"c/pose\"",
    ];
    let configuration = with_sets(text, &sets).unwrap();
    let [module] = configuration.modules() else { panic!() };
    assert_eq!(interface::Value::from(&module.params).to_string(), "{ x = 2, y = 3 }");
    assert_eq!(configuration.links()[0].from.to_string(), "/r2/c/pose");
    for path in ["robots.r2.modules.a.params.x", "modules.\"r2/a\".params.x"] {
        assert_eq!(configuration.value(path).unwrap().as_integer(), Some(2));
    }
    for path in ["robots.r2.links.\"a/pose\"", "links.\"r2/a/pose\"", "links.\"/r2/a/pose\""] {
        assert_eq!(configuration.origin(path).unwrap().kind, SourceKind::Set);
    }
}

#[test]
fn of_settings_that_exclude_each_other_the_later_layer_wins() {
    let text = "[modules.a]\nevery = \"1ms\"\ninputs.x = 1\ninputs.y = 1\n[links]\n\"a/z\" = \"b/z\"\n";
    let sets = ["modules.a.on=scans", "links.\"a/x\"=\"b/x\"", "modules.a.inputs.z=2"];
    let configuration = with_sets(text, &sets).unwrap();
    let [module] = configuration.modules() else { panic!() };
    assert_eq!(
        module.trigger.as_ref().unwrap().value,
        Trigger::On { ports: vec!["scans".into()], timeout: None }
    );
    assert_eq!(interface::Value::from(&module.inputs).to_string(), "{ y = 1, z = 2 }");
    let links: Vec<_> = configuration.links().iter().map(|link| link.to.as_str()).collect();
    assert_eq!(links, ["a/x"]);

    assert_eq!(
        error("[modules.a]\nevery = \"1ms\"\non = \"x\"\n"),
        "exp1.toml:3:1: `every` and `on` exclude each other (keep one of the two)"
    );
    assert_eq!(
        error("[modules.a]\ninputs.x = 1\n[links]\n\"a/x\" = \"b/x\"\n"),
        "exp1.toml:2:8: input `a/x` has both a link and a value \
         (remove the value or the link; the link is at exp1.toml:4)"
    );
}

#[test]
fn senders_of_several_layers_unite_and_false_removes_one() {
    let folder = Folder::new(
        "senders",
        &[
            (
                "base.toml",
                "[robots.r2.links]\n\"execute/reflexes\" = \"a/reflex\"\n\"execute/plan\" = \"planner/plan\"\n",
            ),
            (
                "top.toml",
                "include = [\"base.toml\"]\n[robots.r2.links]\n\
                 \"execute/reflexes\" = [\"b/reflex\", { from = \"/r2/c/reflex\", previous = true }]\n",
            ),
        ],
    );
    let senders = |sets: &[&str]| -> Vec<(String, bool)> {
        let options = Options { sets: sets.iter().map(|set| (*set).into()).collect(), ..Options::default() };
        let configuration = Configuration::load(folder.path("top.toml"), &options).unwrap();
        let own = configuration.links().iter().filter(|link| link.to.value == "r2/execute/reflexes");
        own.map(|link| (link.from.value.to_string(), link.previous)).collect()
    };
    let all = [("/r2/a/reflex", false), ("/r2/b/reflex", false), ("/r2/c/reflex", true)];
    assert_eq!(senders(&[]), all.map(|(from, previous)| (from.to_owned(), previous)));
    let one = "robots.r2.links.\"execute/reflexes\".\"b/reflex\"=false";
    assert_eq!(senders(&[one]).len(), 2);
    assert_eq!(senders(&["links.\"r2/execute/reflexes\"=false"]), []);
    let text = "robots.r2.links.\"execute/reflexes\"=\"d/reflex\"";
    assert_eq!(senders(&[text]), [("/r2/d/reflex".to_owned(), false)]);
}

#[test]
fn commands_of_several_layers_unite_and_false_removes_one() {
    let folder = Folder::new(
        "commands",
        &[
            (
                "base.toml",
                "[robots.r2.actuators]\nwheels = { command = \"execute/wheels\" }\narm.commands = [\"a/arm\"]\n",
            ),
            (
                "middle.toml",
                "include = [\"base.toml\"]\n[robots.r2.actuators]\nwheels.commands = [\"joystick/wheels\", \"auto/wheels\"]\n",
            ),
            (
                "top.toml",
                "include = [\"middle.toml\"]\n[robots.r2.actuators.arm]\ncommands = [\"b/arm\", \"a/arm\"]\n",
            ),
        ],
    );
    let commands = |actuator: &str, sets: &[&str]| -> Vec<String> {
        let options = Options { sets: sets.iter().map(|set| (*set).into()).collect(), ..Options::default() };
        let configuration = Configuration::load(folder.path("top.toml"), &options).unwrap();
        let own = configuration.actuators().iter().find(|own| own.name.value == actuator).unwrap();
        own.commands.iter().map(|url| url.to_string()).collect()
    };
    let all = ["/r2/execute/wheels", "/r2/joystick/wheels", "/r2/auto/wheels"];
    assert_eq!(commands("r2/wheels", &[]), all);
    assert_eq!(commands("r2/arm", &[]), ["/r2/b/arm", "/r2/a/arm"]);
    for one in [
        "robots.r2.actuators.wheels.commands.\"joystick/wheels\"=false",
        "actuators.\"r2/wheels\".commands={ \"/r2/joystick/wheels\" = false }",
    ] {
        assert_eq!(commands("r2/wheels", &[one]), [all[0], all[2]]);
    }
    let more = "robots.r2.actuators.wheels.commands=[\"pad/wheels\"]";
    assert_eq!(commands("r2/wheels", &[more]), [&all[..], &["/r2/pad/wheels"]].concat());
    // A single one takes the place of all.
    assert_eq!(
        commands("r2/wheels", &["robots.r2.actuators.wheels.command=\"pad/wheels\""]),
        ["/r2/pad/wheels"]
    );
}
