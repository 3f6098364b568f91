//! Links that need not be written: which of them are made, how one is left out, and how long they stay.

use slate_composition::{LinkedConfiguration, unlinked_warnings};

use crate::robot::{catalogue, linked, links, read};

/// All that types and roles of the robot leave no choice of.
const INFERRED: [&str; 6] = [
    "r2/execute/plan <- /r2/wanderer/plan inferred",
    "r2/execute/reflexes <- /r2/avoid/reflex inferred",
    "r2/execute/reflexes <- /r2/retreat/reflex inferred",
    "r2/wanderer/range <- /r2/way/change inferred",
    "r2/wanderer/situation <- /r2/execute/status inferred",
    "r2/way/range <- /r2/front/percept inferred",
];

fn without(gone: &[&str]) -> Vec<&'static str> {
    INFERRED.into_iter().filter(|line| !gone.iter().any(|part| line.contains(part))).collect()
}

#[test]
fn types_and_roles_of_blocks_link_a_robot() {
    assert_eq!(linked("", &[]), INFERRED);
}

#[test]
fn false_at_an_inbox_leaves_it_without_any_sender() {
    for setting in [
        "links.\"r2/execute/reflexes\"=false",
        "robots.r2.links.\"execute/reflexes\"=false",
        "links.\"/r2/execute/reflexes\"=false",
    ] {
        assert_eq!(linked("", &[setting]), without(&["reflexes"]), "{setting}");
    }
    let written = "[robots.r2.links]\n\"execute/reflexes\" = [\"avoid/reflex\"]\n";
    assert_eq!(linked(written, &["links.\"r2/execute/reflexes\"=false"]), without(&["reflexes"]));
    assert_eq!(linked("[robots.r2.links]\n\"execute/plan\" = false\n", &[]), without(&["execute/plan"]));
}

#[test]
fn false_at_an_input_leaves_it_without_a_link() {
    assert_eq!(linked("[robots.r2.links]\n\"way/range\" = false\n", &[]), without(&["way/range"]));
}

#[test]
fn false_at_one_sender_leaves_the_others() {
    let one = "[robots.r2.links]\n\"execute/reflexes\" = { \"avoid/reflex\" = false }\n";
    assert_eq!(linked(one, &[]), without(&["avoid"]));
}

#[test]
fn false_in_a_list_leaves_only_senders_that_are_named() {
    let only = |list: &str| linked(&format!("[robots.r2.links]\n\"execute/reflexes\" = {list}\n"), &[]);
    let mut expected = without(&["reflexes"]);
    assert_eq!(only("[false]"), expected);
    expected.insert(1, "r2/execute/reflexes <- /r2/avoid/reflex");
    assert_eq!(only("[\"avoid/reflex\", false]"), expected);
    assert_eq!(only("{ \"avoid/reflex\" = true, \"*\" = false }"), expected);
    assert_eq!(only("{ from = [\"avoid/reflex\", false] }"), expected);
    // Without it the list adds to what is inferred.
    expected.insert(2, "r2/execute/reflexes <- /r2/retreat/reflex inferred");
    assert_eq!(only("[\"avoid/reflex\"]"), expected);
    let closed = "[robots.r2.links]\n\"execute/reflexes\" = [\"avoid/reflex\", false]\n";
    assert_eq!(linked(closed, &["links.\"r2/execute/reflexes\".\"*\"=true"]), expected);
}

#[test]
fn a_reflex_that_reaches_no_execute_is_warned_of() {
    let catalogue = catalogue(&[]);
    let warnings = |sets: &[&str]| {
        let configuration = read("", sets);
        let linked = LinkedConfiguration::new(&configuration, &catalogue, &|_| false);
        let survey = linked.check(&catalogue).unwrap();
        let found = unlinked_warnings(linked.configuration(), &survey);
        found
            .iter()
            .map(|one| one.message().to_owned())
            .filter(|one| one.contains("reflex"))
            .collect::<Vec<_>>()
    };
    let unlinked_warnings =
        |block: &str| format!("outbox `r2/{block}/reflex` has no receiver: this reflex has no effect");
    assert_eq!(
        warnings(&["links.\"r2/execute/reflexes\"=false"]),
        [unlinked_warnings("avoid"), unlinked_warnings("retreat")]
    );
    let one = "links.\"r2/execute/reflexes\"={ \"/r2/avoid/reflex\" = false }";
    assert_eq!(warnings(&[one]), [unlinked_warnings("avoid")]);
    assert_eq!(warnings(&[one, "robots.r2.modules.avoid.enabled=false"]), Vec::<String>::new());
}

