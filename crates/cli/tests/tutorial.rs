//! The tutorial of the book, command by command as a reader types them.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use crate::common::{folder, plugin_target, quick_build, text, wait_for};

const TUTORIAL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../book/src/00-tutorial.md");

/// The blocks of shell commands of a chapter, in order.
fn blocks(chapter: &str) -> Vec<String> {
    let mut blocks = Vec::new();
    let mut rest = chapter;
    while let Some((_, begun)) = rest.split_once("\n```sh\n") {
        let (block, after) = begun.split_once("\n```").unwrap();
        blocks.push(block.to_owned());
        rest = after;
    }
    blocks
}

/// The two terminals of a reader.
struct Reader {
    folder: PathBuf,
    sockets: PathBuf,
    agent: Option<Child>,
}

impl Reader {
    fn new() -> Self {
        let sockets = std::env::temp_dir().join(format!("slate-tutorial-{}", std::process::id()));
        std::fs::create_dir_all(&sockets).unwrap();
        Self { folder: folder("tutorial"), sockets, agent: None }
    }

    fn shell(&self, block: &str) -> Command {
        let binaries = Path::new(env!("CARGO_BIN_EXE_slate")).parent().unwrap();
        let path = format!("{}:{}", binaries.display(), std::env::var("PATH").unwrap());
        let mut command = Command::new("bash");
        quick_build(&mut command)
            .args(["-euo", "pipefail", "-c", block])
            .current_dir(&self.folder)
            .env("PATH", path)
            .env("XDG_RUNTIME_DIR", &self.sockets)
            .env("CARGO_NET_OFFLINE", "true")
            .env_remove("CARGO_TARGET_DIR")
            .env_remove("SLATE_AGENT");
        command
    }

    fn types(&mut self, block: &str) -> String {
        let output = self.shell(block).output().unwrap();
        assert!(output.status.success(), "{block}\n{}", printed_text(&output));
        if let Some(name) = block.lines().find_map(|line| line.strip_prefix("cd ")) {
            self.folder.push(name);
        }
        printed_text(&output)
    }

    /// A run that continues while the reader types into the other terminal.
    fn starts(&mut self, block: &str) {
        // `exec` makes the shell the command, which then gets Ctrl-C itself.
        let mut run = self.shell(&format!("exec {block}"));
        run.process_group(0).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        self.agent = Some(run.spawn().unwrap());
        wait_for("the agent of the tutorial", || {
            self.shell("slate get /loop/state").output().unwrap().status.success()
        });
    }

    fn presses_ctrl_c(&mut self) {
        if let Some(mut agent) = self.agent.take() {
            let interrupt = Command::new("kill").args(["-INT", &agent.id().to_string()]).status().unwrap();
            assert!(interrupt.success());
            agent.wait().unwrap();
        }
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        if let Some(agent) = &mut self.agent {
            let _ = agent.kill();
            let _ = agent.wait();
        }
        let _ = std::fs::remove_dir_all(&self.sockets);
    }
}

fn printed_text(output: &Output) -> String {
    text(&output.stdout) + &text(&output.stderr)
}

/// What cargo builds is kept for the next time.
fn keep_target(project: &Path) {
    let target = plugin_target();
    std::fs::create_dir_all(&target).unwrap();
    std::os::unix::fs::symlink(target, project.join("target")).unwrap();
}

#[test]
fn tutorial_leads_from_new_to_a_replayed_recording() {
    let chapter = std::fs::read_to_string(TUTORIAL).unwrap();
    let mut reader = Reader::new();
    let mut told = String::new();
    for block in blocks(&chapter) {
        if block.starts_with("slate run") && !block.contains("--headless") {
            reader.starts(&block);
            continue;
        }
        if block.contains("--headless") {
            reader.presses_ctrl_c();
        }
        let block = match block.strip_prefix("slate new rover\n") {
            Some(after) => {
                reader.types("slate new rover");
                keep_target(&reader.folder.join("rover"));
                after.to_owned()
            }
            None => block,
        };
        told += &reader.types(&block);
    }
    for promised in ["is valid", "0.15", "0.3", "GoTo", "before.snapshot", "identical, "] {
        assert!(told.contains(promised), "{promised}: {told}");
    }
    let library = std::fs::read_to_string(reader.folder.join("src/lib.rs")).unwrap();
    assert!(library.contains("math::min(0.6,"), "the line that the reader changes is there");
}
