//! Behavior trees of a run in monitors of BehaviorTree.CPP.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common::Running;

const PATROL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/patrol/patrol_tree.toml");

/// A folder with the patrol by a tree, and a table `[groot]`.
fn patrol(name: &str, table: &str) -> Running {
    let running = Running::new(name);
    let text = format!("include = [\"{PATROL}\"]\n[agent]\nname = \"patrol\"\n{table}");
    std::fs::write(running.folder().join("robot.toml"), text).unwrap();
    running
}

#[test]
fn unsupported_monitor_setup_is_reported_before_run() {
    let running = patrol("groot-check", "[groot]\nports = { \"r2/plan\" = 0 }");
    let words = match cfg!(feature = "groot") {
        false => ["built without Groot, which [groot] needs", "--features groot"],
        true => ["`r2/plan` is no Plan that follows a behavior tree", "available: r2/planner"],
    };
    running.fails(7, &["check", "robot.toml"], &[words[0], words[1], "robot.toml:"]);
    running.fails(2, &["run", "robot.toml", "--headless"], &words);
}

#[test]
#[cfg(all(feature = "groot", feature = "external-tools"))]
fn btview_shows_a_tree_that_runs() {
    use std::path::Path;
    use std::process::Command;

    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port().to_string();
    let mut running = patrol("groot-btview", &format!("[groot]\nport = {port}"));
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("btview");
    let environment = slate_test_tools::virtual_environment(&folder, &["btview==0.2.0", "pyzmq==27.3.0"]);
    running.start("patrol", &["run", "robot.toml", "--headless", "--rate", "1", "--out", "here"]);
    let btview = |arguments: &[&str]| {
        let mut command = Command::new(environment.join("bin/btview"));
        command.args(arguments).args(["--port", &port]).env("COLUMNS", "100");
        let output = slate_test_tools::run(&mut command, "btview does not reach the agent");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let snapshot = btview(&["snapshot", "--ascii", "--no-legend"]);
    for words in ["GoToOrigin", "Sequence", "RUNNING"] {
        assert!(snapshot.contains(words), "no `{words}` in\n{snapshot}");
    }
    let info = btview(&["info", "--samples", "5"]);
    assert!(info.contains("Groot2 / BT.CPP 4.x") && info.contains("statuses seen"), "{info}");
    let board = btview(&["blackboard", "--json"]);
    assert!(
        serde_json::from_str::<serde_json::Value>(&board).is_ok_and(|board| board.is_object()),
        "{board}"
    );
    let changes = btview(&["echo", "--json", "--duration", "1"]);
    assert!(changes.lines().all(|line| serde_json::from_str::<serde_json::Value>(line).is_ok()), "{changes}");
    // The socket of libzmq, with a request of two frames.
    let script = format!(
        "import struct, zmq\n\
         socket = zmq.Context().socket(zmq.REQ)\n\
         socket.connect('tcp://127.0.0.1:{port}')\n\
         for kind in b'TSD':\n    socket.send(struct.pack('<BBI', 2, kind, 5)); print(socket.recv_multipart()[0][:6].hex())\n\
         socket.send_multipart([struct.pack('<BBI', 2, ord('I'), 5), b'{{}}']); print(socket.recv_multipart()[0])\n"
    );
    let mut python = Command::new(environment.join("bin/python"));
    let output = slate_test_tools::run(python.args(["-c", &script]), "pyzmq does not reach the agent");
    let expected = "025405000000\n025305000000\n024405000000\nb'error'\n";
    assert_eq!(String::from_utf8_lossy(&output.stdout), expected);
    running.interrupt();
    running.finish();
}
