//! ZeroMQ socket REP over TCP.
//! ZMTP 3.0 (RFC 23 of ZeroMQ) with the mechanism NULL.
//!
//! Own, as a monitor needs one socket type, with limits of frames, messages and times: the crate `zmq` links the C++
//! library libzmq, and `zeromq` brings all socket types.

use std::io::{Error, ErrorKind, Result};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::time::timeout;

/// Longest time of a handshake, and of an answer that a client takes.
const STEP_TIMEOUT: Duration = Duration::from_secs(2);
/// Maximum time from one request to the end of the next one.
/// Monitors ask several times a second.
const IDLE_TIMEOUT: Duration = Duration::from_secs(30);

/// Longest frame, bytes.
const MOST_FRAME: usize = 16 << 10;
/// Maximum number of frames in a message.
const MOST_FRAMES: usize = 8;

const GREETING: usize = 64;
const MECHANISM: std::ops::Range<usize> = 12..32;

const MORE: u8 = 1;
const LONG: u8 = 2;
const COMMAND: u8 = 4;

/// Request with the address of its answer.
pub struct MonitorRequest {
    /// Frames up to the empty one.
    envelope: Vec<Vec<u8>>,
    /// Frames of the request.
    pub body: Vec<Vec<u8>>,
}

/// Connection to a client.
pub struct MonitorConnection<S> {
    stream: S,
}

impl<S: AsyncRead + AsyncWrite + Unpin> MonitorConnection<S> {
    /// Makes the handshake with a client that has connected.
    ///
    /// # Errors
    /// The client speaks another protocol, is not a socket that requests, or is too slow.
    pub async fn open(stream: S) -> Result<Self> {
        let mut own = Self { stream };
        timed(STEP_TIMEOUT, own.shake_hands()).await?;
        Ok(own)
    }

    async fn shake_hands(&mut self) -> Result<()> {
        let mut greeting = [0; GREETING];
        (greeting[0], greeting[9], greeting[10]) = (0xff, 0x7f, 3);
        greeting[MECHANISM][..4].copy_from_slice(b"NULL");
        self.stream.write_all(&greeting).await?;
        let mut other = [0; GREETING];
        self.stream.read_exact(&mut other).await?;
        let is_null = other[MECHANISM] == greeting[MECHANISM];
        if other[0] != 0xff || other[9] & 1 == 0 || other[10] < 3 || !is_null {
            return Err(refused("expected ZMTP 3 without security"));
        }
        const READY: &[u8] = b"\x04\x19\x05READY\x0bSocket-Type\0\0\0\x03REP";
        self.stream.write_all(READY).await?;
        let (flags, ready) = self.frame().await?;
        let kinds: [&[u8]; 2] = [b"\x0bSocket-Type\0\0\0\x03REQ", b"\x0bSocket-Type\0\0\0\x06DEALER"];
        let is_client = kinds.iter().any(|kind| ready.windows(kind.len()).any(|part| part == *kind));
        if flags & COMMAND == 0 || !ready.starts_with(b"\x05READY") || !is_client {
            return Err(refused("expected the handshake of a socket REQ or DEALER"));
        }
        Ok(())
    }

    /// Receives the next request.
    ///
    /// # Errors
    /// The connection has ended, or the request breaks the protocol or a bound.
    pub async fn receive(&mut self) -> Result<MonitorRequest> {
        timed(IDLE_TIMEOUT, self.message()).await
    }

    async fn message(&mut self) -> Result<MonitorRequest> {
        let (mut envelope, mut body) = (Vec::new(), Vec::new());
        let mut is_body = false;
        for _ in 0..MOST_FRAMES {
            let (flags, frame) = self.frame().await?;
            if flags & COMMAND != 0 {
                // Heartbeats are of a later version, which the greeting did not offer.
                return Err(refused("expected a message"));
            }
            let is_delimiter = !is_body && frame.is_empty();
            if is_body {
                body.push(frame)
            } else {
                envelope.push(frame)
            }
            is_body |= is_delimiter;
            if flags & MORE == 0 {
                return match is_body {
                    true => Ok(MonitorRequest { envelope, body }),
                    false => Err(refused("expected an empty frame before the request")),
                };
            }
        }
        Err(refused("expected fewer frames"))
    }

    async fn frame(&mut self) -> Result<(u8, Vec<u8>)> {
        let flags = self.stream.read_u8().await?;
        let size = match flags {
            0..=7 if flags & LONG == 0 => u64::from(self.stream.read_u8().await?),
            0..=7 => self.stream.read_u64().await?,
            _ => return Err(refused("expected no reserved flag")),
        };
        let size = usize::try_from(size).ok().filter(|size| *size <= MOST_FRAME);
        let mut frame = vec![0; size.ok_or_else(|| refused("expected a shorter frame"))?];
        self.stream.read_exact(&mut frame).await?;
        Ok((flags, frame))
    }

    /// Sends the answer to a request.
    ///
    /// # Errors
    /// The connection has ended, or the client does not take it in time.
    pub async fn answer(&mut self, request: &MonitorRequest, frames: &[Vec<u8>]) -> Result<()> {
        let mut bytes = Vec::new();
        let all = || request.envelope.iter().chain(frames);
        let last = all().count().saturating_sub(1);
        for (number, frame) in all().enumerate() {
            let more = if number < last { MORE } else { 0 };
            match u8::try_from(frame.len()) {
                Ok(size) => bytes.extend([more, size]),
                Err(_) => {
                    bytes.push(more | LONG);
                    bytes.extend((frame.len() as u64).to_be_bytes());
                }
            }
            bytes.extend(frame);
        }
        timed(STEP_TIMEOUT, self.stream.write_all(&bytes)).await
    }
}

async fn timed<T>(limit: Duration, step: impl Future<Output = Result<T>>) -> Result<T> {
    timeout(limit, step).await.unwrap_or_else(|_| Err(ErrorKind::TimedOut.into()))
}

fn refused(reason: &'static str) -> Error {
    Error::new(ErrorKind::InvalidData, reason)
}
