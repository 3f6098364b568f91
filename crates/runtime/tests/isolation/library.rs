//! Libraries of isolated modules: the process of a module opens its library, and one that was built with
//! `panic = "abort"` the host does not open at all.

use std::path::PathBuf;
use std::process::Command;

use slate_runtime::{Agent, Options, PluginError, Rate, StartError};

use crate::Test;
use crate::common::{configuration, number};
use crate::modules::plugins;

pub const TESTS: [Test; 3] = [
    ("a library that aborts is refused unless it is isolated", refused_in_the_host),
    ("a library is opened by the process of its module", opened_elsewhere),
    ("an isolated module is reloaded, vetoes and is unloaded", reloaded_and_unloaded),
];

/// Builds the plugin in a folder of this run.
fn build(version: u32) -> PathBuf {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("isolation");
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join(format!("c_counter_{version}.so"));
    let built = Command::new("cc")
        .args(["-shared", "-fPIC", "-o"])
        .arg(&file)
        .arg(format!("-DSTEP={version}"))
        .arg(format!("-DVERSION=\"{version}\""))
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/isolation/counter.c"))
        .status();
    assert!(built.unwrap().success());
    file
}

fn load(isolated: bool) -> Result<Agent, StartError> {
    let text = format!(
        "time.source = \"pulse\"\n[modules.pulse]\n[modules.c_counter]\nisolated = {isolated}\n\
         [plugins.c_counter]\nfile = {:?}\n",
        build(1)
    );
    Agent::load(&configuration(&text), &plugins(), Options { rate: Rate::Max, ..Options::default() })
}

fn is_mapped() -> bool {
    std::fs::read_to_string("/proc/self/maps").unwrap().contains("c_counter")
}

fn refused_in_the_host() {
    let error = load(false).unwrap_err().to_string();
    assert!(error.contains("panic = \"abort\""), "{error}");
}

fn opened_elsewhere() {
    let mut agent = load(true).unwrap();
    for _ in 0..5 {
        agent.step();
    }
    assert_eq!(number(&agent, "c_counter/number/value"), 5.0);
    assert!(!is_mapped());
    let id = number(&agent, "c_counter/process/id");
    let maps = std::fs::read_to_string(format!("/proc/{id}/maps")).unwrap();
    assert!(maps.contains("c_counter_1.so"), "{maps}");
}

fn reloaded_and_unloaded() {
    let mut agent = load(true).unwrap();
    for _ in 0..3 {
        agent.step();
    }
    let composer = agent.composer();
    let Err(PluginError::Veto { reason, .. }) = composer.unload("c_counter") else {
        panic!("it vetoes");
    };
    assert_eq!(reason, "it counts on");
    let refusal = composer.shadow("c_counter", &build(2)).unwrap_err().to_string();
    assert!(refusal.contains("module `c_counter` is isolated"), "{refusal}");
    let reload = composer.reload("c_counter", Some(&build(2))).unwrap();
    assert!(reload.in_place);
    assert_eq!(reload.modules, [("c_counter".to_owned(), Ok(()))]);
    for _ in 0..4 {
        agent.step();
    }
    assert_eq!(number(&agent, "c_counter/number/value"), 3.0 + 4.0 * 2.0);
    let id = number(&agent, "c_counter/process/id");
    composer.unload("c_counter").unwrap();
    assert!(!std::path::Path::new(&format!("/proc/{id}")).exists(), "its process has ended");
    agent.step();
    // What was read off the disk is not left there.
    let copies = std::fs::read_dir(std::env::temp_dir()).unwrap().flatten();
    let prefix = format!("slate-{}-", std::process::id());
    assert_eq!(copies.filter(|copy| copy.file_name().to_string_lossy().starts_with(&prefix)).count(), 0);
}
