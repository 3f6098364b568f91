//! Readers with options of their own.

use std::time::Duration;

use slate_network::{ReadingStatus, SampleAttachment};
use zenoh::{Session, Wait};

use crate::network::agent::{Running, ask, ask_json, eventually, ports, session, wait_for_agent};

/// Attachments of the next samples at a key of an agent.
fn stamps(session: &Session, key: &str, count: usize) -> Vec<SampleAttachment> {
    let subscriber = session.declare_subscriber(key).wait().unwrap();
    eventually("an answer", || ask(session, key, None).iter().any(Result::is_ok));
    let sample = || subscriber.recv_timeout(Duration::from_secs(20)).unwrap().unwrap();
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
    assert!(all.windows(2).all(|pair| pair[1].number == pair[0].number + 1), "{all:?}");
    // On a busy machine some are overwritten before they are sent; the sequence shows it.
    let written = all[59].stamp.sequence - all[0].stamp.sequence;
    assert!((59..120).contains(&written), "{all:?}");
    let kept = stamps(&other, "slate/opts/@read/reliable/sensor/count", 6);
    assert!(kept.windows(2).all(|pair| pair[1].number == pair[0].number + 1), "{kept:?}");
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

#[test]
fn a_reliable_reader_receives_values_from_the_origins_cache() {
    let [port] = ports();
    let _base = Running::start("steady", &format!("listen = [\"tcp/127.0.0.1:{port}\"]"));
    let reader = Running::start(
        "reliable",
        &format!(
            "connect = [\"tcp/127.0.0.1:{port}\"]\nread.\"driver/ambient\" = {{ from = \"slate://steady/sensor/count\", mode = \"reliable\" }}"
        ),
    );
    eventually("values", || reading(&reader).received > 50);
    let ReadingStatus { lost, refused, .. } = reading(&reader);
    assert_eq!((lost, refused), (0, 0));
    // The last values stay with the origin: any program requests them.
    let other = session("peer", &[], &[port]);
    wait_for_agent(&other, "steady");
    let kept = "slate/steady/@read/reliable/sensor/count/@adv/pub/**";
    eventually("kept values", || {
        let get = other.get(kept).consolidation(zenoh::query::ConsolidationMode::None);
        let get = get.accept_replies(zenoh::query::ReplyKeyExpr::Any).timeout(Duration::from_secs(5));
        get.wait().unwrap().iter().count() > 5
    });
}
