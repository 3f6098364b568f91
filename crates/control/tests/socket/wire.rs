//! Requests at the socket, right and wrong.

use super::*;

/// A caller that sends what it likes.
pub struct Raw {
    stream: UnixStream,
    reader: BufReader<UnixStream>,
}

impl Raw {
    pub fn connect(server: &Server) -> Self {
        let stream = UnixStream::connect(server.socket()).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let reader = BufReader::new(stream.try_clone().unwrap());
        Self { stream, reader }
    }

    pub fn say(&mut self, method: &str, path: &str, body: impl AsRef<[u8]>) {
        let body = body.as_ref();
        let length = body.len();
        let head = format!(
            "{method} /api/v1{path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n\
             Content-Length: {length}\r\n\r\n"
        );
        self.stream.write_all(head.as_bytes()).unwrap();
        // Of what is too long not all is taken.
        let _ = self.stream.write_all(body);
    }

    pub fn receive(&mut self) -> (u16, Value) {
        let mut line = String::new();
        self.reader.read_line(&mut line).unwrap();
        let status = line.split(' ').nth(1).unwrap_or_else(|| panic!("{line:?}")).parse().unwrap();
        let mut length = 0;
        loop {
            line.clear();
            self.reader.read_line(&mut line).unwrap();
            let Some((name, value)) = line.trim().split_once(':') else { break };
            if name.eq_ignore_ascii_case("content-length") {
                length = value.trim().parse().unwrap();
            }
        }
        let mut body = vec![0; length];
        self.reader.read_exact(&mut body).unwrap();
        (status, serde_json::from_slice(&body).unwrap())
    }

    pub fn ask(&mut self, method: &str, path: &str, body: impl AsRef<[u8]>) -> (u16, Value) {
        self.say(method, path, body);
        self.receive()
    }
}

#[test]
fn the_socket_is_its_owners_alone() {
    use std::os::unix::fs::PermissionsExt;
    let (_agent, server, _client) = open("mode");
    let mode = std::fs::metadata(server.socket()).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
}

