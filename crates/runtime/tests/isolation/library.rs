//! Libraries of isolated modules: the process of a module opens its library, and one that was built with
//! `panic = "abort"` the host does not open at all.

use std::path::{Path, PathBuf};
use std::process::Command;

use object::{Object, ObjectSection};
use slate_runtime::plugin;
use slate_runtime::{Agent, Options, PluginError, Rate, StartError};

use crate::Test;
use crate::common::{configuration, number};
use crate::modules::plugins;

pub const TESTS: [Test; 5] = [
    ("a library that aborts is refused unless it is isolated", refused_in_the_host),
    ("a library is opened by the process of its module", opened_elsewhere),
    ("a library that ends who opens it ends no host", tried_first),
    ("an isolated module is reloaded, vetoes and is unloaded", reloaded_and_unloaded),
    ("failures before a reload are forgotten", forgotten),
];

/// Builds the plugin in a folder of this run.
fn build(version: u32) -> PathBuf {
    build_with(&format!("c_counter_{version}.so"), version, &[])
}

fn build_with(name: &str, version: u32, more: &[&str]) -> PathBuf {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("isolation");
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join(name);
    let built = Command::new("cc")
        .args(["-shared", "-fPIC", "-o"])
        .arg(&file)
        .args(more)
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

/// That it can't be opened, and why.
fn refusal(file: &Path) -> String {
    let refusal = plugin::load(file).expect_err("it ends who opens it");
    assert!(refusal.to_string().contains(&file.display().to_string()), "{refusal}");
    refusal.problem
}

fn tried_first() {
    let unwind = "-DPANIC=\"unwind\"";
    let deeds = [
        ("exit(0)", "ended with exit code 0"),
        ("abort()", "ended by signal 6 (abort)"),
        ("*(volatile int *)8 = 0", "ended by signal 11 (segmentation fault)"),
    ];
    for (deed, end) in deeds {
        let file = build_with("ends.so", 1, &[unwind, &format!("-DOPENED={deed}")]);
        let problem = refusal(&file);
        assert!(problem.contains("a process that tried it first") && problem.contains(end), "{problem}");
    }
    let whole = build_with("whole.so", 1, &[unwind]);
    assert!(plugin::load(&whole).is_ok());
    let bytes = std::fs::read(&whole).unwrap();
    let parsed = object::read::elf::ElfFile64::<object::Endianness>::parse(&*bytes).unwrap();
    let mut ended = 0;
    for name in [".gnu.hash", ".dynamic"] {
        let (start, length) = parsed.section_by_name(name).unwrap().file_range().unwrap();
        // The upper half of a word makes an address that no process has.
        for at in (start + 4..start + length).step_by(8).map(|at| at as usize) {
            let mut damaged = bytes.clone();
            damaged[at..at + 4].fill(0x7f);
            let file = whole.with_file_name("damaged.so");
            std::fs::write(&file, damaged).unwrap();
            let loaded = plugin::load(&file);
            ended +=
                usize::from(loaded.is_err_and(|error| error.problem.contains("tried it first ended by")));
        }
    }
    assert!(ended > 0);
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

/// Kills the process of the module; the milliseconds of the agent's time until the module works again.
fn away_when_killed(agent: &mut Agent) -> u64 {
    let condition = |agent: &Agent| {
        let (value, _) = agent.board().read("c_counter/state/condition").unwrap().unwrap();
        value.as_str().unwrap().to_owned()
    };
    let id = number(agent, "c_counter/process/id").to_string();
    assert!(Command::new("kill").args(["-KILL", &id]).status().unwrap().success());
    let mut steps_until = |wanted: &str| {
        let steps = (0..2000).find(|_| {
            agent.step();
            condition(agent) == wanted
        });
        assert!(steps.is_some(), "it never is {wanted}");
        agent.now()
    };
    (steps_until("FAILED").abs_diff(steps_until("WORKING"))) / 1_000_000
}

fn forgotten() {
    let mut agent = load(true).unwrap();
    agent.step();
    for version in [2, 1] {
        assert_eq!([(); 4].map(|()| away_when_killed(&mut agent)), [100, 200, 400, 800]);
        agent.composer().reload("c_counter", Some(&build(version))).unwrap();
    }
}
