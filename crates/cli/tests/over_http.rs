//! The command for an agent elsewhere, over HTTP: all verbs, by each role, with and without TLS.
#![cfg(feature = "console")]
#![allow(clippy::unwrap_used, clippy::panic, clippy::disallowed_methods, reason = "a test that fails panics")]

use crate::common;

use std::fs::Permissions;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::PermissionsExt;
#[cfg(feature = "tls")]
use std::path::Path;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use common::{Running, json, text, wait_for};
use serde_json::Value;

/// A run without an end, whose robot has no reflexes, as these go before a person.
const EXP1: [&str; 13] = [
    "run",
    "exp1",
    "--headless",
    "--rate",
    "realtime",
    "--set",
    "robots.r2.modules.avoid_obstacle.enabled=false",
    "--set",
    "modules.referee.enabled=false",
    "--set",
    "console.port=0",
    "--set",
    "console.names=[\"127.0.0.2\"]",
];

const ROLES: [&str; 3] = ["viewer", "operator", "developer"];

/// An agent, and a caller without its socket and secret.
struct Elsewhere {
    agent: Running,
    user: Running,
    address: String,
}

impl Elsewhere {
    fn new(name: &str) -> Self {
        Self::with(name, &[])
    }

    fn with(name: &str, arguments: &[&str]) -> Self {
        let mut agent = Running::new(name);
        agent.start("exp1", &[&EXP1, arguments].concat());
        wait_for("its console", || agent.call(&["console"]).status.success());
        let address = json(&agent.call(&["console", "--json"]))["address"].as_str().unwrap().to_owned();
        let user = Running::new(&format!("{name}-user"));
        Self { agent, user, address }
    }

    fn token(&self, role: &str) -> String {
        let link = self.agent.done(&["console", "--role", role]);
        link.trim().split_once("#token=").unwrap().1.to_owned()
    }

    /// The command, called with a role.
    fn command(&self, role: &str, arguments: &[&str]) -> Command {
        let mut command = self.user.command(arguments);
        command.env("SLATE_AGENT", &self.address).env("SLATE_TOKEN", self.token(role));
        command
    }

    fn call(&self, role: &str, arguments: &[&str]) -> Output {
        self.command(role, arguments).output().unwrap()
    }

    fn done(&self, role: &str, arguments: &[&str]) -> String {
        let output = self.call(role, arguments);
        assert_eq!(output.status.code(), Some(0), "{role}: {arguments:?}: {output:?}");
        text(&output.stdout)
    }
}

/// What a command ends with, and that it says these words.
fn says(output: &Output, code: i32, words: &[&str]) {
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{output:?}");
    for word in words {
        assert!(stderr.contains(word), "no `{word}` in {stderr}");
    }
}