/// What is said of the robot with more of it in another layer.
fn warnings(more: &str) -> Vec<String> {
    let (configuration, catalogue) = (read(more, &[]), catalogue(&[]));
    let linked = LinkedConfiguration::new(&configuration, &catalogue, &|_| false);
    let survey = linked.check(&catalogue).unwrap();
    unlinked_warnings(linked.configuration(), &survey).iter().map(|one| one.message().to_owned()).collect()
}

#[test]
fn a_block_that_drives_a_body_of_another_robot_is_warned_of() {
    // A robot without blocks of its own, such as a trailer.
    let other =
        "[robots.r3.modules]\nguest = { kind = \"front\" }\n[robots.r3.links]\n\"guest/range\" = false\n";
    let crossing = |more: &str| {
        let found = warnings(&format!("{other}{more}"));
        found.into_iter().filter(|one| one.contains("drives robot")).collect::<Vec<_>>()
    };
    assert_eq!(crossing(""), Vec::<String>::new());
    let wheels = "[robots.r3.actuators]\nlegs = { command = \"/r2/execute/wheels\" }\n";
    assert_eq!(
        crossing(wheels),
        ["`r2/execute/wheels` of robot `r2` drives robot `r3` by actuator `r3/legs`"]
    );
}

/// An agent that is loaded without some of its plugins, and gets others while it runs.
struct Running {
    linked: LinkedConfiguration,
    /// The plugins that are not loaded.
    dormant: Vec<&'static str>,
}

impl Running {
    fn without(dormant: &[&'static str]) -> Self {
        let configuration = read("[robots.r2.modules.back]\n", &[]);
        let linked = LinkedConfiguration::new(&configuration, &catalogue(dormant), &|_| false);
        Self { linked, dormant: dormant.to_vec() }
    }

    fn links(&self) -> Vec<String> {
        links(self.linked.configuration())
    }

    /// The same with another plugin; what is wrong if it is refused.
    fn load(&self, plugin: &str) -> Result<Self, String> {
        let dormant: Vec<_> = self.dormant.iter().copied().filter(|name| *name != plugin).collect();
        let (configuration, earlier, now) =
            (self.linked.configuration(), catalogue(&self.dormant), catalogue(&dormant));
        let stays = |name: &str| {
            let module = configuration.modules().iter().find(|module| module.name.value == name);
            module.is_some_and(|module| !earlier.is_dormant(&module.kind.value))
        };
        let linked = LinkedConfiguration::new(configuration, &now, &stays);
        linked.check(&now).map(|_| ()).map_err(|report| report.to_string())?;
        Ok(Self { linked, dormant })
    }
}

#[test]
fn arriving_module_gets_its_links_and_changes_no_other() {
    let before = Running::without(&["back", "retreat", "way_is_free"]);
    assert_eq!(before.links(), without(&["retreat", "way"]));
    assert_eq!(before.load("retreat").unwrap().links(), without(&["way"]));
    // The Plan was there before the Analyze, so it stays without it.
    assert_eq!(before.load("way_is_free").unwrap().links(), without(&["retreat", "wanderer/range"]));
}

#[test]
fn written_or_missing_link_stays_when_a_candidate_arrives() {
    let before = Running::without(&["front", "back"]);
    assert_eq!(before.links(), without(&["way/range"]));
    // The Analyze was loaded when nothing could be read, and is not touched by what comes.
    let came = before.load("front").unwrap().load("back").unwrap();
    assert_eq!(came.links(), without(&["way/range"]));
}

#[test]
fn newcomer_that_makes_a_link_ambiguous_is_refused() {
    let before = Running::without(&["back"]);
    assert_eq!(before.links(), INFERRED);
    let refused = before.load("back").err().unwrap();
    for part in [
        "`r2/way/range` could read `r2/back/percept` or `r2/front/percept`",
        "\"/r2/way/range\" = \"/r2/back/percept\"",
        "\"/r2/way/range\" = \"/r2/front/percept\"",
    ] {
        assert!(refused.contains(part), "{part} in {refused}");
    }
    assert_eq!(before.links(), INFERRED, "nothing has changed");
}
