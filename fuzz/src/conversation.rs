//! Two agents that read from each other, with damage to the packets between them.
//! Afterwards both are as if nothing had happened.

use std::collections::VecDeque;

use crate::agents::{Agent, BOUND, MILLISECOND, recover};
use crate::input::Input;
use crate::memory::within;

/// Packets that are kept back at most.
const KEPT: usize = 16;

/// Plays a script: for each packet, what happens to it.
pub fn run(script: &[u8]) {
    within(2 * BOUND, || play(Input(script)));
}

fn play(mut script: Input<'_>) {
    let mut agents = [Agent::new("base", "arm", 1), Agent::new("arm", "base", 2)];
    let mut kept: [VecDeque<Vec<u8>>; 2] = Default::default();
    let mut now = 0;
    while !script.is_empty() {
        now += 5 * MILLISECOND;
        for from in [0, 1] {
            agents[from].peer.tick(now);
            agents[from].write(now, now);
            for _ in 0..4 {
                let Some(packet) = agents[from].outgoing(now) else { break };
                for packet in harm(packet, &mut kept[from], &mut script) {
                    agents[1 - from].peer.receive(now, &packet, None);
                }
            }
            agents[from].peer.unread_events().for_each(drop);
        }
    }
    let [one, other] = &mut agents;
    recover(one, other, now);
}

/// Damages a packet as the script says; returns the packets that arrive.
fn harm(mut packet: Vec<u8>, kept: &mut VecDeque<Vec<u8>>, script: &mut Input<'_>) -> Vec<Vec<u8>> {
    // What is behind the head is more worth the damage.
    let place = |at: u16, packet: &[u8]| 18 + usize::from(at) % packet.len().saturating_sub(18).max(1);
    match script.byte() {
        1 => return Vec::new(),
        2 => return vec![packet.clone(), packet],
        3 => {
            kept.push_back(packet);
            if kept.len() > KEPT {
                return kept.pop_front().into_iter().collect();
            }
            return Vec::new();
        }
        4 => return kept.drain(..).rev().chain([packet]).collect(),
        5 => packet.truncate(place(script.short(), &packet)),
        6 => {
            let at = place(script.short(), &packet).min(packet.len());
            packet.splice(at..at, script.counted().iter().copied());
        }
        7 => {
            let (at, bits) = (place(script.short(), &packet), script.byte());
            if let Some(byte) = packet.get_mut(at) {
                *byte ^= bits;
            }
        }
        8 => {
            let at = place(script.short(), &packet).min(packet.len());
            let by = script.counted();
            let end = (at + by.len()).min(packet.len());
            packet.splice(at..end, by.iter().copied());
        }
        9 => {
            // Of two packets, the beginning of one and the rest of the other.
            if let Some(other) = kept.pop_front() {
                let at = place(script.short(), &packet).min(packet.len());
                packet.truncate(at);
                packet.extend(&other[at.min(other.len())..]);
            }
        }
        _ => {}
    }
    vec![packet]
}
