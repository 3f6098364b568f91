//! The times of values whose agents have clocks of their own.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use crate::agents;

use std::sync::Arc;

use agents::{Agent, Folder, Number, clock, output, setup, wait_for, write};
use slate_blackboard::interface::View;
use slate_share::peers::{Setup, WantedProperty};
use slate_share::session::Options;

#[test]
fn the_first_value_has_its_time_however_far_the_clocks_differ() {
    const HOURS: u64 = 5 * 3_600_000_000_000;
    let folder = Folder::new();
    let base = Agent::listening("base", &folder);
    let mut out = output(&base.board, "out/number", 1);
    write(&mut out, 1);
    let written = out.last().time;
    for round in 0..5 {
        // Its clock is ahead by hours; another start of it is another connection.
        let ahead = Setup { clock: Arc::new(|| clock()() + HOURS), ..setup("arm") };
        let arm = Agent::start(ahead);
        let mut own = output(&arm.board, "out/number", 1);
        own.write(View::of(&mut Number { value: round + 2 }).bytes(), 0, clock()() + HOURS).unwrap();
        let own_time = own.last().time - HOURS;
        arm.peers.connect("base", &folder.endpoint("base")).unwrap();
        arm.peers.subscribe("base", WantedProperty::new("out/number", Options::default())).unwrap();
        let time = |agent: &Agent, path: &str| {
            let (property, _) = agent.board.get(path)?;
            property.newest().unwrap().map(|(_, _, stamp)| stamp.time)
        };
        let near = |time: u64, expected: u64| time.abs_diff(expected) < 200_000_000;
        if round == 0 {
            wait_for("who is read", || base.peers.is_connected("arm"));
            base.peers.subscribe("arm", WantedProperty::new("out/number", Options::default())).unwrap();
        }
        wait_for("the value here", || arm.number("agents/base/out/number") == Some(1));
        let seen = time(&arm, "agents/base/out/number").unwrap();
        assert!(near(seen, written + HOURS), "round {round}: {seen}, not {}", written + HOURS);
        wait_for("the value there", || base.number("agents/arm/out/number") == Some(round + 2));
        let seen = time(&base, "agents/arm/out/number").unwrap();
        assert!(near(seen, own_time), "round {round}: {seen}, not {own_time}");
        wait_for("who reads it", || base.peers.is_connected("arm"));
        drop(arm);
        wait_for("its end", || !base.peers.is_connected("arm"));
    }
}
