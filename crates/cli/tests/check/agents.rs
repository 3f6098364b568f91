//! Reports on files of several agents, and on networks.

use super::common::{Running, text};
use super::{EXP1, findings};

#[test]
fn each_agent_of_a_file_is_checked_and_nobody_is_reached() {
    let running = Running::new("check-agents");
    let example = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/sharing");
    let text = std::fs::read_to_string(example.join("team.toml")).unwrap();
    let included = |name: &str| format!("include = {:?}", example.join(name));
    let file = ["robot.toml", "watcher.toml"]
        .into_iter()
        .fold(text, |text, name| text.replace(&format!("include = {name:?}"), &included(name)));
    std::fs::write(running.folder().join("team.toml"), &file).unwrap();
    let checked = findings(&running, 0, &["check", "team.toml"]);
    assert_eq!(checked["counts"]["agents"], 2, "{checked}");
    let wrong = format!("{file}\n[nonsense]\n");
    std::fs::write(running.folder().join("wrong.toml"), wrong).unwrap();
    let checked = findings(&running, 7, &["check", "wrong.toml"]);
    // Once, although both agents have it.
    let found = checked["findings"].as_array().unwrap();
    assert_eq!(
        found.iter().filter(|one| one["message"].as_str().unwrap().contains("nonsense")).count(),
        1,
        "{checked}"
    );
}

#[test]
fn network_that_can_not_be_joined_is_told_before_a_run() {
    let running = Running::new("check-network");
    let table = |lines: &str| format!("{EXP1}\n[network]\n{lines}\n");
    let checked = |code: i32, lines: &str| {
        std::fs::write(running.folder().join("robot.toml"), table(lines)).unwrap();
        findings(&running, code, &["check", "robot.toml"])["findings"].clone()
    };
    let line = EXP1.lines().count() + 3;
    let open = checked(7, "listen = [\"tcp/0.0.0.0:7447\"]");
    assert_eq!((&open[0]["severity"], &open[0]["line"]), (&"error".into(), &line.into()), "{open}");
    assert!(open[0]["message"].as_str().unwrap().contains("clear text"), "{open}");
    let good = checked(
        if cfg!(feature = "zenoh") { 0 } else { 7 },
        "listen = [\"tcp/127.0.0.1:7447\"]\nset = [\"r2/planner/params\"]",
    );
    let input =
        checked(7, "listen = [\"tcp/127.0.0.1:7447\"]\nread.\"r2/planner/place\" = \"zenoh:demo/place\"");
    if cfg!(feature = "zenoh") {
        assert!(
            good.as_array().is_some_and(|all| all.iter().all(|one| one["severity"] != "error")),
            "{good}"
        );
        assert!(input[0]["message"].as_str().unwrap().contains("can't read from the network"), "{input}");
        assert_eq!(input[0]["line"], line + 1, "{input}");
        return;
    }
    for refused in [good, input] {
        assert!(refused[0]["message"].as_str().unwrap().contains("built without Zenoh"), "{refused}");
    }
    let output = running.call(&["run", "robot.toml", "--headless"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(text(&output.stderr).contains("cargo build --release --features zenoh"), "{output:?}");
}
