//! Requests over HTTP to an agent, and their answers as they come.

pub mod address;
#[cfg(feature = "tls")]
mod secure;
pub mod socket;
mod stream;
pub mod token;
pub mod trouble;

use std::io::{BufRead, BufReader, Error, ErrorKind, Read, Result, Write};
use std::path::PathBuf;

use serde_json::Value;

use crate::failure::Failure;
use address::Address;
use stream::Stream;
use trouble::Trouble;

/// What stands before the paths of all operations.
pub const BASE: &str = "/api/v1";

/// An agent over HTTP, and the secret that it is asked with.
#[derive(Debug)]
pub struct Access {
    pub address: Address,
    /// Where a browser goes, which asks more of a certificate.
    pub browser: String,
    pub token: String,
    /// The file of whom to trust, instead of whom the system trusts.
    pub certificate: Option<PathBuf>,
}

/// What an agent is asked.
#[derive(Clone, Copy, Default)]
pub struct Request<'r> {
    pub method: &'r str,
    /// With what stands behind the question mark.
    pub path: &'r str,
    /// Which kind of answer is wanted.
    pub accept: Option<&'r str>,
    /// JSON.
    pub body: Option<&'r str>,
    /// The key of a handshake for a WebSocket.
    pub key: Option<&'r str>,
}

/// What it answers.
pub struct Response {
    pub status: u16,
    /// What it makes of the key of a handshake.
    pub accepted: Option<String>,
    pub body: Body,
}

/// The longest line of a head, bytes.
const LINE: u64 = 16 << 10;

/// How the first byte looks of who expects TLS and is told something else.
const ALERT: char = '\u{15}';

impl Access {
    /// Asks, and returns when the head of the answer is there.
    pub fn ask(&self, request: &Request<'_>) -> std::result::Result<Response, Failure> {
        let stream = Stream::connect(&self.address, self.certificate.as_deref())?;
        let address = self.address.to_string();
        let asked = converse(stream, &self.address.authority(), &self.token, request);
        let trouble = |error: Error| match error.kind() {
            ErrorKind::InvalidData if !self.address.is_secure => {
                Trouble::NoHttp { address, reason: error.to_string() }
            }
            ErrorKind::WouldBlock => Trouble::Unreached { address, reason: "no answer within 60 s".into() },
            _ => Trouble::Unreached { address, reason: error.to_string() },
        };
        Ok(asked.map_err(trouble)?)
    }

    /// As [`ask`](Access::ask), and returns all of the answer, which is JSON.
    pub fn value(&self, request: &Request<'_>) -> std::result::Result<Value, Failure> {
        let mut response = self.ask(request)?.well()?;
        let mut text = String::new();
        let address = self.address.to_string();
        let lost = |error: Error| Trouble::Unreached { address, reason: error.to_string() };
        response.body.read_to_string(&mut text).map_err(lost)?;
        Ok(serde_json::from_str(&text).unwrap_or_default())
    }
}

impl Response {
    /// The answer, unless the agent does not do it.
    pub fn well(mut self) -> std::result::Result<Self, Failure> {
        if self.status < 400 {
            return Ok(self);
        }
        let mut text = String::new();
        // What came of it is better than nothing.
        let _ = self.body.read_to_string(&mut text);
        let problem: Value = serde_json::from_str(&text).unwrap_or_default();
        let field = |name: &str| problem.get(name).and_then(Value::as_str).map(str::to_owned);
        let status = self.status;
        let detail = field("detail").unwrap_or_else(|| format!("the agent answers with status {status}"));
        let help = match status {
            401 => "let SLATE_TOKEN be the secret of this run: it stands behind `#token=` in the link that the agent prints".into(),
            _ => field("help").unwrap_or_default(),
        };
        Err(Failure::Http { status, detail, help, code: field("code") })
    }

    /// What is left of the connection, and what was read of it already.
    fn into_stream(self) -> (Stream, Vec<u8>) {
        let read = self.body.reader.buffer().to_vec();
        (self.body.reader.into_inner(), read)
    }
}

