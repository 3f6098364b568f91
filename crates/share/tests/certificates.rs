//! Certificates: identities that they prove, and refusals.
#![cfg(feature = "tls")]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]
#![allow(clippy::disallowed_methods, reason = "certificates go by the calendar")]

use crate::agents;

use std::io::Write;
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt;
use std::sync::{Arc, Mutex};
use std::time::{Duration, SystemTime};

use agents::net::{Authority, Certificate, port};
use agents::{Agent, Folder, rejected, setup, wait_for};
use slate_blackboard::interface::Value;
use slate_runtime::sharing::About;
use slate_share::carrier::tls::Tls;
use slate_share::carrier::{Carrier, CarrierError};
use slate_share::peers::{Notice, PeerEvent, Setup};
use slate_sorted::SortedMap;

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
    let tls: Arc<dyn Carrier> = Arc::new(Tls::new(credentials, false));
    Setup { carriers: SortedMap::from([("tls".into(), tls)]), ..setup(says) }
}

fn reason(agent: &Agent, of: &str) -> String {
    match agent.board.read(&format!("peers/{of}/link/reason")).ok().flatten() {
        Some((Value::Text(text), _)) => text.to_string(),
        _ => String::new(),
    }
}

#[test]
fn no_agent_can_impersonate_another() {
    let folder = Folder::new();
    let authority = Authority::new(&folder.path(""), "ours");
    let at = format!("tls:127.0.0.1:{}", port());
    let base = agent("base", &authority.sign("base"), "base", &authority).listen(&at);
    let base = Agent::start(base);
    let liar = Agent::start(agent("arm", &authority.sign("leg"), "leg", &authority));
    liar.peers.connect("base", &at).unwrap();
    let expected = "the certificate there is that of agent `leg`, and not of agent `arm`";
    wait_for("the refusal", || reason(&liar, "base") == expected);
    // Nor does the dialed agent.
    let arm = Agent::start(agent("arm", &authority.sign("arm"), "arm", &authority));
    arm.peers.connect("bose", &at).unwrap();
    let expected = "the certificate there is that of agent `base`, and not of agent `bose`";
    wait_for("the refusal", || reason(&arm, "bose") == expected);
    arm.peers.connect("base", &at).unwrap();
    wait_for("the true one", || base.peers.is_connected("arm"));
    assert!(!liar.peers.is_connected("base"));
}

#[test]
fn an_address_of_ipv6_is_one_like_others() {
    let folder = Folder::new();
    let authority = Authority::new(&folder.path(""), "ours");
    let at = format!("tls:[::1]:{}", port());
    let base = Agent::start(agent("base", &authority.sign("base"), "base", &authority).listen(&at));
    let arm = Agent::start(agent("arm", &authority.sign("arm"), "arm", &authority));
    arm.peers.connect("base", &at).unwrap();
    wait_for("a link", || base.peers.is_connected("arm") && arm.peers.is_connected("base"));
}

#[test]
fn certificate_without_name_is_refused() {
    let folder = Folder::new();
    let authority = Authority::new(&folder.path(""), "ours");
    let at = format!("tls:127.0.0.1:{}", port());
    let base = Agent::start(agent("base", &authority.sign("base"), "base", &authority).listen(&at));
    let good = authority.sign("arm");
    let arm = agent("arm", &good, "arm", &authority);
    // The files are read again for each link.
    let nameless =
        authority.sign_with("arm", |made| made.distinguished_name = rcgen::DistinguishedName::new());
    std::fs::copy(&nameless.certificate, &good.certificate).unwrap();
    std::fs::copy(&nameless.key, &good.key).unwrap();
    let arm = Agent::start(arm);
    arm.peers.connect("base", &at).unwrap();
    wait_for("the refusal", || reason(&arm, "base").contains("has no common name"));
    assert!(base.peers.agents().is_empty());
}

