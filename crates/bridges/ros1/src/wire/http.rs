//! Subset of HTTP for XML-RPC: one request per connection.
//!
//! Own rather than `hyper`: with one POST, a `Content-Length` and a limit of each part there is no keep-alive, chunked
//! encoding or connection pool to handle, and without that the whole is shorter than a server and a client of `hyper`.

use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;

/// Timeout of the other side for a request or an answer.
pub const TIMEOUT: Duration = Duration::from_secs(5);

/// Bytes that the head of a request or an answer may have.
const HEAD: usize = 16 << 10;

/// Bytes that a request or an answer may have.
const BODY: usize = 4 << 20;

/// Address of an API: `http://HOST:PORT/`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HttpAddress {
    /// Host and port.
    pub authority: String,
    path: String,
}

impl HttpAddress {
    /// Reads an address.
    ///
    /// # Errors
    /// The reason in words.
    pub fn parse(text: &str) -> Result<Self, String> {
        let rest = text.strip_prefix("http://").ok_or("it does not begin with http://")?;
        let (authority, path) = rest.split_once('/').unwrap_or((rest, ""));
        let port = authority.rsplit_once(':').map(|(host, port)| (host.is_empty(), port.parse::<u16>()));
        match port {
            Some((false, Ok(_))) => Ok(Self { authority: authority.into(), path: format!("/{path}") }),
            _ => Err("it has no host and port, as http://localhost:11311 does".into()),
        }
    }
}

/// Sends a request, and returns the body of the answer.
///
/// # Errors
/// Why no answer has come, in words.
pub async fn post(address: &HttpAddress, body: &str) -> Result<String, String> {
    let exchange = async {
        let mut stream = TcpStream::connect(&address.authority).await.map_err(|error| error.to_string())?;
        // No newer version, so that the answer comes in one piece.
        let head = format!(
            "POST {} HTTP/1.0\r\nHost: {}\r\nContent-Type: text/xml\r\nContent-Length: {}\r\n\r\n",
            address.path,
            address.authority,
            body.len()
        );
        stream.write_all(head.as_bytes()).await.map_err(|error| error.to_string())?;
        stream.write_all(body.as_bytes()).await.map_err(|error| error.to_string())?;
        let (line, answer) = read(&mut stream).await?;
        match line.split(' ').nth(1) {
            Some("200") => Ok(answer),
            _ => Err(format!("it answers {line:?}")),
        }
    };
    let late = |_| format!("it does not answer within {} s", TIMEOUT.as_secs());
    timeout(TIMEOUT, exchange).await.map_err(late)?
}

/// Reads the body of the next request.
///
/// # Errors
/// Why no request could be read, in words.
pub async fn read_request(stream: &mut TcpStream) -> Result<String, String> {
    let late = |_| "it does not end".to_owned();
    let (line, body) = timeout(TIMEOUT, read(stream)).await.map_err(late)??;
    if line.starts_with("POST ") { Ok(body) } else { Err("it is no POST".into()) }
}

/// Sends an answer.
///
/// # Errors
/// When the connection is lost.
pub async fn respond(stream: &mut TcpStream, status: &str, body: &str) -> std::io::Result<()> {
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: text/xml\r\nContent-Length: {}\r\nConnection: close\r\n\r\n",
        body.len()
    );
    timeout(TIMEOUT, stream.write_all((head + body).as_bytes())).await??;
    stream.shutdown().await
}

/// Reads the first line and the body.
async fn read(stream: &mut TcpStream) -> Result<(String, String), String> {
    let mut bytes = Vec::new();
    let end = loop {
        if let Some(at) = bytes.windows(4).position(|own| own == b"\r\n\r\n") {
            break at;
        }
        if bytes.len() > HEAD {
            return Err(format!("its head is longer than {HEAD} bytes"));
        }
        let mut chunk = [0; 2048];
        let count = stream.read(&mut chunk).await.map_err(|error| error.to_string())?;
        if count == 0 {
            return Err("the connection ended in its head".into());
        }
        bytes.extend_from_slice(&chunk[..count]);
    };
    let body = bytes.split_off(end + 4);
    let head = String::from_utf8(bytes).map_err(|_| "its head is not UTF-8".to_owned())?;
    let mut lines = head.lines();
    let first = lines.next().unwrap_or_default().to_owned();
    let length = lines.filter_map(|line| line.split_once(':'));
    let length = length.into_iter().find(|(name, _)| name.eq_ignore_ascii_case("content-length"));
    let length = length.map(|(_, value)| value.trim().parse::<usize>());
    let length = match length {
        Some(Ok(length)) if length <= BODY => length,
        Some(_) => return Err(format!("its Content-Length is not a number up to {BODY}")),
        None => return Err("it has no Content-Length".into()),
    };
    let mut body = body;
    body.truncate(length);
    let left = (length - body.len()) as u64;
    // Memory is taken as the bytes come.
    stream.take(left).read_to_end(&mut body).await.map_err(|error| error.to_string())?;
    if body.len() < length {
        return Err(format!("the connection ended after {} of {length} bytes", body.len()));
    }
    let body = String::from_utf8(body).map_err(|_| "it is not UTF-8".to_owned())?;
    Ok((first, body))
}
