//! Changes that are written into the files.

use super::*;

fn open(folder: &Folder, sets: &[&str]) -> Database {
    Database::open(folder.path("exp1.toml"), options(sets)).unwrap()
}

fn text(folder: &Folder, name: &str) -> String {
    fs::read_to_string(folder.path(name)).unwrap()
}

/// All values, without where they come from.
pub(super) fn values(configuration: &Configuration) -> Vec<String> {
    configuration.settings("").unwrap().iter().map(|s| format!("{}={}", s.path, s.value)).collect()
}

/// The text after these changes and a save.
#[track_caller]
fn saved(test: &str, before: &str, changes: &[(&str, &str)]) -> String {
    let folder = Folder::new(test, &[("exp1.toml", before)]);
    let database = open(&folder, &[]);
    database.set(changes).unwrap();
    let expected = values(&database.current());
    assert_eq!(database.save(SaveTo::Origin).unwrap(), [folder.path("exp1.toml")]);
    assert!(database.diff().is_empty());
    assert_eq!(values(&database.current()), expected);
    assert_eq!(values(&open(&folder, &[]).current()), expected);
    assert!(database.save(SaveTo::Origin).unwrap().is_empty(), "there is nothing to save");
    text(&folder, "exp1.toml")
}

#[test]
fn a_value_is_changed_where_it_stands_and_nothing_else() {
    let before = "# first\n[loop] # the pace\n  period = '20ms'  # fast enough\n\n# who follows\n[modules.follower]\n\
                  params = { gain = 1.20, speed=0.5 } # both\ninputs . goal = {x=1.0,  y=0}# where to\n\n\
                  # the robot\n[robots.r2.modules]\nplanner = { params = { speed = 0x10 } }\n\n[robots.r2.links]\n\
                  \"planner/pose\" = \"a/pose\" # own\n\"planner/goal\" = '/world/goal'\n\n\
                  [robots.r2.actuators.arm]\nmodules = [\"a\", \"b\"]\n\n\
                  [actuators.wheels]\ncommand = \"follower/wheels\"\nlimits.left = [ # least\n  -1, # most\n  1.0,\n] # end\n# last\n";
    let changes = [
        ("loop.period", "10ms"),
        ("modules.follower.params.speed", "0.8"),
        ("modules.follower.inputs.goal.x", "-2.5"),
        ("modules.\"r2/planner\".params.speed", "17"),
        ("robots.r2.links.\"planner/pose\"", "b/pose"),
        ("links.\"r2/planner/goal\"", "/r2/map/goal"),
        ("actuators.wheels.limits.left", "[-2, 1.0]"),
        ("actuators.\"r2/arm\".modules", "[\"r2/c\", \"d\"]"),
    ];
    let expected = before
        .replace("'20ms'", "\"10ms\"")
        .replace("speed=0.5", "speed=0.8")
        .replace("{x=1.0", "{x=-2.5")
        .replace("0x10", "17")
        .replace("\"a/pose\"", "\"b/pose\"")
        .replace("'/world/goal'", "\"map/goal\"")
        .replace("[\"a\", \"b\"]", "[\"c\", \"/d\"]")
        .replace("-1,", "-2,");
    assert_eq!(saved("in-place", before, &changes), expected);
}

