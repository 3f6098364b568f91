//! Agents that share over TLS, as processes of their own, with certificates that are made as the book says.
#![cfg(feature = "tls")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::net::TcpListener;
use std::path::Path;
use std::process::Command;

use common::{Running, WORLD, wait_for};

const BOOK: &str = include_str!("../../../book/src/17-network.md");

const BASE: &str = r#"
[time]
source = "simulator"
[modules.simulator]
"#;

const ARM: &str = r#"
[modules.referee]
params = { robot = "r2", goal_tolerance = 0.1, time_limit = 1e6 }
[links]
"referee/truth" = "slate://base/simulator/r2/truth"
"#;

/// Runs the commands of the book that make certificates, changed in that way.
fn make_certificates(folder: &Path, change: impl Fn(String) -> String) {
    let mut blocks = BOOK.split("```sh\n").skip(1).filter_map(|block| block.split("```").next());
    let block = blocks.find(|block| block.contains("openssl req -x509")).unwrap();
    let changed = change(block.to_owned());
    std::fs::create_dir_all(folder).unwrap();
    let mut made = Command::new("bash");
    let output = made.args(["-euo", "pipefail", "-c", &changed]).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{output:?}");
}

/// A port that is free now, and likely so in a moment.
fn port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

fn security(agent: &str, keys: &str, authority: &str, allow: &str) -> String {
    format!(
        "[share.security]\ncertificate = \"{keys}/{agent}.pem\"\nkey = \"{keys}/{agent}.key\"\n\
         authority = \"{authority}\"\n[share.security.allow]\n{allow}\n"
    )
}

struct Scene {
    running: Running,
    port: u16,
}

impl Scene {
    /// Certificates, and an agent `base` that lets in `arm`.
    fn new(name: &str) -> Self {
        let scene = Self { running: Running::new(name), port: port() };
        let folder = scene.running.folder();
        make_certificates(&folder.join("keys"), |block| block);
        let share = format!("[share]\nlisten = \"tls:127.0.0.1:{}\"\n", scene.port);
        let security = security("base", "keys", "keys/authority.pem", "arm = { read = \"simulator/**\" }");
        std::fs::write(folder.join("base.toml"), format!("{BASE}{share}{security}{WORLD}")).unwrap();
        scene
    }

    fn start(&mut self, agent: &str) {
        let file = format!("{agent}.toml");
        self.running.start(agent, &["run", &file, "--headless", "--rate", "realtime"]);
    }

    /// Another agent, which dials `base`.
    fn other(&self, agent: &str, keys: &str, authority: &str) {
        let at = format!("[share.agents.base]\nat = \"tls:127.0.0.1:{}\"\n", self.port);
        let security = security(agent, keys, authority, "base = {}");
        let text = format!("{ARM}{at}{security}{WORLD}");
        std::fs::write(self.running.folder().join(format!("{agent}.toml")), text).unwrap();
    }

    /// Waits until what a command prints of an agent has these words.
    fn says(&self, command: &str, agent: &str, words: &[&str]) {
        let mut last = String::new();
        for _ in 0..300 {
            last = self.running.done(&[command, "--agent", agent]);
            if words.iter().all(|word| last.contains(word)) {
                return;
            }
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
        panic!("{command} of {agent} never said {words:?}: {last}");
    }
}

#[test]
fn two_agents_share_over_tls_with_certificates_of_the_book() {
    let mut scene = Scene::new("tls-link");
    scene.other("arm", "keys", "keys/authority.pem");
    scene.start("base");
    scene.start("arm");
    wait_for("the robot's place", || scene.running.read("arm", "/referee/truth/x") == 0.6);
    scene.says("peers", "arm", &["tls:127.0.0.1:", "reads slate://base/simulator/r2/truth"]);
    scene.says("peers", "base", &["it dials", "arm reads /simulator/r2/truth"]);
    assert!(!scene.running.done(&["peers", "--agent", "base"]).contains("rejected"));
}

#[test]
fn both_sides_log_refused_agent_and_reason() {
    let mut scene = Scene::new("tls-refused");
    let folder = scene.running.folder().to_owned();
    // Another authority's; the agent itself takes both.
    make_certificates(&folder.join("theirs"), |block| block);
    let read = |of: &str| std::fs::read_to_string(folder.join(of).join("authority.pem")).unwrap();
    std::fs::write(folder.join("both.pem"), read("keys") + &read("theirs")).unwrap();
    scene.other("arm", "theirs", "both.pem");
    scene.start("base");
    scene.start("arm");
    let words = "in the name of `arm`, was not signed by the authority";
    scene.says("log", "base", &["rejected: 127.0.0.1 at tls:127.0.0.1:", words]);
    scene.says("peers", "base", &["rejected", words]);
    let words = "refuses this agent's certificate (UnknownCA)";
    scene.says("log", "arm", &[words]);
    scene.says("peers", "arm", &[words]);

    // One without permission.
    make_certificates(&folder.join("keys"), |block| {
        let (_, agents) = block.split_once("for agent in").unwrap();
        format!("for agent in{agents}").replace("base arm", "leg")
    });
    scene.other("leg", "keys", "keys/authority.pem");
    scene.start("leg");
    let words = "agent `leg` is not in [share.security.allow] of agent `base`";
    scene.says("log", "base", &["rejected: agent `leg`", words]);
    scene.says("peers", "base", &["rejected", words]);
    scene.says("log", "leg", &[words]);

    // One whose certificate expires while it runs: it could not start with it.
    (0..2).for_each(|_| scene.running.kill());
    make_certificates(&folder.join("old"), |block| block.replace("-days 365", "-days 3"));
    scene.other("arm", "old", "old/authority.pem");
    let base = std::fs::read_to_string(folder.join("base.toml")).unwrap().replace("keys/", "old/");
    std::fs::write(folder.join("base.toml"), base).unwrap();
    scene.start("arm");
    scene.says("log", "arm", &["old/arm.pem expires in 7"]);
    let again = "openssl x509 -req -days 0 -in arm.csr -CA authority.pem -CAkey authority.key -extfile arm.ext -out arm.pem";
    let made = Command::new("bash").args(["-c", again]).current_dir(folder.join("old")).output().unwrap();
    assert!(made.status.success(), "{made:?}");
    std::thread::sleep(std::time::Duration::from_millis(1500));
    scene.start("base");
    scene.says("log", "arm", &["old/arm.pem has expired"]);
    scene.says("peers", "arm", &["old/arm.pem has expired"]);
}
