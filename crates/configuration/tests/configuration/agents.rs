//! Several agents in one file.

use super::*;

const TEAM: &str = r#"# What holds for all.
[loop]
period = "20ms" # slow
hang = "1s"

[share.agents.robot]
at = "local:robot"

[share.agents.watcher]
at = "local:watcher"

[modules.clock]
every = "1ms"

[agents.robot] # in the field
include = "robot.toml"

[agents.robot.modules.clock]
on = "ticks"

[agents.watcher.loop]
period = "50ms"

[agents.watcher.modules.referee]
params.tolerance = 0.1 # meters
"#;

const ROBOT: &str = "[agent]\nname = \"pioneer\"\nseed = 3\n[loop]\nperiod = \"10ms\"\n\
                     [modules.follower]\nparams = { gain = 1.2 } # tried\n[links]\n\"follower/pose\" = \"clock/pose\"\n";

fn team(test: &str) -> Folder {
    Folder::new(test, &[("team.toml", TEAM), ("robot.toml", ROBOT)])
}

fn of(agent: &str, sets: &[&str]) -> Options {
    Options { agent: Some(agent.into()), ..options(sets) }
}

fn load(folder: &Folder, agent: &str, sets: &[&str]) -> Result<Configuration, Report> {
    Configuration::load(folder.path("team.toml"), &of(agent, sets))
}

/// What is wrong with a text, read for the agent `a`.
#[track_caller]
fn wrong(text: &str, sets: &[&str]) -> String {
    Configuration::from_text("team.toml", text, &of("a", sets)).unwrap_err().to_string()
}

#[test]
fn each_agent_has_what_holds_for_all_and_over_it_its_own() {
    let folder = team("agents");
    let names = Configuration::agents(folder.path("team.toml"), &options(&[])).unwrap();
    assert_eq!(names, ["robot", "watcher"]);
    assert!(Configuration::agents(folder.path("robot.toml"), &options(&[])).unwrap().is_empty());

    let robot = load(&folder, "robot", &[]).unwrap();
    // A file that it includes may be that of others too, and so gives it no name.
    assert_eq!((robot.agent_name(), robot.seed().value), ("robot", 3));
    assert_eq!((robot.period().value, robot.hang().value), (10_000_000, 1_000_000_000));
    let names: Vec<_> = robot.modules().iter().map(|module| module.name.as_str()).collect();
    assert_eq!(names, ["clock", "follower"]);
    // Its own goes over what excludes it.
    let on = Trigger::On { ports: vec!["ticks".into()], timeout: None };
    assert_eq!(robot.modules()[0].trigger.as_ref().unwrap().value, on);
    let peers: Vec<_> = robot.share().unwrap().agents.keys().cloned().collect();
    assert_eq!(peers, ["watcher"], "it is no other agent to itself");
    assert_eq!(robot.share().unwrap().listen[0].value, "local:robot");
    assert_eq!(robot.links()[0].from.to_string(), "/clock/pose");
    assert!(robot.table("agents").is_none());

    let watcher = load(&folder, "watcher", &[]).unwrap();
    assert_eq!((watcher.agent_name(), watcher.period().value), ("watcher", 50_000_000));
    assert_eq!(watcher.modules()[0].trigger.as_ref().unwrap().value, Trigger::Every(1_000_000));
    assert_eq!(watcher.share().unwrap().agents.keys().next().unwrap(), "robot");

    for (configuration, path, origin) in [
        (&robot, "loop.period", "robot.toml:5"),
        (&robot, "loop.hang", "team.toml:4"),
        (&robot, "agents.robot.modules.clock.on", "team.toml:19"),
        (&robot, "agent.name", "team.toml:15"),
        (&watcher, "agents.watcher.loop.period", "team.toml:22"),
    ] {
        assert_eq!(folder.plain(configuration.origin(path).unwrap()), origin, "{path}");
    }
    assert_eq!(robot.settings("agents.robot.modules.follower").unwrap().len(), 1);
}

