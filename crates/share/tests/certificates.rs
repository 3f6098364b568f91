//! What certificates prove, and what is refused.
#![cfg(feature = "zenoh")]
#![allow(clippy::unwrap_used, reason = "a test ends at the first surprise")]
#![allow(clippy::disallowed_methods, reason = "certificates go by the calendar")]

mod agents;

use std::collections::BTreeMap;
use std::os::unix::fs::PermissionsExt;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use agents::net::{Authority, Certificate, port};
use agents::{Agent, Folder, setup, wait_for};
use slate_blackboard::interface::Value;
use slate_runtime::sharing::About;
use slate_share::carrier::zenoh::Zenoh;
use slate_share::carrier::{Carrier, CarrierError};
use slate_share::peers::Setup;

const HOUR: Duration = Duration::from_secs(3600);

#[test]
fn files_that_are_of_no_use_are_refused() {
    let folder = Folder::new();
    let folder = folder.path("");
    let (authority, foreign) = (Authority::new(&folder, "ours"), Authority::new(&folder, "theirs"));
    let good = authority.sign("arm");
    let refused = |certificate: &Certificate, authority: &Authority| {
        let error = certificate.load(&authority.certificate, "arm").unwrap_err();
        (error.about, error.message, error.help.unwrap())
    };
    good.load(&authority.certificate, "arm").unwrap();

    let (about, message, _) = refused(&good, &foreign);
    assert_eq!(about, About::Certificate);
    assert!(message.contains("was not signed by the authority"), "{message}");

    let (about, message, help) = refused(&authority.sign("leg"), &authority);
    assert_eq!(about, About::Certificate);
    assert!(message.ends_with("is that of `leg`, and this agent is `arm`"), "{message}");
    assert_eq!(help, "make one with the common name (CN) `arm`");

    let (_, message, _) = refused(
        &authority.sign_with("arm", |made| made.not_after = (SystemTime::now() - HOUR).into()),
        &authority,
    );
    assert!(message.contains("has expired"), "{message}");
    let (_, message, _) = refused(
        &authority.sign_with("arm", |made| made.not_before = (SystemTime::now() + HOUR).into()),
        &authority,
    );
    assert!(message.contains("is not valid yet"), "{message}");

    let other = Certificate { certificate: good.certificate.clone(), key: authority.sign("arm").key };
    let (about, message, _) = refused(&other, &authority);
    assert_eq!(about, About::Key);
    assert!(message.ends_with("does not belong to the certificate"), "{message}");

    let swapped = Certificate { certificate: good.key.clone(), key: good.key.clone() };
    let (about, message, _) = refused(&swapped, &authority);
    assert_eq!(about, About::Certificate);
    assert!(message.ends_with("holds no certificate in PEM"), "{message}");

    let missing = Certificate { certificate: good.certificate.clone(), key: folder.join("nothing.key") };
    let (about, message, _) = refused(&missing, &authority);
    assert_eq!(about, About::Key);
    assert!(message.contains("nothing.key can't be read: No such file"), "{message}");

    std::fs::set_permissions(&good.key, std::fs::Permissions::from_mode(0o640)).unwrap();
    let (about, message, help) = refused(&good, &authority);
    assert_eq!(about, About::Key);
    assert!(message.starts_with("others than its owner may use the key"), "{message}");
    assert!(help.starts_with("chmod 600 /"), "{help}");
}

/// An agent with a certificate, whatever it says that it is.
fn agent(says: &str, certificate: &Certificate, is: &str, authority: &Authority) -> Setup {
    let credentials = certificate.load(&authority.certificate, is).unwrap();
    let zenoh: Arc<dyn Carrier> = Arc::new(Zenoh::with_credentials(credentials, false));
    Setup { carriers: BTreeMap::from([("zenoh".into(), zenoh)]), ..setup(says) }
}

fn reason(agent: &Agent, of: &str) -> String {
    match agent.board.read(&format!("peers/{of}/link/reason")).ok().flatten() {
        Some((Value::Text(text), _)) => text.to_string(),
        _ => String::new(),
    }
}

#[test]
fn nobody_speaks_for_another_agent() {
    let folder = Folder::new();
    let authority = Authority::new(&folder.path(""), "ours");
    let at = format!("zenoh:tls/127.0.0.1:{}", port());
    let base = agent("base", &authority.sign("base"), "base", &authority).listen(&at);
    let base = Agent::start(base);
    let liar = Agent::start(agent("arm", &authority.sign("leg"), "leg", &authority));
    liar.peers.connect("base", &at).unwrap();
    let expected = "the certificate there is that of agent `leg`, and not of agent `arm`";
    wait_for("the refusal", || reason(&liar, "base") == expected);
    // Nor does whoever is dialled.
    let arm = Agent::start(agent("arm", &authority.sign("arm"), "arm", &authority));
    arm.peers.connect("bose", &at).unwrap();
    let expected = "the certificate there is that of agent `base`, and not of agent `bose`";
    wait_for("the refusal", || reason(&arm, "bose") == expected);
    arm.peers.connect("base", &at).unwrap();
    wait_for("the true one", || base.peers.is_connected("arm"));
    assert!(!liar.peers.is_connected("base"));
}