#[test]
fn a_certificate_of_another_authority_is_refused() {
    let folder = Folder::new();
    let (ours, theirs) =
        (Authority::new(&folder.path(""), "ours"), Authority::new(&folder.path(""), "theirs"));
    let at = format!("tls:127.0.0.1:{}", port());
    let base = Agent::start(agent("base", &ours.sign("base"), "base", &ours).listen(&at));
    // It takes the certificate of `base`, but `base` does not take that of the other authority.
    let mixed = theirs.sign("arm");
    let both = folder.path("both.pem");
    let texts = [&ours, &theirs].map(|authority| std::fs::read_to_string(&authority.certificate).unwrap());
    std::fs::write(&both, texts.concat()).unwrap();
    let credentials = mixed.load(&both, "arm").unwrap();
    let tls: Arc<dyn Carrier> = Arc::new(Tls::new(credentials, false));
    let arm = Agent::start(Setup { carriers: SortedMap::from([("tls".into(), tls)]), ..setup("arm") });
    arm.peers.connect("base", &at).unwrap();
    wait_for("a reason", || !reason(&arm, "base").is_empty());
    assert!(
        reason(&arm, "base").contains("refuses this agent's certificate (UnknownCA)"),
        "{}",
        reason(&arm, "base")
    );
    let why = "the certificate there, in the name of `arm`, was not signed by the authority";
    wait_for("the other side to say so", || rejected(&base, why) > 0);
    // What strangers call themselves stays in its line.
    let rude = theirs.sign("ev\u{1b}[31m\nil");
    let credentials = rude.load(&both, "ev\u{1b}[31m\nil").unwrap();
    let tls: Arc<dyn Carrier> = Arc::new(Tls::new(credentials, false));
    let rude = Agent::start(Setup { carriers: SortedMap::from([("tls".into(), tls)]), ..setup("rude") });
    rude.peers.connect("base", &at).unwrap();
    wait_for("a name that can be printed", || rejected(&base, "`ev\\u{1b}[31m\\nil`") > 0);
    // And the other way round.
    let leg = Agent::start(agent("leg", &theirs.sign("leg"), "leg", &theirs));
    leg.peers.connect("base", &at).unwrap();
    wait_for("a reason", || reason(&leg, "base").contains("was not signed by the authority"));
    for name in ["arm", "leg"] {
        assert!(!base.peers.is_connected(name));
    }
    assert!(base.peers.agents().is_empty(), "nobody of them came as far as to greet");
}

#[test]
fn a_link_ends_with_its_certificate() {
    let folder = Folder::new();
    let authority = Authority::new(&folder.path(""), "ours");
    let at = format!("tls:127.0.0.1:{}", port());
    let base = Agent::start(agent("base", &authority.sign("base"), "base", &authority).listen(&at));
    let end = SystemTime::now() + Duration::from_secs(4);
    let short = authority.sign_with("arm", |made| made.not_after = end.into());
    let arm = Agent::start(agent("arm", &short, "arm", &authority));
    arm.peers.connect("base", &at).unwrap();
    wait_for("the agent", || base.peers.is_connected("arm"));
    wait_for("its end", || !base.peers.is_connected("arm"));
    assert!(SystemTime::now() >= end - Duration::from_secs(1));
    wait_for("the reason", || reason(&arm, "base").contains("has expired") && SystemTime::now() > end);
    assert!(!base.peers.is_connected("arm"));
}

#[test]
fn nothing_leaves_the_machine_without_certificates_and_rights() {
    let folder = Folder::new();
    let authority = Authority::new(&folder.path(""), "ours");
    let credentials = authority.sign("arm").load(&authority.certificate, "arm").unwrap();
    let certified = |restricted| Tls::new(credentials.clone(), restricted);
    let refused = |tls: &Tls, endpoint: &str| {
        let listened = tls.listen(endpoint).unwrap_err();
        assert_eq!(listened.to_string(), tls.check(endpoint).unwrap_err().to_string());
        assert_eq!(listened.to_string(), tls.dial(endpoint).unwrap_err().to_string());
        assert!(matches!(listened, CarrierError::Unsafe { .. }));
        listened.to_string()
    };
    for endpoint in ["tls:0.0.0.0:7447", "tls:[::]:7447", "tls:192.0.2.1:7447"] {
        assert!(
            refused(&Tls::default(), endpoint).contains("TLS needs `certificate`, `key` and `authority`")
        );
        assert!(refused(&certified(false), endpoint).contains("list in [share.security.allow]"));
        certified(true).check(endpoint).unwrap();
    }
}

