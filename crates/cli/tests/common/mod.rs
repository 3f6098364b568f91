//! The command as a user calls it, from a folder of its own.
#![allow(dead_code, reason = "each test uses a part of it")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::io::Write;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use serde_json::Value;

/// A robot's world, in which no run ends by itself.
pub const WORLD: &str = r#"
[world]
arena = "rocs_arena"
layout = "start"
goal = [0.0, 0.0]
robots.r2 = { model = "pioneer_p3dx" }
layouts.start.robots.r2 = { x = 0.6, y = 0.8, theta = 0.0 }
"#;

/// A fresh folder that a test works in. Its thread has the test's name, so tests beside each other may choose the same name.
pub fn folder(name: &str) -> PathBuf {
    let test = std::thread::current().name().unwrap_or("thread").replace("::", "-");
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(test).join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// Calls the command in a folder.
pub fn slate(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_slate")).args(arguments).current_dir(folder).output().unwrap()
}

/// A domain of DDS that no other test of this process has, and hardly anybody else.
pub fn domain() -> String {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    let number = std::process::id().wrapping_mul(8).wrapping_add(NEXT.fetch_add(1, Ordering::Relaxed));
    (100 + number % 130).to_string()
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The last line of stdout, which is JSON.
pub fn json(output: &Output) -> Value {
    let stdout = text(&output.stdout);
    serde_json::from_str(stdout.lines().last().unwrap_or_default()).unwrap_or_else(|_| panic!("{output:?}"))
}

/// The summary of a headless run of EXP1, and the exit code.
pub fn exp1(folder: &Path, arguments: &[&str]) -> (Value, Option<i32>) {
    let mut all = vec!["run", "exp1", "--headless", "--json"];
    all.extend(arguments);
    let output = slate(folder, &all);
    (json(&output), output.status.code())
}

/// Waits until something is so, and says what it was if it is not within a time that no machine needs.
pub fn wait_for(what: &str, mut is_so: impl FnMut() -> bool) {
    for _ in 0..600 {
        if is_so() {
            return;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    panic!("{what}: not within 30 s");
}

/// A run in the background, whose tools find it and no other one. It is killed when this is dropped.
pub struct Running {
    folder: PathBuf,
    /// Where sockets are; the path of a socket can't be long.
    sockets: PathBuf,
    runs: Vec<Child>,
    /// The program, and the calling user, if it differs from the user of this process.
    ordinary: Option<(PathBuf, u32)>,
}

/// Unused user.
const ORDINARY_USER: u32 = 54_321;

impl Running {
    /// Nothing runs yet.
    pub fn new(name: &str) -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let sockets = std::env::temp_dir().join(format!("slate-test-{}-{number}-{name}", std::process::id()));
        std::fs::create_dir_all(&sockets).unwrap();
        Self { folder: folder(name), sockets, runs: Vec::new(), ordinary: None }
    }

    /// Calls the command as an ordinary user from now on, to which the limits of the system apply.
    pub fn become_ordinary_user(&mut self) {
        let found = Command::new("id").arg("-u").output().unwrap();
        if text(&found.stdout).trim() != "0" {
            return;
        }
        let program = self.sockets.join("program");
        // It may lie where only its owner gets to.
        std::fs::copy(env!("CARGO_BIN_EXE_slate"), &program).unwrap();
        for place in [&self.sockets, &self.folder, &program] {
            std::os::unix::fs::chown(place, Some(ORDINARY_USER), Some(ORDINARY_USER)).unwrap();
        }
        self.ordinary = Some((program, ORDINARY_USER));
    }

    /// As [`command`](Running::command), for a process that gets no thread beside its first.
    pub fn command_without_threads(&self, arguments: &[&str]) -> Command {
        let own = self.command(arguments);
        let mut limited = Command::new("prlimit");
        limited.arg("--nproc=1:1").arg(own.get_program()).args(own.get_args());
        self.prepare(&mut limited);
        limited
    }

    /// Lets the first run make no more threads, nor processes.
    pub fn take_threads(&self) {
        let mut limit = Command::new("prlimit");
        limit.args(["--pid", &self.runs[0].id().to_string(), "--nproc=1:1"]);
        self.prepare(&mut limit);
        assert!(limit.status().unwrap().success());
    }

    fn prepare(&self, command: &mut Command) {
        command.current_dir(&self.folder).env("XDG_RUNTIME_DIR", &self.sockets);
        command.env("XDG_STATE_HOME", &self.sockets);
        if let Some((_, user)) = self.ordinary {
            command.uid(user).gid(user);
        }
    }

    /// Where the command is called.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Where its sockets are.
    pub fn sockets(&self) -> &Path {
        &self.sockets
    }

    /// Lets sockets be somewhere else from now on.
    pub fn use_sockets(&mut self, folder: &Path) {
        let _ = std::fs::remove_dir_all(&self.sockets);
        self.sockets = folder.into();
    }

    /// Starts a run, and waits until its tools reach it.
    pub fn start(&mut self, agent: &str, arguments: &[&str]) {
        self.launch(agent, self.command(arguments));
    }

    /// Starts a run by a command of its own, and waits until its tools reach it.
    pub fn launch(&mut self, agent: &str, mut command: Command) {
        self.runs.push(command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap());
        for _ in 0..600 {
            if self.call(&["module", "list", "--agent", agent]).status.success() {
                return;
            }
            if let Some(status) = self.runs.last_mut().unwrap().try_wait().unwrap() {
                let output = self.runs.pop().unwrap().wait_with_output().unwrap();
                panic!("the run has ended with {status}: {output:?}");
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        panic!("{agent} is not reached");
    }

    /// The command, to be called in another way.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let own = Path::new(env!("CARGO_BIN_EXE_slate"));
        let mut command = Command::new(self.ordinary.as_ref().map_or(own, |(program, _)| program));
        command.args(arguments);
        self.prepare(&mut command);
        command
    }

    /// Calls the command where no file may grow, which fails like a disk that is full.
    pub fn on_full_disk(&self, arguments: &[&str]) -> Output {
        let own = self.command(arguments);
        let mut limited = Command::new("sh");
        limited.args(["-c", "trap '' XFSZ; ulimit -f 0; exec \"$@\"", "sh"]).arg(own.get_program());
        limited.args(own.get_args()).current_dir(&self.folder).env("XDG_RUNTIME_DIR", &self.sockets);
        limited.output().unwrap()
    }

    /// Calls the command.
    pub fn call(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    /// What the command prints when all goes well.
    pub fn done(&self, arguments: &[&str]) -> String {
        let output = self.call(arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {output:?}");
        text(&output.stdout)
    }

    /// What the command says when it ends with that code.
    pub fn fails(&self, code: i32, arguments: &[&str], words: &[&str]) -> String {
        let output = self.call(arguments);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {output:?}");
        for word in words {
            assert!(stderr.contains(word), "{arguments:?} does not say `{word}`: {stderr}");
        }
        stderr
    }

    /// Asks an agent at its socket.
    pub fn ask(&self, agent: &str, method: &str, path: &str, body: &str) -> Value {
        let socket = self.sockets.join("slate").join(format!("{agent}.sock"));
        let mut stream = UnixStream::connect(socket).unwrap();
        let length = body.len();
        let request = format!(
            "{method} /api/v1{path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
             Content-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}"
        );
        stream.write_all(request.as_bytes()).unwrap();
        let answer = std::io::read_to_string(stream).unwrap();
        serde_json::from_str(answer.split_once("\r\n\r\n").unwrap().1).unwrap()
    }

    /// A value on the blackboard.
    pub fn read(&self, agent: &str, url: &str) -> Value {
        self.ask(agent, "GET", &format!("/slate/{agent}{url}"), "")["value"].clone()
    }

    /// Waits for the end of the first run.
    pub fn finish(&mut self) -> Output {
        self.runs.remove(0).wait_with_output().unwrap()
    }

    /// Asks the first run to end, as Ctrl-C does.
    pub fn interrupt(&self) {
        self.signal("INT");
    }

    /// Sends the first run a signal.
    pub fn signal(&self, name: &str) {
        let id = self.runs[0].id().to_string();
        assert!(Command::new("kill").args([&format!("-{name}"), &id]).status().unwrap().success());
    }

    /// Ends the first run at once, without a chance to clean up.
    pub fn kill(&mut self) {
        let mut run = self.runs.remove(0);
        run.kill().unwrap();
        run.wait().unwrap();
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        while !self.runs.is_empty() {
            self.kill();
        }
        let _ = std::fs::remove_dir_all(&self.sockets);
    }
}

/// Calls cargo in the folder of a plugin. What it builds is kept for the next time, and nothing is downloaded.
pub fn cargo(folder: &Path, verb: &str) -> String {
    let output = quick_build(&mut Command::new(std::env::var("CARGO").unwrap_or("cargo".into())))
        .args([verb, "--offline"])
        .current_dir(folder)
        .env("CARGO_TARGET_DIR", plugin_target())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    text(&output.stdout)
}

/// Where a library is that [`cargo`] has built.
pub fn built_plugin(library: &str) -> PathBuf {
    plugin_target().join("debug").join(library)
}

/// What all plugins need is built once: this folder and these settings are those of the plugins in the run time's tests.
pub fn plugin_target() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("plugin-target")
}

/// A test's plugin needs no debug info, and is built once.
pub fn quick_build(command: &mut Command) -> &mut Command {
    command.env("CARGO_PROFILE_DEV_DEBUG", "none").env("CARGO_INCREMENTAL", "0")
}

/// A library that was built with the command.
pub fn library(name: &str) -> String {
    let folder = Path::new(env!("CARGO_BIN_EXE_slate")).parent().unwrap();
    let path = folder.join("deps").join(name);
    assert!(path.is_file(), "{} is not there", path.display());
    path.to_str().unwrap().into()
}
