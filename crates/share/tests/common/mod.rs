//! A few robots whose messages arrive at once, in order.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that fails panics")]

use slate_share::knowledge::{Limits, Replica, Statement};

/// Little room, so that limits are reached.
#[allow(dead_code, reason = "not every test needs it")]
pub const TIGHT: Limits = Limits {
    robots: 4,
    lives: 4,
    facts: 16,
    bytes: 16 << 10,
    key: 16,
    value: 64,
    message: 320,
    stages: 2,
    outgoing: 32,
};

/// A statement of which nothing but the value matters.
pub fn value(value: &[u8]) -> Statement<'_> {
    Statement { schema: 1, certainty: 0.5, value }
}

/// Lets the robots at these places talk in both directions until they have nothing more to say to each other. What they
/// say to others is lost.
pub fn talk(team: &mut [Replica], one: usize, other: usize) {
    let pair = [team[one].robot(), team[other].robot()];
    team[one].add_neighbor(pair[1]);
    team[other].add_neighbor(pair[0]);
    // Fresh news may have been taken by messages that were lost.
    team[one].tick();
    team[other].tick();
    loop {
        let mut quiet = true;
        for (from, to) in [(one, other), (other, one)] {
            while let Some(message) = team[from].outgoing() {
                quiet = false;
                if message.to == team[to].robot() {
                    let sender = team[from].robot();
                    team[to].receive(sender, &message.bytes).unwrap();
                }
            }
        }
        if quiet {
            return;
        }
    }
}

/// The values stated about a key, by origin.
#[allow(dead_code, reason = "not every test needs it")]
pub fn seen(replica: &Replica, key: &str) -> Vec<(u32, Vec<u8>)> {
    let facts = replica.facts(key.as_bytes());
    facts.map(|fact| (fact.origin, fact.statement.value.to_vec())).collect()
}
