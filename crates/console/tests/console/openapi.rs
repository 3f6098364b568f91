//! Schemathesis, a foreign tool, requests what the document allows and what it does not.

use std::path::{Path, PathBuf};
use std::process::Command;

use slate_test_tools::{run, virtual_environment};

use crate::agent::Running;

const PACKAGE: &str = "schemathesis==4.32.5";

/// The program.
fn schemathesis() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("schemathesis");
    virtual_environment(&folder, &[PACKAGE]).join("bin/schemathesis")
}

#[test]
fn every_request_is_answered_as_documented() {
    let program = schemathesis();
    let agent = Running::start("schemathesis");
    let document = Path::new(env!("CARGO_TARGET_TMPDIR")).join("openapi.json");
    std::fs::write(&document, agent.get("/openapi.json").body).unwrap();
    let output = run(
        Command::new(program)
            .arg("run")
            .arg(&document)
            .args(["--url", &format!("http://{}", agent.address())])
            .args(["--header", &format!("Authorization: Bearer {}", agent.token("developer"))])
            // Of what is refused, the document says nothing that could be checked for each value.
            .args(["--checks", "not_a_server_error,status_code_conformance,content_type_conformance,response_schema_conformance"])
            .args(["--phases", "examples,coverage,fuzzing", "--max-examples", "15", "--seed", "1"])
            .args(["--rate-limit", "400/s", "--request-timeout", "10"])
            // A stream has no end.
            .args(["--exclude-operation-id", "log", "--no-color"])
            // It would leave files of any name.
            .args(["--exclude-operation-id", "save_snapshot", "--exclude-operation-id", "save_layout"])
            .args(["--exclude-operation-id", "start_recording"])
            // It leaves notes where it runs.
            .current_dir(env!("CARGO_TARGET_TMPDIR"))
            .env("HYPOTHESIS_STORAGE_DIRECTORY", std::env::temp_dir().join("slate-schemathesis")),
        "an answer is not what the document says",
    );
    let text = String::from_utf8_lossy(&output.stdout);
    let line = text.lines().find(|line| line.contains("generated,")).unwrap_or_default();
    let numbers: Vec<u32> = line.split([' ', ',']).filter_map(|word| word.parse().ok()).collect();
    assert!(matches!(numbers[..], [generated, passed] if generated == passed && passed > 500), "{text}");
}