#[test]
fn a_new_value_gets_a_place_that_fits() {
    let before = "# first\nlayout = 1 # own\n\n[modules.follower] # who\nenabled = true # yes\n\n[modules.mapper]\n\
                  params = { size = 1 } # table\n\n[robots.r2.modules]\nplanner = {}\n# end\n";
    let changes = [
        ("modules.follower.params.gain", "2.5"),
        ("modules.follower.deadline", "5ms"),
        ("modules.mapper.params.depth", "2"),
        ("modules.\"r2/planner\".params.speed", "1.5"),
        ("modules.\"r2/scout\".kind", "planner"),
        ("modules.lone.kind", "planner"),
        ("robots.r3.modules.lone.kind", "planner"),
        ("links.\"follower/pose\"", "a/pose"),
        ("log.levels.\"r2/planner\"", "debug"),
        ("robots.r2.links.\"planner/pose\"", "a/pose"),
    ];
    let folder_text = {
        let folder = Folder::new("new", &[("exp1.toml", before)]);
        let options = || Options { extra_tables: vec!["layout".into()], ..Options::default() };
        let database = Database::open(folder.path("exp1.toml"), options()).unwrap();
        database.set(&changes).unwrap();
        let expected = values(&database.current());
        database.save(SaveTo::Origin).unwrap();
        let again = Database::open(folder.path("exp1.toml"), options()).unwrap();
        assert_eq!(values(&again.current()), expected);
        text(&folder, "exp1.toml")
    };
    let expected = "# first\nlayout = 1 # own\n\n[modules.follower] # who\nenabled = true # yes\ndeadline = \"5ms\"\n\
                    params.gain = 2.5\n\n[modules.mapper]\nparams = { size = 1, depth = 2 } # table\n\n\
                    [modules.lone]\nkind = \"planner\"\n\n[modules.\"r3/lone\"]\nkind = \"planner\"\n\n\
                    [robots.r2.modules]\nplanner = { params = { speed = 1.5 } }\nscout.kind = \"planner\"\n\n\
                    [robots.r2.links]\n\"planner/pose\" = \"a/pose\"\n\n[links]\n\"follower/pose\" = \"/a/pose\"\n\n\
                    [log.levels]\n\"r2/planner\" = \"debug\"\n# end\n";
    assert_eq!(folder_text, expected);
}

#[test]
fn change_replaces_setting_and_keeps_comments() {
    let before = "[modules.a]\n# how often\nevery = \"1ms\" # fast\n# the goal\ninputs.goal = { x = 1.0 } # there\n\
                  [actuators.w]\n# who\ncommand = \"a/w\"\n[links]\n# from b\n\"a/pose\" = \"b/pose\" # linked\n";
    let changes = [
        ("modules.a.on", "scans"),
        ("links.\"a/goal\"", "b/goal"),
        ("modules.a.inputs.pose", "{ x = 2.0 }"),
        ("actuators.w.commands", "[\"a/w\", \"b/w\"]"),
    ];
    let expected = "[modules.a]\n# from b\n# linked\ninputs.pose.x = 2.0\n# how often\n# fast\non = \"scans\"\n\
                    [actuators.w]\n# who\ncommands = [\"a/w\", \"/b/w\"]\n[links]\n# the goal\n# there\n\
                    \"a/goal\" = \"/b/goal\"\n";
    assert_eq!(saved("exclusive", before, &changes), expected);
}

#[test]
fn lists_keep_their_lines_and_comments() {
    let before = "[world]\npath = [\n  [0, 0], # start\n  [1, 0],\n  [1, 1], # end\n]\nshort = [1, 2, 3]\n\
                  [[world.bodies]]\nname = \"box\" # a box\nsize = [1, 1]\n[[world.bodies]]\nname = \"ball\"\n";
    let longer = [
        ("world.path", "[[0, 0], [2, 0], [1, 1], [3, 3]]"),
        ("world.short", "[1, 5, 3, 4]"),
        ("world.bodies", "[{ name = \"can\", size = [1, 1] }, { name = \"ball\" }, { name = \"cone\" }]"),
    ];
    let expected = "[world]\npath = [\n  [0, 0], # start\n  [2, 0],\n  [1, 1],\n  [3, 3], # end\n]\nshort = [1, 5, 3, 4]\n\
                    [[world.bodies]]\nname = \"can\" # a box\nsize = [1, 1]\n[[world.bodies]]\nname = \"ball\"\n\n\
                    [[world.bodies]]\nname = \"cone\"\n";
    assert_eq!(saved("longer", before, &longer), expected);
    let shorter =
        [("world.path", "[[0, 1]]"), ("world.short", "[]"), ("world.bodies", "[{ size = [1, 1] }]")];
    let text = saved("shorter", before, &shorter);
    assert!(text.contains("# start") && text.contains("# end") && text.contains("short = []"), "{text}");
}

#[test]
fn a_table_and_a_value_replace_each_other() {
    let before = "[links]\n\"a/x\" = \"b/x\" # x\n\"a/y\" = { from = \"b/y\", previous = true } # y\n\n# about z\n\
                  [links.\"a/z\"] # z\nfrom = \"b/z\" # from z\n";
    let changes = [
        ("links.\"a/x\"", "{ from = \"c/x\", previous = true }"),
        ("links.\"a/y\"", "c/y"),
        ("links.\"a/z\"", "c/z"),
    ];
    let text = saved("replace", before, &changes);
    for comment in ["# x", "# y", "# about z", "# from z"] {
        assert_eq!(text.matches(comment).count(), 1, "{comment} in {text}");
    }
}

