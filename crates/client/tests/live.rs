//! Programs in C that talk to a live agent, found by pkg-config and by CMake.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and starts programs"
)]

use std::path::{Path, PathBuf};
use std::process::{self, Command};
use std::sync::OnceLock;

use slate_control::Server;
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{self, Database};
use slate_runtime::{Agent, Control, Options};

/// Number.
#[interface]
#[derive(PartialEq)]
pub struct Number {
    /// Value.
    #[unit("m")]
    pub value: f64,
}

/// Ports.
#[ports]
pub struct Io {
    input: Input<Number>,
    inbox: Inbox<Number>,
    sum: Output<Number>,
}

/// Parameters.
#[params]
pub struct Params {
    #[param(default = 0.5, range = 0.0..=1.0, unit = "m", doc = "added to the input")]
    offset: f64,
}

/// Adds its parameter and its messages to its input.
pub struct Adder;

#[module(stage = Think)]
impl Module for Adder {
    type Io = Io;
    type Params = Params;
    type State = f64;

    fn tick(sent: &mut f64, io: &Io, params: &Params, now: &Tick) -> Outcome {
        for message in io.inbox.iter() {
            if message.value < 0.0 {
                message.refuse(7);
            } else {
                *sent += message.value;
            }
        }
        let input = io.input.get().map_or(0.0, |input| input.value);
        let value = input + params.offset + *sent;
        // Each value is another one for those who watch.
        io.sum.set(Number { value: value + now.number() as f64 * 1e-6 });
        Outcome::Ok
    }
}

/// Where the library is installed, from what the tests were built with.
fn prefix() -> &'static Path {
    static PREFIX: OnceLock<PathBuf> = OnceLock::new();
    PREFIX.get_or_init(|| {
        let prefix = Path::new(env!("CARGO_TARGET_TMPDIR")).join("prefix");
        let built = std::env::current_exe().unwrap().parent().unwrap().to_owned();
        run(Command::new(Path::new(env!("CARGO_MANIFEST_DIR")).join("install")).arg(&prefix).arg(built));
        prefix
    })
}

fn run(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    printed(Path::new(command.get_program()), &output)
}

fn printed(program: &Path, output: &process::Output) -> String {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{}: {}\n{out}{err}", program.display(), output.status);
    out
}

fn sources() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/c")
}

/// Runs a program while an agent runs, and returns what it prints.
fn beside_agent(name: &str, program: &Path) -> String {
    let text = "[modules.adder]\n";
    let name = format!("client-{}-{name}", std::process::id());
    let file = format!("{name}.toml");
    let database = Database::from_text(&file, text, configuration::Options::default()).unwrap();
    let options = Options { armed: true, ..Options::default() };
    let mut agent = Agent::load_with(&database, &[Plugin::linked::<Adder>()], options).unwrap();
    let server = Server::open(&agent).unwrap();
    let stopper = agent.stopper();
    let name = server.name().to_owned();
    std::thread::scope(|threads| {
        let output = threads.spawn(|| {
            let output =
                Command::new(program).arg(name).env("LD_LIBRARY_PATH", prefix().join("lib")).output();
            stopper.stop();
            output
        });
        agent.run(Box::new(|_| Control::Continue)).unwrap();
        printed(program, &output.join().unwrap().unwrap())
    })
}

#[test]
fn c_program_reads_sets_watches_and_sends() {
    let program = prefix().join("talk");
    let flags = run(Command::new("pkg-config")
        .args(["--cflags", "--libs", "slate"])
        .env("PKG_CONFIG_PATH", prefix().join("lib/pkgconfig")));
    run(Command::new("cc")
        .args(["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-g", "-o"])
        .arg(&program)
        .arg(sources().join("talk.c"))
        .args(flags.split_whitespace()));
    let printed = beside_agent("talk", &program);
    assert!(printed.ends_with("done\n"), "{printed}");
}

#[test]
fn cmake_finds_the_library_for_c_and_cpp() {
    let build = prefix().join("cmake-build");
    let mut configure = Command::new("cmake");
    configure.arg("-S").arg(sources()).arg("-B").arg(&build);
    run(configure.arg(format!("-DCMAKE_PREFIX_PATH={}", prefix().display())));
    run(Command::new("cmake").arg("--build").arg(&build));
    let printed = beside_agent("cmake", &build.join("read"));
    assert!(printed.starts_with("sum 0.5"), "{printed}");
}
