//! Links that are cut, and peers that swallow everything.
#![allow(clippy::disallowed_methods, reason = "what real links do takes real time")]

use std::thread::sleep;
use std::time::{Duration, Instant};

use slate_network::ReadingStatus;

use crate::network::agent::{Running, eventually, ports};
use crate::network::cable::Cable;
use crate::network::certificates::Authority;
use crate::network::quic::{table, udp_port};

/// An agent whose count is kept for a while, so that a busy machine overwrites none before it is sent.
fn origin(name: &str, port: u16) -> Running {
    let mut agent = Running::load_with(
        name,
        "\"driver/speeds\" = \"sensor/count\"",
        &format!("listen = [\"tcp/127.0.0.1:{port}\"]"),
    );
    agent.connect().unwrap();
    agent
}

/// An agent whose queue reads the count of another one with those options.
fn reader(name: &str, port: u16, options: &str) -> Running {
    let table = format!(
        "connect = [\"tcp/127.0.0.1:{port}\"]\n\
         read.\"driver/speeds\" = {{ from = \"slate://{}/sensor/count\", {options} }}",
        name.trim_end_matches("-reader")
    );
    Running::start(name, &table)
}

fn reading(agent: &Running) -> ReadingStatus {
    agent.network().readings().remove(0)
}

#[test]
fn a_reader_of_all_values_misses_none_when_its_link_is_cut() {
    let [port] = ports();
    let origin = origin("cut", port);
    let cable = Cable::to(port);
    let reader = reader("cut-reader", cable.port, "values = \"all\", mode = \"reliable\"");
    eventually("values", || reading(&reader).received > 20);
    for round in 0..4 {
        // A connection that is closed, and one that is silent.
        match round % 2 {
            0 => cable.cut(),
            _ => cable.swallow(),
        }
        eventually("the absence", || reader.network().agents() == ["cut-reader"]);
        sleep(Duration::from_millis(500));
        let written = origin.number("sensor/count/value");
        cable.mend();
        eventually("later values", || reader.number("driver/last/value") > written + 20.0);
        assert_eq!(reader.number("driver/gaps/value"), 0.0, "round {round}");
        let ReadingStatus { lost, thinned, refused, .. } = reading(&reader);
        assert_eq!((lost, thinned, refused), (0, 0, 0), "round {round}");
    }
}

#[test]
fn a_reader_with_certificates_misses_no_value_on_a_cut_link() {
    let (port, authority) = (udp_port(), Authority::new());
    let links = "\"driver/speeds\" = \"sensor/count\"";
    let listen = format!("listen = [\"quic/127.0.0.1:{port}\"]");
    let rights = "[network.security.allow.arm]\nread = [\"sensor/**\"]";
    let mut base = Running::load_with("base", links, &table(&listen, &authority.sign("base"), rights));
    base.connect().unwrap();
    let cable = Cable::for_datagrams(port);
    let connect = format!(
        "connect = [\"quic/127.0.0.1:{}\"]\n\
         read.\"driver/speeds\" = {{ from = \"slate://base/sensor/count\", values = \"all\", mode = \"reliable\" }}",
        cable.port
    );
    let rights = "[network.security.allow.base]";
    let arm = Running::start("arm", &table(&connect, &authority.sign("arm"), rights));
    eventually("values", || reading(&arm).received > 20);
    cable.cut();
    eventually("the absence", || arm.network().agents() == ["arm"]);
    let written = base.number("sensor/count/value");
    cable.mend();
    eventually("later values", || arm.number("driver/last/value") > written + 20.0);
    let ReadingStatus { lost, thinned, refused, .. } = reading(&arm);
    assert_eq!((lost, thinned, refused, arm.number("driver/gaps/value")), (0, 0, 0, 0.0));
}

