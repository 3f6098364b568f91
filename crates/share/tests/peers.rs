//! Agents that share over the carrier of one machine, as their users see them.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use crate::agents;
#[path = "exchange/mod.rs"]
mod exchange;

use std::os::unix::fs::PermissionsExt;

use agents::{Agent, Folder, setup};
use slate_blackboard::interface::Value;
use slate_share::carrier::local::Local;
use slate_share::carrier::{Carrier, CarrierError};
use slate_share::peers::Peers;

fn folder(_: &str) -> Folder {
    Folder::new()
}

#[test]
fn an_endpoint_is_for_one_agent_and_its_user_alone() {
    let folder = Folder::new();
    let base = Agent::listening("base", &folder);
    let mode = std::fs::metadata(folder.path("base")).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
    let endpoint = folder.endpoint("base");
    let error = Local.listen(&endpoint).unwrap_err();
    assert!(matches!(error, CarrierError::InUse { .. }));
    assert_eq!(
        error.to_string(),
        format!(
            "endpoint `{endpoint}` is in use by another agent, process {}: stop that one, or listen at another endpoint",
            std::process::id()
        )
    );
    drop(base);
    assert!(!folder.path("base").exists());
    // What an agent leaves that is killed.
    drop(std::os::unix::net::UnixListener::bind(folder.path("base")).unwrap());
    let error = Local.dial(&endpoint).unwrap_err();
    assert_eq!(error.to_string(), format!("no agent listens at `{endpoint}`"));
    let base = Agent::listening("base", &folder);
    assert!(Local.dial(&endpoint).is_ok());
    drop(base);
    std::fs::write(folder.path("base"), "no socket").unwrap();
    assert!(matches!(Local.listen(&endpoint), Err(CarrierError::Unsafe { .. })));
    let error = Local.listen("local:a b").unwrap_err();
    assert!(error.to_string().starts_with("`local:a b` is not an endpoint: local:NAME"));
    let board = std::sync::Arc::new(slate_blackboard::Board::new("x"));
    let error = Peers::start(&board, setup("x").listen("tcp:7447")).unwrap_err();
    assert!(error.to_string().contains("it begins with the name of a carrier"));
}

#[test]
fn dialed_endpoint_is_shown_from_the_start() {
    let (folder, base) = (Folder::new(), Agent::start(setup("base")));
    for number in 0..100 {
        let (name, endpoint) = (format!("n{number}"), folder.endpoint("nobody"));
        base.peers.connect(&name, &endpoint).unwrap();
        let path = format!("peers/{name}/link/endpoint");
        let shown = || base.board.read(&path).ok().flatten();
        agents::wait_for("what is shown first", || shown().is_some());
        assert_eq!(shown().unwrap().0, Value::Text(endpoint));
    }
}