#[test]
fn a_table_may_name_its_agent_otherwise() {
    let text = "[agent]\nname = \"all\"\n[agents.a.agent]\nname = \"first\"\n[agents.b]\n";
    let name = |agent: &str| {
        Configuration::from_text("team.toml", text, &of(agent, &[])).unwrap().agent_name().to_owned()
    };
    assert_eq!((name("a"), name("b")), ("first".into(), "b".into()));
    assert_eq!(
        wrong("[agents.a]\n[agents.b]\nagent.name = \"a\"\n", &[]),
        "team.toml:3:14: two agents are called `a` (an agent is found by its name; leave `agent.name` out, and each \
         is called like its table)"
    );
}

#[test]
fn layers_keep_their_order() {
    let folder = Folder::new(
        "agents-layers",
        &[
            (
                "team.toml",
                "include = \"base.toml\"\n[world]\na = 2\nb = 2\n[agents.robot]\nworld.c = 2\n[agents.other]\n",
            ),
            ("base.toml", "[world]\na = 1\nb = 1\nc = 1\nd = 1\n[agents.robot.world]\nb = 1.5\nd = 1.5\n"),
            (
                "host.toml",
                "[world]\ne = 3\nf = 3\n[agents.robot.world]\nf = 3.5\n[agents.other.world]\ne = 0\n",
            ),
        ],
    );
    let host = Some(folder.path("host.toml"));
    let sets = [
        "agents.robot.world.g=4",
        "world.g=5",
        "world.h=5",
        "agents.robot.world.h=6",
        "agents.other.world.a=0",
    ];
    let options = Options { host, ..of("robot", &sets) };
    let robot = Configuration::load(folder.path("team.toml"), &options).unwrap();
    let world = interface::Value::from(robot.table("world").unwrap()).to_string();
    assert_eq!(world, "{ a = 2, b = 2, c = 2, d = 1.5, e = 3, f = 3.5, g = 5, h = 6 }");
}

#[test]
fn one_of_several_has_to_be_chosen_and_be_there() {
    let folder = team("agents-chosen");
    let none = Configuration::load(folder.path("team.toml"), &options(&[])).unwrap_err();
    assert_eq!(
        folder.plain(none),
        "team.toml:15:9: several agents are described, and none is chosen: `robot`, `watcher` (`slate run` starts them \
         all, `slate run --agent robot` one of them)"
    );
    assert_eq!(
        folder.plain(load(&folder, "watchr", &[]).unwrap_err()),
        "team.toml:15:9: no agent is called `watchr` (did you mean `watcher`?)"
    );
    let alone = |agent| Configuration::load(folder.path("robot.toml"), &of(agent, &[]));
    assert_eq!(alone("pioneer").unwrap().agent_name(), "pioneer");
    let error = alone("robot").unwrap_err().to_string();
    assert_eq!(error, "no agent is called `robot` (the configuration describes one, `pioneer`)");
}

