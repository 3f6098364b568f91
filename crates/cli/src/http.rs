//! A request over HTTP to an agent of this computer, and its answer as it comes.

use std::io::{BufRead, BufReader, Read, Result, Write};
use std::net::TcpStream;

use crate::failure::Failure;

/// What an agent is asked.
pub struct Request<'r> {
    pub method: &'r str,
    /// With what stands behind the question mark.
    pub path: &'r str,
    pub token: &'r str,
    /// Which kind of answer is wanted.
    pub accept: Option<&'r str>,
    /// JSON.
    pub body: Option<&'r str>,
}

/// What it answers.
pub struct Response {
    pub status: u16,
    pub body: Body,
}

/// The longest line of a head, bytes.
const LINE: u64 = 16 << 10;

/// Asks, and returns when the head of the answer is there.
pub fn ask(address: &str, request: &Request<'_>) -> std::result::Result<Response, Failure> {
    let Some(host) = address.strip_prefix("http://") else {
        return Err(Failure::Tls { address: address.into() });
    };
    let unreached = |reason: String| Failure::Unreached { address: address.into(), reason };
    converse(host, request).map_err(|error| unreached(error.to_string()))
}

fn converse(host: &str, request: &Request<'_>) -> Result<Response> {
    let Request { method, path, token, accept, body } = request;
    let mut stream = TcpStream::connect(host)?;
    let mut head = format!("{method} {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n");
    head += &format!("Authorization: Bearer {token}\r\n");
    if let Some(accept) = accept {
        head += &format!("Accept: {accept}\r\n");
    }
    if body.is_some() {
        head += "Content-Type: application/json\r\n";
    }
    let body = body.unwrap_or_default();
    stream.write_all(format!("{head}Content-Length: {}\r\n\r\n{body}", body.len()).as_bytes())?;
    let mut reader = BufReader::new(stream);
    let first = line(&mut reader)?;
    let status = first.split(' ').nth(1).and_then(|status| status.parse().ok());
    let status = status.ok_or_else(|| nonsense(format!("it answers `{first}`")))?;
    let mut left = Left::ToTheEnd;
    loop {
        let line = line(&mut reader)?.to_ascii_lowercase();
        let Some((name, value)) = line.split_once(':') else { break };
        match (name, value.trim()) {
            ("transfer-encoding", "chunked") => left = Left::Chunks(0),
            ("content-length", length) => left = Left::Bytes(length.parse().unwrap_or(0)),
            _ => {}
        }
    }
    if *method == "HEAD" || matches!(status, 204 | 304) {
        // They have none, whatever the head says.
        left = Left::Bytes(0);
    }
    Ok(Response { status, body: Body { reader, left } })
}

fn line(reader: &mut BufReader<TcpStream>) -> Result<String> {
    let mut line = String::new();
    reader.take(LINE).read_line(&mut line)?;
    Ok(line.trim_end().to_owned())
}

fn nonsense(problem: String) -> std::io::Error {
    std::io::Error::new(std::io::ErrorKind::InvalidData, problem)
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
    reader: BufReader<TcpStream>,
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
    use std::net::TcpListener;

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
        let request = Request { method: "GET", path: "/", token: "t", accept: None, body: None };
        let response = converse(&host, &request);
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
            "HTTP/1.1 200 OK\r\nContent-Length: 9\r\n\r\nhello",
            "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n9\r\nhello",
            "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\nhello",
        ] {
            assert!(answered(answer, 1000).is_err(), "{answer:?}");
        }
    }
}