#[test]
fn a_table_in_the_place_of_one_of_the_file_has_nothing_of_it() {
    let before = "[links]\n# about x\n\"a/x\" = { from = \"b/x\", previous = true } # x\n";
    let text = saved("afresh", before, &[("links.\"a/x\"", "c/x"), ("links.\"a/x\".from", "c/y")]);
    assert_eq!(text, "[links]\n# about x\n\"a/x\" = { from = \"/c/y\" } # x\n");
    let before = "[modules.a.params]\n# about old\nold.z = 1 # z\n";
    let text = saved("deep", before, &[("modules.a.params.old", "word"), ("modules.a.params.old.new", "2")]);
    for words in ["# about old", "# z", "old.new = 2"] {
        assert_eq!(text.matches(words).count(), 1, "{words} in {text}");
    }
}

#[test]
fn a_saved_link_changed_in_two_ways_is_saved_again() {
    let folder = Folder::new("again", &[("exp1.toml", COMMENTED), ("robot.toml", ROBOT)]);
    let options = || Options { extra_tables: vec!["world".into(), "seedling".into()], ..Options::default() };
    let database = Database::open(folder.path("exp1.toml"), options()).unwrap();
    let own = "robots.r2.links.\"a/new\"";
    database.set(&[(own, "{ from = \"c/x\", previous = true }")]).unwrap();
    database.save(SaveTo::Origin).unwrap();
    database.set(&[(own, "c/x")]).unwrap();
    database.set(&[("links.\"/r2/a/new\".from", "c/x")]).unwrap();
    let expected = values(&database.current());
    database.save(SaveTo::Origin).unwrap();
    assert!(database.diff().is_empty());
    let again = Database::open(folder.path("exp1.toml"), options()).unwrap();
    assert_eq!(values(&again.current()), expected);
}

#[test]
fn an_empty_table_in_place_of_one_in_several_lines_is_written() {
    let before = "[modules.a.params]\n# about x\nx.y = 0 # y\nx.text = \"\"\n";
    let changes = [("modules.a.params.x", "0"), ("modules.a.params.x", "{}")];
    let text = saved("empty", before, &changes);
    for words in ["# about x", "# y", "x = {}"] {
        assert_eq!(text.matches(words).count(), 1, "{words} in {text}");
    }
    let before = "[modules.a.params]\nz = 1\n[modules.a.params.x.deep]\ny = 0\n";
    let text = saved("section", before, &changes);
    assert_eq!(text, "[modules.a.params]\nz = 1\nx = {}\n");
}

#[test]
fn each_value_goes_to_the_file_that_it_comes_from() {
    let files = [
        ("exp1.toml", "include = \"common/base.toml\" # shared\n[loop]\nperiod = \"20ms\"\n"),
        (
            "common/base.toml",
            "# base\n[loop]\nhang = \"1s\" # long\n[modules.a]\nparams = { x = 1, y = 1 }\n",
        ),
        ("host.toml", "# here\n[modules.a]\nparams.y = 2 # slow\n"),
    ];
    let folder = Folder::new("origin", &files);
    let options = |sets: &[&str]| Options { host: Some(folder.path("host.toml")), ..options(sets) };
    let database = Database::open(folder.path("exp1.toml"), options(&["modules.a.params.y=9"])).unwrap();
    database.set(&[("loop.hang", "3s"), ("modules.a.params.y", "5"), ("modules.a.params.z", "6")]).unwrap();
    let paths: Vec<_> =
        database.save(SaveTo::Origin).unwrap().iter().map(|p| folder.plain(p.display())).collect();
    assert_eq!(paths, ["exp1.toml", "common/base.toml", "host.toml"]);
    assert_eq!(text(&folder, "exp1.toml"), format!("{}\n[modules.a.params]\nz = 6\n", files[0].1));
    assert_eq!(text(&folder, "common/base.toml"), files[1].1.replace("\"1s\"", "\"3s\""));
    assert_eq!(text(&folder, "host.toml"), files[2].1.replace("= 2", "= 5"));
    assert!(database.diff().is_empty(), "what is saved goes over the command line: {:?}", database.diff());
    assert_eq!(database.current().value("modules.a.params.y").unwrap().as_integer(), Some(5));

    // All of it to this machine's file.
    database.set(&[("loop.hang", "4s"), ("modules.a.params.z", "7")]).unwrap();
    assert_eq!(database.save(SaveTo::Host).unwrap(), [folder.path("host.toml")]);
    let expected = "# here\n[modules.a]\nparams.y = 5 # slow\nparams.z = 7\n\n[loop]\nhang = \"4s\"\n";
    assert_eq!(text(&folder, "host.toml"), expected);
    assert!(database.diff().is_empty());
    let origin = database.current().origin("loop.hang").unwrap().to_string();
    assert_eq!(folder.plain(origin), "host.toml:7");
}

