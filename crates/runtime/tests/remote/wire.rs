//! The lines between a tool and its agent.

use super::*;

/// A tool that says what it likes.
pub struct Raw {
    stream: UnixStream,
    reader: BufReader<UnixStream>,
}

impl Raw {
    pub fn connect(server: &Server) -> Self {
        let stream = UnixStream::connect(server.socket()).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let reader = BufReader::new(stream.try_clone().unwrap());
        let mut raw = Self { stream, reader };
        assert_eq!(raw.hear(), json!({ "slate": 1, "agent": server.name() }));
        raw
    }

    fn hear(&mut self) -> Value {
        let mut line = String::new();
        self.reader.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line}"))
    }

    pub fn ask(&mut self, line: impl AsRef<[u8]>) -> Value {
        self.stream.write_all(line.as_ref()).unwrap();
        self.stream.write_all(b"\n").unwrap();
        self.hear()
    }
}

#[test]
fn bad_lines_are_answered_with_what_is_wrong() {
    let (_agent, server, _client) = open("lines");
    let mut stream = Raw::connect(&server);
    for (line, word) in [
        ("", "no call"),
        ("hello", "no call"),
        ("{}", "missing field `call`"),
        (r#"{"call":"plugin/lst"}"#, "plugin/list"),
        (r#"{"call":"plugin/list","agent":"x"}"#, "agent"),
        (r#"{"call":"plugin/load"}"#, "a name or a file"),
        (r#"{"call":"module/enable","name":7}"#, "string"),
        (r#"{"call":"config/get","path":"a..b"}"#, "no path"),
        (r#"{"call":"config/set","changes":[["a=b","c"]]}"#, "path"),
        (r#"{"call":"config/save","to":"moon"}"#, "origin"),
        (r#"{"call":"read","url":"http://x/y"}"#, "slate://"),
        (r#"{"call":"read","url":"/teller/tld"}"#, "teller/told"),
        (r#"{"call":"read","url":"slate://other/teller/told"}"#, "no agent `other`"),
    ] {
        let answer = stream.ask(line);
        let message = answer["error"]["message"].as_str().unwrap_or_else(|| panic!("{line}: {answer}"));
        assert!(message.contains(word), "{line}: {message}");
        assert!(!answer["error"]["help"].as_str().unwrap().is_empty(), "{line}: {answer}");
    }
    let deep = format!(r#"{{"call":{}"#, "[".repeat(100_000));
    assert!(stream.ask(&deep)["error"]["message"].is_string());
    let long = stream.ask(vec![b'x'; LINE_LIMIT + 1]);
    assert!(long["error"]["message"].as_str().unwrap().contains("longer than"), "{long}");
    // It goes on after all of that.
    assert!(stream.ask(r#"{"call":"plugin/list"}"#)["result"].is_array());
}

#[test]
fn calls_sent_at_once_are_answered_in_their_order() {
    let (_agent, server, _client) = open("order");
    let mut stream = Raw::connect(&server);
    let calls = [r#"{"call":"read","url":"/teller/params/first"}"#, "wrong", r#"{"call":"plugin/list"}"#];
    stream.stream.write_all(format!("{}\n", calls.join("\n")).as_bytes()).unwrap();
    assert_eq!(stream.hear()["result"]["value"], json!(2.0));
    assert!(stream.hear()["error"].is_object());
    assert!(stream.hear()["result"].is_array());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn any_line_gets_one_answer(lines in proptest::collection::vec(".*", 1..40)) {
        let (_agent, server, _client) = open("any");
        let mut stream = Raw::connect(&server);
        for line in lines.iter().filter(|line| !line.contains('\n')) {
            let answer = stream.ask(line);
            prop_assert!(answer["error"]["message"].is_string(), "{}: {}", line, answer);
        }
    }
}

#[test]
fn tools_that_are_silent_or_hear_nothing_hold_nobody_up() {
    let (_agent, server, mut client) = open("silent");
    let mut silent: Vec<_> = (0..20).map(|_| Raw::connect(&server)).collect();
    // These ask without end and never listen, until nothing more goes into the socket.
    let mut deaf: Vec<_> = (0..10).map(|_| UnixStream::connect(server.socket()).unwrap()).collect();
    for stream in &mut deaf {
        stream.set_write_timeout(Some(Duration::from_millis(50))).unwrap();
        while stream.write_all(b"{\"call\":\"config/get\"}\n").is_ok() {}
    }
    for _ in 0..20 {
        silent.push(Raw::connect(&server));
        assert!(!client.plugins().unwrap().is_empty());
    }
    // The first of the silent ones had to go, the client never.
    let mut line = String::new();
    assert_eq!(silent[0].reader.read_line(&mut line).unwrap_or(0), 0);
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
    // What an agent leaves that is killed: a socket that nobody listens at.
    drop(std::os::unix::net::UnixListener::bind(&socket).unwrap());
    assert!(socket.exists() && !agents().contains(&name("names")));
    assert!(matches!(Client::connect(&name("names")), Err(ClientError::NoAgent { .. })));
    let again = Server::open(&agent).unwrap();
    assert_eq!(again.name(), name("names"));
    Client::connect(again.name()).unwrap().plugins().unwrap();
}
