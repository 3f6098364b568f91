//! Rights of each agent, checked at the origin.

use std::time::Duration;

use serde_json::{Value as Json, json};
use slate_network::{NetworkSettings, router_access_control, set_key};
use zenoh::{Session, Wait};

use crate::network::agent::{Running, ask, ask_json, eventually, ports, session, session_with};
use crate::network::certificates::Authority;
use crate::network::quic::{program, table, tls, udp_port};

const TEXT: &str = "text/plain";

/// Agent `base`, which lets `reader` read, `sender` set and send, and `both` do both.
fn base(port: u16, authority: &Authority, more: &str) -> Running {
    let rights = "[network.security.allow.reader]\nread = [\"sensor/**\", \"driver/*\"]\n\
                  [network.security.allow.sender]\nsend = [\"sensor/params/**\", \"driver/notes\"]\n\
                  [network.security.allow.both]\nread = [\"sensor/pose\"]\nsend = [\"driver/goal\"]\n";
    let entries = format!("listen = [\"quic/127.0.0.1:{port}\"{more}]\nset = [\"**\"]");
    Running::start("base", &table(&entries, &authority.sign("base"), rights))
}

/// A program that is connected.
fn connected(port: u16, authority: &Authority, name: &str) -> Session {
    let session = program(port, &authority.sign(name));
    let tree = format!("slate/base/@tree/{name}");
    eventually("the agent", || ask(&session, &tree, None).iter().any(Result::is_ok));
    session
}

