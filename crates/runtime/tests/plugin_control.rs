//! The aspect `Plugins`: modules request changes of their agent, and no tick waits for one.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and threads are a matter of the wall clock"
)]

use crate::scripted;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use scripted::{Number, Stage, eventually, script};
use slate_module::aspect::{PluginAnswer, PluginEntry, Stop};
use slate_module::prelude::*;

/// A module that asks once, and another plugin's module.
fn robot(asking: &str, other: &str) -> String {
    format!("[modules.{asking}]\nkind = \"scripted\"\n[modules.{other}]\nkind = \"extra\"\n")
}

/// Asks in its first tick, and passes on what comes of it.
fn asks(module: &str, ask: impl Fn(&scripted::ScriptedIo) -> u64 + Send + 'static) -> Arc<Asked> {
    let asked = Arc::new(Asked::default());
    let (seen, mut request) = (Arc::clone(&asked), None);
    script(module, move |io, _| {
        match request {
            None => {
                let number = ask(io);
                assert_eq!(io.plugins.answer(number), PluginAnswer::Pending);
                request = Some(number);
            }
            Some(number) => match io.plugins.answer(number) {
                PluginAnswer::Pending => drop(seen.pending.fetch_add(1, Ordering::SeqCst)),
                other => *seen.answer.lock().unwrap() = Some(other),
            },
        }
        *seen.list.lock().unwrap() = io.plugins.list();
        Outcome::Ok
    });
    asked
}

#[derive(Default)]
struct Asked {
    /// Ticks that found it was not done yet.
    pending: AtomicU64,
    answer: std::sync::Mutex<Option<PluginAnswer>>,
    list: std::sync::Mutex<Vec<PluginEntry>>,
}

impl Asked {
    fn wait(&self, stage: &mut Stage) -> PluginAnswer {
        stage.until_true("an answer", |_| self.answer.lock().unwrap().is_some());
        self.answer.lock().unwrap().clone().unwrap()
    }

    /// The plugins, and whether they are loaded.
    fn list(&self) -> Vec<(String, bool)> {
        self.list.lock().unwrap().iter().map(|entry| (entry.name.clone(), entry.loaded)).collect()
    }
}

fn refused(answer: PluginAnswer) -> String {
    match answer {
        PluginAnswer::Refused(reason) => reason,
        other => panic!("{other:?}"),
    }
}

fn owned(list: &[(&str, bool)]) -> Vec<(String, bool)> {
    list.iter().map(|(name, loaded)| ((*name).into(), *loaded)).collect()
}

#[test]
fn a_module_unloads_another_plugin_and_sees_it_in_the_list() {
    let asked = asks("unloader", |io| io.plugins.unload("extra"));
    let mut stage = Stage::load(&robot("unloader", "unloaded"));
    stage.step();
    assert_eq!(asked.list(), owned(&[("beat", true), ("scripted", true), ("extra", true)]));
    assert_eq!(asked.wait(&mut stage), PluginAnswer::Done("the library of extra is linked in".into()));
    assert!(stage.agent.modules().iter().all(|module| module != "unloaded"));
    stage.step();
    assert_eq!(asked.list(), owned(&[("beat", true), ("scripted", true), ("extra", false)]));
}

#[test]
fn impossible_request_is_refused_with_reason() {
    for (module, ask, expected) in [
        ("loader_of_none", 1, "no plugin `nothing`"),
        ("unloader_of_none", 2, "no plugin `nothing`"),
        ("reloader_of_none", 3, "no plugin `nothing`"),
    ] {
        let asked = asks(module, move |io| match ask {
            1 => io.plugins.load("nothing"),
            2 => io.plugins.unload("nothing"),
            _ => io.plugins.reload("nothing"),
        });
        let mut stage = Stage::load(&robot(module, "other"));
        let reason = refused(asked.wait(&mut stage));
        assert!(reason.contains(expected), "{reason}");
    }
    let asked = asks("loader_of_loaded", |io| io.plugins.load("extra"));
    let mut stage = Stage::load(&robot("loader_of_loaded", "other"));
    assert_eq!(refused(asked.wait(&mut stage)), "plugin `extra` is already loaded");
    let asked = asks("unloader_of_time", |io| io.plugins.unload("beat"));
    let mut stage = Stage::load(&robot("unloader_of_time", "other"));
    assert_eq!(
        refused(asked.wait(&mut stage)),
        "module `beat` is the time source, and without it no time passes"
    );
}

