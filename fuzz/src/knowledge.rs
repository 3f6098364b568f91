//! Robot that receives anything from others.
//! An invalid message changes nothing, and afterwards the robot learns the same as an honest one.

use crate::input::Input;
use crate::memory::within;
use slate_share::knowledge::{Limits, Replica, Statement};

/// Little room, so that limits are reached.
pub const LIMITS: Limits = Limits {
    robots: 4,
    lives: 4,
    facts: 16,
    bytes: 16 << 10,
    key: 16,
    value: 64,
    message: 512,
    stages: 2,
    outgoing: 32,
};

/// Upper bound of memory, bytes.
/// The limits count the allocator's overhead, and a message is read beside the kept facts.
const BOUND: usize = 4 << 20;

/// The part of a script that is a message.
pub const MESSAGE: u8 = 0;
/// The robots that are known compare what they know.
pub const TICK: u8 = 1;
/// The robot states something about a key.
pub const STATE: u8 = 2;
/// It retracts what it has stated about a key.
pub const RETRACT: u8 = 3;
/// It comes back with what it has saved.
pub const RESTART: u8 = 4;

const KINDS: u8 = 5;

/// Plays a script.
pub fn run(script: &[u8]) {
    within(BOUND, || play(Input(script)));
}

fn play(mut script: Input<'_>) {
    let mut replica = Replica::new(1, 77, LIMITS);
    (2..5).for_each(|robot| replica.add_neighbor(robot));
    while !script.is_empty() {
        match script.byte() % KINDS {
            MESSAGE => {
                let (from, message) = (u32::from(script.byte() % 5), script.counted());
                let before = (replica.save(), replica.memory(), replica.counters());
                if let Err(error) = replica.receive(from, message) {
                    let _ = error.to_string();
                    let after = (replica.save(), replica.memory(), replica.counters());
                    assert!(before == after, "what was refused changed something: {error}");
                }
            }
            TICK => replica.tick(),
            STATE => {
                let key = [script.byte() % 32];
                let statement = Statement { schema: 1, certainty: 0.5, value: script.part(8) };
                let _ = replica.state(script.word().into(), &key, statement);
            }
            RETRACT => drop(replica.retract(script.word().into(), &[script.byte() % 32])),
            _ => {
                let saved = replica.save();
                replica =
                    Replica::restore(1, script.word(), LIMITS, &saved).expect("what is saved is restored");
                (2..5).for_each(|robot| replica.add_neighbor(robot));
            }
        }
        let limits = LIMITS;
        assert!(replica.memory() <= limits.memory(), "{} bytes", replica.memory());
        // Some of it is sent.
        for _ in 0..script.byte() % 4 {
            if let Some(message) = replica.outgoing() {
                assert!(message.bytes.len() <= LIMITS.message, "{} bytes", message.bytes.len());
            }
        }
    }
    agree(&mut replica);
}

/// Lets a robot that knows nothing talk with this one until both know the same.
fn agree(replica: &mut Replica) {
    let mut other = Replica::new(2, 5, LIMITS);
    (3..6).for_each(|robot| replica.remove_neighbor(robot));
    other.add_neighbor(1);
    for _ in 0..64 {
        replica.tick();
        other.tick();
        while let Some(message) = replica.outgoing() {
            if message.to == 2 {
                other.receive(1, &message.bytes).expect("robots write messages");
            }
        }
        while let Some(message) = other.outgoing() {
            replica.receive(2, &message.bytes).expect("robots write messages");
        }
        if replica.versions().eq(other.versions()) {
            return;
        }
    }
    panic!("two robots do not agree");
}
