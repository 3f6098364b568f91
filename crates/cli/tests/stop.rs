//! The software stop of an agent that runs: what is said, what the actuators get, and what is refused.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::time::Duration;

use common::Running;

/// Stops by these words, and looks what is said.
#[track_caller]
fn stops(running: &Running, words: &[&str], agents: &[&str]) {
    let said = running.done(&[&["stop"], words].concat());
    let mut found: Vec<_> =
        said.lines().filter_map(|line| line.split_once(" has stopped all actuators after ")).collect();
    found.sort_unstable();
    assert_eq!(found.iter().map(|(agent, _)| *agent).collect::<Vec<_>>(), agents, "{said}");
    for (_, time) in found {
        let time: f64 = time.strip_suffix(" ms").unwrap().parse().unwrap();
        assert!((0.0..4000.0).contains(&time), "{said}");
    }
    assert!(said.ends_with("the stop holds until `slate reset` and `slate arm`\n"), "{said}");
}

fn wheels(running: &Running) -> [f64; 2] {
    let command = running.read("exp1", "/r2/wheels/command");
    // It stands before it has a first command.
    ["left", "right"].map(|side| command[side].as_f64().unwrap_or_default())
}

fn mode(running: &Running) -> String {
    running.read("exp1", "/r2/wheels/gate")["mode"].as_str().unwrap().into()
}

/// Whether it comes to be so within some seconds.
fn soon(mut so: impl FnMut() -> bool) -> bool {
    (0..1000).any(|_| {
        std::thread::sleep(Duration::from_millis(10));
        so()
    })
}

/// Waits until the robot drives.
#[track_caller]
fn drives(running: &Running) {
    assert!(soon(|| wheels(running) != [0.0; 2]), "it stands: {}", mode(running));
}

