//! Endpoints that can't match are logged with the name of the policy.

use serde_json::json;

use crate::dds::agent::{eventually, start};
use crate::dds::cyclone::peer::{Peer, alone};
use crate::dds::interfaces::target;

#[test]
fn qos_mismatch_names_its_policy() {
    alone("dds::cyclone::mismatch::qos_mismatch_names_its_policy", |domain| {
        let of = "type = \"demo::Target\", idl = \"tests/dds/target.idl\"";
        let agent = start(&format!(
            "domain = {domain}\nread.\"planner/target\" = {{ topic = \"Target\", {of}, transient_local = true }}\n\
             write.\"Seen\" = {{ from = \"planner/seen\", {of}, reliable = false }}\n\
             write.\"Found\" = {{ from = \"scout/found\", {of} }}"
        ));
        let mut peer = Peer::cyclone(domain);
        let mut check = |topic: &str, of: &str, qos, writes: bool, words: &str| {
            match writes {
                true => peer.advertise(topic, of, qos),
                false => peer.subscribe(topic, of, qos),
            }
            eventually(words, || agent.logged(words) > 0);
        };
        check(
            "Target",
            "Target",
            json!({ "reliable": false, "transient_local": true }),
            true,
            "Target: a writer offers incompatible QoS, so nothing is received from it: RELIABILITY (offered BEST_EFFORT, requested RELIABLE); reliable = false reads it",
        );
        check(
            "Target",
            "Target",
            json!({}),
            true,
            "Target: a writer offers incompatible QoS, so nothing is received from it: DURABILITY (offered VOLATILE, requested TRANSIENT_LOCAL); take transient_local = true away",
        );
        check(
            "Seen",
            "Target",
            json!({}),
            false,
            "Seen: a reader requests incompatible QoS, so nothing is sent to it: RELIABILITY (offered BEST_EFFORT, requested RELIABLE); take reliable = false away",
        );
        check(
            "Found",
            "Target",
            json!({ "representation": "xcdr2" }),
            false,
            "Found: a reader requests incompatible QoS, so nothing is sent to it: REPRESENTATION (offered XCDR1, requested XCDR2)",
        );
        check(
            "Target",
            "Count",
            json!({ "transient_local": true }),
            true,
            "Target: a writer has type demo::Count and this agent demo::Target, so they exchange nothing",
        );
        check(
            "Target",
            "Unkeyed",
            json!({ "transient_local": true }),
            true,
            "Target: demo::Target has no key in a writer and one here, so they exchange nothing: write the same @key in both IDL files",
        );
        assert!(agent.logged("incompatible QoS") >= 4);
        // The rest runs.
        drop(peer);
        let mut peer = Peer::cyclone(domain);
        peer.advertise("Target", "Target", json!({ "transient_local": true }));
        peer.publish("Target", &target(3));
        eventually("the target", || agent.number("planner/target/position/x") == 3.0);
    });
}

#[test]
fn messages_that_do_not_fit_are_counted_and_logged_once() {
    alone("dds::cyclone::mismatch::messages_that_do_not_fit_are_counted_and_logged_once", |domain| {
        let of = "type = \"demo::Target\", idl = \"tests/dds/target.idl\"";
        let agent =
            start(&format!("domain = {domain}\nread.\"planner/target\" = {{ topic = \"Target\", {of} }}"));
        let mut peer = Peer::cyclone(domain);
        peer.advertise("Target", "Target", json!({}));
        let status = || agent.bridge().topics()[0].clone();
        eventually("a reader", || peer.matched("Target") == 1 && status().others == Some(1));
        let mut long = target(1);
        long["path"] = json!(vec![json!({ "x": 0.0, "y": 0.0 }); 5]);
        for refused in 1..=3 {
            peer.publish("Target", &long);
            eventually("a refusal", || status().refused == refused);
        }
        let reason = "path: a sequence has 5 items, the interface has room for 4";
        assert_eq!(status().error.as_deref(), Some(reason));
        let words = format!("dds: a message of Target does not fit /planner/target: {reason}");
        assert_eq!(agent.logged(&words), 1);
        peer.publish("Target", &target(2));
        eventually("the next one", || status().count == 1 && status().error.is_none());
    });
}
