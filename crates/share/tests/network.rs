//! Cables that are cut, and agents that fall silent without a word.
#![cfg(all(feature = "tls", feature = "zenoh"))]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]
#![allow(clippy::disallowed_methods, reason = "what real agents do takes real time")]

use crate::agents;

use std::net::TcpListener;
use std::thread;
use std::time::{Duration, Instant};

use agents::cable::{CUT, Cable, SWALLOWS};
use agents::net::port;
use agents::{Agent, Blob, Folder, add, output, setup, wait_for, write};
use slate_blackboard::interface::Interface;
use slate_share::carrier::zenoh::Zenoh;
use slate_share::carrier::{Carrier, CarrierError};
use slate_share::peers::{Setup, Want};
use slate_share::session::{Compression, Limits, Options};

#[test]
fn an_address_that_swallows_holds_nobody_else() {
    let silent = TcpListener::bind(("127.0.0.1", port())).unwrap();
    let folder = Folder::over("tcp");
    let base = Agent::listening("base", &folder);
    let arm = Agent::start(folder.setup("arm"));
    arm.peers.connect("silent", &format!("zenoh:tcp/{}", silent.local_addr().unwrap())).unwrap();
    arm.peers.connect("base", &folder.endpoint("base")).unwrap();
    let start = Instant::now();
    wait_for("the other agent", || base.peers.is_connected("arm"));
    assert!(start.elapsed() < Duration::from_millis(900), "it waits for the one that swallows");
    wait_for("a reason", || {
        let read = arm.board.read("peers/silent/link/reason").ok().flatten();
        read.is_some_and(|(value, _)| value.to_string().contains("deadline"))
    });
    let start = Instant::now();
    drop(arm);
    assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
}

#[test]
fn a_link_that_was_full_has_room_again() {
    for protocol in ["tcp", "udp"] {
        let (zenoh, endpoint) = (Zenoh, format!("zenoh:{protocol}/127.0.0.1:{}", port()));
        let listener = zenoh.listen(&endpoint).unwrap();
        let near = zenoh.dial(&endpoint).unwrap();
        let far = listener.accept(Duration::from_secs(5)).unwrap().unwrap();
        let packet = vec![7; near.largest()];
        for link in [&near, &far] {
            let mut full = 0;
            let start = Instant::now();
            while full < 20 && start.elapsed() < Duration::from_secs(2) {
                full += u32::from(!link.send(&packet).expect(protocol));
            }
            wait_for("room", || link.send(&packet).expect(protocol));
            // Nobody has taken them, and they have not ended the link.
            thread::sleep(Duration::from_millis(50));
            link.send(&packet).expect(protocol);
        }
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
fn a_swallowed_agent_disturbs_nobody() {
    let folder = Folder::over("tcp");
    // As agents have it: the link is closed, and dialled again, while this looks.
    let limits = Limits::default();
    let base = Agent::start(Setup { limits, ..folder.setup("base") }.listen(&folder.endpoint("base")));
    let mut writer = output(&base.board, "out/count", 1);
    let blobs = add(&base.board, "out/blob", Blob::DESCRIPTOR, 1 << 20, 4);
    let mut blob = blobs.channel().unwrap().writer().unwrap();
    let healthy = Agent::start(setup("healthy"));
    healthy.peers.connect("base", &folder.endpoint("base")).unwrap();
    healthy.peers.subscribe("base", Want::new("out/count", Options::default())).unwrap();
    wait_for("the healthy one", || base.peers.is_connected("healthy"));
    let growth = |_| {
        let cable = Cable::to(&folder.endpoint("base"));
        let ill = Agent::start(Setup { limits, ..setup("ill") });
        ill.peers.connect("base", cable.endpoint()).unwrap();
        let want = Want::new("out/blob", Options::default().compression(Compression::None));
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

#[test]
fn endpoints_that_make_no_sense_are_refused() {
    let zenoh = Zenoh;
    for endpoint in [
        "zenoh:quic/127.0.0.1:7447",
        "zenoh:tls/127.0.0.1:7447",
        "zenoh:tcp/127.0.0.1",
        "zenoh:tcp/127.0.0.1:0",
        "zenoh:tcp/127.0.0.1:70000",
        "zenoh:tcp/:7447",
        "zenoh:tcp/127.0.0.1:7447#iface=lo",
        "zenoh:tcp/a?rel=1:7447",
        "zenoh:127.0.0.1:7447",
        "zenoh:tcp/[::g]:7447",
    ] {
        for error in [zenoh.check(endpoint).unwrap_err(), zenoh.listen(endpoint).unwrap_err()] {
            let expected =
                format!("`{endpoint}` is no endpoint: zenoh carries tcp and udp: zenoh:tcp/HOST:PORT");
            assert!(error.to_string().starts_with(&expected), "{error}");
        }
    }
    let error = zenoh.listen("zenoh:tcp/no-such-host.invalid:7447").unwrap_err().to_string();
    assert!(error.contains("host `no-such-host.invalid` is not found"), "{error}");
    for protocol in ["tcp", "udp"] {
        let endpoint = format!("zenoh:{protocol}/127.0.0.1:{}", port());
        let _listener = zenoh.listen(&endpoint).unwrap();
        let error = zenoh.listen(&endpoint).unwrap_err();
        assert!(matches!(error, CarrierError::InUse { .. }), "{error}");
    }
    let nobody = format!("zenoh:tcp/127.0.0.1:{}", port());
    assert!(matches!(zenoh.dial(&nobody), Err(CarrierError::Nobody { .. })));
}

#[test]
fn what_is_not_encrypted_stays_on_the_machine() {
    for endpoint in ["zenoh:tcp/0.0.0.0:7447", "zenoh:udp/[::]:7447", "zenoh:tcp/192.0.2.1:7447"] {
        let listened = Zenoh.listen(endpoint).unwrap_err();
        assert_eq!(listened.to_string(), Zenoh.check(endpoint).unwrap_err().to_string());
        assert_eq!(listened.to_string(), Zenoh.dial(endpoint).unwrap_err().to_string());
        assert!(matches!(listened, CarrierError::Unsafe { .. }));
        assert!(listened.to_string().contains("there it has to be tls:HOST:PORT"), "{listened}");
    }
}
