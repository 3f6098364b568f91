//! Client that sends given bytes, right or wrong.

use std::io::{BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use serde_json::Value as Json;

/// Client of the console.
#[derive(Clone)]
pub struct Client {
    pub address: SocketAddr,
    token: String,
    headers: Vec<(String, String)>,
}

/// What comes back.
#[derive(Debug)]
pub struct Reply {
    pub status: u16,
    pub headers: Vec<(String, String)>,
    pub body: Vec<u8>,
}

impl Reply {
    pub fn header(&self, name: &str) -> &str {
        self.headers.iter().find(|(own, _)| own == name).map_or("", |(_, value)| value)
    }

    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    /// The answer of a request that is done.
    #[track_caller]
    pub fn json(&self) -> Json {
        assert_eq!(self.status, 200, "{}", self.text());
        serde_json::from_slice(&self.body).unwrap()
    }

    /// Why it is not done, in a form that all such answers have.
    #[track_caller]
    pub fn problem(&self, status: u16) -> String {
        assert_eq!(self.status, status, "{}", self.text());
        assert_eq!(self.header("content-type"), "application/problem+json");
        let problem: Json = serde_json::from_slice(&self.body).unwrap();
        assert_eq!(problem["status"], status);
        let (detail, help) =
            (problem["detail"].as_str().unwrap(), problem["help"].as_str().unwrap_or_default());
        assert!(help.is_empty() || !detail.contains(help), "told twice: {problem}");
        assert!(!detail.contains("change:"), "a place in a text that nobody wrote: {problem}");
        // Of these the status alone says too little.
        assert!(![404, 422].contains(&status) || problem["code"].is_string(), "{problem}");
        format!("{detail} {help}")
    }
}

impl Client {
    pub fn new(address: SocketAddr, token: &str) -> Self {
        Self { address, token: token.into(), headers: Vec::new() }
    }

    /// With one more header.
    pub fn with(&self, name: &str, value: &str) -> Self {
        let mut client = self.clone();
        client.headers.push((name.into(), value.into()));
        client
    }

    /// The head of a request, without its end.
    pub fn head(&self, method: &str, path: &str) -> String {
        let has = |name: &str| self.headers.iter().any(|(own, _)| own.eq_ignore_ascii_case(name));
        let mut head = format!("{method} {path} HTTP/1.1\r\n");
        if !has("host") {
            head += &format!("Host: {}\r\n", self.address);
        }
        if !self.token.is_empty() && !has("authorization") {
            head += &format!("Authorization: Bearer {}\r\n", self.token);
        }
        for (name, value) in &self.headers {
            head += &format!("{name}: {value}\r\n");
        }
        head
    }

    pub fn send(&self, method: &str, path: &str, body: Option<&Json>) -> Reply {
        let path =
            if path == "/" || path.starts_with("/api") { path.into() } else { format!("/api/v1{path}") };
        let mut request = self.head(method, &path);
        let body = body.map(ToString::to_string).unwrap_or_default();
        if !body.is_empty() && !request.to_ascii_lowercase().contains("content-type") {
            request += "Content-Type: application/json\r\n";
        }
        self.raw(
            format!("{request}Connection: close\r\nContent-Length: {}\r\n\r\n{body}", body.len()).as_bytes(),
        )
    }

    pub fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        stream
    }

    /// Sends bytes, and reads an answer.
    pub fn raw(&self, bytes: &[u8]) -> Reply {
        let mut stream = self.connect();
        // A refusal may arrive before all is sent.
        let _ = stream.write_all(bytes);
        reply(&mut BufReader::new(stream))
    }
}

/// Reads an answer.
pub fn reply(reader: &mut impl BufRead) -> Reply {
    let mut line = String::new();
    let mut next = |reader: &mut dyn BufRead| {
        line.clear();
        let _ = reader.read_line(&mut line);
        line.trim_end().to_owned()
    };
    let first = next(reader);
    let status = first.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0);
    let mut headers = Vec::new();
    loop {
        let line = next(reader);
        let Some((name, value)) = line.split_once(": ") else { break };
        headers.push((name.to_ascii_lowercase(), value.to_owned()));
    }
    let mut body = Vec::new();
    let length =
        headers.iter().find(|(name, _)| name == "content-length").and_then(|(_, value)| value.parse().ok());
    if let Some(length) = length {
        body.resize(length, 0);
        let _ = reader.read_exact(&mut body);
    }
    Reply { status, headers, body }
}