#[test]
fn every_verb_works_remotely_within_the_rights_of_its_role() {
    let all = Elsewhere::new("elsewhere");
    all.agent.done(&["wait", "/loop/histogram/count", "> 10"]);
    let still = r#"{"list": []}"#;
    let speed = "robots.r2.modules.planner.params.max_linear_velocity=0.3";
    let verbs: &[(&[&str], &str)] = &[
        (&["module", "list"], "viewer"),
        (&["plugin", "list"], "viewer"),
        (&["link"], "viewer"),
        (&["peers"], "viewer"),
        (&["list", "/r2/**"], "viewer"),
        (&["tree", "--values"], "viewer"),
        (&["top", "--once"], "viewer"),
        (&["get", "/simulator/r2/truth"], "viewer"),
        (&["watch", "/simulator/r2/truth", "-n", "3"], "viewer"),
        (&["wait", "/loop/histogram/count", "> 10"], "viewer"),
        (&["stat", "/simulator/r2/truth", "--for", "300ms"], "viewer"),
        (&["log"], "viewer"),
        (&["config", "get"], "viewer"),
        (&["config", "diff"], "viewer"),
        (&["graph"], "viewer"),
        (&["record", "status"], "viewer"),
        (&["api", "GET", "/agent"], "viewer"),
        (&["console"], "viewer"),
        (&["set", "/r2/avoid_obstacle/robots", still], "operator"),
        (&["record", "start", "/simulator/**"], "operator"),
        (&["record", "stop", "recording.mcap"], "operator"),
        (&["record", "snapshot"], "operator"),
        (&["stop"], "viewer"),
        (&["reset"], "operator"),
        (&["arm"], "operator"),
        (&["set", "/r2/planner/params/max_linear_velocity", "0.35"], "developer"),
        (&["goal", "-0.5", "1.25", "--yes"], "developer"),
        (&["config", "set", speed], "developer"),
        (&["config", "revert", "robots.r2.modules.planner"], "developer"),
        (&["module", "disable", "r2/pass_range"], "developer"),
        (&["module", "enable", "r2/pass_range"], "developer"),
        (&["link", "referee/truth", "simulator/r2/truth", "--dry-run"], "developer"),
        (&["unlink", "referee/truth", "--dry-run"], "developer"),
        (&["trace", "--seconds", "0.2"], "developer"),
        (&["snapshot", "save", "now.snapshot"], "developer"),
        (&["snapshot", "load", "now.snapshot"], "developer"),
    ];
    let report = all.agent.folder().join("runs/exp1-0");
    for role in ROLES {
        let rank = |role: &str| ROLES.iter().position(|own| *own == role);
        // A recording makes a new file.
        for name in ["recording.mcap", "flight.mcap"] {
            let _ = std::fs::remove_file(report.join(name));
        }
        for (arguments, least) in verbs {
            let output = all.call(role, arguments);
            // An operator sets inputs, so only the agent knows the setter of a name.
            let is_value = matches!(arguments[0], "set" | "goal");
            let named = if is_value && role == "viewer" { "operator" } else { least };
            match rank(role) < rank(least) {
                true => says(&output, 5, &["may not do this", named]),
                false => assert_eq!(output.status.code(), Some(0), "{role}: {arguments:?}: {output:?}"),
            }
        }
    }
    // What was made is at the agent, and nothing here.
    let (there, here) = (all.agent.folder(), all.user.folder());
    assert!(there.join("snapshots/now.snapshot").is_file());
    assert!(report.join("recording.mcap").is_file() && report.join("trace.json").is_file(), "{report:?}");
    assert_eq!(std::fs::read_dir(here).unwrap().count(), 0);
    // A viewer can fetch a recording.
    let said = all.done("viewer", &["record", "fetch", "recording", "--out", "mine.mcap"]);
    let read = |file: PathBuf| std::fs::read(file).unwrap();
    assert!(said.starts_with("mine.mcap has "), "{said}");
    assert!(read(here.join("mine.mcap")) == read(report.join("recording.mcap")));
    let again = all.call("viewer", &["record", "fetch", "recording.mcap", "--out", "mine.mcap"]);
    says(&again, 2, &["mine.mcap", "exists already"]);
    says(&all.call("viewer", &["record", "fetch", "none"]), 4, &["there is no none.mcap", "recordings"]);
    says(&all.call("viewer", &["record", "fetch", "../now"]), 5, &["can't be the name of a recording"]);
    assert_eq!(std::fs::read_dir(here).unwrap().count(), 1, "of what is not fetched nothing is left");
    // A shell is offered its names.
    wait_for("names", || {
        let mut command = all.command("viewer", &["--", "slate", "get", "/r2/planner/pa"]);
        command.env("SLATE_COMPLETE", "bash").env("_CLAP_IFS", "\n").env("_CLAP_COMPLETE_INDEX", "2");
        text(&command.output().unwrap().stdout).lines().any(|line| line == "/r2/planner/params")
    });
    // Forms for programs are the same.
    let modules: Value = serde_json::from_str(&all.done("viewer", &["module", "list", "--json"])).unwrap();
    assert_eq!(modules["schema"], "slate.module/1");
    let top: Value = serde_json::from_str(&all.done("viewer", &["top", "--json"])).unwrap();
    assert_eq!((&top["agent"], &top["process"]), (&"exp1".into(), &Value::Null));
    let console = json(&all.call("operator", &["console", "--json"]));
    assert_eq!((&console["agent"], &console["role"]), (&"exp1".into(), &"operator".into()));
}

