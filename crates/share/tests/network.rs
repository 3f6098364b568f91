//! Cables that are cut, and agents that fall silent without a word.
#![cfg(feature = "tls")]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]
#![allow(clippy::disallowed_methods, reason = "what real agents do takes real time")]

use crate::agents;

use std::net::TcpListener;
use std::thread;
use std::time::{Duration, Instant};

use agents::cable::{CUT, Cable, SWALLOWS};
use agents::net::port;
use agents::{Agent, Blob, Folder, add, output, wait_for, write};
use slate_blackboard::interface::Interface;
use slate_share::peers::{Setup, WantedProperty};
use slate_share::session::{Compression, Limits, Options};

#[test]
fn unresponsive_address_blocks_no_other() {
    let silent = TcpListener::bind(("127.0.0.1", port())).unwrap();
    let folder = Folder::over_tls();
    let base = Agent::listening("base", &folder);
    let arm = Agent::start(folder.setup("arm"));
    arm.peers.connect("silent", &format!("tls:{}", silent.local_addr().unwrap())).unwrap();
    arm.peers.connect("base", &folder.endpoint("base")).unwrap();
    let start = Instant::now();
    wait_for("the other agent", || base.peers.is_connected("arm"));
    assert!(start.elapsed() < Duration::from_millis(900), "it waits for the one that swallows");
    wait_for("a reason", || {
        let read = arm.board.read("peers/silent/link/reason").ok().flatten();
        read.is_some_and(|(value, _)| value.to_string().contains("no handshake"))
    });
    let start = Instant::now();
    drop(arm);
    assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
}

#[test]
fn a_link_that_was_full_has_room_again() {
    let folder = Folder::over_tls();
    let (base, arm) = (folder.setup("base").carriers, folder.setup("arm").carriers);
    let endpoint = folder.endpoint("base");
    let listener = base["tls"].listen(&endpoint).unwrap();
    let dial = thread::spawn(move || arm["tls"].dial(&endpoint).unwrap());
    let far = listener.accept(Duration::from_secs(5)).unwrap().unwrap();
    while !dial.is_finished() {
        assert_eq!(far.receive(&mut [0], Duration::from_millis(5)).unwrap(), None);
    }
    let near = dial.join().unwrap();
    let packet = vec![7; near.largest()];
    for (link, other) in [(&near, &far), (&far, &near)] {
        let is_full = || (0..1000).any(|_| !link.send(&packet).unwrap());
        assert!(is_full(), "it takes packets without end");
        let mut taken = vec![0; packet.len()];
        wait_for("room", || {
            assert_eq!(other.receive(&mut taken, Duration::from_millis(5)).unwrap(), Some(packet.len()));
            link.send(&packet).unwrap()
        });
        assert_eq!(taken, packet);
    }
}

/// The longest that the healthy agent did not hear of the one that writes.
fn gap(writer: &mut slate_blackboard::channel::Writer, healthy: &Agent, time: Duration) -> Duration {
    let (start, mut heard, mut seen) = (Instant::now(), Instant::now(), None);
    let mut longest = Duration::ZERO;
    while start.elapsed() < time {
        let number = writer.last().sequence + 1;
        write(writer, number);
        let now = healthy.number("agents/base/out/count");
        longest = longest.max(heard.elapsed());
        if now != seen {
            (seen, heard) = (now, Instant::now());
        }
        thread::sleep(Duration::from_millis(1));
    }
    longest
}

#[test]
fn unresponsive_agent_disturbs_no_other() {
    let folder = Folder::over_tls();
    // As agents have it: the link is closed, and dialed again, while this looks.
    let limits = Limits::default();
    let base = Agent::start(Setup { limits, ..folder.setup("base") }.listen(&folder.endpoint("base")));
    let mut writer = output(&base.board, "out/count", 1);
    let blobs = add(&base.board, "out/blob", Blob::DESCRIPTOR, 1 << 20, 4);
    let mut blob = blobs.channel().unwrap().writer().unwrap();
    let healthy = Agent::start(folder.setup("healthy"));
    healthy.peers.connect("base", &folder.endpoint("base")).unwrap();
    healthy.peers.subscribe("base", WantedProperty::new("out/count", Options::default())).unwrap();
    wait_for("the healthy one", || base.peers.is_connected("healthy"));
    let growth = |_| {
        let cable = Cable::to(&folder.endpoint("base"));
        let ill = Agent::start(Setup { limits, ..folder.setup("ill") });
        ill.peers.connect("base", cable.endpoint()).unwrap();
        let want = WantedProperty::new("out/blob", Options::default().compression(Compression::None));
        ill.peers.subscribe("base", want).unwrap();
        wait_for("the ill one", || blobs.readers() == 1);
        let before = gap(&mut writer, &healthy, Duration::from_millis(800));
        cable.set(SWALLOWS);
        // Enough to fill whatever stands between them.
        for number in 1..=20_u64 {
            blob.write(&[&number.to_ne_bytes()[..], &[7; 1 << 20]].concat(), 1 << 20, 0).unwrap();
            thread::sleep(Duration::from_millis(2));
        }
        let during = gap(&mut writer, &healthy, Duration::from_millis(3000));
        println!("worst gap {during:.1?}, before {before:.1?}");
        cable.set(CUT);
        drop(ill);
        wait_for("its end", || !base.peers.is_connected("ill"));
        during.saturating_sub(before)
    };
    // A busy machine lets threads wait for each other; what one agent does to another it does each time.
    let least = (0..3).map(growth).find(|growth| *growth <= Duration::from_millis(50));
    assert!(least.is_some(), "the healthy agent waits for the one that is swallowed");
}
