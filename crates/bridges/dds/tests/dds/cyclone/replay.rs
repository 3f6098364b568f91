//! A run with DDS, made again from its recording.

use std::path::Path;

use serde_json::json;
use slate_dds::DdsBridge;

use crate::dds::agent::{assert_repeated, database, plugins, record};
use crate::dds::cyclone::peer::{Peer, alone};
use crate::dds::interfaces::target;

#[test]
fn a_run_with_dds_is_made_again_bit_for_bit() {
    alone("dds::cyclone::replay::a_run_with_dds_is_made_again_bit_for_bit", |domain| {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("dds.mcap");
        let of = "type = \"demo::Target\", idl = \"tests/dds/target.idl\"";
        let database = database(&format!(
            "domain = {domain}\nread.\"planner/target\" = {{ topic = \"Target\", {of} }}\n\
             write.\"Seen\" = {{ from = \"planner/seen\", {of} }}"
        ));
        record::<DdsBridge>(&path, (&database, &plugins()), &[], |bridge, _| {
            let mut peer = Peer::cyclone(domain);
            peer.advertise("Target", "Target", json!({}));
            let mut number = 0_u32;
            while bridge.topics()[0].count < 100 {
                peer.publish("Target", &target(number as u8));
                number += 1;
                assert!(number < 100_000, "{:?}", bridge.topics());
            }
        });
        assert_repeated(&path, &plugins(), 100);
    });
}