#[test]
fn a_reader_of_all_values_follows_an_agent_that_restarts() {
    let [port] = ports();
    let first = origin("reborn", port);
    let reader = reader("reborn-reader", port, "values = \"all\", mode = \"reliable\"");
    eventually("values", || reader.number("driver/last/value") > 100.0);
    drop(first);
    eventually("the absence", || reader.network().agents() == ["reborn-reader"]);
    let gaps = reader.number("driver/gaps/value");
    let again = origin("reborn", port);
    eventually("values of the new one", || reader.number("driver/last/value") < 100.0);
    eventually("values of the new one", || {
        let written = again.number("sensor/count/value");
        written - reader.number("driver/last/value") < 20.0 && written > 60.0
    });
    // From the last of the first one to the first of the second one.
    assert_eq!((gaps, reader.number("driver/gaps/value")), (0.0, 1.0));
    let ReadingStatus { lost, thinned, refused, .. } = reading(&reader);
    assert_eq!((lost, thinned, refused), (0, 0, 0));
}

#[test]
fn values_dropped_by_origin_count_as_lost() {
    let [port] = ports();
    let origin = origin("short", port);
    let cable = Cable::to(port);
    let reader = reader("short-reader", cable.port, "values = \"all\", mode = \"reliable\"");
    eventually("values", || reading(&reader).received > 20);
    cable.cut();
    let written = origin.number("sensor/count/value");
    // The origin keeps 512 values.
    eventually("more values than are kept", || origin.number("sensor/count/value") > written + 600.0);
    let before = reading(&reader);
    cable.mend();
    eventually("values again", || reading(&reader).received > before.received + 520);
    let ReadingStatus { received, lost, thinned, .. } = reading(&reader);
    assert!((50..400).contains(&lost) && thinned == 0, "{lost} lost, {thinned} thinned of {received}");
}

#[test]
fn values_skipped_by_rate_do_not_count_as_lost() {
    let [port] = ports();
    let _origin = origin("rated", port);
    let cable = Cable::to(port);
    let reader = reader("rated-reader", cable.port, "rate = \"50ms\", mode = \"reliable\"");
    eventually("values", || reading(&reader).received > 5);
    cable.cut();
    sleep(Duration::from_millis(700));
    let before = reading(&reader).received;
    cable.mend();
    // Those of the cut come, too: one for each period.
    eventually("values again", || reading(&reader).received > before + 20);
    let ReadingStatus { lost, thinned, received, .. } = reading(&reader);
    assert!(lost == 0 && thinned > received, "{lost} lost, {thinned} thinned of {received}");
}

/// The longest that an agent hears nothing within some seconds.
fn gap(agent: &Running, time: Duration) -> Duration {
    let (start, mut heard, mut longest) = (Instant::now(), Instant::now(), Duration::ZERO);
    let mut received = reading(agent).received;
    while start.elapsed() < time {
        sleep(Duration::from_millis(1));
        longest = longest.max(heard.elapsed());
        let now = reading(agent).received;
        if now != received {
            (received, heard) = (now, Instant::now());
        }
    }
    longest
}

#[test]
fn a_peer_that_swallows_everything_costs_others_at_most_50_ms() {
    let [port] = ports();
    let _origin = origin("swallowed", port);
    let healthy = reader("swallowed-reader", port, "values = \"all\"");
    eventually("values", || reading(&healthy).received > 20);
    let growth = |round: u32| {
        let cable = Cable::to(port);
        let table = format!(
            "connect = [\"tcp/127.0.0.1:{}\"]\nread.\"driver/picture\" = \"slate://swallowed/sensor/picture\"",
            cable.port
        );
        let ill = Running::start(&format!("swallowed-{round}"), &table);
        eventually("large values", || reading(&ill).received > 5);
        let before = gap(&healthy, Duration::from_millis(800));
        // Large values fill whatever stands between them.
        cable.swallow();
        let during = gap(&healthy, Duration::from_millis(3000));
        println!("worst gap {during:.1?}, before {before:.1?}");
        cable.cut();
        during.saturating_sub(before)
    };
    // A busy machine lets threads wait for each other; what one agent does to another it does each time.
    let least = (0..3).map(growth).find(|growth| *growth <= Duration::from_millis(50));
    assert!(least.is_some(), "the healthy agent waits for the one that is swallowed");
}
