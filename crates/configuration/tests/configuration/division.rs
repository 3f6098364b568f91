//! One file for robots in one agent, and for robots in agents of their own.

use super::*;

/// All in one agent.
const WORLD: &str = r#"
[time]
source = "simulator"

[mission]
outcome = "/referee/verdict"

[world]
goals = ["/r2/planner/goal", "/elsewhere/goal"]

[modules.simulator]

[modules.referee]

[links]
"referee/truth" = "simulator/r2/truth"
"simulator/r2/wheels" = { from = "r2/wheels/command", stale = "100ms" }

[robots.r2.modules]
planner = {}

[robots.r2.links]
"planner/position" = "/simulator/r2/position"
"planner/seen" = "/r3/planner/goal"

[robots.r2.actuators.wheels]
command = "planner/wheels"

[robots.r3.modules]
planner = {}
"#;

const AGENTS: &str = r#"
[agents.base]

[agents.r2]
runs = ["r2"]

[agents.r3]
runs = "r3"
"#;

fn of(agent: &str, sets: &[&str]) -> Options {
    Options { agent: Some(agent.into()), ..options(sets) }
}

fn load(agents: &str, agent: &str) -> Result<Configuration, Report> {
    Configuration::from_text("robots.toml", &format!("{WORLD}{agents}"), &of(agent, &[]))
}

fn modules(configuration: &Configuration) -> Vec<&str> {
    configuration.modules().iter().map(|module| module.name.as_str()).collect()
}

fn links(configuration: &Configuration) -> Vec<String> {
    let links = configuration.links().iter();
    links.map(|link| format!("{} <- {}", link.to.value, *link.from)).collect()
}

#[track_caller]
fn wrong(agents: &str, agent: &str) -> String {
    load(agents, agent).unwrap_err().to_string()
}

#[test]
fn each_agent_runs_its_modules_and_reads_the_rest_remotely() {
    let base = load(AGENTS, "base").unwrap();
    assert_eq!(modules(&base), ["referee", "simulator"]);
    assert_eq!(
        links(&base),
        ["referee/truth <- /simulator/r2/truth", "simulator/r2/wheels <- slate://r2/r2/wheels/command"]
    );
    assert!(base.actuators().is_empty());
    assert_eq!(base.time_source().unwrap().value, "simulator");
    assert!(!base.is_clock_elsewhere());
    assert_eq!(base.mission().unwrap().outcome.to_string(), "/referee/verdict");

    let r2 = load(AGENTS, "r2").unwrap();
    assert_eq!((r2.agent_name(), modules(&r2)), ("r2", vec!["r2/planner"]));
    assert_eq!(
        links(&r2),
        [
            "r2/planner/position <- slate://base/simulator/r2/position",
            "r2/planner/seen <- slate://r3/r3/planner/goal",
        ]
    );
    assert_eq!(r2.actuators()[0].commands[0].to_string(), "/r2/planner/wheels");
    assert!(r2.time_source().is_none());
    assert!(r2.is_clock_elsewhere());
    assert_eq!(r2.mission().unwrap().outcome.to_string(), "slate://base/referee/verdict");

    let r3 = load(AGENTS, "r3").unwrap();
    assert_eq!((modules(&r3), links(&r3).len(), r3.actuators().len()), (vec!["r3/planner"], 0, 0));
}

