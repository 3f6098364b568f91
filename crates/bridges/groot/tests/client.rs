//! A socket REQ of ZeroMQ, as bytes.

use std::io::{Read, Result, Write};
use std::net::TcpStream;
use std::time::Duration;

/// What a client sends first: its greeting, and the command READY.
pub fn handshake() -> Vec<u8> {
    let mut bytes = vec![0; 64];
    (bytes[0], bytes[9], bytes[10]) = (0xff, 0x7f, 3);
    bytes[12..16].copy_from_slice(b"NULL");
    bytes.extend(b"\x04\x26\x05READY\x0bSocket-Type\0\0\0\x03REQ\x08Identity\0\0\0\0");
    bytes
}

/// A request of a type, with further frames.
pub fn request(kind: u8, parts: &[&[u8]]) -> Vec<u8> {
    let header = [2, kind, 77, 0, 0, 0];
    let frames: Vec<&[u8]> = [&[][..], &header].into_iter().chain(parts.iter().copied()).collect();
    let mut bytes = Vec::new();
    for (number, frame) in frames.iter().enumerate() {
        bytes.extend([u8::from(number + 1 < frames.len()), frame.len() as u8]);
        bytes.extend(*frame);
    }
    bytes
}

pub struct Client(TcpStream);

impl Client {
    pub fn connect(port: u16) -> Self {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        stream.write_all(&handshake()).unwrap();
        let mut answer = [0; 64 + 27];
        stream.read_exact(&mut answer).unwrap();
        assert_eq!(&answer[64..], b"\x04\x19\x05READY\x0bSocket-Type\0\0\0\x03REP");
        Self(stream)
    }

    /// The frames of an answer, without the empty one in front.
    pub fn ask(&mut self, kind: u8, parts: &[&[u8]]) -> Vec<Vec<u8>> {
        self.try_ask(kind, parts).unwrap()
    }

    pub fn try_ask(&mut self, kind: u8, parts: &[&[u8]]) -> Result<Vec<Vec<u8>>> {
        self.0.write_all(&request(kind, parts))?;
        let mut frames = Vec::new();
        loop {
            let mut head = [0; 2];
            self.0.read_exact(&mut head)?;
            assert_eq!(head[0] & 2, 0, "a short frame");
            let mut frame = vec![0; usize::from(head[1])];
            self.0.read_exact(&mut frame)?;
            frames.push(frame);
            if head[0] & 1 == 0 {
                assert!(frames.remove(0).is_empty(), "the frame before an answer");
                return Ok(frames);
            }
        }
    }
}