/// That the robot stands, now and for a while.
#[track_caller]
fn stands(running: &Running, how: &str) {
    for _ in 0..20 {
        assert_eq!((wheels(running), mode(running).as_str()), ([0.0; 2], how));
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_stopped_robot_stands_until_it_is_reset_and_armed() {
    let mut running = Running::new("stop");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1"]);
    drives(&running);
    stops(&running, &["a child ran by"], &["exp1"]);
    stands(&running, "STOPPED");
    let log = || running.read("exp1", "/log/tail").to_string();
    assert!(soon(|| log().contains("the actuators are stopped: a child ran by")), "{}", log());
    for arm in [&["arm"][..], &["arm", "r2/wheels"]] {
        let words = ["still stopped: `r2/wheels` (a child ran by)", "`slate reset`, then `slate arm`"];
        running.fails(5, arm, &words);
    }
    // What stopped it first is why it stands.
    stops(&running, &[], &["exp1"]);
    running.fails(5, &["arm"], &["a child ran by"]);
    stands(&running, "STOPPED");

    assert_eq!(running.done(&["reset"]), "the stop is reset; `slate arm` arms the actuators\n");
    // It is shown with the next cycle.
    assert!(soon(|| mode(&running) == "DISARMED"));
    stands(&running, "DISARMED");
    assert!(running.done(&["reset"]).contains("no stop was active"));
    stands(&running, "DISARMED");
    running.fails(4, &["arm", "r2/whels"], &["no actuator is called `r2/whels`", "did you mean r2/wheels?"]);
    running.fails(4, &["arm", "gripper"], &["no actuator is called `gripper`"]);
    stands(&running, "DISARMED");
    assert_eq!(running.done(&["arm", "r2/wheels"]), "r2/wheels is armed\n");
    drives(&running);

    // A reset of what is not stopped disarms nothing.
    assert!(running.done(&["reset"]).contains("no stop was active"));
    drives(&running);
    stops(&running, &["--agent", "exp1"], &["exp1"]);
    running.done(&["reset", "--agent", "exp1"]);
    assert_eq!(running.done(&["arm", "--agent", "exp1"]), "the actuators are armed\n");
    drives(&running);
    running.fails(3, &["stop", "--agent", "exp7"], &["no agent `exp7`", "running agents: exp1"]);
    drives(&running);
}

#[test]
fn stop_takes_any_words_and_json_names_stopped_agents() {
    let mut running = Running::new("stop-words");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1"]);
    let reason = || running.read("exp1", "/log/tail").to_string();
    stops(&running, &["the", "robot", "is", "crazy", "--agent", "exp1"], &["exp1"]);
    assert!(soon(|| reason().contains("stopped: the robot is crazy")), "{}", reason());
    assert_eq!(
        running.done(&["reset", "--json"]),
        "{\"agent\":\"exp1\",\"schema\":\"slate.reset/1\",\"was_stopped\":true}\n"
    );
    assert!(running.done(&["arm", "r2/wheels", "--json"]).contains("\"actuator\":\"r2/wheels\""));
    drives(&running);

    // An option that there is not is no reason to drive on.
    let said = running.done(&["stop", "--now", "-x", "quick", "--json"]);
    let document: serde_json::Value = serde_json::from_str(&said).unwrap();
    assert_eq!(document["schema"], "slate.stop/1");
    assert_eq!(document["reason"], "--now -x quick");
    assert_eq!(
        (&document["agents"][0]["agent"], &document["agents"][0]["stopped"]),
        (&"exp1".into(), &true.into())
    );
    assert!(document["agents"][0]["after_ms"].as_f64().unwrap() < 4000.0);
    stands(&running, "STOPPED");
}

#[test]
fn several_agents_stop_though_one_hangs_which_is_named() {
    let mut running = Running::new("stop-all");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1"]);
    running.start("exp1-2", &["run", "exp1", "--headless", "--rate", "1"]);
    stops(&running, &["it", "smells"], &["exp1", "exp1-2"]);
    for agent in ["exp1", "exp1-2"] {
        assert!(soon(|| running.read(agent, "/r2/wheels/gate")["mode"] == "STOPPED"), "{agent}");
    }
    for agent in ["exp1", "exp1-2"] {
        running.done(&["--agent", agent, "reset"]);
        running.done(&["--color", "never", "--agent", agent, "arm"]);
    }
    // An option keeps its meaning behind one that there is not, and in front of the verb.
    stops(&running, &["--now", "--agent", "exp1-2"], &["exp1-2"]);
    let said = running.done(&["--agent=exp1-2", "stop", "--now", "--json"]);
    assert!(said.contains("\"reason\":\"--now\"") && !said.contains("\"exp1\""), "{said}");
    assert_eq!(running.read("exp1", "/r2/wheels/gate")["mode"], "ARMED");
    // An option without its value, or with one that it does not have, is no reason to drive on.
    for words in [&["--agent"][..], &["--color", "blue"], &["--json=1"]] {
        stops(&running, words, &["exp1", "exp1-2"]);
    }

    // To let several go needs more care.
    for verb in ["reset", "arm"] {
        running.fails(2, &[verb], &["several agents are running: exp1, exp1-2"]);
    }
    running.done(&["reset", "--agent", "exp1-2"]);
    running.done(&["arm", "--agent", "exp1-2"]);

    // A listener that never answers, like a suspended agent.
    let socket = std::os::unix::net::UnixListener::bind(running.sockets().join("slate/frozen.sock")).unwrap();
    let output = running.call(&["stop"]);
    assert_eq!(output.status.code(), Some(3), "{output:?}");
    let (said, wrong) = (common::text(&output.stdout), common::text(&output.stderr));
    assert!(said.contains("exp1 has stopped") && said.contains("exp1-2 has stopped"), "{said}");
    for words in ["`frozen` has not confirmed", "no answer within 4 s", "use the robot's own emergency stop"]
    {
        assert!(wrong.contains(words), "{words}: {wrong}");
    }
    assert!(soon(|| running.read("exp1-2", "/r2/wheels/gate")["mode"] == "STOPPED"));
    let output = running.call(&["stop", "--agent", "frozen", "--json"]);
    assert_eq!(output.status.code(), Some(3), "{output:?}");
    assert_eq!(common::json(&output)["agents"][0]["stopped"], false);
    let error: serde_json::Value = serde_json::from_slice(&output.stderr).unwrap();
    assert_eq!((&error["code"], &error["exit"]), (&"S103".into(), &3.into()));
    drop(socket);
}

#[test]
fn an_agent_that_hung_finds_an_abandoned_stop() {
    let mut running = Running::new("stop-late");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1"]);
    drives(&running);
    running.signal("STOP");
    let output = running.call(&["stop", "it", "hangs"]);
    running.signal("CONT");
    assert_eq!(output.status.code(), Some(3), "{output:?}");
    assert!(soon(|| mode(&running) == "STOPPED"));
    stands(&running, "STOPPED");
    assert!(running.read("exp1", "/log/tail").to_string().contains("it hangs"));
}

#[test]
fn without_an_agent_there_is_nothing_to_stop() {
    let running = Running::new("nobody");
    for command in ["stop", "reset", "arm"] {
        running.fails(3, &[command], &["no agent is running", "slate run"]);
        running.fails(3, &[command, "--agent", "exp1"], &["no agent `exp1`", "slate run"]);
    }
}

/// How the console of the only run is reached.
fn console(running: &Running) -> serde_json::Value {
    let mut files =
        std::fs::read_dir(running.sockets().join("slate")).unwrap().map(|entry| entry.unwrap().path());
    let console = files.find(|path| path.extension().is_some_and(|end| end == "console")).unwrap();
    serde_json::from_slice(&std::fs::read(console).unwrap()).unwrap()
}

#[test]
fn stop_works_without_a_free_descriptor() {
    let mut running = Running::new("stop-reserve");
    let own = running.command(&["run", "exp1", "--headless", "--rate", "1", "--set", "console.port=0"]);
    let mut limited = std::process::Command::new("sh");
    limited.args(["-c", "ulimit -n 40; exec \"$@\"", "sh"]).arg(own.get_program()).args(own.get_args());
    limited.current_dir(running.folder()).env("XDG_RUNTIME_DIR", running.sockets());
    running.launch("exp1", limited);
    drives(&running);
    let (sockets, console) = (running.sockets().join("slate"), console(&running));
    let address = console["address"].as_str().unwrap();
    // More idle tools than the agent has descriptors for.
    let local: Vec<_> = (0..60)
        .map(|_| std::os::unix::net::UnixStream::connect(sockets.join("exp1.sock")).unwrap())
        .collect();
    let place = address.trim_start_matches("http://");
    let remote: Vec<_> = (0..60).map(|_| std::net::TcpStream::connect(place).unwrap()).collect();
    std::thread::sleep(Duration::from_millis(500));
    stops(&running, &["no descriptor is left"], &["exp1"]);
    let token = console["tokens"]["viewer"].as_str().unwrap();
    let mut over_http = running.command(&["stop", "--agent", address]);
    let output = over_http.env("SLATE_TOKEN", token).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    drop((local, remote));
    assert!(soon(|| running.call(&["get", "/r2/wheels/gate"]).status.success()));
    stands(&running, "STOPPED");
}

#[test]
fn stop_works_without_a_free_thread() {
    let mut running = Running::new("stop-threads");
    running.become_ordinary_user();
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1", "--set", "console.port=0"]);
    drives(&running);
    let console = console(&running);
    let (address, token) =
        (console["address"].as_str().unwrap(), console["tokens"]["viewer"].as_str().unwrap());
    running.take_threads();
    let call = |arguments: &[&str]| {
        let mut command = running.command_without_threads(arguments);
        let output = command.env("SLATE_TOKEN", token).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {output:?}");
    };
    call(&["stop", "no thread is left"]);
    stands(&running, "STOPPED");
    // A process that finds and releases it needs none either.
    call(&["reset"]);
    call(&["arm"]);
    drives(&running);
    call(&["get", "--agent", address, "/r2/wheels/gate"]);
    call(&["stop", "--agent", address]);
    stands(&running, "STOPPED");
}