#[test]
fn a_certificate_of_another_authority_is_refused() {
    let folder = Folder::new();
    let (ours, theirs) =
        (Authority::new(&folder.path(""), "ours"), Authority::new(&folder.path(""), "theirs"));
    let at = format!("zenoh:tls/127.0.0.1:{}", port());
    let base = Agent::start(agent("base", &ours.sign("base"), "base", &ours).listen(&at));
    // It takes the certificate of `base`, but `base` does not take that of the other authority.
    let mixed = theirs.sign("arm");
    let both = folder.path("both.pem");
    let texts = [&ours, &theirs].map(|authority| std::fs::read_to_string(&authority.certificate).unwrap());
    std::fs::write(&both, texts.concat()).unwrap();
    let credentials = mixed.load(&both, "arm").unwrap();
    let zenoh: Arc<dyn Carrier> = Arc::new(Zenoh::with_credentials(credentials, false));
    let arm = Agent::start(Setup { carriers: BTreeMap::from([("zenoh".into(), zenoh)]), ..setup("arm") });
    arm.peers.connect("base", &at).unwrap();
    wait_for("a reason", || !reason(&arm, "base").is_empty());
    println!("{}", reason(&arm, "base"));
    // And the other way round.
    let leg = Agent::start(agent("leg", &theirs.sign("leg"), "leg", &theirs));
    leg.peers.connect("base", &at).unwrap();
    wait_for("a reason", || reason(&leg, "base").contains("UnknownIssuer"));
    // Whoever has none at all.
    let bare = Agent::start(setup("bare"));
    bare.peers.connect("base", &at.replace("tls", "tcp")).unwrap();
    wait_for("a reason", || !reason(&bare, "base").is_empty());
    println!("{}", reason(&bare, "base"));
    for name in ["arm", "leg", "bare"] {
        assert!(!base.peers.is_connected(name));
    }
    assert!(base.peers.agents().is_empty(), "nobody of them came as far as to greet");
}

#[test]
fn a_link_ends_with_its_certificate() {
    let folder = Folder::new();
    let authority = Authority::new(&folder.path(""), "ours");
    let at = format!("zenoh:tls/127.0.0.1:{}", port());
    let base = Agent::start(agent("base", &authority.sign("base"), "base", &authority).listen(&at));
    let end = SystemTime::now() + Duration::from_secs(4);
    let short = authority.sign_with("arm", |made| made.not_after = end.into());
    let arm = Agent::start(agent("arm", &short, "arm", &authority));
    arm.peers.connect("base", &at).unwrap();
    wait_for("the agent", || base.peers.is_connected("arm"));
    wait_for("its end", || !base.peers.is_connected("arm"));
    assert!(SystemTime::now() >= end - Duration::from_secs(1));
    wait_for("the reason", || !reason(&arm, "base").is_empty() && SystemTime::now() > end);
    println!("{}", reason(&arm, "base"));
    assert!(!base.peers.is_connected("arm"));
}

#[test]
fn nothing_leaves_the_machine_without_certificates_and_rights() {
    let folder = Folder::new();
    let authority = Authority::new(&folder.path(""), "ours");
    let credentials = authority.sign("arm").load(&authority.certificate, "arm").unwrap();
    let certified = |restricted| Zenoh::with_credentials(credentials.clone(), restricted);
    let refused = |zenoh: &Zenoh, endpoint: &str| {
        let listened = zenoh.listen(endpoint).unwrap_err();
        assert_eq!(listened.to_string(), zenoh.check(endpoint).unwrap_err().to_string());
        assert_eq!(listened.to_string(), zenoh.dial(endpoint).unwrap_err().to_string());
        assert!(matches!(listened, CarrierError::Unsafe { .. }));
        listened.to_string()
    };
    for zenoh in [Zenoh::new(), certified(true)] {
        for endpoint in ["zenoh:tcp/0.0.0.0:7447", "zenoh:udp/[::]:7447", "zenoh:tcp/192.0.2.1:7447"] {
            assert!(refused(&zenoh, endpoint).contains("there it has to be zenoh:tls/"), "{endpoint}");
        }
    }
    let tls = "zenoh:tls/0.0.0.0:7447";
    assert!(refused(&Zenoh::new(), tls).contains("TLS needs `certificate`, `key` and `authority`"));
    assert!(refused(&certified(false), tls).contains("say in [share.security.allow]"));
    certified(true).check(tls).unwrap();
}

#[test]
fn endpoints_that_make_no_sense_are_refused() {
    let zenoh = Zenoh::new();
    for endpoint in [
        "zenoh:quic/127.0.0.1:7447",
        "zenoh:tcp/127.0.0.1",
        "zenoh:tcp/127.0.0.1:0",
        "zenoh:tcp/127.0.0.1:70000",
        "zenoh:tcp/:7447",
        "zenoh:tcp/127.0.0.1:7447#iface=lo",
        "zenoh:tcp/a?rel=1:7447",
        "zenoh:127.0.0.1:7447",
        "zenoh:tcp/[::g]:7447",
    ] {
        for error in [zenoh.check(endpoint).unwrap_err(), zenoh.listen(endpoint).unwrap_err()] {
            let expected =
                format!("`{endpoint}` is no endpoint: zenoh carries tcp, udp and tls: zenoh:tcp/HOST:PORT");
            assert!(error.to_string().starts_with(&expected), "{error}");
        }
    }
    let error = zenoh.listen("zenoh:tcp/no-such-host.invalid:7447").unwrap_err().to_string();
    assert!(error.contains("host `no-such-host.invalid` is not found"), "{error}");
    for protocol in ["tcp", "udp"] {
        let endpoint = format!("zenoh:{protocol}/127.0.0.1:{}", port());
        let _listener = zenoh.listen(&endpoint).unwrap();
        let error = zenoh.listen(&endpoint).unwrap_err();
        assert!(matches!(error, CarrierError::InUse { .. }), "{error}");
    }
    let nobody = format!("zenoh:tcp/127.0.0.1:{}", port());
    assert!(matches!(zenoh.dial(&nobody), Err(CarrierError::Nobody { .. })));
}