#[test]
fn a_module_cannot_unload_the_code_that_it_runs() {
    let expected = |name: &str, module: &str| {
        format!("`{name}` has the code of `{module}`, which asks for it to be unloaded")
    };
    let asked = asks("suicidal", |io| io.plugins.unload("scripted"));
    let mut stage = Stage::load(&robot("suicidal", "other"));
    assert_eq!(refused(asked.wait(&mut stage)), expected("scripted", "suicidal"));

    let asked = asks("sly", |io| io.plugins.unload("everything"));
    let list = "[plugins.everything]\nplugins = [\"extra\", \"scripted\"]\n";
    let mut stage = Stage::load(&(robot("sly", "other") + list));
    assert_eq!(refused(asked.wait(&mut stage)), expected("everything", "sly"));
    assert!(stage.agent.modules().iter().any(|module| module == "other"));
}

#[test]
fn requests_of_failed_tick_are_dropped() {
    script("failing_asker", |io, now| match now.number() {
        1 => {
            assert_eq!(io.plugins.unload("extra"), 1);
            Outcome::Failed
        }
        _ => {
            assert_eq!(io.plugins.answer(1), PluginAnswer::Unknown);
            io.number.set(Number { value: now.number() });
            Outcome::Ok
        }
    });
    let mut stage = Stage::load(&robot("failing_asker", "spared"));
    stage.until("failing_asker", 200);
    assert!(stage.agent.modules().iter().any(|module| module == "spared"));
}

#[test]
fn no_tick_waits_for_a_change_that_takes_long() {
    let released = Arc::new(AtomicBool::new(false));
    let release = Arc::clone(&released);
    script("slow_to_go", move |io, now| {
        if now.number() == 1 {
            let release = Arc::clone(&release);
            let mule = move |_: &Stop| {
                while !release.load(Ordering::SeqCst) {
                    std::thread::sleep(Duration::from_millis(1));
                }
            };
            io.threads.spawn("mule", mule).unwrap();
        }
        Outcome::Ok
    });
    let asked = asks("impatient", |io| io.plugins.unload("extra"));
    let mut stage = Stage::load(&robot("impatient", "slow_to_go"));
    let answer = asked.wait(&mut stage);
    assert!(refused(answer).starts_with("thread `mule` of module `slow_to_go` has not ended"));
    let pending = asked.pending.load(Ordering::SeqCst);
    assert!(pending > 20, "{pending}");
    released.store(true, Ordering::SeqCst);
}

#[test]
fn the_last_64_requests_are_known_and_each_gets_its_own_answer() {
    script("curious", |io, now| {
        match now.number() {
            1 => (1..=65).for_each(|number| {
                assert_eq!(io.plugins.load(&format!("plugin-{number}")), number);
            }),
            2 => assert_eq!(io.plugins.answer(1), PluginAnswer::Unknown),
            _ => {
                let answered = |number: &u64| match io.plugins.answer(*number) {
                    PluginAnswer::Refused(reason) => reason.contains(&format!("`plugin-{number}`")),
                    other => {
                        assert_eq!(other, PluginAnswer::Pending);
                        false
                    }
                };
                io.number.set(Number { value: (2..=65).filter(answered).count() as u64 });
            }
        }
        Outcome::Ok
    });
    let mut stage = Stage::new(&["curious"]);
    stage.until("curious", 64);
    assert_eq!(stage.agent.counts("curious").unwrap().2, 0, "{:?}", stage.lines());
}

#[test]
fn ended_agent_leaves_no_requesting_thread() {
    let asked = asks("hasty", |io| io.plugins.unload("extra"));
    let mut stage = Stage::load(&robot("hasty", "other"));
    stage.step();
    let board = Arc::downgrade(stage.agent.board());
    drop(stage);
    eventually("all of the agent is gone", || board.strong_count() == 0);
    drop(asked);
}

#[test]
fn changes_are_made_while_the_loop_runs_on_the_wall_clock() {
    let asked = asks("runner", |io| io.plugins.unload("extra"));
    let mut stage = Stage::on_the_wall_clock_with(&robot("runner", "other"));
    let seen = Arc::clone(&asked);
    let until_answered = Box::new(move |_: &slate_runtime::Cycle<'_>| {
        let answered = seen.answer.lock().unwrap().is_some();
        if answered { slate_runtime::Control::Stop } else { slate_runtime::Control::Continue }
    });
    stage.agent.run(until_answered).unwrap();
    assert_eq!(
        asked.answer.lock().unwrap().clone(),
        Some(PluginAnswer::Done("the library of extra is linked in".into()))
    );
}