#[test]
fn a_file_that_was_edited_meanwhile_is_not_overwritten() {
    let files = [
        ("exp1.toml", "include = \"b.toml\"\n[loop]\nperiod = \"20ms\"\n"),
        ("b.toml", "[agent]\nseed = 1\n"),
    ];
    let folder = Folder::new("meanwhile", &files);
    let database = open(&folder, &[]);
    database.set(&[("loop.period", "10ms"), ("agent.seed", "2")]).unwrap();
    fs::write(folder.path("b.toml"), "[agent]\nseed = 1\nname = \"x\"\n").unwrap();
    let report = database.save(SaveTo::Origin).unwrap_err();
    assert_eq!(
        folder.plain(report),
        "b.toml was changed on the disk since it was read (take that over first (reload it; a watched file is by \
         itself), then save again)"
    );
    assert_eq!(text(&folder, "exp1.toml"), files[0].1, "nothing is written");
    assert_eq!(database.diff().len(), 2);
    database.reload().unwrap().commit().unwrap();
    database.save(SaveTo::Origin).unwrap();
    assert_eq!(text(&folder, "b.toml"), "[agent]\nseed = 2\nname = \"x\"\n");
    assert_eq!(database.current().agent_name(), "x");
}

#[test]
fn unsavable_change_is_reported_and_stays() {
    let database = Database::from_text("exp1.toml", "[loop]\nperiod = \"20ms\"\n", options(&[])).unwrap();
    database.set(&[("loop.period", "10ms")]).unwrap();
    assert_eq!(
        database.save(SaveTo::Origin).unwrap_err().to_string(),
        "`loop.period` can't be saved: exp1.toml is built in and no file (save to the file of this machine, or start \
         from a file)"
    );
    assert_eq!(
        database.save(SaveTo::Host).unwrap_err().to_string(),
        "no file of this machine to save to (name one when the agent is started)"
    );
    assert_eq!(database.diff().len(), 1);

    let folder = Folder::new("text", &[("host.toml", "")]);
    let host = Options { host: Some(folder.path("host.toml")), ..options(&[]) };
    let database = Database::from_text("exp1.toml", "[loop]\nperiod = \"20ms\"\n", host).unwrap();
    database.set(&[("loop.period", "10ms")]).unwrap();
    database.save(SaveTo::Host).unwrap();
    assert_eq!(text(&folder, "host.toml"), "[loop]\nperiod = \"10ms\"\n");

    // The folder has gone, so nothing can be written; and the database continues.
    let folder = Folder::new("gone", &[("exp1.toml", "")]);
    let database = open(&folder, &[]);
    database.set(&[("loop.period", "10ms")]).unwrap();
    fs::remove_dir_all(&folder.0).unwrap();
    assert!(database.save(SaveTo::Origin).is_err());
    assert_eq!(database.diff().len(), 1);
}

#[test]
fn line_ends_byte_order_mark_permissions_and_symlinks_stay() {
    let before = "\u{feff}# first\r\n[loop] # pace\r\nperiod = \"20ms\" # fast\r\n\r\n# last\r\n";
    let expected = before.replace("20ms", "10ms").replace("# fast\r\n", "# fast\r\nhang = \"1s\"\r\n");
    assert_eq!(saved("windows", before, &[("loop.period", "10ms"), ("loop.hang", "1s")]), expected);

    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let folder = Folder::new("linked", &[("real/it.toml", "[agent]\nseed = 1")]);
        std::os::unix::fs::symlink("real/it.toml", folder.path("exp1.toml")).unwrap();
        fs::set_permissions(folder.path("real/it.toml"), fs::Permissions::from_mode(0o640)).unwrap();
        let database = open(&folder, &[]);
        database.set(&[("agent.seed", "2")]).unwrap();
        database.save(SaveTo::Origin).unwrap();
        assert_eq!(text(&folder, "real/it.toml"), "[agent]\nseed = 2\n");
        assert!(fs::symlink_metadata(folder.path("exp1.toml")).unwrap().is_symlink());
        let mode = fs::metadata(folder.path("real/it.toml")).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o640);
        assert_eq!(fs::read_dir(folder.path("real")).unwrap().count(), 1, "no temporary file is left");
    }
}