/// The paths that a program sees.
fn seen(session: &Session, name: &str) -> Vec<String> {
    let tree = ask_json(session, &format!("slate/base/@tree/{name}"), None).unwrap();
    tree.as_array().unwrap().iter().map(|entry| entry["path"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn an_agent_that_may_read_can_neither_set_nor_send() {
    let (port, authority) = (udp_port(), Authority::new());
    let agent = base(port, &authority, "");
    let reader = connected(port, &authority, "reader");
    assert_eq!(ask_json(&reader, "slate/base/sensor/pose?format=json", None).unwrap()["x"], 1.5);
    for path in ["sensor/params/step", "driver/goal/x", "driver/notes"] {
        let replies = ask(&reader, &set_key("base", path), Some((b"2", TEXT)));
        assert!(replies.is_empty(), "{path}: {replies:?}");
    }
    // The key of the property itself is for reading.
    for key in ["slate/base/driver/goal", "slate/base/sensor/params/step"] {
        let refused = ask_json(&reader, key, Some((b"2", TEXT))).unwrap_err();
        assert!(refused["reason"].as_str().unwrap().contains("is read only"), "{refused}");
        assert!(refused["help"].as_str().unwrap().contains("slate/base/@set/"), "{refused}");
    }
    assert_eq!((agent.number("sensor/params/step"), agent.number("driver/seen/value")), (1.0, 0.0));
    assert_eq!(agent.number("driver/heard/value"), 0.0);
    let visible = seen(&reader, "reader");
    assert!(
        visible.contains(&"sensor/pose".into()) && !visible.contains(&"driver/notes".into()),
        "{visible:?}"
    );
}

#[test]
fn an_agent_that_may_send_reads_nothing() {
    let (port, authority) = (udp_port(), Authority::new());
    let agent = base(port, &authority, "");
    let sender = connected(port, &authority, "sender");
    let subscriber = sender.declare_subscriber("slate/**").wait().unwrap();
    let set = |path: &str, value: &[u8]| ask_json(&sender, &set_key("base", path), Some((value, TEXT)));
    assert_eq!(set("sensor/params/step", b"2.5").unwrap()["status"], "accepted");
    assert_eq!(set("driver/notes", b"4").unwrap()["status"], "done");
    assert_eq!(set("driver/notes", b"-1").unwrap_err()["status"], "refused");
    eventually("the message", || agent.number("driver/heard/value") == 4.0);
    assert_eq!(agent.number("sensor/params/step"), 2.5);
    assert!(ask(&sender, &set_key("base", "driver/goal/x"), Some((b"1", TEXT))).is_empty());
    for key in ["slate/base/sensor/pose", "slate/base/sensor/params", "slate/base/**"] {
        assert!(ask(&sender, key, None).is_empty(), "{key}");
    }
    assert!(subscriber.try_recv().unwrap().is_none());
    assert_eq!(seen(&sender, "sender"), ["driver/notes", "sensor/params"]);
    // Nor does it see what others may.
    assert!(ask(&sender, "slate/base/@tree/reader", None).is_empty());
    assert!(ask(&sender, "slate/base/@tree", None).is_empty());
}

#[test]
fn wildcards_mean_what_may_be_read() {
    let (port, authority) = (udp_port(), Authority::new());
    let agent = base(port, &authority, "");
    let both = connected(port, &authority, "both");
    let subscriber = both.declare_subscriber("slate/base/**").wait().unwrap();
    for _ in 0..20 {
        assert_eq!(subscriber.recv().unwrap().key_expr().as_str(), "slate/base/sensor/pose");
    }
    let replies = ask(&both, "slate/base/**", None);
    let keys: Vec<_> = replies.iter().map(|reply| reply.as_ref().unwrap().key_expr().as_str()).collect();
    assert_eq!(keys, ["slate/base/sensor/pose"]);
    let set = ask_json(&both, &set_key("base", "driver/goal"), Some((b"{\"x\": 3}", "application/json")));
    assert_eq!(set.unwrap()["status"], "accepted");
    eventually("the goal", || agent.number("driver/seen/value") == 3.0);
}

#[test]
fn rights_hold_for_readers_with_options() {
    let (port, authority) = (udp_port(), Authority::new());
    let _agent = base(port, &authority, "");
    let reader = connected(port, &authority, "reader");
    for options in ["all", "rate=50ms", "reliable"] {
        let key = format!("slate/base/@read/{options}/sensor/count");
        let subscriber = reader.declare_subscriber(&key).wait().unwrap();
        eventually("an answer", || ask(&reader, &key, None).iter().any(Result::is_ok));
        for _ in 0..5 {
            let sample = subscriber.recv_timeout(Duration::from_secs(20)).unwrap();
            assert!(sample.is_some(), "{options}");
        }
    }
    let both = connected(port, &authority, "both");
    let other = both.declare_subscriber("slate/base/@read/all/sensor/count").wait().unwrap();
    let own = both.declare_subscriber("slate/base/@read/all/sensor/pose").wait().unwrap();
    let answers =
        |path: &str| ask(&both, &format!("slate/base/@read/all/{path}"), None).iter().any(Result::is_ok);
    eventually("an answer", || answers("sensor/pose"));
    assert!(!answers("sensor/count"));
    for _ in 0..20 {
        assert!(own.recv_timeout(Duration::from_secs(20)).unwrap().is_some());
    }
    assert!(other.try_recv().unwrap().is_none());
}

#[test]
fn no_agent_can_impersonate_another() {
    let (port, authority) = (udp_port(), Authority::new());
    let entries = format!(
        "listen = [\"quic/127.0.0.1:{port}\"]\nread.\"driver/ambient\" = \"slate://arm/sensor/count\""
    );
    let rights = "[network.security.allow.arm]\n[network.security.allow.leg]\nread = [\"sensor/**\"]";
    let base = Running::start("base", &table(&entries, &authority.sign("base"), rights));
    let leg = connected(port, &authority, "leg");
    let _token = leg.liveliness().declare_token("slate/arm/@alive").wait().unwrap();
    let _own = leg.liveliness().declare_token("slate/leg/@alive").wait().unwrap();
    eventually("its own name", || base.network().agents() == ["base", "leg"]);
    for _ in 0..50 {
        leg.put("slate/arm/sensor/count", "7").encoding(TEXT).wait().unwrap();
    }
    let arm = program(port, &authority.sign("arm"));
    let publisher = arm.declare_publisher("slate/arm/sensor/count").wait().unwrap();
    eventually("the true one", || {
        publisher.put("9").encoding(TEXT).wait().unwrap();
        base.number("driver/seen/value") == 9.0
    });
    let status = base.network().readings().remove(0);
    assert!(status.received < 50 && status.refused == 0, "{status:?}");
}

#[test]
fn programs_without_a_name_have_rights_of_their_own() {
    let (port, authority) = (udp_port(), Authority::new());
    let [clear] = ports();
    let entries = format!(
        "listen = [\"quic/127.0.0.1:{port}\", \"tcp/127.0.0.1:{clear}\"]\nset = [\"**\"]\n\
         read.\"driver/ambient\" = \"zenoh:demo/temperature\""
    );
    let rights = "unauthenticated = { read = [\"sensor/count\"], send = [\"driver/goal/**\"] }\n\
                  [network.security.allow.arm]\nread = [\"**\"]";
    let base = Running::start("base", &table(&entries, &authority.sign("base"), rights));
    let local = session("peer", &[], &[clear]);
    eventually("the agent", || ask(&local, "slate/base/@tree", None).iter().any(Result::is_ok));
    let tree = ask_json(&local, "slate/base/@tree", None).unwrap();
    let paths: Vec<_> =
        tree.as_array().unwrap().iter().map(|entry| entry["path"].as_str().unwrap()).collect();
    assert_eq!(paths, ["driver/goal", "sensor/count"]);
    assert!(ask(&local, "slate/base/sensor/pose", None).is_empty());
    let set = ask_json(&local, &set_key("base", "driver/goal/x"), Some((b"2", TEXT))).unwrap();
    assert_eq!(set["status"], "accepted");
    eventually("its value", || {
        local.put("demo/temperature", "20").encoding(TEXT).wait().unwrap();
        base.number("driver/seen/value") == 22.0
    });
}

/// What a router of Zenoh has in its configuration, for agents with these tables.
fn router_rights(agents: &[&Running]) -> Json {
    let settings: Vec<_> =
        agents.iter().map(|agent| NetworkSettings::of(&agent.configuration).unwrap().unwrap()).collect();
    let named: Vec<_> = agents.iter().map(|agent| agent.surface.board().agent()).zip(&settings).collect();
    router_access_control(&named)
}

#[test]
fn a_router_checks_the_rights_of_agents_behind_it() {
    let (port, authority) = (udp_port(), Authority::new());
    let connect = format!("mode = \"client\"\nconnect = [\"quic/127.0.0.1:{port}\"]\nset = [\"**\"]");
    let rights = "[network.security.allow.hub]\nrouter = true\nread = [\"sensor/**\"]\nsend = [\"driver/goal\"]\n\
                  [network.security.allow.arm]\nread = [\"sensor/count\"]\n\
                  [network.security.allow.leg]\nsend = [\"driver/goal\"]";
    let mut base = Running::load("base", &table(&connect, &authority.sign("base"), rights));
    let read = "read.\"driver/ambient\" = \"slate://base/sensor/count\"";
    let rights = "[network.security.allow.hub]\nrouter = true";
    let mut arm = Running::load("arm", &table(&format!("{connect}\n{read}"), &authority.sign("arm"), rights));
    let mut router = tls(&authority.sign("hub"), true);
    router.push(("access_control", router_rights(&[&base, &arm])));
    let _hub = session_with("router", &[format!("quic/127.0.0.1:{port}")], &[], &router);
    base.connect().unwrap();
    arm.connect().unwrap();
    eventually("values", || arm.number("driver/seen/value") > 5.0);
    let asked = |name: &str, key: &str, payload: Option<(&[u8], &str)>| {
        let endpoint = [format!("quic/127.0.0.1:{port}")];
        let session = session_with("client", &[], &endpoint, &tls(&authority.sign(name), true));
        let replies = ask(&session, key, payload);
        replies.iter().all(Result::is_ok).then_some(replies.len())
    };
    let goal = json!({ "x": 3 }).to_string();
    let payload = Some((goal.as_bytes(), "application/json"));
    let set = set_key("base", "driver/goal");
    assert_eq!(asked("arm", "slate/base/sensor/count", None), Some(1));
    assert_eq!(asked("arm", "slate/base/sensor/pose", None), Some(0));
    assert_eq!(asked("arm", &set, payload), Some(0));
    assert_eq!(asked("leg", "slate/base/sensor/count", None), Some(0));
    assert_eq!(asked("leg", &set, payload), Some(1));
    assert_eq!(asked("nobody", "slate/base/sensor/count", None), Some(0));
    assert_eq!(asked("nobody", &set, payload), Some(0));
    eventually("the goal", || base.number("driver/seen/value") == 3.0);
}