#[test]
fn endpoints_that_make_no_sense_are_refused() {
    let folder = Folder::new();
    let authority = Authority::new(&folder.path(""), "ours");
    let credentials = authority.sign("arm").load(&authority.certificate, "arm").unwrap();
    let tls = Tls::new(credentials, false);
    for endpoint in [
        "tls:127.0.0.1",
        "tls:127.0.0.1:0",
        "tls:127.0.0.1:70000",
        "tls::7447",
        "tls:/127.0.0.1:7447",
        "tls:[::g]:7447",
    ] {
        for error in [tls.check(endpoint).unwrap_err(), tls.listen(endpoint).unwrap_err()] {
            let expected = format!("`{endpoint}` is not an endpoint: tls:HOST:PORT");
            assert!(error.to_string().starts_with(&expected), "{error}");
        }
    }
    let error = tls.listen("tls:no-such-host.invalid:7447").unwrap_err().to_string();
    assert!(error.contains("host `no-such-host.invalid` is not found"), "{error}");
    for host in ["127.0.0.1", "localhost", "[::1]"] {
        let endpoint = format!("tls:{host}:{}", port());
        assert!(matches!(tls.dial(&endpoint), Err(CarrierError::Nobody { .. })));
        let _listener = tls.listen(&endpoint).unwrap();
        let error = tls.listen(&endpoint).unwrap_err();
        assert!(matches!(error, CarrierError::InUse { .. }), "{error}");
    }
}

#[test]
fn foreign_peer_is_reported_once_and_blocks_no_other() {
    let folder = Folder::new();
    let (ours, theirs) =
        (Authority::new(&folder.path(""), "ours"), Authority::new(&folder.path(""), "theirs"));
    let port = port();
    let at = format!("tls:127.0.0.1:{port}");
    let told: Arc<Mutex<Vec<String>>> = Arc::default();
    let notice: Notice = {
        let told = Arc::clone(&told);
        Arc::new(move |_, happening| {
            if let PeerEvent::Rejected { reason } = happening {
                told.lock().unwrap().push(reason.clone());
            }
        })
    };
    let base = agent("base", &ours.sign("base"), "base", &ours).listen(&at);
    let base = Agent::start(Setup { notice: Some(notice), ..base });
    // Some are silent, some don't use TLS, one has a foreign certificate.
    let silent: Vec<_> = (0..4).map(|_| TcpStream::connect(("127.0.0.1", port)).unwrap()).collect();
    let mut noise = TcpStream::connect(("127.0.0.1", port)).unwrap();
    noise.write_all(b"GET / HTTP/1.1\r\n\r\n").unwrap();
    let both = folder.path("both.pem");
    let texts = [&ours, &theirs].map(|authority| std::fs::read_to_string(&authority.certificate).unwrap());
    std::fs::write(&both, texts.concat()).unwrap();
    let credentials = theirs.sign("leg").load(&both, "leg").unwrap();
    let tls: Arc<dyn Carrier> = Arc::new(Tls::new(credentials, false));
    let leg = Agent::start(Setup { carriers: SortedMap::from([("tls".into(), tls)]), ..setup("leg") });
    leg.peers.connect("base", &at).unwrap();
    let arm = Agent::start(agent("arm", &ours.sign("arm"), "arm", &ours));
    arm.peers.connect("base", &at).unwrap();
    wait_for("the true one", || base.peers.is_connected("arm"));
    let noise = "the peer does not speak TLS as agents do";
    let of_leg = "the certificate there, in the name of `leg`, was not signed by the authority";
    let told_of = |what: &str| told.lock().unwrap().iter().filter(|reason| reason.contains(what)).count();
    wait_for(noise, || told_of(noise) == 1);
    // It dials again and again.
    wait_for(of_leg, || rejected(&base, of_leg) >= 3);
    assert_eq!(told_of(of_leg), 1);
    assert!(told.lock().unwrap().iter().all(|reason| reason.starts_with(&format!("127.0.0.1 at {at}: "))));
    drop(silent);
}