pub(super) const COMMENTED: &str = r##"# c01 the main file
include = "robot.toml" # c02
seedling = "#not a comment" # c03

# c04 before loop
[loop] # c05
# c06
period = "20ms" # c07
# c08 between
hang = '2s'

[modules.a] # c09
# c10
params.x = 1 # c11
# c12
params.y = 2.0
params.list = [ # c13
  1, # c14
  # c15
  2,
  # c16
] # c17
# c18
every = "1ms" # c19
inputs.goal = { x = 1.0, y = 2.0 } # c20

[modules]
b = { params = { x = 1 } } # c21

[modules.a.params.deep] # c22
z = "z" # c23

# c24
[actuators.wheels] # c25
command = "a/wheels" # c26
limits = { left = [-1, 1], right = [-1, 1] } # c27

[world] # c28
# c29
[[world.bodies]] # c30
name = "box" # c31

[robots.r2] # c32
# c33
links."b/x" = "a/x" # c34
links."/b/z" = "b/z" # c35
# c36 the end
"##;

pub(super) const ROBOT: &str = r##"# c37 a robot
[robots.r2.modules] # c38
a = {} # c39
# c40
b.params = { x = 1 } # c41
b.kind = "a" # c42
[links] # c43
"r2/b/y" = { from = "a/y", previous = true } # c44
[log.levels] # c45
a = "debug" # c46
# c47"##;

/// A path and a value that it can have.
pub(super) fn change() -> impl Strategy<Value = (String, String)> {
    let number = || {
        prop_oneof![(-9..9i64).prop_map(|n| n.to_string()), (-9.0..9.0).prop_map(|n: f64| format!("{n:?}"))]
    };
    let any = || {
        let list = prop::collection::vec(number(), 0..5).prop_map(|items| format!("[{}]", items.join(", ")));
        let table = (number(), "[ #\"'=a-c\n\\\\é]{0,8}")
            .prop_map(|(x, text)| format!("{{ x = {x}, text = {} }}", toml_edit::Value::from(text)));
        prop_oneof![
            number(),
            number(),
            list,
            table,
            prop::sample::select(&["true", "word", "{}"][..]).prop_map(String::from)
        ]
    };
    let params = prop::sample::select(
        &[
            "modules.a.params.x",
            "modules.a.params.y",
            "modules.a.params.list",
            "modules.a.params.deep.z",
            "modules.a.params.deep.\"new # one\"",
            "modules.b.params.x",
            "modules.b.params.new.x",
            "modules.\"r2/a\".params.x",
            "robots.r2.modules.a.params.y",
            "robots.r2.modules.b.params.x",
            "modules.\"r2/b\".params.y",
            "modules.a.inputs.goal.x",
            "modules.a.inputs.other",
            "world.layout",
            "world.bodies",
            "world.deep.er.x",
            "seedling",
        ][..],
    );
    let links = prop::sample::select(
        &[
            "links.\"a/goal\"",
            "links.\"r2/b/x\"",
            "robots.r2.links.\"b/y\"",
            "links.\"b/z\"",
            "robots.r2.links.\"a/new\"",
            "links.\"/r2/a/new\".from",
        ][..],
    );
    let url = prop::sample::select(
        &["c/x", "/r2/c/x", "/c/y", "slate://base/c/y", "{ from = \"c/x\", previous = true }"][..],
    );
    let fixed = prop::sample::select(
        &[
            ("loop.period", "5ms"),
            ("loop.hang", "\"3s\""),
            ("modules.a.every", "5ms"),
            ("modules.a.on", "scans"),
            ("modules.a.on", "[\"scans\", \"pose\"]"),
            ("modules.b.deadline", "5ms"),
            ("modules.new.kind", "a"),
            ("robots.r2.modules.new", "{ kind = \"a\", params = { x = 1 } }"),
            ("robots.r3.modules.new", "{ kind = \"a\" }"),
            ("actuators.wheels.command", "a/other"),
            ("actuators.wheels.commands", "[\"a/wheels\", \"b/wheels\"]"),
            ("actuators.wheels.limits.left", "[-2, 2.5]"),
            ("log.level", "warn"),
            ("log.levels.a", "info"),
            ("log.levels.\"r2/b\"", "trace"),
            ("agent.seed", "7"),
        ][..],
    );
    let text = |(path, value): (&str, String)| (path.to_owned(), value);
    let texts = |(path, value): (&str, &str)| (path.to_owned(), value.to_owned());
    prop_oneof![4 => (params, any()).prop_map(text), 2 => (links, url).prop_map(texts), 3 => fixed.prop_map(texts)]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    #[test]
    fn any_change_that_is_saved_reads_the_same_and_keeps_comments(
        steps in prop::collection::vec((prop::collection::vec(change(), 1..4), prop::bool::weighted(0.3)), 1..8),
    ) {
        let folder = Folder::new("any", &[("exp1.toml", COMMENTED), ("robot.toml", ROBOT)]);
        let options = || Options { extra_tables: vec!["world".into(), "seedling".into()], ..Options::default() };
        let database = Database::open(folder.path("exp1.toml"), options()).unwrap();
        for (changes, save) in steps {
            // A few don't fit together with earlier ones; these are refused whole.
            let before = values(&database.current());
            if database.set(&changes).is_err() {
                prop_assert_eq!(values(&database.current()), before);
            }
            if save {
                database.save(SaveTo::Origin).unwrap();
            }
        }
        let expected = values(&database.current());
        database.save(SaveTo::Origin).unwrap();
        prop_assert!(database.diff().is_empty());
        prop_assert_eq!(&values(&database.current()), &expected);
        let again = Database::open(folder.path("exp1.toml"), options()).unwrap();
        prop_assert_eq!(&values(&again.current()), &expected);
        let texts = text(&folder, "exp1.toml") + &text(&folder, "robot.toml");
        for comment in 1..=47 {
            let comment = format!("# c{comment:02}");
            prop_assert_eq!(texts.matches(&comment).count(), 1, "{} in:\n{}", comment, texts);
        }
    }
}