#[test]
fn properties_named_by_an_application_are_found_at_their_agent() {
    let goals = |agent: &str| load(AGENTS, agent).unwrap().value("world.goals").unwrap().to_string();
    assert_eq!(goals("base"), r#"["slate://r2/r2/planner/goal", "/elsewhere/goal"]"#);
    assert_eq!(goals("r2"), r#"["/r2/planner/goal", "/elsewhere/goal"]"#);
}

#[test]
fn agents_find_each_other_locally_unless_the_file_says_where() {
    let base = load(AGENTS, "base").unwrap();
    let at = |configuration: &Configuration, agent: &str| {
        configuration.share().unwrap().agents[agent].value.clone()
    };
    assert_eq!(base.share().unwrap().listen[0].value, "local:base");
    assert_eq!((at(&base, "r2"), at(&base, "r3")), ("local:r2".into(), "local:r3".into()));
    let elsewhere = format!("{AGENTS}\n[share.agents.r2]\nat = \"tls:10.0.0.2:7000\"\n");
    assert_eq!(at(&load(&elsewhere, "base").unwrap(), "r2"), "tls:10.0.0.2:7000");
    let renamed = AGENTS.replace("[agents.r2]", "[agents.r2]\nagent.name = \"pioneer\"");
    let base = load(&renamed, "base").unwrap();
    assert_eq!(at(&base, "pioneer"), "local:pioneer");
    assert_eq!(links(&base)[1], "simulator/r2/wheels <- slate://pioneer/r2/wheels/command");
}

#[test]
fn own_properties_of_agent_stay_local() {
    let agents = AGENTS.replace(
        "runs = \"r3\"",
        "runs = \"r3\"\n[agents.r3.modules.camera]\n[agents.r3.links]\n\"r3/planner/image\" = \"camera/image\"\n\
         [agents.r3.robots.r3.modules.planner]\nparams.speed = 0.3",
    );
    let r3 = load(&agents, "r3").unwrap();
    assert_eq!(
        (modules(&r3), links(&r3)),
        (vec!["camera", "r3/planner"], vec!["r3/planner/image <- /camera/image".into()])
    );
    assert_eq!(r3.origin("robots.r3.modules.planner.params.speed").unwrap().to_string(), "robots.toml:43");
    let configuration = load(&agents, "base").unwrap();
    assert_eq!(modules(&configuration), ["referee", "simulator"]);
}

#[test]
fn a_module_can_be_run_elsewhere_too() {
    let agents = AGENTS.replace("[agents.base]", "[agents.base]\nruns = [\"simulator\"]\n[agents.judge]");
    let judge = load(&agents, "judge").unwrap();
    assert_eq!(
        (modules(&judge), links(&judge)),
        (vec!["referee"], vec!["referee/truth <- slate://base/simulator/r2/truth".into()])
    );
    assert!(judge.is_clock_elsewhere());
    let base = load(&agents, "base").unwrap();
    assert_eq!(base.mission().unwrap().outcome.to_string(), "slate://judge/referee/verdict");
}

#[test]
fn settings_change_what_the_agent_runs() {
    let text = format!("{WORLD}{AGENTS}");
    let set = ["robots.r2.modules.planner.params.speed=0.2", "agents.r3.loop.period=5ms"];
    let of_agent = |agent: &str| Configuration::from_text("robots.toml", &text, &of(agent, &set)).unwrap();
    let speed = |agent: &str| of_agent(agent).value("robots.r2.modules.planner.params.speed").is_some();
    assert_eq!((speed("r2"), speed("r3")), (true, false));
    assert_eq!((of_agent("r3").period().value, of_agent("r2").period().value), (5_000_000, 20_000_000));
}

#[test]
fn unassigned_or_doubly_assigned_module_is_refused() {
    for (agents, agent, what) in [
        (
            "[agents.base]\n[agents.r2]\nruns = [\"r9\"]\n[agents.r3]\nruns = [\"r3\"]",
            "r2",
            "no robot or module is called `r9` (did you mean",
        ),
        (
            "[agents.base]\n[agents.r2]\nruns = [\"r2\"]\n[agents.r3]\nruns = [\"r2\", \"r3\"]",
            "r3",
            "`r2` runs `r2`, too",
        ),
        (
            "[agents.r2]\nruns = [\"r2\"]\n[agents.r3]\nruns = [\"r3\"]",
            "r2",
            "no agent runs `simulator` (name it in the `runs` of one agent",
        ),
        (
            "[agents.a]\n[agents.b]\n[agents.r2]\nruns = [\"r2\"]\n[agents.r3]\nruns = [\"r3\"]",
            "r2",
            "several agents run `simulator`: `a`, `b`",
        ),
        (
            "[agents.base]\n[agents.base.robots.r2.modules.camera]\n[agents.r2]\nruns = [\"r2\"]",
            "base",
            "`r2` runs `r2` (write it in [agents.r2]",
        ),
        ("[agents.base]\n[agents.r2]\nruns = 2", "base", "`runs` takes text, found a whole number"),
    ] {
        let said = wrong(agents, agent);
        assert!(said.contains(what), "{said}");
        assert!(said.contains("robots.toml:"), "{said}");
    }
}

#[test]
fn a_change_at_run_time_is_of_what_the_agent_runs() {
    let folder = Folder::new("division", &[("robots.toml", &format!("{WORLD}{AGENTS}"))]);
    let open = |agent: &str| Database::open(folder.path("robots.toml"), of(agent, &[])).unwrap();
    let database = open("r2");
    for path in
        ["robots.r3.modules.planner.params.speed", "modules.simulator.params.rate", "links.'referee/truth'"]
    {
        let refused = database.set(&[(path, "0.2")]).unwrap_err().to_string();
        assert!(refused.contains("runs `") && refused.contains("change it there: --agent "), "{refused}");
    }
    let before = modules(&open("base").current()).len();
    database
        .set(&[("robots.r2.modules.planner.params.speed", "0.2"), ("modules.camera.kind", "camera")])
        .unwrap();
    let names = |configuration: &Configuration| modules(configuration).join(" ");
    assert_eq!(names(&database.current()), "camera r2/planner");
    database.save(SaveTo::Origin).unwrap();
    assert_eq!(names(&open("r2").current()), "camera r2/planner");
    assert_eq!(
        (modules(&open("base").current()).len(), names(&open("r3").current())),
        (before, "r3/planner".into())
    );
}
