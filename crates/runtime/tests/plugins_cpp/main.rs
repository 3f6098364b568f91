//! A plugin in C++, and what its author may do wrong: `cargo test -p slate-runtime --features slate-test-tools/external-tools`.
#![allow(
    unsafe_code,
    dead_code,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and it shares the support of the tests of plugins"
)]

#[path = "../plugins/fixtures.rs"]
mod fixtures;
#[path = "../plugins/support.rs"]
mod support;
#[path = "../common/trace.rs"]
mod trace;

use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

use crate::fixtures::{Folder, gcc, header_folder};
use crate::support::*;
use slate_blackboard::interface::Value;
use slate_runtime::log::MemoryTarget;
use slate_runtime::{Mode, PluginError};

/// Builds a plugin in C++ as its author would.
fn compile(compiler: &str, more: &[&str], library: &std::path::Path) {
    let mut command = Command::new(compiler);
    command.args(["-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O1", "-shared", "-fPIC"]);
    command.args(["-fvisibility=hidden", "-fvisibility-inlines-hidden"]).args(more);
    let (headers, fixtures) = header_folder();
    let built = command.arg("-I").arg(headers).arg(fixtures.join("average.cpp")).arg("-o").arg(library);
    let output = built.output().unwrap_or_else(|error| panic!("{compiler} is needed for this test: {error}"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The libraries in C++ and C, built once.
fn built() -> [PathBuf; 2] {
    static LIBRARIES: OnceLock<(Folder, [PathBuf; 2])> = OnceLock::new();
    let (_, files) = LIBRARIES.get_or_init(|| {
        let folder = Folder::new();
        let files = ["libaverage.so", "libsmoother.so"].map(|file| folder.path().join(file));
        compile("g++", &["-fno-gnu-unique"], &files[0]);
        gcc("smoother.c", &[], &files[1]);
        (folder, files)
    });
    files.clone()
}

fn robot() -> String {
    let [average, smoother] = built();
    format!(
        "{}{}[modules.average]\nparams = {{ gain = 0.25 }}\n[modules.smoother]\nparams = {{ gain = 0.25 }}\n[links]\n\
         \"average/input\" = \"beat/count\"\n\"smoother/input\" = \"beat/count\"\n",
        library("average", &average),
        library("smoother", &smoother)
    )
}

fn set(agent: &slate_runtime::Agent, parameter: &str, value: i128) {
    let path = format!("average/params/{parameter}");
    agent.board().write(&path, &Value::Integer(value), 0).unwrap();
}

/// What the log says so far; a thread of its own writes it.
fn log_text(log: &MemoryTarget) -> String {
    log.lines().iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

#[test]
fn plugin_in_cpp_computes_as_that_in_c() {
    let (mut agent, log) = logged_lockstep(&robot());
    let read = |agent: &slate_runtime::Agent, path: &str| agent.board().read(path).unwrap().unwrap().0;
    for _ in 0..50 {
        step(&mut agent, 1);
        assert_eq!(read(&agent, "average/mean"), read(&agent, "smoother/mean"));
    }
    assert_eq!(number(&agent, "average/mean/samples"), 50);
    until("the first sample's message", || log_text(&log).contains("first sample"));
    assert_says(&log_text(&log), &["average", "value", "0.25"]);
    let plugins = agent.composer().plugins();
    let plugin = plugins.iter().find(|plugin| plugin.name == "average").unwrap();
    assert_eq!((plugin.version.as_str(), plugin.loaded), ("0.9.0", true));
}

#[test]
fn exception_in_cpp_fails_that_module_with_its_message() {
    let (mut agent, log) = logged_lockstep(&robot());
    step(&mut agent, 3);
    set(&agent, "fails", 1);
    step(&mut agent, 20);
    let (_, _, panics) = agent.counts("average").unwrap();
    assert_eq!(panics, 5, "after five it stays off");
    assert_eq!(agent.counts("smoother").unwrap().0, 23);
    until("the exception's message", || log_text(&log).contains("the sensor speaks nonsense"));
    assert_says(&log_text(&log), &["average", "threw an exception: the sensor speaks nonsense"]);
    let safe = agent.board().read("average/mean/value").unwrap().unwrap().0.as_f64();
    assert_eq!(safe, Some(-1.0));
}

#[test]
fn plugin_in_cpp_keeps_its_state_over_a_reload() {
    let running = Running::start(&robot(), Mode::Staged, &["beat/count/value", "average/mean/samples"]);
    for _ in 0..3 {
        let reload = running.composer.reload("average", None).unwrap();
        assert_eq!(reload.modules, [("average".into(), Ok(()))]);
        assert!(reload.in_place);
        running.cycles(5);
    }
    let (_, _, samples) = running.stop();
    for row in &samples {
        assert_eq!(row[0], row[1], "a sample for each cycle, over every reload");
    }
}

#[test]
fn plugin_in_cpp_refuses_unloading_and_then_is_gone() {
    let mut agent = lockstep(&robot());
    set(&agent, "held", 1);
    step(&mut agent, 2);
    let refusal = agent.composer().unload("average").unwrap_err();
    assert!(matches!(refusal, PluginError::Veto { .. }), "{refusal:?}");
    assert_says(&complaint(&refusal), &["average", "its mean is being used"]);
    set(&agent, "held", 0);
    // An exception leaves nothing behind that keeps the library open.
    set(&agent, "fails", 1);
    step(&mut agent, 2);
    assert_eq!(agent.composer().unload("average").unwrap(), [("average".into(), "unmapped")]);
}

#[test]
fn interface_that_differs_in_cpp_is_refused_with_its_field() {
    let folder = Folder::new();
    let file = folder.path().join("libaverage.so");
    compile("clang++", &["-DNARROW"], &file);
    let refusal =
        try_lockstep(&robot().replace(built()[0].to_str().unwrap(), file.to_str().unwrap())).unwrap_err();
    let expected = [
        "`average/input` and `/beat/count` are different versions of Count",
        "`value` is u32 in ticks in `average/input` and u64 in ticks in `/beat/count`",
    ];
    assert_says(&complaint(&refusal), &expected);
}