#[test]
fn bad_requests_are_answered_with_what_is_wrong() {
    let (_agent, server, _client) = open("lines");
    let mut stream = Raw::connect(&server);
    let agent = name("lines");
    for (method, path, body, status, word) in [
        ("GET", "/plugns", "", 404, "unknown path"),
        ("DELETE", "/agent", "", 405, "method DELETE is not allowed for"),
        ("GET", "/agent?x=1", "", 400, "not a parameter"),
        ("GET", "/agent", "{}", 400, "takes no body"),
        ("PUT", "/modules/teller", "hello", 400, "no JSON"),
        ("PUT", "/modules/teller", r#"{"enabled":7}"#, 422, "boolean"),
        ("PUT", "/modules/teller", r#"{"enabled":true,"agent":"x"}"#, 422, "agent"),
        ("POST", "/plugins", r#"{"file":"x.so"}"#, 409, "relative"),
        ("GET", "/settings?path=a..b", "", 404, "not a path"),
        ("PATCH", "/settings", r#"[["a=b","c"]]"#, 422, "path"),
        ("POST", "/settings/save", r#"{"to":"moon"}"#, 422, "origin"),
        ("GET", "/slate/other/teller/told", "", 409, "no agent `other`"),
    ] {
        let (found, answer) = stream.ask(method, path, body);
        assert_eq!(found, status, "{method} {path} {body}: {answer}");
        let message = answer["detail"].as_str().unwrap_or_else(|| panic!("{path}: {answer}"));
        assert!(message.contains(word), "{method} {path} {body}: {message}");
        assert!(!answer["help"].as_str().unwrap().is_empty(), "{path}: {answer}");
    }
    let (status, near) = stream.ask("GET", &format!("/slate/{agent}/teller/tld"), "");
    assert!(status == 404 && near["detail"].as_str().unwrap().contains("teller/told"), "{near}");
    assert_eq!(stream.ask("PATCH", "/settings", "[".repeat(100_000)).0, 400);
    // It continues after all of that.
    assert!(stream.ask("GET", "/plugins", "").1.is_array());
    let mut long = Raw::connect(&server);
    long.say("PATCH", "/settings", vec![b'x'; (1 << 20) + 1]);
    assert_eq!(long.receive().0, 413);
}

#[test]
fn requests_sent_at_once_are_answered_in_their_order() {
    let (_agent, server, _client) = open("order");
    let mut stream = Raw::connect(&server);
    let path = format!("/slate/{}/teller/params/first", name("order"));
    stream.say("GET", &path, "");
    stream.say("GET", "/wrong", "");
    stream.say("GET", "/plugins", "");
    assert_eq!(stream.receive().1["value"], json!(2.0));
    assert_eq!(stream.receive().0, 404);
    assert!(stream.receive().1.is_array());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn any_body_gets_one_answer(bodies in proptest::collection::vec(".*", 1..40)) {
        let (_agent, server, _client) = open("any");
        let mut stream = Raw::connect(&server);
        for body in bodies.iter().filter(|body| !body.is_empty()) {
            let (status, answer) = stream.ask("PATCH", "/settings", body);
            prop_assert!(status >= 400 && answer["detail"].is_string(), "{}: {}", body, answer);
        }
    }
}

#[test]
fn silent_or_deaf_callers_block_no_other() {
    let (_agent, server, mut client) = open("silent");
    let mut silent: Vec<_> = (0..20).map(|_| Raw::connect(&server)).collect();
    // These ask without end and never listen, until nothing more goes into the socket.
    let mut deaf: Vec<_> = (0..10).map(|_| UnixStream::connect(server.socket()).unwrap()).collect();
    for stream in &mut deaf {
        stream.set_write_timeout(Some(Duration::from_millis(50))).unwrap();
        while stream.write_all(b"GET /api/v1/settings HTTP/1.1\r\nHost: localhost\r\n\r\n").is_ok() {}
    }
    for _ in 0..60 {
        silent.push(Raw::connect(&server));
        assert!(!client.plugins().unwrap().is_empty());
    }
    // The first of the silent ones had to go, the client never.
    let mut line = String::new();
    assert_eq!(silent[0].reader.read_line(&mut line).unwrap_or(0), 0);
}

#[test]
fn log_names_the_person_behind_a_caller() {
    let log = MemoryTarget::default();
    let agent = load(&database("caller"), log.clone());
    let server = Server::open(&agent).unwrap();
    let mut client = Client::connect(server.name()).unwrap();
    client.modules().unwrap();
    client.on_behalf_of("a model\u{7}");
    client.links().unwrap();
    client.reset().unwrap();
    for line in ["/api/v1/links is done", "/reset is done"] {
        eventually(|| log.lines().iter().any(|logged| logged.to_string().contains(line)));
    }
    assert!(!log.lines().iter().any(|line| line.to_string().contains("/modules")));
}

#[test]
fn names_are_taken_once_and_free_again() {
    let agent = load(&database("names"), MemoryTarget::default());
    let (first, second) = (Server::open(&agent).unwrap(), Server::open(&agent).unwrap());
    assert_eq!(first.name(), name("names"));
    assert_eq!(second.name(), format!("{}-2", name("names")));
    assert!(agents().contains(&first.name().to_owned()) && agents().contains(&second.name().to_owned()));
    let (socket, lock) = (first.socket().to_owned(), first.socket().with_extension("lock"));
    assert!(socket.exists() && lock.exists());
    drop(first);
    assert!(!socket.exists() && !lock.exists());
    assert!(matches!(Client::connect(&name("names")), Err(ClientError::NoAgent { .. })));
    // A killed agent leaves a socket without a listener.
    drop(std::os::unix::net::UnixListener::bind(&socket).unwrap());
    assert!(socket.exists() && !agents().contains(&name("names")));
    assert!(matches!(Client::connect(&name("names")), Err(ClientError::NoAgent { .. })));
    let again = Server::open(&agent).unwrap();
    assert_eq!(again.name(), name("names"));
    Client::connect(again.name()).unwrap().plugins().unwrap();
}
