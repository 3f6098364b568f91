//! Modules that run on a recording have their places among those that are played.

use slate_replay::{Plan, Verdict};
use slate_runtime::{Agent, NewLink};

use crate::replay::repaired::verdict;
use crate::replay::support::{file, play, record};

/// Each but the source runs when there is something new, and says what it saw of it: one stands before the source, two beside each
/// other, and one behind them that reads the last cycle.
const ROBOT: &str = r#"
[agent]
name = "robot"
[loop]
period = "10ms"
[log.targets]
console = false
[modules.source]
[modules.before]
kind = "seen"
stage = "PreLoop"
[modules.x]
kind = "seen"
[modules.y]
kind = "seen"
[modules.behind]
kind = "seen"
stage = "Act"
[links]
"before/number" = "x/seen"
"before/other" = "source/number"
"x/number" = "source/number"
"x/other" = "y/seen"
"y/number" = "source/number"
"behind/number" = { from = "source/number", previous = true }
"behind/other" = "before/seen"
[record]
enabled = true
"#;

const MODULES: [&str; 5] = ["source", "before", "x", "y", "behind"];

fn is_the_same(path: &std::path::Path) {
    let all = MODULES.iter().flat_map(|one| MODULES.iter().map(move |other| [*one, *other]));
    for modules in all {
        let plan = Plan { modules: modules.iter().map(|name| (*name).into()).collect(), ..Plan::default() };
        let (_, outcome, player) = play(path, plan);
        let outcome = outcome.unwrap();
        assert_eq!(outcome.first, None, "{modules:?}: {outcome:?}");
        assert!(player.misses().is_empty() && outcome.unseen.is_empty(), "{modules:?}");
        let count = |name: &str| {
            let own = outcome.properties.iter().filter(|own| own.url.starts_with(&format!("/{name}/")));
            own.map(|own| own.same).sum::<u64>()
        };
        assert!(modules.iter().all(|name| count(name) > 20), "{outcome:?}");
    }
}

#[test]
fn each_module_sees_what_it_saw_in_the_cycles_in_which_it_ran() {
    let path = file("places.mcap");
    record(&path, ROBOT, |_, _| {});
    is_the_same(&path);
}

/// Also when the order of the modules becomes another one, and when one that they read is switched off.
#[test]
fn other_links_give_other_poses_and_a_module_off_is_not_ready() {
    let path = file("other-places.mcap");
    record(&path, ROBOT, |agent, cycle| {
        let changes: &[(&str, &str)] = match cycle {
            5 => &[("links.\"x/other\"", "false")],
            6 => &[("links.\"y/other\"", "\"x/seen\"")],
            9 => &[("modules.source.enabled", "false")],
            12 => &[("modules.source.enabled", "true")],
            15 => &[("links.\"before/number\"", "\"y/seen\""), ("modules.source.params.step", "0.5")],
            18 => &[("modules.y.enabled", "false")],
            20 => &[("modules.y.enabled", "true")],
            22 => &[("links.\"behind/other\"", "\"y/seen\"")],
            _ => return,
        };
        drop(agent.database().unwrap().set(changes).unwrap());
    });
    is_the_same(&path);
}

/// An input that is set by hand, and what may fill it instead: one of its fields, or all of it.
const BY_HAND: &str = r#"
[agent]
name = "robot"
[loop]
period = "10ms"
[log.targets]
console = false
[modules.source]
[modules.scale]
inputs.number.value = 1.5
[record]
enabled = true
"#;

const LINKS: [(&str, &str); 2] =
    [("scale/number/value", "source/number/value"), ("scale/number", "source/number")];

fn link((to, from): (&str, &str)) -> NewLink {
    NewLink::new(to, from)
}

/// Records it while `between` changes it; the recording is played, `scale` runs on it, and the whole run is made again.
fn is_playable(name: &str, between: impl FnMut(&Agent, usize)) {
    let path = file(name);
    record(&path, BY_HAND, between);
    play(&path, Plan::default());
    let (_, outcome, _) = play(&path, Plan { modules: ["scale".into()].into(), ..Plan::default() });
    let outcome = outcome.unwrap();
    assert_eq!(outcome.first, None, "{name}: {outcome:?}");
    let scaled = outcome.properties.iter().find(|own| own.url == "/scale/scaled");
    assert!(scaled.is_some_and(|own| own.same > 20), "{name}: {outcome:?}");
    let verdict = verdict(&path);
    assert!(matches!(verdict, Verdict::Identical { .. }), "{name}: {verdict:?}");
}

fn set(agent: &Agent, value: &str) {
    agent.database().unwrap().set(&[("modules.scale.inputs.number.value", value)]).unwrap();
}

#[test]
fn link_on_trial_leaves_no_trace_in_a_recording() {
    for (place, with) in LINKS.into_iter().enumerate() {
        is_playable(&format!("on-trial-{place}.mcap"), |agent, cycle| match cycle {
            5 => drop(agent.composer().check_link(&link(with)).unwrap()),
            9 => set(agent, "0.5"),
            _ => {}
        });
    }
}

#[test]
fn link_and_unlink_of_a_set_input_can_be_replayed() {
    for (place, with) in LINKS.into_iter().enumerate() {
        is_playable(&format!("linked-for-a-while-{place}.mcap"), |agent, cycle| match cycle {
            4 => set(agent, "0.5"),
            8 => drop(agent.composer().link(&link(with)).unwrap()),
            16 => drop(agent.composer().unlink(with.0).unwrap()),
            20 => set(agent, "2.5"),
            _ => {}
        });
    }
}