#[test]
fn local_paths_are_not_taken_for_remote_ones() {
    let all = Elsewhere::new("elsewhere-files");
    let call = |arguments: &[&str]| all.call("developer", arguments);
    says(&call(&["record", "start", "--out", "here/run.mcap"]), 2, &["file of this machine", "run.mcap"]);
    says(&call(&["snapshot", "save", "/tmp/now.snapshot"]), 2, &["file of this machine"]);
    says(&call(&["trace", "--out", "../trace.json"]), 2, &["file of this machine"]);
    says(&call(&["record", "start", "--out", "run.sh"]), 5, &["can't be the name of a recording"]);
    for verb in [
        &["plugin", "load", "target/libx.so"][..],
        &["plugin", "reload", "slate-wheeled", "libx.so"],
        &["plugin", "shadow", "slate-wheeled", "libx.so"],
    ] {
        says(&call(verb), 5, &["can't be named over the network", "on the agent's machine"]);
    }
    // A run is here, whatever agent is usual.
    says(&call(&["run", "exp1", "--agent", &all.address]), 2, &["exp1"]);
    says(&call(&["ps"]), 0, &["no agent of this user runs on this machine"]);
}

#[test]
fn a_secret_is_found_given_or_refused() {
    let all = Elsewhere::new("elsewhere-secrets");
    let address = all.address.as_str();
    let list = ["module", "list", "--agent", address];
    // This computer's own are in a file beside the socket.
    assert!(all.agent.done(&list).contains("r2/planner"));
    let localhost = address.replace("127.0.0.1", "localhost");
    assert!(all.agent.done(&["api", "GET", "/agent", "--agent", &localhost]).contains("developer"));
    let viewer = json(&all.agent.call(&["console", "--agent", address, "--role", "viewer", "--json"]));
    assert_eq!(viewer["role"], "viewer");
    // Elsewhere they have to be said.
    says(&all.user.call(&list), 5, &["no token", "SLATE_TOKEN"]);
    let with = |token: &str| all.user.command(&list).env("SLATE_TOKEN", token).output().unwrap();
    assert!(with(&all.token("viewer")).status.success());
    says(&with(&"0".repeat(64)), 5, &["the token is unknown", "SLATE_TOKEN"]);
    says(&with("two words"), 2, &["SLATE_TOKEN", "expected letters and digits"]);
    says(&with("a\r\nX-Evil: 1"), 2, &["expected letters and digits"]);
    let file = all.user.folder().join("robot.token");
    std::fs::write(&file, format!("{}\n", all.token("operator"))).unwrap();
    std::fs::set_permissions(&file, Permissions::from_mode(0o644)).unwrap();
    says(&with("@robot.token"), 2, &["robot.token", "chmod 600"]);
    std::fs::set_permissions(&file, Permissions::from_mode(0o600)).unwrap();
    assert!(with("@robot.token").status.success());
    says(&with("@nothing.token"), 2, &["nothing.token"]);
    let link = all.agent.done(&["console"]);
    says(&all.user.call(&["module", "list", "--agent", link.trim()]), 2, &["SLATE_TOKEN", "seen by others"]);
    says(&all.user.call(&["api", "--agent", address, "--role", "viewer"]), 5, &["no token of a viewer"]);
    says(&all.user.call(&["api", "--agent", address, "--role", "operator"]), 5, &["no token of an operator"]);
}

#[test]
fn unreachable_agent_has_reason() {
    let user = Running::new("unreached");
    let call = |address: &str| {
        let arguments = ["module", "list", "--agent", address];
        user.command(&arguments).env("SLATE_TOKEN", "0".repeat(32)).output().unwrap()
    };
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    let free = silent.local_addr().unwrap();
    drop(silent);
    says(&call(&format!("http://{free}")), 3, &["is not reached", "console.port"]);
    says(&call("http://192.0.2.1:7878"), 3, &["without TLS", "https://192.0.2.1:7878", "ssh -L"]);
    says(&call("ftp://robot"), 2, &["neither http nor https", "such as http"]);
    says(&call("http://robot:x"), 2, &["port"]);
    // Something else is there.
    let other = TcpListener::bind("127.0.0.1:0").unwrap();
    let place = other.local_addr().unwrap();
    std::thread::spawn(move || {
        for stream in other.incoming() {
            let mut stream = stream.unwrap();
            let _ = stream.read(&mut [0; 4096]);
            let _ = stream.write_all(b"SSH-2.0-robot\r\n");
        }
    });
    says(&call(&format!("http://{place}")), 3, &["does not answer in HTTP", "SSH-2.0"]);
    let told: &[&str] = match cfg!(feature = "tls") {
        true => &["does not speak TLS"],
        false => &["cargo build --release --features tls"],
    };
    says(&call(&format!("https://{place}")), 3, told);
}

