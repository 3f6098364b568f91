//! Bytes from anywhere are taken or refused: nothing panics, grows without bound, or is taken over in half.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use common::{TIGHT, talk, value};
use proptest::prelude::*;
use slate_share::knowledge::{Limits, Replica};

/// Two robots with several lives, of which the first lacks some of what the second has.
fn pair(limits: Limits) -> Vec<Replica> {
    let mut team = vec![Replica::new(0, 9, limits), Replica::new(1, 9, limits)];
    team[0].state(4, b"k", value(b"0")).unwrap();
    talk(&mut team, 0, 1);
    team[0] = Replica::new(0, 3, limits);
    for number in 0..10_u8 {
        team[0].state(5, &[number], value(&[number; 20])).unwrap();
        team[0].retract(5, &[number / 2]).unwrap();
    }
    talk(&mut team, 0, 1);
    for number in 0..10_u8 {
        team[1].state(6, &[number], value(b"of 1")).unwrap();
    }
    team
}

/// Messages of every kind, as two robots send them to each other.
fn messages(limits: Limits) -> Vec<Vec<u8>> {
    let (mut team, mut messages) = (pair(limits), Vec::new());
    // Fresh facts are lost, so that they are requested.
    while team[1].outgoing().is_some() {}
    team[1].tick();
    loop {
        let before = messages.len();
        for (from, to) in [(0, 1), (1, 0)] {
            while let Some(message) = team[from].outgoing() {
                team[to].receive(from as u32, &message.bytes).unwrap();
                messages.push(message.bytes);
            }
        }
        if messages.len() == before {
            break;
        }
    }
    let kinds: slate_sorted::SortedSet<u8> = messages.iter().map(|message| message[1]).collect();
    assert_eq!(kinds.into_iter().collect::<Vec<_>>(), [0, 1, 2], "a digest, a request and parts of lives");
    messages
}

/// Gives the bytes to a replica, and checks what must hold whatever they are.
fn feed(replica: &mut Replica, bytes: &[u8], limits: &Limits) {
    let before = (replica.save(), replica.memory());
    let taken = replica.receive(1, bytes);
    if taken.is_err() {
        assert_eq!(before, (replica.save(), replica.memory()));
    }
    assert!(replica.memory() <= limits.memory());
    replica.tick();
    while let Some(message) = replica.outgoing() {
        assert!(message.bytes.len() <= limits.message);
    }
    // What it has can still be saved and used.
    Replica::restore(0, 1, *limits, &replica.save()).unwrap();
    replica.state(9, b"k", value(b"still")).ok();
}

#[test]
fn a_message_cut_anywhere_is_refused_or_is_a_shorter_message() {
    for message in messages(TIGHT) {
        for length in 0..message.len() {
            feed(&mut pair(TIGHT)[0], &message[..length], &TIGHT);
        }
    }
}

#[test]
fn a_refusal_says_where_and_what_should_be_there() {
    let mut replica = pair(TIGHT).remove(0);
    let mut reason = |bytes: &[u8]| replica.receive(1, bytes).unwrap_err().to_string();
    assert_eq!(reason(&[]), "refused at byte 0 of 0: another byte should be there");
    assert_eq!(reason(&[2, 0]), "refused at byte 1 of 2: a format of this version of Slate should be there");
    assert_eq!(reason(&[1, 9]), "refused at byte 2 of 2: a kind of message should be there");
    assert_eq!(reason(&[1; 321]), "refused at byte 0 of 321: no message of that length should be there");
    // A length of four gigabytes allocates nothing.
    let section = [1, 2, 0, 7, 1, 0, 0, 0, 0, 0, 1, 1, 0, 0, 1, 1, 0xff, 0xff, 0xff, 0xff, 0x0f];
    assert_eq!(reason(&section), "refused at byte 21 of 21: a length within the limits should be there");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_are_survived(kind in 0_u8..4, bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let mut replica = pair(TIGHT).remove(0);
        feed(&mut replica, &bytes, &TIGHT);
        let framed = [&[1, kind], &bytes[..]].concat();
        feed(&mut replica, &framed, &TIGHT);
    }

    #[test]
    fn damaged_messages_are_survived(
        damages in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), 1..=255_u8), 1..20),
    ) {
        let messages = messages(TIGHT);
        let mut replica = pair(TIGHT).remove(0);
        for (which, at, damage) in damages {
            let mut message = which.get(&messages).clone();
            let at = at.index(message.len());
            message[at] ^= damage;
            feed(&mut replica, &message, &TIGHT);
        }
    }
}
