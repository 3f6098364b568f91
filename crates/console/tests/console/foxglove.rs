//! The client library of Foxglove, which is not ours.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::{Value as Json, json};

use crate::agent::Running;

/// The client, and what reads messages by their schemas.
const PACKAGES: [&str; 4] = [
    "@foxglove/ws-protocol@0.8.0",
    "@foxglove/rosmsg@5.0.5",
    "@foxglove/rosmsg2-serialization@3.1.0",
    "ws@8.18.0",
];

fn run(command: &mut Command, advice: &str) -> Output {
    match command.output() {
        Ok(output) if output.status.success() => output,
        Ok(output) => panic!("{advice}\n{command:?}\n{}", String::from_utf8_lossy(&output.stderr)),
        Err(error) => panic!("{advice}\n{command:?}: {error}"),
    }
}

/// A folder that has the packages.
fn packages() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("foxglove-node");
    let marker = folder.join("packages");
    let wanted = PACKAGES.join("\n");
    if std::fs::read_to_string(&marker).is_ok_and(|found| found == wanted) {
        return folder;
    }
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("package.json"), "{\"private\": true}").unwrap();
    let advice = "this test needs Node (apt-get install nodejs npm), and a network the first time";
    run(Command::new("npm").args(["install", "--silent"]).args(PACKAGES).current_dir(&folder), advice);
    std::fs::write(&marker, wanted).unwrap();
    folder
}

#[test]
fn the_client_of_foxglove_reads_sets_calls_and_drives_under_both_names_of_the_protocol() {
    let packages = packages();
    for (name, protocol) in [("foxglove-one", "foxglove.websocket.v1"), ("foxglove-two", "foxglove.sdk.v1")] {
        let agent = Running::start(name);
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/console/foxglove.cjs");
        let output = run(
            Command::new("node")
                .arg(script)
                .args([
                    &agent.address().to_string(),
                    protocol,
                    &agent.token("operator"),
                    &agent.token("developer"),
                ])
                .env("NODE_PATH", packages.join("node_modules")),
            "the client is not content",
        );
        let seen: Json = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(seen["protocol"], protocol);
        assert_eq!(seen["name"], format!("slate://{}", agent.name()));
        assert_eq!(seen["rising"], true);
        let image =
            json!({ "schema": "sensor_msgs/msg/Image", "width": 64, "encoding": "rgb8", "bytes": 12288 });
        assert_eq!(seen["image"], image);
        assert_eq!(
            (&seen["place"], &seen["schema"]),
            (&json!({ "x": 1.5, "y": "NaN" }), &json!("slate_msgs/msg/Speed"))
        );
        let parameters = seen["parameters"].as_array().unwrap();
        assert!(parameters.contains(&json!(["/sensor/params/step", 1])), "{parameters:?}");
        assert_eq!(seen["told"], "/sensor/params/step");
        assert_eq!((&seen["publishers"], &seen["subscribers"]), (&json!(["sensor"]), &json!(["driver"])));
        assert_eq!(seen["stopped"], json!([7, "{\"done\":\"stop\"}"]));
        assert_eq!(seen["refused"], 8);
        assert_eq!(agent.number("driver/heard/value"), 8.0);
        assert_eq!(agent.number("wheel/command/value"), 0.0);
        assert_eq!(agent.get("/agent").json()["stopped"], "by Foxglove");
    }
}