/// Carries connections to an address, until nothing goes through any more.
struct Cable {
    address: String,
    is_cut: Arc<AtomicBool>,
}

impl Cable {
    fn to(address: &str) -> Self {
        let there = address.split_once("://").unwrap().1.to_owned();
        // The same port at another address of this machine, so that the agent is called by a name that it has.
        let port = there.rsplit_once(':').unwrap().1;
        let listener = TcpListener::bind(format!("127.0.0.2:{port}")).unwrap();
        let (is_cut, own) = (Arc::new(AtomicBool::new(false)), listener.local_addr().unwrap());
        let cut = Arc::clone(&is_cut);
        std::thread::spawn(move || {
            for near in listener.incoming() {
                let (near, far) = (near.unwrap(), TcpStream::connect(&there).unwrap());
                for (mut from, mut to) in [(near.try_clone().unwrap(), far.try_clone().unwrap()), (far, near)]
                {
                    let cut = Arc::clone(&cut);
                    std::thread::spawn(move || {
                        let mut bytes = [0; 4096];
                        while let Ok(count @ 1..) = from.read(&mut bytes) {
                            while cut.load(Ordering::Relaxed) {
                                std::thread::sleep(Duration::from_millis(5));
                            }
                            if to.write_all(&bytes[..count]).is_err() {
                                break;
                            }
                        }
                        let _ = to.shutdown(std::net::Shutdown::Both);
                    });
                }
            }
        });
        Self { address: format!("http://{own}"), is_cut }
    }

    /// Nothing passes, and neither end is notified.
    fn cut(&self) {
        self.is_cut.store(true, Ordering::Relaxed);
    }
}

/// The command at a terminal of its own, with what is typed there.
fn terminal(all: &Elsewhere, address: &str, arguments: &str) -> Child {
    let command = format!("{} {arguments}", env!("CARGO_BIN_EXE_slate"));
    let mut script = Command::new("script");
    script.args(["-qec", &command, "/dev/null"]).env("XDG_RUNTIME_DIR", all.user.sockets());
    script.env("SLATE_AGENT", address).env("SLATE_TOKEN", all.token("operator"));
    script.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    script.current_dir(all.user.folder()).spawn().unwrap()
}

/// Holds a key as a terminal repeats it, until the robot is driven.
fn hold_key(terminal: &mut Child, key: &[u8], is_driven: impl Fn() -> bool) {
    wait_for("the robot", || {
        for _ in 0..5 {
            terminal.stdin.as_mut().unwrap().write_all(key).unwrap();
            std::thread::sleep(Duration::from_millis(30));
        }
        is_driven()
    });
}

#[test]
fn a_remote_robot_is_driven_by_keys_and_stops_on_disconnect() {
    let all = Elsewhere::new("elsewhere-teleop");
    let holder = || all.agent.ask("exp1", "GET", "/leases", "")[0]["holder"].clone();
    let priority = || all.agent.read("exp1", "/r2/wheels/gate/priority");
    // As it is meant to be.
    let mut driver = terminal(&all, &all.address, "teleop --speed 0.2");
    wait_for("the controls", || holder().as_str().is_some_and(|who| who.contains("(operator at 127.0.0.1")));
    // 0.2 m/s by wheels of 9.75 cm.
    let left = || all.agent.read("exp1", "/r2/wheels/command/left").as_f64().unwrap_or_default();
    hold_key(&mut driver, b"w", || priority() == "TELEOPERATION" && (left() - 2.05).abs() < 0.1);
    let last = Instant::now();
    while all.agent.read("exp1", "/r2/wheels/command/left") != 0.0 {
        assert!(last.elapsed() < Duration::from_millis(250), "{:?}", last.elapsed());
    }
    driver.stdin.as_mut().unwrap().write_all(b"\x1b").unwrap();
    let output = driver.wait_with_output().unwrap();
    assert!(text(&output.stdout).contains("is released"), "{output:?}");
    assert_eq!(holder(), Value::Null);
    // The network fails without notice.
    let cable = Cable::to(&all.address);
    let mut driver = terminal(&all, &cable.address, "teleop");
    wait_for("the controls", || holder().is_string());
    hold_key(&mut driver, b"w", || priority() == "TELEOPERATION");
    cable.cut();
    let cut = Instant::now();
    while priority() == "TELEOPERATION" {
        assert!(cut.elapsed() < Duration::from_millis(250), "{:?}", cut.elapsed());
    }
    wait_for("the controls", || holder().is_null());
    assert!(cut.elapsed() < Duration::from_secs(8), "{:?}", cut.elapsed());
    driver.kill().unwrap();
    driver.wait().unwrap();
}

