//! Refusals of `[share.security]` when an agent starts, with the place where it is written.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use crate::agents;

use agents::{Agent as Other, Folder, output, setup, wait_for, write};
use slate_blackboard::interface::Value;
use slate_runtime::configuration::{Configuration, Options as Reading};
use slate_runtime::{Agent, Options, StartError};
use slate_share::agent::AgentSharing;

fn start(text: &str) -> Result<Agent, StartError> {
    let text = format!("[agent]\nname = \"base\"\n{text}");
    let configuration = Configuration::from_text("base.toml", &text, &Reading::default())?;
    let options = Options { sharing: Some(Box::new(AgentSharing::default())), ..Options::default() };
    Agent::load(&configuration, &[], options)
}

/// The first complaint with its line, and its help.
fn refused(text: &str) -> (String, String) {
    let Err(StartError::Configuration(report)) = start(text) else { unreachable!("it starts") };
    let first = &report.diagnostics()[0];
    let line = first.line().unwrap();
    (format!("{line}: {}", first.message()), first.help_text().unwrap_or_default().into())
}

#[test]
fn invalid_settings_are_refused_with_place() {
    let (message, help) = refused("[share.security]\ncertificate = \"base.pem\"\n");
    assert!(message.contains("[share.security] lacks `key`"), "{message}");
    assert!(help.contains("belong together"), "{help}");
    let (message, _) = refused("[share.security]\n");
    assert!(message.contains("[share.security] is empty"), "{message}");
    let (message, _) = refused("[share.security.allow.arm]\nread = [\"a b\"]\n");
    assert!(message.contains("`a b` is not a pattern of paths"), "{message}");
    let (message, _) = refused("[share.security.allow.arm]\nwrite = [\"a\"]\n");
    assert!(message.contains("unknown key `write` in [share.security.allow.arm]"), "{message}");
    let (message, _) = refused("[share]\nlisten = []\n");
    assert!(message.contains("`listen` names no endpoint"), "{message}");
}

#[test]
fn an_agent_listens_at_several_places_and_lets_in_whom_it_says() {
    let folder = Folder::new();
    let (here, there) = (folder.endpoint("here"), folder.endpoint("there"));
    let text = format!(
        "[share]\nlisten = [\"{here}\", \"{there}\"]\n[share.security.allow]\narm = {{ read = \"x/**\" }}\n"
    );
    let base = start(&text).unwrap();
    let mut speed = output(base.board(), "x/speed", 1);
    write(&mut speed, 3);
    let arm = Other::start(setup("arm"));
    arm.peers.connect("base", &there).unwrap();
    wait_for("the one that may", || arm.peers.is_connected("base"));
    let leg = Other::start(setup("leg"));
    leg.peers.connect("base", &here).unwrap();
    wait_for("the refusal of the other one", || {
        let shown = leg.board.read("peers/base/link/reason").ok().flatten();
        shown.is_some_and(
            |(value, _)| matches!(value, Value::Text(text) if text.contains("[share.security.allow]")),
        )
    });
}

#[test]
fn endpoint_of_zenoh_names_the_table_that_has_it() {
    let (message, _) = refused("[share]\nlisten = \"zenoh:tcp/127.0.0.1:7447\"\n");
    assert!(message.starts_with("4: ") && message.contains("of [network]"), "{message}");
    let folder = Folder::new();
    let here = folder.endpoint("here");
    let agents =
        format!("[share]\nlisten = \"{here}\"\n[share.agents.arm]\nat = \"zenoh:udp/192.0.2.1:7447\"\n");
    let (message, _) = refused(&agents);
    assert!(message.starts_with("6: ") && message.contains("of [network]"), "{message}");
}

#[cfg(not(feature = "tls"))]
#[test]
fn missing_tls_support_has_remedy() {
    let (message, _) = refused("[share]\nlisten = \"tls:127.0.0.1:7447\"\n");
    assert!(message.contains("the feature `tls`"), "{message}");
    let files = "certificate = \"a.pem\"\nkey = \"a.key\"\nauthority = \"b.pem\"\n";
    let (message, help) = refused(&format!("[share.security]\n{files}"));
    assert!(message.contains("was built without TLS"), "{message}");
    assert!(help.contains("the feature `tls`"), "{help}");
}

#[cfg(feature = "tls")]
#[test]
fn a_setup_that_leaves_the_machine_unprotected_is_refused() {
    use agents::net::Authority;
    let (message, _) = refused("[share]\nlisten = \"tls:0.0.0.0:7447\"\n");
    assert!(message.starts_with("4: "), "{message}");
    assert!(
        message.contains("TLS needs `certificate`, `key` and `authority` in [share.security]"),
        "{message}"
    );
    let folder = Folder::new();
    let here = folder.endpoint("here");
    let agents = format!("[share]\nlisten = \"{here}\"\n[share.agents.arm]\nat = \"tls:192.0.2.1:7447\"\n");
    let (message, _) = refused(&agents);
    assert!(message.starts_with("6: "), "{message}");
    let authority = Authority::new(&folder.path(""), "ours");
    let other = authority.sign("arm");
    let (certificate, key) = (other.certificate.display(), other.key.display());
    let authority = authority.certificate.display();
    let files = format!("certificate = \"{certificate}\"\nkey = \"{key}\"\nauthority = \"{authority}\"\n");
    let (message, help) = refused(&format!("[share.security]\n{files}"));
    assert!(message.contains("is that of `arm`, and this agent is `base`"), "{message}");
    assert!(message.starts_with("4: "), "{message}");
    assert!(help.contains("common name (CN) `base`"), "{help}");
    // Its own certificate is its identity; the rights of others are required too.
    let issuer = Authority::new(&folder.path(""), "others");
    let own = issuer.sign("base");
    let files = format!(
        "certificate = \"{}\"\nkey = \"{}\"\nauthority = \"{}\"\n",
        own.certificate.display(),
        own.key.display(),
        issuer.certificate.display()
    );
    let (message, help) = refused(&format!("[share.security]\n{files}"));
    assert!(message.contains("but no rights of others"), "{message}");
    assert!(help.contains("[share.security.allow.NAME]"), "{help}");
    start(&format!("[share.security]\n{files}[share.security.allow.arm]\n")).unwrap();
}
