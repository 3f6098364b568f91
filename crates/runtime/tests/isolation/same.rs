//! An isolated module is the same as one that is linked in: same values of every kind, same log, same digest.

use slate_module::Level;
use slate_runtime::configuration::{Configuration, Options as Reading};
use slate_runtime::log::MemoryTarget;
use slate_runtime::{Agent, Options, Rate};

use crate::Test;
use crate::common::number;
use crate::modules::plugins;

pub const TESTS: [Test; 4] = [
    ("values of every kind are those of linked-in modules", values_of_every_kind),
    ("parameters and switches reach an isolated module", parameters_and_switches),
    ("lines of the log come under the module's name", lines_of_the_log),
    ("what a process can't do is said", what_it_cannot_do),
];

pub const ALL: [&str; 8] = ["pulse", "plotter", "adder", "clerk", "dice", "relay", "villain", "counter"];

/// A module of every kind of port; those of which the name is in `isolated` are.
pub fn text(isolated: &[&str]) -> String {
    let mut text = String::from("time.source = \"pulse\"\nloop.period = \"10ms\"\nlog.level = \"debug\"\n");
    for module in ALL {
        let apart = isolated.contains(&module);
        text += &format!("[modules.{module}]\nisolated = {apart}\n");
    }
    text += r#"
[links]
"adder/series" = "plotter/series"
"adder/all" = "plotter/series"
"clerk/notes" = "adder/note"
"relay/input" = "dice/number"
"villain/input" = "relay/output"
"counter/enabled" = "switch"
[actuators.wheel]
command = "villain/wheel"
"#;
    text.replace("\"counter/enabled\" = \"switch\"\n", "")
}

fn load(text: &str, options: Options) -> Agent {
    let configuration = Configuration::from_text("test.toml", text, &Reading::default()).unwrap();
    Agent::load(&configuration, &plugins(), options).unwrap_or_else(|error| panic!("{error}"))
}

fn lockstep(text: &str) -> Agent {
    load(text, Options { rate: Rate::Max, armed: true, ..Options::default() })
}

fn values_of_every_kind() {
    let run = |isolated: &[&str]| {
        let mut agent = lockstep(&text(isolated));
        let (traced, _) = agent.board().find("plotter/traced").unwrap();
        let mut seen = Vec::new();
        for cycle in 0..200 {
            let watching = (cycle % 3 == 0).then(|| traced.watch());
            agent.step();
            drop(watching);
            let value = agent.board().read("plotter/traced").unwrap();
            seen.push(value.map(|(value, stamp)| (value.as_f64(), stamp.sequence)));
        }
        assert_eq!(number(&agent, "pulse/beat/value"), 200.0);
        assert_eq!(number(&agent, "wheel/command/value"), 1.0);
        assert!(number(&agent, "clerk/total/value") > 0.0);
        (agent.digest(), number(&agent, "adder/sum/value"), seen)
    };
    let linked = run(&[]);
    assert_eq!(run(&ALL), linked);
    // Also when the other end of each link is not isolated.
    assert_eq!(run(&["plotter", "clerk", "relay"]), linked);
    assert_eq!(run(&["adder", "dice", "villain"]), linked);
}

fn parameters_and_switches() {
    let run = |isolated: &[&str]| {
        let mut agent = lockstep(&text(isolated));
        let set = |agent: &Agent, path: &str, value| agent.board().write(path, &value, 0).unwrap();
        use slate_blackboard::interface::Value;
        for cycle in 0..60 {
            match cycle {
                20 => drop(set(&agent, "adder/params/gain", Value::Float(2.5))),
                30 => drop(set(&agent, "adder/enabled/value", Value::Bool(false))),
                40 => drop(set(&agent, "adder/enabled/value", Value::Bool(true))),
                _ => {}
            }
            agent.step();
        }
        assert_eq!(agent.counts("adder").unwrap().0, 50);
        agent.digest()
    };
    assert_eq!(run(&["adder"]), run(&[]));
}

fn lines_of_the_log() {
    let run = |isolated: &[&str]| {
        let target = MemoryTarget::default();
        let log: Vec<Box<dyn slate_runtime::log::LogTarget>> = vec![Box::new(target.clone())];
        let mut agent =
            load(&text(isolated), Options { rate: Rate::Max, armed: true, log, ..Options::default() });
        for _ in 0..5 {
            agent.step();
        }
        drop(agent);
        let lines = target.lines().into_iter();
        lines.filter(|line| &*line.module == "villain").collect::<Vec<_>>()
    };
    let lines = run(&["villain"]);
    assert_eq!(lines.len(), 5);
    assert_eq!((lines[4].level, lines[4].text.as_str()), (Level::Info, "tick 5 of this life"));
    assert_eq!(lines, run(&[]));
}

fn what_it_cannot_do() {
    let refusal = |options: Options| {
        let text = text(&["villain"]);
        let configuration = Configuration::from_text("test.toml", &text, &Reading::default()).unwrap();
        Agent::load(&configuration, &plugins(), options).unwrap_err().to_string()
    };
    let program = |path: &str| Options { isolation_program: Some(path.into()), ..Options::default() };
    let text = refusal(program("/nowhere/robot"));
    assert!(text.contains("its process can't be started: No such file"), "{text}");
    let text = refusal(program("/bin/true"));
    assert!(text.contains("`villain` can't be set up") && text.contains("ended with exit code"), "{text}");
    let own = "[modules.villain]\nisolated = true\n";
    let text = self::text(&["villain"]).replace(own, &format!("{own}isolation.memory = \"64kB\"\n"));
    let configuration = Configuration::from_text("test.toml", &text, &Reading::default()).unwrap();
    let error = Agent::load(&configuration, &plugins(), Options::default()).unwrap_err();
    let slate_runtime::StartError::Configuration(report) = error else { panic!("{error}") };
    let line = 1 + text.lines().position(|line| line.starts_with("isolation.memory")).unwrap();
    let place = format!("test.toml:{line}:20: `villain` may allocate 64000 bytes");
    assert!(report.to_string().contains(&place), "{report}");
    assert!(report.to_string().contains("give it more memory"), "{report}");
    let wrong = "[modules.counter]\nisolated = true\nisolation = { memory = 3, rearm = true, core = 1 }";
    let error = Configuration::from_text("test.toml", wrong, &Reading::default()).unwrap_err().to_string();
    assert!(error.contains("`memory` takes a size above zero"), "{error}");
    assert!(error.contains("core"), "{error}");
}