#[test]
fn a_command_whose_agent_ends_meanwhile_says_so() {
    let mut all = Elsewhere::new("elsewhere-lost");
    let watch = ["watch", "/simulator/r2/truth", "--json"];
    let mut watching = all.command("viewer", &watch).stdout(Stdio::piped()).spawn().unwrap();
    let mut wait = all.command("viewer", &["wait", "/loop/histogram/count", "< 0", "--timeout", "1m"]);
    let waiting = wait.stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = std::io::BufRead::lines(std::io::BufReader::new(watching.stdout.take().unwrap()));
    assert!(lines.next().unwrap().unwrap().contains("slate.watch/1"));
    // The other one has begun to wait, too.
    std::thread::sleep(Duration::from_secs(2));
    all.agent.kill();
    // What was there to see was shown.
    assert!(lines.all(|line| line.unwrap().contains("slate.watch/1")));
    assert_eq!(watching.wait().unwrap().code(), Some(0));
    says(&waiting.wait_with_output().unwrap(), 3, &["agent `exp1` does not answer"]);
}

#[test]
fn a_remote_operator_sets_the_goal_where_the_file_allows_it() {
    let operable = "console.operable=[\"/r2/knowledge/params/goal_x\", \"/r2/knowledge/params/goal_y\"]";
    let all = Elsewhere::with("elsewhere-operable", &["--set", operable]);
    assert!(all.done("operator", &["goal", "-0.5", "1.25", "--yes"]).contains("goal_y"));
    let goal = json(&all.call("viewer", &["get", "/r2/knowledge/params", "--json"]));
    assert!(goal.to_string().contains("\"goal_x\":-0.5,\"goal_y\":1.25"), "{goal}");
    says(&all.call("operator", &["goal", "9", "0", "--yes"]), 5, &["outside"]);
    says(
        &all.call("operator", &["set", "/r2/planner/params/max_linear_velocity", "0.3"]),
        5,
        &["an operator may not"],
    );
    says(&all.call("viewer", &["goal", "0", "0", "--yes"]), 5, &["a viewer may not"]);
}

/// Makes a certificate by OpenSSL, signed by itself or by an authority.
#[cfg(feature = "tls")]
fn certificate(folder: &Path, script: &str) {
    let made = Command::new("sh").args(["-ec", script]).current_dir(folder).output().unwrap();
    assert!(made.status.success(), "{made:?}");
}

#[cfg(feature = "tls")]
const KEY: &str = "-newkey ec -pkeyopt ec_paramgen_curve:P-256 -noenc";

