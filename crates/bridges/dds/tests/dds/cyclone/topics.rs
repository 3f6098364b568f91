//! Topics both ways with CycloneDDS.

use serde_json::{Value as Json, json};
use slate_dds::TopicStatus;

use crate::dds::agent::{Running, eventually, start};
use crate::dds::cyclone::peer::{Peer, alone};
use crate::dds::interfaces::target;

const IDL: &str = "idl = \"tests/dds/target.idl\"";

fn status(agent: &Running, topic: &str) -> TopicStatus {
    agent.bridge().topics().into_iter().find(|own| own.topic == topic).unwrap()
}

/// A value on the board, as JSON.
fn value(agent: &Running, path: &str) -> Json {
    agent.value(path).map_or(Json::Null, |value| serde_json::to_value(value).unwrap())
}

/// Members of a struct on the wire that a target has.
fn on_wire(number: u8) -> Json {
    let mut value = target(number);
    value["remark"] = json!("from afar");
    value
}

/// Targets of a struct there and here, in a representation of both; whether the agent reads and writes them all.
fn both_ways(test: &str, there: &str, here: &str, representation: &str) {
    alone(test, |domain| {
        let of = format!("type = \"demo::{here}\", {IDL}");
        let agent = start(&format!(
            "domain = {domain}\nread.\"planner/target\" = {{ topic = \"Target\", {of} }}\n\
             write.\"Seen\" = {{ from = \"planner/seen\", {of}, representation = \"{representation}\" }}\n\
             write.\"Found\" = {{ from = \"scout/found\", {of}, representation = \"{representation}\", depth = 1 }}"
        ));
        let mut peer = Peer::cyclone(domain);
        let qos = json!({ "representation": representation });
        peer.advertise("Target", there, qos.clone());
        peer.subscribe("Seen", there, qos.clone());
        peer.subscribe("Found", there, qos);
        eventually("both ends", || {
            peer.matched("Target") == 1
                && status(&agent, "Seen").others == Some(1)
                && peer.matched("Seen") == 1
        });
        for number in 1..=12_u8 {
            let mut sent = on_wire(number);
            if there != "GrowingTarget" {
                sent.as_object_mut().unwrap().remove("remark");
            }
            peer.publish("Target", &sent);
            eventually("the target", || value(&agent, "planner/target")["id"] == target(number)["id"]);
            let mut read = value(&agent, "planner/target");
            read.as_object_mut().unwrap().remove("reserved");
            assert_eq!(read, target(number));
            let mut heard = Vec::new();
            eventually("the target again", || {
                heard.extend(peer.take("Seen"));
                !heard.is_empty()
            });
            if there == "GrowingTarget" {
                // The interface does not have it.
                sent["remark"] = json!("");
            }
            assert_eq!(heard, [sent]);
        }
        eventually("a target of the agent", || {
            let found = peer.take("Found");
            found.iter().any(|own| own["name"] == "scouted" && own["path"][1]["y"] == 2.0 && own["mode"] == 7)
        });
        let read = status(&agent, "Target");
        assert_eq!((read.count, read.refused, read.dropped, read.error), (12, 0, 0, None));
        assert_eq!(read.message, format!("demo::{here}"));
    });
}

#[test]
fn keyed_structs_go_both_ways_in_xcdr1() {
    both_ways("dds::cyclone::topics::keyed_structs_go_both_ways_in_xcdr1", "Target", "Target", "xcdr1");
}

#[test]
fn keyed_structs_go_both_ways_in_xcdr2() {
    both_ways("dds::cyclone::topics::keyed_structs_go_both_ways_in_xcdr2", "Target", "Target", "xcdr2");
}

#[test]
fn appendable_structs_go_both_ways() {
    let test = "dds::cyclone::topics::appendable_structs_go_both_ways";
    both_ways(test, "GrowingTarget", "GrowingTarget", "xcdr2");
}

#[test]
fn an_older_version_of_a_type_goes_both_ways() {
    let test = "dds::cyclone::topics::an_older_version_of_a_type_goes_both_ways";
    both_ways(test, "OldTarget", "GrowingTarget", "xcdr2");
}

#[test]
fn instances_fill_one_input_and_may_be_disposed() {
    alone("dds::cyclone::topics::instances_fill_one_input_and_may_be_disposed", |domain| {
        let agent = start(&format!(
            "domain = {domain}\nread.\"planner/target\" = {{ topic = \"Target\", type = \"demo::Target\", {IDL} }}"
        ));
        for life in 0..2 {
            let mut peer = Peer::cyclone(domain);
            peer.advertise("Target", "Target", json!({}));
            eventually("a reader", || {
                peer.matched("Target") == 1
                    && status(&agent, "Target").others.is_some_and(|others| others > 0)
            });
            for number in 1..=5 {
                peer.publish("Target", &target(number));
                let dispose = json!({ "do": "dispose", "topic": "Target", "value": target(number) });
                peer.request(dispose);
            }
            eventually("all instances", || status(&agent, "Target").count == 5 * (life + 1));
            assert_eq!(value(&agent, "planner/target")["id"], target(5)["id"]);
            peer.kill();
        }
        let read = status(&agent, "Target");
        assert_eq!((read.refused, read.error), (0, None));
    });
}

#[test]
fn late_readers_receive_the_last_value() {
    alone("dds::cyclone::topics::late_readers_receive_the_last_value", |domain| {
        let of = format!("type = \"demo::Target\", {IDL}, transient_local = true, depth = 1");
        let agent = start(&format!(
            "domain = {domain}\nread.\"planner/target\" = {{ topic = \"Target\", {of} }}\n\
             write.\"Seen\" = {{ from = \"planner/seen\", {of} }}"
        ));
        let qos = json!({ "transient_local": true, "depth": 1 });
        let mut early = Peer::cyclone(domain);
        early.advertise("Target", "Target", qos.clone());
        early.publish("Target", &target(7));
        eventually("the target", || status(&agent, "Seen").count == 1);
        let mut late = Peer::cyclone(domain);
        late.subscribe("Seen", "Target", qos);
        let mut heard = Vec::new();
        eventually("the last value", || {
            heard.extend(late.take("Seen"));
            !heard.is_empty()
        });
        assert_eq!(heard, [target(7)]);
    });
}

#[test]
fn a_reliable_dds_topic_loses_nothing_at_1000_messages_a_second() {
    alone("dds::cyclone::topics::a_reliable_dds_topic_loses_nothing_at_1000_messages_a_second", |domain| {
        let agent = start(&format!(
            "domain = {domain}\nread.\"planner/number\" = {{ topic = \"Count\", type = \"demo::Count\", \
                 idl = \"tests/dds/count.idl\", depth = 1000 }}"
        ));
        let mut peer = Peer::cyclone(domain);
        peer.advertise("Count", "Count", json!({ "depth": 1000 }));
        eventually("a reader", || peer.matched("Count") == 1 && status(&agent, "Count").others == Some(1));
        peer.request(json!({ "do": "burst", "topic": "Count", "count": 3000, "period": 0.001 }));
        eventually("all of them", || status(&agent, "Count").count == 3000);
        let read = status(&agent, "Count");
        assert_eq!((read.dropped, read.refused), (0, 0));
        assert_eq!(agent.number("planner/number/value"), 3000.0);
    });
}
