//! Bytes that no monitor sends.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::Duration;

use slate_test_tools::resident_memory;

use crate::agent::RunningAgent;
use crate::client::{Client, handshake, request};

/// Conversations that are mutated.
const COUNT: usize = 3_000;

#[test]
fn mutated_messages_end_neither_agent_nor_bridge() {
    let agent = RunningAgent::start("[modules.planner]\nkind = \"shown\"\n[groot]\nport = 0");
    let port = agent.ports()[0];
    // Clients that say nothing, or want much memory, stay through all of it.
    let mut open = Vec::new();
    for last in [0, 1 << 62, u64::MAX, 1 << 30] {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.write_all(&handshake()).unwrap();
        stream.write_all(&[&[3_u8][..], &u64::to_be_bytes(last)].concat()).unwrap();
        open.push(stream);
    }
    let before = resident_memory();
    let mut state = 1_u64;
    let mut next = move |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    for number in 0..COUNT {
        let kind = b"TSBDIRU"[number % 7];
        let mut bytes = handshake();
        // Half of them reach the requests.
        let from = if number % 2 == 0 { 0 } else { bytes.len() };
        bytes.extend(request(kind, &[b"main", b"{\"uid\":1}"]));
        for _ in 0..1 + next(8) {
            let place = from + next(bytes.len() - from);
            bytes[place] = next(256) as u8;
        }
        if next(4) == 0 {
            bytes.truncate(from + next(bytes.len() - from));
        }
        let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        // The bridge may close it at any time.
        let _ = stream.write_all(&bytes);
        let _ = stream.shutdown(Shutdown::Write);
        if next(16) == 0 {
            stream.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
            let _ = stream.read(&mut [0; 256]);
        }
    }
    // One that asks without an end and never reads.
    let mut deaf = TcpStream::connect(("127.0.0.1", port)).unwrap();
    deaf.set_write_timeout(Some(Duration::from_millis(5))).unwrap();
    let _ = deaf.write_all(&handshake());
    let _ = (0..2_000).try_for_each(|_| deaf.write_all(&request(b'T', &[])));
    let grown = resident_memory().saturating_sub(before);
    assert!(grown < 64 << 20, "{grown} bytes more");
    let (ticks, mut tries) = (agent.ticks(), 0);
    // Places may be taken until the last ones are closed.
    let tree = loop {
        let answer = std::panic::catch_unwind(|| Client::connect(port).ask(b'T', &[]));
        match answer {
            Ok(tree) => break tree,
            Err(_) if tries < 100 => tries += 1,
            Err(error) => std::panic::resume_unwind(error),
        }
        std::thread::sleep(Duration::from_millis(50));
    };
    assert_eq!(tree[1], b"<root/>");
    while agent.ticks() <= ticks {
        std::thread::sleep(Duration::from_millis(1));
    }
    drop((open, deaf));
}