#[cfg(feature = "tls")]
#[test]
fn an_agent_with_a_certificate_is_queried_over_tls() {
    let mut agent = Running::new("elsewhere-tls");
    let folder = agent.folder().to_owned();
    // As the book says.
    let page = include_str!("../../../book/src/27-command-line.md");
    let own = page.split("```").find(|block| block.contains("openssl req -x509")).unwrap();
    let own = own.trim_start_matches("sh").replace("console.", "own.");
    let signed = format!(
        "openssl req -x509 {KEY} -days 30 -subj /CN=others -keyout authority.key -out authority.pem
         openssl req -new {KEY} -subj /CN=robot -keyout signed.key -out signed.csr
         printf 'basicConstraints = CA:FALSE\\nsubjectAltName = DNS:localhost\\n' >signed.ext
         openssl x509 -req -days 30 -in signed.csr -CA authority.pem -CAkey authority.key -extfile signed.ext -out signed.pem
         openssl x509 -req -not_before 20200101000000Z -not_after 20200102000000Z -in signed.csr -CA authority.pem \
             -CAkey authority.key -extfile signed.ext -out old.pem || \
             openssl x509 -req -days -1 -in signed.csr -CA authority.pem -CAkey authority.key -extfile signed.ext -out old.pem
         openssl rand -hex 32 >developer.token
         cp signed.key old.key
         chmod 600 *.key *.token"
    );
    certificate(&folder, &own);
    certificate(&folder, &signed);
    let user = Running::new("elsewhere-tls-user");
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let token = format!("@{}", path("developer.token"));
    for name in ["own", "signed", "old"] {
        let set = |key: &str, file: String| format!("console.{key}={:?}", path(&file));
        let sets = [
            set("certificate", format!("{name}.pem")),
            set("key", format!("{name}.key")),
            set("tokens.developer", "developer.token".into()),
        ];
        let mut arguments = EXP1.to_vec();
        sets.iter().for_each(|set| arguments.extend(["--set", set]));
        agent.start("exp1", &arguments);
        wait_for("its console", || agent.call(&["console"]).status.success());
        // A browser goes by a name that the certificate holds, programs of this machine by its address.
        let held = if name == "own" { "robot.local" } else { "localhost" };
        let link = agent.done(&["console"]);
        let port = link.strip_prefix(&format!("https://{held}:")).unwrap_or_else(|| panic!("{link}"));
        let address = format!("https://127.0.0.1:{}", port.split_once("/#token=").unwrap().0);
        if name != "old" {
            let said = json(&agent.call(&["console", "--json"]));
            assert_eq!(
                (&said["address"], &said["link"]),
                (&address.as_str().into(), &link.trim_end().into())
            );
        }
        let localhost = address.replace("127.0.0.1", "localhost");
        let call = |address: &str, trusted: Option<&str>, arguments: &[&str]| {
            let mut command = user.command(&[arguments, &["--agent", address]].concat());
            command.env("SLATE_TOKEN", &token);
            if let Some(trusted) = trusted {
                command.env("SLATE_CERTIFICATE", path(trusted));
            }
            command.output().unwrap()
        };
        let list = ["module", "list"];
        match name {
            "own" => {
                // Given by itself it is known wherever it is shown.
                for address in [&address, &localhost] {
                    assert!(text(&call(address, Some("own.pem"), &list).stdout).contains("r2/planner"));
                    let said = call(address, Some("own.pem"), &["api", "GET", "/agent"]);
                    assert_eq!(json(&said)["role"], "developer");
                    says(&call(address, Some("own.pem"), &["stop"]), 0, &[]);
                }
                // Another agent's certificate is no reason to trust this one.
                says(&call(&address, Some("signed.pem"), &list), 3, &["is not trusted", "SLATE_CERTIFICATE"]);
                says(&call(&address, Some("authority.pem"), &list), 3, &["is not trusted", "signed it"]);
                says(&call(&address, None, &list), 3, &["is not trusted", "SLATE_CERTIFICATE"]);
                says(&call(&address, None, &["api", "GET", "/agent"]), 3, &["is not trusted"]);
                says(&call(&address, None, &["stop"]), 3, &["is not trusted"]);
                says(&call(&address, Some("own.key"), &list), 2, &["own.key", "BEGIN CERTIFICATE"]);
                says(&call(&address, Some("nothing.pem"), &list), 2, &["nothing.pem"]);
                let open = address.replace("https:", "http:");
                says(&call(&open, Some("own.pem"), &list), 3, &["speaks TLS", &address]);
                // The operator knows its certificate.
                assert_eq!(json(&agent.call(&["api", "GET", "/agent"]))["role"], "developer");
                assert!(agent.done(&["module", "list", "--agent", &address]).contains("r2/planner"));
            }
            "signed" => {
                assert!(text(&call(&localhost, Some("authority.pem"), &list).stdout).contains("r2/planner"));
                says(&call(&address, Some("authority.pem"), &list), 3, &["is not trusted", "another name"]);
                says(&call(&localhost, Some("own.pem"), &list), 3, &["is not trusted"]);
            }
            _ => {
                says(&call(&localhost, Some("authority.pem"), &list), 3, &["is not trusted", "expired"]);
                // Nor is one that is given by itself.
                says(&call(&localhost, Some("old.pem"), &list), 3, &["is not trusted", "expired"]);
            }
        }
        agent.interrupt();
        agent.finish();
    }
}
