//! Agent in any state of its session that receives any packets.
//! Greetings, frames of the right connection, messages of the control stream and values, in any order. Afterwards it
//! connects to an honest agent.

use crate::agents::{Agent, BOUND, MILLISECOND, recover};
use crate::input::{Input, append_counted};
use crate::memory::within;
use serde::Serialize;
use slate_share::session::Session;

/// Token of the hostile agent for its side of the connection.
const TOKEN: u64 = 0xbad;

/// The part of a script that is a raw packet.
pub const PACKET: u8 = 0;
/// Frames, for which the head is put before them.
pub const FRAMES: u8 = 1;
/// The next item of a stream: its number, and the item.
pub const ITEM: u8 = 2;
/// Milliseconds that pass.
pub const PASS: u8 = 3;
/// The agent writes, and its packets are lost.
pub const WRITE: u8 = 4;

const KINDS: u8 = 5;

/// Plays a script: whether the hostile agent has greeted before, and parts.
pub fn run(script: &[u8]) {
    within(BOUND, || play(Input(script)));
}

fn play(mut script: Input<'_>) {
    let mut base = Agent::new("base", "arm", 1);
    let mut now = MILLISECOND;
    let greeting = base.outgoing(now).expect("an agent that is alone greets");
    let mut head = greeting[..2].to_vec();
    head.extend(TOKEN.to_le_bytes());
    head.extend(&greeting[2..10]);
    let mut numbers = [0_u64; 8];
    if script.byte() % 2 == 1 {
        let hello = append_frame(&head, &(0_u8, "arm", 7_u64, 1_u64));
        base.peer.receive(now, &hello, None);
        assert!(base.peer.session().other().is_some(), "an agent that has greeted is there");
    }
    while !script.is_empty() {
        match script.byte() % KINDS {
            PACKET => {
                let packet = script.counted();
                let _ = Session::greeting(packet);
                base.peer.receive(now, packet, None);
            }
            FRAMES => {
                let packet = [&head[..], script.counted()].concat();
                base.peer.receive(now, &packet, None);
            }
            ITEM => {
                let stream = script.byte() % 8;
                let number = &mut numbers[usize::from(stream)];
                *number += 1;
                let fragment = (2_u8, u32::from(stream), *number, 0_u32, 1_u32, script.counted());
                base.peer.receive(now, &append_frame(&head, &fragment), None);
            }
            PASS => {
                now += u64::from(script.byte()) * MILLISECOND;
                base.peer.tick(now);
            }
            _ => {
                base.write(now, now);
                for _ in 0..4 {
                    base.outgoing(now);
                }
            }
        }
        base.peer.unread_events().for_each(drop);
    }
    // The hostile one might be said to be there already.
    base.peer.disconnect(now, "it is hostile");
    recover(&mut base, &mut Agent::new("arm", "base", 2), now);
}

/// Returns a packet of one frame.
/// A tuple stands for the frame, as both are written the same way.
fn append_frame(head: &[u8], frame: &impl Serialize) -> Vec<u8> {
    postcard::to_extend(frame, head.to_vec()).expect("it has a length")
}

/// Appends a part of a script that has bytes.
pub fn append_part(kind: u8, bytes: &[u8], script: &mut Vec<u8>) {
    script.push(kind);
    append_counted(bytes, script);
}