fn converse(mut stream: Stream, host: &str, token: &str, request: &Request<'_>) -> Result<Response> {
    let Request { method, path, accept, body, key } = request;
    let mut head = format!("{method} {path} HTTP/1.1\r\nHost: {host}\r\n");
    head += &format!("Authorization: Bearer {token}\r\n");
    head += &match key {
        None => "Connection: close\r\n".to_owned(),
        Some(key) => format!(
            "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
             Sec-WebSocket-Protocol: slate.v1\r\nSec-WebSocket-Key: {key}\r\n"
        ),
    };
    if let Some(accept) = accept {
        head += &format!("Accept: {accept}\r\n");
    }
    if body.is_some() {
        head += "Content-Type: application/json\r\n";
    }
    let body = body.unwrap_or_default();
    stream.write_all(format!("{head}Content-Length: {}\r\n\r\n{body}", body.len()).as_bytes())?;
    stream.flush()?;
    let mut reader = BufReader::new(stream);
    let first = line(&mut reader)?;
    let status = first.split(' ').nth(1).and_then(|status| status.parse().ok());
    let status = status.filter(|_| first.starts_with("HTTP/")).ok_or_else(|| match first.chars().next() {
        None => nonsense("it closes the connection".into()),
        Some(ALERT) => nonsense("it speaks TLS".into()),
        Some(_) => nonsense(format!("it answers `{}`", first.escape_default())),
    })?;
    let (mut left, mut accepted) = (Left::ToTheEnd, None);
    loop {
        let line = line(&mut reader)?;
        let Some((name, value)) = line.split_once(':') else { break };
        let value = value.trim();
        match name.to_ascii_lowercase().as_str() {
            "transfer-encoding" if value.eq_ignore_ascii_case("chunked") => left = Left::Chunks(0),
            "content-length" => left = Left::Bytes(value.parse().unwrap_or(0)),
            "sec-websocket-accept" => accepted = Some(value.to_owned()),
            _ => {}
        }
    }
    if *method == "HEAD" || matches!(status, 101 | 204 | 304) {
        // They have none, whatever the head says.
        left = Left::Bytes(0);
    }
    // What comes from now on may come slowly.
    reader.get_ref().wait_at_most(None)?;
    Ok(Response { status, accepted, body: Body { reader, left } })
}

fn line(reader: &mut BufReader<Stream>) -> Result<String> {
    let mut line = String::new();
    reader.take(LINE).read_line(&mut line)?;
    Ok(line.trim_end().to_owned())
}

fn nonsense(problem: String) -> Error {
    Error::new(ErrorKind::InvalidData, problem)
}

/// How much of a body is still to come.
enum Left {
    Bytes(u64),
    /// So many bytes of this chunk, and then perhaps another one.
    Chunks(u64),
    ToTheEnd,
}

/// The body of an answer.
pub struct Body {
    reader: BufReader<Stream>,
    left: Left,
}

impl Read for Body {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        if let Left::Chunks(0) = self.left {
            let mut size = line(&mut self.reader)?;
            if size.is_empty() {
                // The end of the chunk before.
                size = line(&mut self.reader)?;
            }
            let digits = size.split(';').next().unwrap_or_default().trim();
            self.left = match u64::from_str_radix(digits, 16) {
                Ok(0) => Left::Bytes(0),
                Ok(size) => Left::Chunks(size),
                Err(_) => return Err(nonsense(format!("a part of the answer begins with `{size}`"))),
            };
        }
        let most = match self.left {
            Left::Bytes(left) | Left::Chunks(left) => left,
            Left::ToTheEnd => u64::MAX,
        };
        let length = buffer.len().min(usize::try_from(most).unwrap_or(usize::MAX));
        let read = self.reader.read(&mut buffer[..length])?;
        match &mut self.left {
            Left::Bytes(left) | Left::Chunks(left) if read > 0 => *left -= read as u64,
            Left::Bytes(0) | Left::ToTheEnd => {}
            Left::Bytes(_) | Left::Chunks(_) => return Err(nonsense("the answer has no end".into())),
        }
        Ok(read)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that fails panics")]
mod tests {
    use std::net::{TcpListener, TcpStream};

    use super::*;

    /// What is read of an answer that comes in pieces of so many bytes.
    fn answered(answer: &'static str, piece: usize) -> Result<(u16, String)> {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let host = listener.local_addr().unwrap().to_string();
        let server = std::thread::spawn(move || {
            let mut stream = listener.accept().unwrap().0;
            let mut head = [0; 4096];
            let _ = stream.read(&mut head).unwrap();
            stream.set_nodelay(true).unwrap();
            for part in answer.as_bytes().chunks(piece) {
                stream.write_all(part).unwrap();
            }
        });
        let request = Request { method: "GET", path: "/", ..Request::default() };
        let response = converse(Stream::Open(TcpStream::connect(&host).unwrap()), &host, "t", &request);
        server.join().unwrap();
        let mut response = response?;
        let mut text = String::new();
        response.body.read_to_string(&mut text)?;
        Ok((response.status, text))
    }

    #[test]
    fn a_body_is_read_whichever_way_its_end_is_said_and_however_it_comes() {
        for piece in [1, 3, 1000] {
            for answer in [
                "HTTP/1.1 404 Not Found\r\nContent-Length: 5\r\n\r\nhello",
                "HTTP/1.1 404 Not Found\r\nTransfer-Encoding: chunked\r\n\r\n3\r\nhel\r\n2;x=y\r\nlo\r\n0\r\n\r\n",
                "HTTP/1.1 404 Not Found\r\n\r\nhello",
            ] {
                assert_eq!(answered(answer, piece).unwrap(), (404, "hello".into()), "{answer:?}");
            }
        }
    }

    #[test]
    fn an_answer_that_is_none_or_breaks_off_is_no_answer() {
        for answer in [
            "",
            "nothing\r\n\r\n",
            "\u{15}\u{3}\u{3}\0\u{2}\u{2}2",
            "SSH 200 OK\r\n\r\nhello",
            "HTTP/1.1 200 OK\r\nContent-Length: 9\r\n\r\nhello",
            "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n9\r\nhello",
            "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\nhello",
        ] {
            assert!(answered(answer, 1000).is_err(), "{answer:?}");
        }
    }
}
