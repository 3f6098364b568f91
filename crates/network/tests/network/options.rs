//! Readers with options of their own.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use slate_network::{ReadingStatus, SampleAttachment};
use zenoh::{Session, Wait};

use crate::network::agent::{Running, ask, ask_json, eventually, ports, session, wait_for_agent};

/// Attachments of the next samples at a key of an agent.
fn stamps(session: &Session, key: &str, count: usize) -> Vec<SampleAttachment> {
    let subscriber = session.declare_subscriber(key).wait().unwrap();
    assert!(ask(session, key, None).iter().all(Result::is_ok), "{key}");
    let sample = || subscriber.recv_timeout(Duration::from_secs(20)).unwrap().expect("a sample");
    let attachment = |_| SampleAttachment::decode(&sample().attachment().unwrap().to_bytes()).unwrap();
    (0..count).map(attachment).collect()
}

#[test]
fn each_reader_has_its_own_options() {
    let [port] = ports();
    let _agent = Running::start("opts", &format!("listen = [\"tcp/127.0.0.1:{port}\"]"));
    let other = session("peer", &[], &[port]);
    wait_for_agent(&other, "opts");
    let all = stamps(&other, "slate/opts/@read/all/sensor/count", 60);
    let first = all[0].stamp.sequence;
    for (index, sample) in (0..).zip(&all) {
        assert_eq!((sample.number, sample.stamp.sequence), (index + 1, first + index));
    }
    for (options, least) in [("rate=200ms", 5), ("interval=200ms", 5), ("best-effort,rate=200ms", 5)] {
        let slow = stamps(&other, &format!("slate/opts/@read/{options}/sensor/count"), 6);
        assert!(slow.windows(2).all(|pair| pair[1].number == pair[0].number + 1), "{options}: {slow:?}");
        let values = slow[5].stamp.sequence - slow[0].stamp.sequence;
        assert!(values > 5 * least, "{options}: {slow:?}");
    }
}

#[test]
fn options_that_make_no_sense_are_refused_with_what_to_write() {
    let [port] = ports();
    let _agent = Running::start(
        "refusing",
        &format!("listen = [\"tcp/127.0.0.1:{port}\"]\npublish = [\"sensor/count\"]"),
    );
    let other = session("peer", &[], &[port]);
    wait_for_agent(&other, "refusing");
    for (wanted, reason) in [
        ("fast/sensor/count", "unknown option `fast`"),
        ("rate=0.1s/sensor/count", "write `rate=100ms`"),
        ("all,rate=1s/sensor/count", "neither a rate nor an interval"),
        ("all/sensor/pose", "nothing is published"),
        ("all/sensor/count/value", "nothing is published"),
        ("all", "nothing is published"),
    ] {
        let refused = ask_json(&other, &format!("slate/refusing/@read/{wanted}"), None).unwrap_err();
        assert!(refused["reason"].as_str().unwrap().contains(reason), "{wanted}: {refused}");
        assert!(!refused["help"].as_str().unwrap().is_empty());
    }
}

#[test]
fn thinned_is_not_lost() {
    let [port] = ports();
    let _base = Running::start("origin", &format!("listen = [\"tcp/127.0.0.1:{port}\"]"));
    let reader = Running::start(
        "thinning",
        &format!(
            "connect = [\"tcp/127.0.0.1:{port}\"]\nread.\"driver/ambient\" = {{ from = \"slate://origin/sensor/count\", rate = \"10Hz\" }}"
        ),
    );
    eventually("values", || reading(&reader).received > 10);
    let ReadingStatus { received, lost, thinned, .. } = reading(&reader);
    assert_eq!(lost, 0);
    assert!(thinned > 3 * received, "{thinned} of {received}");
}

fn reading(agent: &Running) -> ReadingStatus {
    agent.network().readings().remove(0)
}

/// A cable between two ports, which can be cut.
struct Cable {
    port: u16,
    ends: Arc<Mutex<Vec<TcpStream>>>,
    is_cut: Arc<Mutex<bool>>,
}

impl Cable {
    fn to(target: u16) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let (ends, is_cut) = (Arc::<Mutex<Vec<TcpStream>>>::default(), Arc::<Mutex<bool>>::default());
        let (known, cut) = (Arc::clone(&ends), Arc::clone(&is_cut));
        std::thread::spawn(move || {
            for near in listener.incoming().flatten() {
                if *cut.lock().unwrap() {
                    continue;
                }
                let far = TcpStream::connect(("127.0.0.1", target)).unwrap();
                for (mut from, mut to) in [
                    (near.try_clone().unwrap(), far.try_clone().unwrap()),
                    (far.try_clone().unwrap(), near.try_clone().unwrap()),
                ] {
                    std::thread::spawn(move || {
                        let mut bytes = [0; 65_536];
                        while let Ok(count @ 1..) = from.read(&mut bytes)
                            && to.write_all(&bytes[..count]).is_ok()
                        {}
                        let _ = to.shutdown(Shutdown::Both);
                    });
                }
                known.lock().unwrap().extend([near, far]);
            }
        });
        Self { port, ends, is_cut }
    }

    fn cut(&self) {
        *self.is_cut.lock().unwrap() = true;
        for end in self.ends.lock().unwrap().drain(..) {
            let _ = end.shutdown(Shutdown::Both);
        }
    }

    fn mend(&self) {
        *self.is_cut.lock().unwrap() = false;
    }
}

#[test]
fn a_reliable_reader_receives_what_was_sent_while_its_cable_was_cut() {
    let [port] = ports();
    let _base = Running::start("steady", &format!("listen = [\"tcp/127.0.0.1:{port}\"]"));
    for (name, mode) in [("usual", ""), ("reliable", ", mode = \"reliable\"")] {
        let cable = Cable::to(port);
        let reader = Running::start(
            name,
            &format!(
                "connect = [\"tcp/127.0.0.1:{}\"]\nread.\"driver/ambient\" = {{ from = \"slate://steady/sensor/count\", values = \"all\"{mode} }}",
                cable.port
            ),
        );
        eventually("values", || reading(&reader).received > 20);
        let before = reading(&reader);
        assert_eq!((before.lost, before.thinned), (0, 0), "{name}");
        cable.cut();
        eventually("the cut", || reader.network().agents() == [name]);
        std::thread::sleep(Duration::from_millis(200));
        cable.mend();
        let kept = reading(&reader).received;
        eventually("values again", || reading(&reader).received > kept + 30);
        let ReadingStatus { lost, refused, .. } = reading(&reader);
        assert_eq!(lost == 0, name == "reliable", "{name}: {lost} lost");
        assert_eq!(refused, 0);
    }
}
