//! Addresses that others reach are encrypted, and require secrets of the owner's choice.

use std::io::{BufReader, Write};
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig, ClientConnection, RootCertStore, StreamOwned};

use crate::agent::Running;
use crate::client::{Client, reply};
use crate::modules::CONFIGURATION;

fn folder(name: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// Writes a file that only its owner may read.
fn write_secret(file: &Path, content: &str) {
    std::fs::write(file, content).unwrap();
    std::fs::set_permissions(file, std::fs::Permissions::from_mode(0o600)).unwrap();
}

#[test]
fn with_a_certificate_it_speaks_tls_and_nothing_else() {
    let folder = folder("console-tls");
    let made = rcgen::generate_simple_self_signed(vec!["localhost".into()]).unwrap();
    let (certificate, key, token) =
        (folder.join("c.pem"), folder.join("k.pem"), folder.join("operator.token"));
    std::fs::write(&certificate, made.cert.pem()).unwrap();
    write_secret(&key, &made.signing_key.serialize_pem());
    let secret = "0123456789abcdef0123456789abcdef";
    write_secret(&token, secret);
    let text = format!(
        "{CONFIGURATION}\n[console]\nport = 0\naddresses = [\"127.0.0.1\"]\ncertificate = {certificate:?}\nkey = {key:?}\n\
         tokens.operator = {token:?}"
    );
    let run = Running::start_with("tls", &text);
    assert!(run.console.link().starts_with("https://localhost:"), "the certificate holds no address");
    let mut roots = RootCertStore::empty();
    roots.add(CertificateDer::from(made.cert.der().to_vec())).unwrap();
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let settings =
        ClientConfig::builder_with_provider(provider).with_safe_default_protocol_versions().unwrap();
    let settings = settings.with_root_certificates(roots).with_no_client_auth();
    let name = ServerName::try_from("localhost").unwrap();
    let connection = ClientConnection::new(Arc::new(settings), name).unwrap();
    let mut stream = StreamOwned::new(connection, TcpStream::connect(run.address()).unwrap());
    let head = Client::new(run.address(), secret).head("GET", "/api/v1/agent");
    stream.write_all(format!("{head}Connection: close\r\n\r\n").as_bytes()).unwrap();
    let agent = reply(&mut BufReader::new(stream)).json();
    assert_eq!((&agent["role"], &agent["name"]), (&"operator".into(), &run.name().into()));
    // A client without TLS gets no answer.
    assert_eq!(Client::new(run.address(), secret).send("GET", "/agent", None).status, 0);
}

#[test]
fn the_link_uses_a_name_that_the_certificate_has() {
    let folder = folder("console-tls-names");
    let token = folder.join("viewer.token");
    write_secret(&token, "0123456789abcdef0123456789abcdef");
    for (number, (held, said, wanted)) in [
        (&["robot.local"][..], "", "robot.local"),
        (&["robot.local", "127.0.0.1"], "", "127.0.0.1"),
        // No other caller reaches it.
        (&["robot.local", "localhost"], "names = [\"robot.local\"]", "localhost"),
        (&["arm.local", "robot.local"], "names = [\"robot.local\"]", "robot.local"),
        (&["*.lab.local"], "names = [\"robot.lab.local\"]", "robot.lab.local"),
        // Which names there are it does not say.
        (&["*.lab.local"], "", "127.0.0.1"),
    ]
    .into_iter()
    .enumerate()
    {
        let held: Vec<String> = held.iter().map(|name| (*name).into()).collect();
        let made = rcgen::generate_simple_self_signed(held.clone()).unwrap();
        let (certificate, key) = (folder.join("c.pem"), folder.join("k.pem"));
        std::fs::write(&certificate, made.cert.pem()).unwrap();
        write_secret(&key, &made.signing_key.serialize_pem());
        let text = format!(
            "{CONFIGURATION}\n[console]\nport = 0\naddresses = [\"127.0.0.1\"]\n{said}\ncertificate = {certificate:?}\n\
             key = {key:?}\ntokens.viewer = {token:?}"
        );
        let run = Running::start_with(&format!("tls-name-{number}"), &text);
        let link = run.console.link();
        assert!(
            link.starts_with(&format!("https://{wanted}:{}/#", run.address().port())),
            "{held:?}: {link}"
        );
        let log = run.board.history("log/tail").unwrap();
        let lines: Vec<_> = log.iter().map(|(line, _)| serde_json::to_string(line).unwrap()).collect();
        let is_warned = lines.iter().any(|line| line.contains("the console's certificate holds no name"));
        assert_eq!(is_warned, wanted == "127.0.0.1" && held.len() == 1, "{lines:?}");
        // The link admits its user by that name.
        let mut roots = RootCertStore::empty();
        roots.add(CertificateDer::from(made.cert.der().to_vec())).unwrap();
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        let settings =
            ClientConfig::builder_with_provider(provider).with_safe_default_protocol_versions().unwrap();
        let settings = settings.with_root_certificates(roots).with_no_client_auth();
        let connection =
            ClientConnection::new(Arc::new(settings), ServerName::try_from(wanted).unwrap()).unwrap();
        let mut stream = StreamOwned::new(connection, TcpStream::connect(run.address()).unwrap());
        let host = format!("{wanted}:{}", run.address().port());
        let client = Client::new(run.address(), "0123456789abcdef0123456789abcdef").with("Host", &host);
        let head = client.head("GET", "/api/v1/agent");
        let sent = stream.write_all(format!("{head}Connection: close\r\n\r\n").as_bytes());
        assert_eq!(sent.is_ok(), !is_warned, "{held:?}: {sent:?}");
        if !is_warned {
            assert_eq!(reply(&mut BufReader::new(stream)).json()["role"], "viewer");
        }
    }
}

/// Why no console begins with those settings.
fn refusal(settings: &str) -> String {
    let options =
        slate_runtime::configuration::Options { extra_tables: vec!["console".into()], ..Default::default() };
    let text = format!("[console]\nport = 0\n{settings}");
    let database = slate_runtime::configuration::Database::from_text("a.toml", &text, options).unwrap();
    let agent = slate_runtime::Agent::load_with(&database, &[], slate_runtime::Options::default()).unwrap();
    let settings = slate_console::Settings::of(&agent.configuration()).unwrap();
    slate_console::Console::start(&agent, &settings, Vec::new()).unwrap_err().to_string()
}

const SECRET: &str = "0123456789abcdef0123456789abcdef";

#[test]
fn a_secret_that_others_can_read_or_guess_is_none() {
    let token = folder("console-secrets").join("viewer.token");
    let settings = format!("tokens.viewer = {token:?}");
    write_secret(&token, SECRET);
    std::fs::set_permissions(&token, std::fs::Permissions::from_mode(0o644)).unwrap();
    assert!(refusal(&settings).contains("chmod 600"));
    write_secret(&token, "secret");
    assert!(refusal(&settings).contains("openssl rand"));
}

#[test]
fn key_that_others_can_read_is_refused() {
    let folder = folder("console-key");
    let made = rcgen::generate_simple_self_signed(vec!["localhost".into()]).unwrap();
    let (certificate, key) = (folder.join("c.pem"), folder.join("k.pem"));
    std::fs::write(&certificate, made.cert.pem()).unwrap();
    write_secret(&key, &made.signing_key.serialize_pem());
    std::fs::set_permissions(&key, std::fs::Permissions::from_mode(0o644)).unwrap();
    let said = refusal(&format!("certificate = {certificate:?}\nkey = {key:?}"));
    assert!(said.contains("k.pem") && said.contains("mode 644"), "{said}");
}

#[test]
fn one_token_for_two_roles_is_refused() {
    let folder = folder("console-one-token");
    let [one, other] = ["one.token", "other.token"].map(|name| folder.join(name));
    write_secret(&one, SECRET);
    write_secret(&other, &format!("{SECRET}\n"));
    for operator in [&one, &other] {
        let said = refusal(&format!("tokens = {{ viewer = {one:?}, operator = {operator:?} }}"));
        assert!(said.contains("the same token as that of a viewer"), "{said}");
    }
}
