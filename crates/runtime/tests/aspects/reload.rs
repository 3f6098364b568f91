//! A service of a plugin that is a shared library.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use slate_module::Plugin;

use crate::aspects::common::number;
use crate::aspects::light::Lamp;
use crate::aspects::{agent, complaint, condition, full, steps, ticks};

/// The plugin `torch`, built on first use.
fn torch() -> &'static Path {
    static LIBRARY: OnceLock<PathBuf> = OnceLock::new();
    LIBRARY.get_or_init(|| build("aspects-torch", include_str!("fixtures/torch.rs")))
}

/// A later version of it, which has one more port.
fn torch_with_a_port() -> PathBuf {
    let (ports, more) = ("pub struct Io {", "pub struct Io {\n    power: Input<Power>,");
    let text = include_str!("fixtures/torch.rs");
    assert!(text.contains(ports));
    let power = "/// Power.\n#[interface]\npub struct Power {\n    /// Watts.\n    pub watts: f64,\n}\n";
    build("aspects-torch-port", &(text.replace(ports, more) + power))
}

/// Builds a version of the plugin `torch` in a folder of that name.
fn build(folder: &str, source: &str) -> PathBuf {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let library = folder.replace('-', "_");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(folder);
    fs::create_dir_all(folder.join("src")).unwrap();
    // All plugins of tests are built in one folder, with the same settings, so that what they need is built once.
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).join("plugin-target");
    // Two runs of the tests at a time take turns.
    let lock = File::create(folder.join("lock")).unwrap();
    lock.lock().unwrap();
    let manifest = format!(
        "[workspace]\n[package]\nname = \"torch\"\nversion = \"1.0.0\"\nedition = \"2024\"\n\
         [lib]\nname = \"{library}\"\ncrate-type = [\"cdylib\"]\n[dependencies]\nslate-plugin = {{ path = \"{}\" }}\n\
         [profile.dev]\ndebug = false\nincremental = false\n",
        crates.join("plugin").display()
    );
    fs::write(folder.join("Cargo.toml"), manifest).unwrap();
    fs::write(folder.join("src/lib.rs"), source).unwrap();
    // The versions that Slate itself is built with are on this machine for sure.
    fs::copy(crates.join("../Cargo.lock"), folder.join("Cargo.lock")).unwrap();
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["build", "--offline", "--quiet", "--manifest-path"])
        .arg(folder.join("Cargo.toml"))
        .arg("--target-dir")
        .arg(&target)
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_BUILD_TARGET")
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    target.join(format!("debug/lib{library}.so"))
}

/// A torch of the library, whose tick is the last of a cycle, and a lamp that is linked in.
fn robot(more: &str) -> String {
    let file = torch().display();
    format!(
        "[plugins.torch]\nfile = \"{file}\"\n{more}\n[modules.torch]\nstage = \"PostLoop\"\n[modules.lamp]\n"
    )
}

fn plugins() -> Vec<Plugin> {
    vec![Plugin::linked::<Lamp>()]
}

#[test]
fn users_of_a_service_wait_while_its_provider_is_reloaded() {
    let mut agent = agent(&robot(""), &plugins());
    steps(&mut agent, 3);
    assert_eq!((ticks(&agent, "lamp"), number(&agent, "lamp/brightness/value")), (2, 1001.0));
    for again in 0..3 {
        let reload = agent.composer().reload("torch", None).unwrap();
        assert!(reload.in_place);
        assert_eq!(reload.modules, [("torch".to_owned(), Ok(()))]);
        steps(&mut agent, 1);
        assert_eq!(condition(&agent, "lamp"), "WAITING", "until the new code provides it");
        assert_eq!(number(&agent, "lamp/brightness/value"), -1.0);
        steps(&mut agent, 1);
        assert_eq!(condition(&agent, "lamp"), "WORKING");
        assert_eq!(number(&agent, "lamp/brightness/value"), 1002.0 + f64::from(again), "the new one");
    }
}

#[test]
fn a_provider_whose_service_is_used_does_not_get_other_ports() {
    let mut agent = agent(&robot(""), &plugins());
    steps(&mut agent, 3);
    let version = torch_with_a_port();
    let error = full(&agent.composer().reload("torch", Some(&version)).unwrap_err());
    assert!(error.contains("`lamp` needs `light_meter 1`, which nothing provides"), "{error}");
    steps(&mut agent, 1);
    // The service was not taken from it for a moment.
    assert_eq!((ticks(&agent, "lamp"), number(&agent, "lamp/brightness/value")), (3, 1001.0));
    assert!(agent.board().find("torch/power").is_err());
    assert_eq!(agent.composer().reload("torch", None).unwrap().modules, [("torch".to_owned(), Ok(()))]);
    steps(&mut agent, 2);
    assert_eq!(number(&agent, "lamp/brightness/value"), 1002.0);
    // Without users it does.
    agent.composer().unload("lamp").unwrap();
    let reload = agent.composer().reload("torch", Some(&version)).unwrap();
    assert!(!reload.in_place && reload.modules == [("torch".to_owned(), Ok(()))], "{reload:?}");
    steps(&mut agent, 1);
    assert!(agent.board().find("torch/power").is_ok());
}

#[test]
fn new_code_is_not_tried_on_modules_with_services() {
    let mut agent = agent(&robot(""), &plugins());
    steps(&mut agent, 2);
    let error = full(&agent.composer().shadow("torch", torch()).unwrap_err());
    assert!(error.contains("module `torch` uses services") && error.contains("reload"), "{error}");
    assert!(agent.composer().plugins().iter().all(|plugin| plugin.shadow.is_none()));
}

#[test]
fn the_code_of_a_service_stays_as_long_as_it_is_used() {
    let mut agent = agent(&robot(""), &plugins());
    steps(&mut agent, 3);
    let error = full(&agent.composer().unload("torch").unwrap_err());
    assert!(error.contains("`lamp` needs `light_meter 1`, which nothing provides"), "{error}");
    steps(&mut agent, 1);
    assert_eq!(ticks(&agent, "lamp"), 3);
    agent.composer().unload("lamp").unwrap();
    let unloaded = agent.composer().unload("torch").unwrap();
    assert_eq!(unloaded[0].0, "torch");
    steps(&mut agent, 1);
}

#[test]
fn a_service_of_a_plugin_that_is_not_loaded_is_named() {
    let text = complaint(&robot("load = false"), &plugins());
    assert!(text.contains("`lamp` needs `light_meter 1`, which nothing provides"), "{text}");
    assert!(text.contains("load a plugin that provides it; not loaded: torch"), "{text}");
}
