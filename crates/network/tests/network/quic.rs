//! Links between machines: QUIC with certificates of both ends.
#![allow(clippy::disallowed_methods, reason = "certificates go by the calendar")]

use std::net::UdpSocket;
use std::os::unix::fs::PermissionsExt;
use std::time::{Duration, SystemTime};

use serde_json::{Value as Json, json};
use slate_network::{AgentNetwork, NetworkSettings};
use zenoh::qos::Reliability;
use zenoh::{Session, Wait};

use crate::network::agent::{Running, ask, eventually, session_with};
use crate::network::certificates::{Authority, Certificate};

/// Free UDP port.
pub fn udp_port() -> u16 {
    UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// A table `[network]` with certificates and rights.
pub fn table(entries: &str, certificate: &Certificate, rights: &str) -> String {
    format!("{entries}\n{}\n{rights}", certificate.table())
}

/// The TLS entries of a program of Zenoh, which may lack a certificate.
pub fn tls(certificate: &Certificate, is_mutual: bool) -> Vec<(&'static str, Json)> {
    let mut tls = json!({
        "root_ca_certificate": certificate.authority,
        "enable_mtls": is_mutual,
        "verify_name_on_connect": false,
    });
    if is_mutual {
        for end in ["listen", "connect"] {
            tls[format!("{end}_certificate")] = json!(certificate.certificate);
            tls[format!("{end}_private_key")] = json!(certificate.key);
        }
    }
    vec![("transport/link/tls", tls)]
}

/// A program of Zenoh with a certificate.
pub fn program(port: u16, certificate: &Certificate) -> Session {
    session_with("peer", &[], &[format!("quic/127.0.0.1:{port}")], &tls(certificate, true))
}

/// Agent `base`, of which others read the sensor.
fn base(port: u16, authority: &Authority) -> Running {
    let rights = "[network.security.allow.arm]\nread = [\"sensor/**\"]";
    let entries = format!("listen = [\"quic/127.0.0.1:{port}\"]\nset = [\"**\"]");
    Running::start("base", &table(&entries, &authority.sign("base"), rights))
}

/// Agent `arm`, which reads `base`.
fn arm(port: u16, certificate: &Certificate) -> Running {
    let entries = format!(
        "connect = [\"quic/127.0.0.1:{port}\"]\nread.\"driver/ambient\" = \"slate://base/sensor/count\""
    );
    Running::start("arm", &table(&entries, certificate, "[network.security.allow.base]"))
}

#[test]
fn two_agents_read_each_other_over_mutual_quic() {
    let (port, authority) = (udp_port(), Authority::new());
    // In any order.
    let arm = arm(port, &authority.sign("arm"));
    let base = base(port, &authority);
    eventually("values", || arm.number("driver/seen/value") > 5.0);
    eventually("both", || {
        base.network().agents() == ["arm", "base"] && arm.network().agents() == ["arm", "base"]
    });
    // Tests beside this one have strangers.
    let is_stranger = |agent: &Running| agent.has_logged("is not in [network.security.allow]");
    assert!(!is_stranger(&base) && !is_stranger(&arm), "{:?}", base.log.lines());
}

#[test]
fn agents_come_and_go_and_values_flow_again() {
    let (port, authority) = (udp_port(), Authority::new());
    let arm = arm(port, &authority.sign("arm"));
    for _ in 0..3 {
        let base = base(port, &authority);
        let before = arm.network().readings()[0].received;
        eventually("values", || arm.network().readings()[0].received > before + 5);
        drop(base);
    }
}

#[test]
fn strangers_are_refused_and_the_rest_goes_on() {
    let (port, authority, others) = (udp_port(), Authority::new(), Authority::new());
    let base = base(port, &authority);
    let arm = arm(port, &authority.sign("arm"));
    eventually("values", || arm.number("driver/seen/value") > 5.0);
    let expired = authority.sign_until("expired", SystemTime::now() - Duration::from_secs(60));
    let mut foreign = others.sign("arm");
    foreign.authority = authority.certificate.clone();
    let mine = authority.sign("nobody");
    let endpoint = [format!("quic/127.0.0.1:{port}")];
    for (what, tls, can_link) in [
        ("the peer shows no certificate", tls(&mine, false), false),
        ("the certificate there was not signed by the authority", tls(&foreign, true), false),
        ("the certificate there has expired", tls(&expired, true), false),
        ("agent `nobody` is not in [network.security.allow], and may do nothing", tls(&mine, true), true),
    ] {
        let stranger = session_with("peer", &[], &endpoint, &tls);
        let subscriber = stranger.declare_subscriber("slate/**").wait().unwrap();
        let seen = arm.number("driver/seen/value");
        eventually("values of others", || arm.number("driver/seen/value") > seen + 50.0);
        for key in
            ["slate/base/sensor/count", "slate/base/@tree", "slate/base/@tree/arm", "slate/base/@alive"]
        {
            let replies = ask(&stranger, key, None);
            assert!(replies.is_empty(), "{what}: {replies:?}");
        }
        assert!(subscriber.try_recv().unwrap().is_none(), "{what}");
        let tokens = stranger.liveliness().get("slate/*/@alive").wait().unwrap();
        assert_eq!(tokens.iter().count(), 0, "{what}");
        assert_eq!(stranger.info().links().wait().count() > 0, can_link, "{what}");
        let lines = base.log.lines();
        let told = lines.iter().filter(|line| line.to_string().contains(what)).count();
        assert_eq!(told, 1, "{what}: {lines:?}");
    }
    assert_eq!(base.network().agents(), ["arm", "base"]);
}

#[test]
fn an_agent_believes_no_server_of_another_authority() {
    let (port, authority, others) = (udp_port(), Authority::new(), Authority::new());
    // It takes the certificate of `arm`, and has one of its own authority.
    let mut liar = others.sign("base");
    let both =
        [&others.certificate, &authority.certificate].map(|file| std::fs::read_to_string(file).unwrap());
    std::fs::write(&liar.authority, both.concat()).unwrap();
    liar.authority = others.certificate.clone();
    let server = session_with("peer", &[format!("quic/127.0.0.1:{port}")], &[], &tls(&liar, true));
    let publisher = server.declare_publisher("slate/base/sensor/count").wait().unwrap();
    let arm = arm(port, &authority.sign("arm"));
    eventually("the reason", || {
        arm.has_logged(&format!(
            "`quic/127.0.0.1:{port}`: the certificate there was not signed by the authority"
        ))
    });
    publisher.put("7").wait().unwrap();
    assert_eq!((arm.network().readings()[0].received, server.info().links().wait().count()), (0, 0));
    drop(server);
    eventually("its port", || UdpSocket::bind(("127.0.0.1", port)).is_ok());
    let _base = base(port, &authority);
    eventually("values of the true one", || arm.number("driver/seen/value") > 5.0);
}

#[test]
fn a_link_ends_with_its_certificate() {
    let (port, authority) = (udp_port(), Authority::new());
    let base = base(port, &authority);
    let end = SystemTime::now() + Duration::from_secs(4);
    let arm = arm(port, &authority.sign_until("arm", end));
    eventually("values", || arm.number("driver/seen/value") > 5.0);
    assert!(arm.has_logged("expires in 0 minutes: renew it"), "{:?}", arm.log.lines());
    eventually("its end", || base.network().agents() == ["base"]);
    assert!(SystemTime::now() >= end - Duration::from_secs(1));
    // A renewed one is used for the next link.
    let _renewed = authority.sign("arm");
    let before = arm.network().readings()[0].received;
    eventually("values again", || arm.network().readings()[0].received > before + 5);
}

#[test]
fn best_effort_goes_by_datagrams() {
    let (port, authority) = (udp_port(), Authority::new());
    let entries =
        format!("listen = [\"quic/127.0.0.1:{port}\"]\nread.\"driver/ambient\" = \"zenoh:demo/temperature\"");
    let rights = "[network.security.allow.lab]";
    let base = Running::start("base", &table(&entries, &authority.sign("base"), rights));
    let endpoint = format!("quic/127.0.0.1:{port}?mixed_rel=1");
    let lab = session_with("peer", &[], &[endpoint], &tls(&authority.sign("lab"), true));
    let links = || lab.info().links().wait().map(|link| link.reliability()).collect::<Vec<_>>();
    eventually("both ways", || links().len() == 2);
    assert!(links().contains(&Some(Reliability::BestEffort)), "{:?}", links());
    let publisher =
        lab.declare_publisher("demo/temperature").reliability(Reliability::BestEffort).wait().unwrap();
    eventually("values", || {
        publisher.put("21.5").wait().unwrap();
        base.number("driver/seen/value") == 21.5
    });
}

/// The first error at the start of agent `base`, with its place and what to do.
fn failure(network: &str) -> String {
    let agent = Running::load("base", network);
    let settings = NetworkSettings::of(&agent.configuration).unwrap().unwrap();
    let error = AgentNetwork::start(&agent.surface, &settings).unwrap_err();
    let report = error.report(&agent.configuration);
    let first = &report.diagnostics()[0];
    format!("{} ({})", first.placed(), first.help_text().unwrap())
}

#[test]
fn useless_files_are_reported_with_line() {
    let (authority, others) = (Authority::new(), Authority::new());
    let refused = |certificate: &Certificate| {
        let entries = format!("listen = [\"quic/127.0.0.1:{}\"]", udp_port());
        failure(&table(&entries, certificate, "[network.security.allow.arm]"))
    };
    let expect = |text: String, line: u32, words: &str| {
        assert!(text.starts_with(&format!("test.toml:{line}:")) && text.contains(words), "{text}");
    };
    const CERTIFICATE: u32 = 14;
    let past = SystemTime::now() - Duration::from_secs(60);
    expect(refused(&authority.sign_until("base", past)), CERTIFICATE, "has expired");
    let future = SystemTime::now() + Duration::from_secs(7200);
    expect(refused(&authority.sign_until("base", future)), CERTIFICATE, "is not valid yet");
    expect(refused(&authority.sign("leg")), CERTIFICATE, "is that of `leg`, and this agent is `base`");
    let mut foreign = others.sign("base");
    foreign.authority = authority.certificate.clone();
    expect(refused(&foreign), CERTIFICATE, "was not signed by the authority");
    let good = authority.sign("base");
    let mut wrong = authority.sign("base");
    wrong.certificate = "nowhere.pem".into();
    expect(refused(&wrong), CERTIFICATE, "the certificate nowhere.pem can't be read: No such file");
    wrong = authority.sign("base");
    wrong.authority = wrong.key.clone();
    expect(refused(&wrong), CERTIFICATE + 2, "holds no certificate in PEM");
    let mut wrong = authority.sign("base");
    wrong.key = others.sign("base").key;
    expect(refused(&wrong), CERTIFICATE + 1, "does not belong to the certificate");
    std::fs::set_permissions(&good.key, std::fs::Permissions::from_mode(0o644)).unwrap();
    let text = refused(&authority_file(&good));
    expect(text.clone(), CERTIFICATE + 1, "others than its owner may use the key");
    assert!(text.contains("(chmod 600 "), "{text}");
}

/// The same files.
fn authority_file(certificate: &Certificate) -> Certificate {
    let Certificate { certificate, key, authority } = certificate;
    Certificate { certificate: certificate.clone(), key: key.clone(), authority: authority.clone() }
}

#[test]
fn used_port_and_missing_router_are_reported_over_quic() {
    let (port, authority) = (udp_port(), Authority::new());
    let taken = UdpSocket::bind(("127.0.0.1", port)).unwrap();
    let rights = "[network.security.allow.hub]\nrouter = true";
    let entries = format!("listen = [\"quic/127.0.0.1:{port}\"]");
    let text = failure(&table(&entries, &authority.sign("base"), rights));
    assert!(text.starts_with("test.toml:12:") && text.contains("can't be listened at"), "{text}");
    drop(taken);
    let entries = format!("mode = \"client\"\nconnect = [\"quic/127.0.0.1:{port}\"]");
    let text = failure(&table(&entries, &authority.sign("base"), rights));
    assert!(text.starts_with("test.toml:13:") && text.contains("refuses the other's certificate"), "{text}");
}

const BOOK: &str = include_str!("../../../../book/src/17-network.md");

#[test]
fn the_table_of_the_book_starts_with_its_certificates() {
    let block = |language: &str, word: &str| {
        let fence = format!("```{language}\n");
        let blocks = BOOK.split(&fence).skip(1);
        let mut blocks = blocks.filter_map(|block| block.split("```").next());
        blocks.find(|block| block.contains(word)).unwrap().to_owned()
    };
    let folder =
        std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("book-{}", std::process::id()));
    let keys = folder.join("keys");
    std::fs::create_dir_all(&keys).unwrap();
    let mut openssl = std::process::Command::new("bash");
    openssl.args(["-euo", "pipefail", "-c", &block("sh", "openssl req -x509")]).current_dir(&keys);
    slate_test_tools::run(&mut openssl, "the certificates of the book can't be made");
    let port = udp_port();
    let place = |text: String| {
        text.replace("\"keys/", &format!("\"{}/", keys.display()))
            .replace("0.0.0.0:7447", &format!("127.0.0.1:{port}"))
    };
    let table = place(block("toml", "[network.security.allow.arm]")).replace("[network]\n", "");
    let _base = Running::start("base", &table.replace("localizer/**", "sensor/**"));
    let files = Certificate {
        certificate: keys.join("arm.pem"),
        key: keys.join("arm.key"),
        authority: keys.join("authority.pem"),
    };
    let arm = arm(port, &files);
    eventually("values", || arm.number("driver/seen/value") > 5.0);
    let _ = std::fs::remove_dir_all(folder);
}

#[test]
fn a_stalled_handshake_stops_no_link_that_is_there() {
    let (port, authority) = (udp_port(), Authority::new());
    let base = base(port, &authority);
    let arm = arm(port, &authority.sign("arm"));
    eventually("values", || arm.number("driver/seen/value") > 5.0);
    // The first packet of a true handshake, and nothing after it.
    let trap = UdpSocket::bind("127.0.0.1:0").unwrap();
    let endpoint = format!("quic/{}", trap.local_addr().unwrap());
    let tls = tls(&authority.sign("lab"), true);
    let lab = std::thread::spawn(move || session_with("peer", &[], &[endpoint], &tls));
    let mut packet = [0; 2048];
    let length = trap.recv(&mut packet).unwrap();
    let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
    sender.send_to(&packet[..length], ("127.0.0.1", port)).unwrap();
    let start = std::time::Instant::now();
    while start.elapsed() < Duration::from_secs(5) {
        let seen = arm.number("driver/seen/value");
        eventually("values meanwhile", || arm.number("driver/seen/value") > seen);
    }
    assert_eq!(base.network().agents(), ["arm", "base"]);
    drop(lab.join().unwrap());
}
