//! A run that is reached over HTTP.
#![cfg(feature = "console")]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use crate::common;

use std::io::{Read, Write};
use std::net::TcpStream;

use common::{Running, folder, slate, text};
use serde_json::Value;

#[test]
fn a_headless_run_is_reached_when_its_settings_ask_for_it() {
    let mut running = Running::new("console");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "realtime", "--set", "console.port=0"]);
    let mut files =
        std::fs::read_dir(running.sockets().join("slate")).unwrap().map(|entry| entry.unwrap().path());
    let file = files.find(|path| path.extension().is_some_and(|extension| extension == "console")).unwrap();
    let content: Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    let (host, token) = (content["address"].as_str().unwrap(), content["tokens"]["viewer"].as_str().unwrap());
    let host = host.strip_prefix("http://").unwrap();
    let mut stream = TcpStream::connect(host).unwrap();
    let head = format!("Host: {host}\r\nAuthorization: Bearer {token}\r\nConnection: close\r\n\r\n");
    stream.write_all(format!("GET /api/v1/documents/world HTTP/1.1\r\n{head}").as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let (_, body) = answer.split_once("\r\n\r\n").unwrap();
    let world: Value = serde_json::from_str(body).unwrap();
    assert_eq!(world["goals"][0]["label"], "goal", "{answer}");
    running.interrupt();
    let stderr = text(&running.finish().stderr);
    assert!(stderr.contains(&format!("console: http://{host}/#token=")), "{stderr}");
    assert!(!file.exists());
}

#[test]
fn a_run_that_others_would_reach_unprotected_does_not_start() {
    let folder = folder("console-open");
    let output = slate(&folder, &["run", "exp1", "--headless", "--set", "console.addresses=[\"0.0.0.0\"]"]);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("neither TLS nor tokens") && stderr.contains("0.0.0.0"), "{stderr}");
    assert!(!folder.join("runs").exists(), "it leaves nothing behind");
}