#[test]
fn a_sender_is_added_to_its_list_and_taken_off_it() {
    let before =
        "[robots.r2.links]\n\"execute/reflexes\" = [\"a/reflex\"] # those\n\"execute/plan\" = \"p/plan\"\n";
    let added = [("robots.r2.links.\"execute/reflexes\".\"b/reflex\"", "true")];
    assert_eq!(
        saved("sender-added", before, &added),
        before.replace("[\"a/reflex\"]", "[\"a/reflex\", \"b/reflex\"]")
    );
    let removed = [("links.\"r2/execute/reflexes\".\"/r2/a/reflex\"", "false")];
    assert_eq!(
        saved("sender-removed", before, &removed),
        before.replace("[\"a/reflex\"]", "{ \"a/reflex\" = false }")
    );
}

#[test]
fn command_is_added_to_its_list_and_taken_off_it() {
    let before =
        "[robots.r2.actuators]\nwheels = { commands = [\"a/wheels\"], time_to_live = \"50ms\" } # those\n";
    let added = [("robots.r2.actuators.wheels.commands.\"b/wheels\"", "true")];
    assert_eq!(
        saved("command-added", before, &added),
        before.replace("[\"a/wheels\"]", "[\"a/wheels\", \"b/wheels\"]")
    );
    let removed = [("actuators.\"r2/wheels\".commands.\"/r2/a/wheels\"", "false")];
    assert_eq!(
        saved("command-removed", before, &removed),
        before.replace("[\"a/wheels\"]", "{ \"a/wheels\" = false }")
    );
    let single = "[robots.r2.actuators]\n# the wheels\nwheels.command = \"a/wheels\" # only\n";
    assert_eq!(
        saved("command-single", single, &added),
        "[robots.r2.actuators]\n# the wheels\n# only\nwheels.commands = [\"a/wheels\", \"b/wheels\"]\n"
    );
}

#[test]
fn false_that_closes_a_list_of_senders_is_added_to_it() {
    let before = "[robots.r2.links]\n\"execute/reflexes\" = [\"a/reflex\"] # those\n";
    let closed = [("robots.r2.links.\"execute/reflexes\"", "[false]")];
    assert_eq!(
        saved("senders-closed", before, &closed),
        before.replace("[\"a/reflex\"]", "[\"a/reflex\", false]")
    );
}