#[test]
fn a_setting_of_the_command_line_is_for_one_or_for_all() {
    let folder = team("agents-sets");
    let sets = [
        "agents.robot.loop.period=5ms",
        "loop.hang=3s",
        "agents.watcher.modules.referee.params.tolerance=0.2",
    ];
    let robot = load(&folder, "robot", &sets).unwrap();
    let watcher = load(&folder, "watcher", &sets).unwrap();
    assert_eq!((robot.period().value, robot.hang().value), (5_000_000, 3_000_000_000));
    assert_eq!((watcher.period().value, watcher.hang().value), (50_000_000, 3_000_000_000));
    assert_eq!(watcher.value("modules.referee.params.tolerance").unwrap().as_f64(), Some(0.2));
    for (set, expected) in [
        ("agents.robt.loop.period=5ms", "--set:1:8: no agent is called `robt` (did you mean `robot`?)"),
        ("agents.robot=5", "--set:1:14: `agents.robot` takes a table"),
        (
            "modules.referee.enabled=false",
            "no module is called `referee` (known: `clock`, `follower`; a setting of one",
        ),
    ] {
        let error = load(&folder, "robot", &[set]).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    assert!(
        set_error("", "agents.robot.loop.period=5ms")
            .contains("no agent is called `robot` (the configuration is")
    );
}

#[test]
fn errors_show_their_line_also_of_other_agents() {
    assert_eq!(
        wrong("[agents.a.modules.x]\nparms = 1\n[agents.b.loop]\nperiods = 1\n[lop]\n", &[]),
        "team.toml:2:1: unknown key `parms` in module `x` (did you mean `params`?)\n\
         team.toml:5:2: unknown key `lop` at the top (did you mean `log`, `loop`?)\n\
         team.toml:4:1: unknown key `periods` in [loop] (did you mean `period`?)"
    );
    assert!(wrong("[agents]\na = {}\nb = 5\n", &[]).contains("team.toml:3:5: `agents.b` takes a table"));
    assert!(wrong("agents = 5\n", &[]).contains("team.toml:1:10: `agents` takes a table"));
    assert!(
        wrong("[agents.a]\n[agents.\"b c\"]\n", &[]).contains("team.toml:2:9: `b c` can't name an agent")
    );

    let folder = Folder::new(
        "agents-mistakes",
        &[
            (
                "team.toml",
                "[agents.a]\ninclude = \"a.toml\"\n[agents.b]\ninclude = [\"b.toml\", \"elsewhere.toml\"]\n",
            ),
            ("a.toml", "[agents.c]\n"),
            ("b.toml", "[lop]\n"),
            ("host.toml", "[agents.aa.loop]\nperiod = \"1ms\"\n"),
        ],
    );
    let load = |agent, host: Option<&str>| {
        let options = Options { host: host.map(|host| folder.path(host)), ..of(agent, &[]) };
        folder.plain(
            Configuration::load(folder.path("team.toml"), &options)
                .map(drop)
                .map_err(|e| e.to_string())
                .err()
                .unwrap_or_default(),
        )
    };
    assert!(load("a", None).contains("a.toml:1:2: `agents` stands in what belongs to one agent"));
    fs::write(folder.path("a.toml"), "").unwrap();
    // Another agent may run where the files are that are not here; its own must be.
    assert_eq!(load("a", None), "");
    assert!(load("b", None).contains("team.toml:4:22: can't read the configuration elsewhere.toml"));
    fs::write(folder.path("elsewhere.toml"), "").unwrap();
    assert!(load("a", None).contains("b.toml:1:2: unknown key `lop`"));
    fs::write(folder.path("b.toml"), "").unwrap();
    assert_eq!(load("a", Some("host.toml")), "host.toml:1:9: no agent is called `aa` (did you mean `a`?)");
}

/// The texts of the files after these changes of an agent and a save.
#[track_caller]
fn saved(folder: &Folder, agent: &str, changes: &[(&str, &str)]) -> (String, String) {
    let open = |agent: &str| Database::open(folder.path("team.toml"), of(agent, &[])).unwrap();
    let values = |database: &Database| -> Vec<String> {
        database.get("").unwrap().iter().map(|s| format!("{}={}", s.path, s.value)).collect()
    };
    let other = if agent == "robot" { "watcher" } else { "robot" };
    let (database, before) = (open(agent), values(&open(other)));
    database.set(changes).unwrap();
    let expected = values(&database);
    database.save(SaveTo::Origin).unwrap();
    assert!(database.diff().is_empty());
    assert_eq!(values(&database), expected);
    assert_eq!(values(&open(agent)), expected);
    assert_eq!(values(&open(other)), before, "the other agent is as it was");
    let text = |name| fs::read_to_string(folder.path(name)).unwrap();
    (text("team.toml"), text("robot.toml"))
}

#[test]
fn a_change_of_one_agent_is_saved_where_it_changes_no_other() {
    let folder = team("agents-save");
    // What stands in its own table, what holds for all, what is new.
    let changes = [
        ("modules.referee.params.tolerance", "0.3"),
        ("loop.hang", "9s"),
        ("agents.watcher.log.level", "debug"),
        ("modules.clock.on", "ticks"),
    ];
    let (team_text, robot_text) = saved(&folder, "watcher", &changes);
    let expected = TEAM
        .replace("period = \"50ms\"\n", "period = \"50ms\"\nhang = \"9s\"\n")
        .replace("tolerance = 0.1", "tolerance = 0.3")
        + "\n[agents.watcher.modules.clock]\non = \"ticks\"\n\n[agents.watcher.log]\nlevel = \"debug\"\n";
    assert_eq!((team_text.as_str(), robot_text.as_str()), (expected.as_str(), ROBOT));

    // A file that it alone includes is its own.
    let (team_text, robot_text) = saved(&folder, "robot", &[("modules.follower.params.gain", "2.0")]);
    assert_eq!((team_text, robot_text), (expected.clone(), ROBOT.replace("1.2", "2.0")));
    // Not if another agent includes it too.
    let both = expected.replace(
        "[agents.watcher.loop]",
        "[agents.watcher]\ninclude = \"robot.toml\"\n\n[agents.watcher.loop]",
    );
    fs::write(folder.path("team.toml"), &both).unwrap();
    let (team_text, _) = saved(&folder, "robot", &[("modules.follower.params.gain", "3.0")]);
    let line = "[agents.robot.modules.clock]\non = \"ticks\"\n";
    let own = "\n[agents.robot.modules.follower.params]\ngain = 3.0\n";
    assert_eq!(team_text, both.replacen(line, &format!("{line}{own}"), 1));
}

#[test]
fn tables_may_be_written_in_any_way() {
    for (test, text, expected) in [
        (
            "agents-inline",
            "agents = { robot = { loop = { hang = \"1s\" } }, other = {} } # both\n[loop]\nperiod = \"20ms\"\n",
            "agents = { robot = { loop = { hang = \"1s\", period = \"5ms\" } }, other = {} } # both\n[loop]\nperiod = \"20ms\"\n",
        ),
        (
            "agents-dotted",
            "agents.robot.log.level = \"warn\" # quiet\nagents.other.log.level = \"info\"\n[loop]\nperiod = \"20ms\"\n",
            "agents.robot.log.level = \"warn\" # quiet\nagents.robot.loop.period = \"5ms\"\nagents.other.log.level = \"info\"\n[loop]\nperiod = \"20ms\"\n",
        ),
        (
            "agents-section",
            "[loop]\nperiod = \"20ms\"\n[agents]\nrobot.log.level = \"warn\"\nother = {} # nothing\n",
            "[loop]\nperiod = \"20ms\"\n[agents]\nrobot.log.level = \"warn\"\nrobot.loop.period = \"5ms\"\nother = {} # nothing\n",
        ),
        (
            "agents-empty",
            "[loop]\nperiod = \"20ms\"\n[agents.robot] # here\n# nothing yet\n[agents.other]\n",
            "[loop]\nperiod = \"20ms\"\n[agents.robot] # here\n\n[agents.robot.loop]\nperiod = \"5ms\"\n# nothing yet\n[agents.other]\n",
        ),
    ] {
        let folder = Folder::new(test, &[("team.toml", text)]);
        let database = Database::open(folder.path("team.toml"), of("robot", &[])).unwrap();
        database.set(&[("loop.period", "5ms")]).unwrap();
        database.save(SaveTo::Origin).unwrap();
        assert_eq!(fs::read_to_string(folder.path("team.toml")).unwrap(), expected);
        let other = Configuration::load(folder.path("team.toml"), &of("other", &[])).unwrap();
        assert_eq!(other.period().value, 20_000_000);
    }
}

#[test]
fn the_file_of_this_computer_gets_a_table_of_the_agent() {
    let folder = team("agents-host");
    fs::write(folder.path("host.toml"), "[loop]\nhang = \"5s\" # slow here\n").unwrap();
    let options = || Options { host: Some(folder.path("host.toml")), ..of("robot", &[]) };
    let database = Database::open(folder.path("team.toml"), options()).unwrap();
    database.set(&[("loop.hang", "6s"), ("modules.follower.params.gain", "4.0")]).unwrap();
    let host = || fs::read_to_string(folder.path("host.toml")).unwrap();
    database.save(SaveTo::Host).unwrap();
    assert_eq!(
        host(),
        "[loop]\nhang = \"5s\" # slow here\n\n[agents.robot.loop]\nhang = \"6s\"\n\n[agents.robot.modules.follower.params]\n\
         gain = 4.0\n"
    );
    // What stands there is changed there, and not below it.
    database.set(&[("loop.hang", "7s")]).unwrap();
    database.save(SaveTo::Origin).unwrap();
    assert!(host().contains("hang = \"7s\"") && host().contains("5s"));
    assert_eq!(fs::read_to_string(folder.path("team.toml")).unwrap(), TEAM);
}

#[test]
fn changes_at_run_time_are_those_of_one_agent() {
    let folder = team("agents-live");
    let database = Database::open(folder.path("team.toml"), of("watcher", &[])).unwrap();
    let error = database.set(&[("agents.robot.loop.period", "5ms")]).unwrap_err().to_string();
    assert!(error.contains("`robot` is another agent (change it there: --agent robot"), "{error}");
    database.set(&[("agents.watcher.loop.period", "5ms")]).unwrap();
    assert_eq!(database.diff()[0].path, "loop.period");
    assert_eq!(database.get("agents.watcher.loop.period").unwrap()[0].value.as_str(), Some("5ms"));
    database.revert("agents.watcher.loop").unwrap().commit().unwrap();
    assert!(database.diff().is_empty());

    // An edit of another agent's table does not concern this one, nor does an error there.
    let edit = |from: &str, to: &str| {
        let text = fs::read_to_string(folder.path("team.toml")).unwrap().replace(from, to);
        fs::write(folder.path("team.toml"), text).unwrap();
        database.reload().unwrap().commit().unwrap()
    };
    assert!(edit("on = \"ticks\"", "onn = \"ticks\"").is_empty());
    assert_eq!(edit("\"50ms\"", "\"40ms\"").len(), 1);
    assert_eq!(database.current().period().value, 40_000_000);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn settings_of_one_agent_are_saved_without_touching_others(
        steps in prop::collection::vec(prop::collection::vec(save::change(), 1..4), 1..6),
    ) {
        let team = save::COMMENTED.to_owned() + "\n[agents.one] # d1\n# d2\n[agents.two] # d3\nloop.hang = \"4s\" # d4\n";
        let folder = Folder::new("agents-any", &[("team.toml", team.as_str()), ("robot.toml", save::ROBOT)]);
        let open = |agent: &str| {
            let extra_tables = vec!["world".into(), "seedling".into()];
            let options = Options { extra_tables, agent: Some(agent.into()), ..Options::default() };
            Database::open(folder.path("team.toml"), options).unwrap()
        };
        let (database, two) = (open("one"), save::values(&open("two").current()));
        for changes in steps {
            // A few don't fit together with earlier ones; these are refused whole.
            let _ = database.set(&changes);
            let expected = save::values(&database.current());
            if let Err(refused) = database.save(SaveTo::Origin) {
                // What takes something away can't be said in a table that only adds.
                prop_assert!(refused.to_string().contains("write this change into the file by hand"), "{}", refused);
                database.revert("").unwrap().commit().unwrap();
                continue;
            }
            prop_assert_eq!(&save::values(&database.current()), &expected);
            prop_assert_eq!(&save::values(&open("one").current()), &expected);
            prop_assert_eq!(&save::values(&open("two").current()), &two);
        }
        let text = fs::read_to_string(folder.path("team.toml")).unwrap();
        prop_assert_eq!(fs::read_to_string(folder.path("robot.toml")).unwrap(), save::ROBOT);
        for comment in (1..=36).map(|c| format!("# c{c:02}")).chain((1..=4).map(|d| format!("# d{d}"))) {
            prop_assert_eq!(text.matches(&comment).count(), 1, "{} in:\n{}", comment, text);
        }
    }
}
