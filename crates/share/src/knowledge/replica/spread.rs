use std::collections::VecDeque;

use slate_sorted::SortedMap;

use super::held::HeldLives;
use super::random::Random;
use crate::knowledge::Limits;
use crate::knowledge::wire::{Claim, Message, WireWriter, write_section};

/// Number of neighbors that a tick compares with.
const COMPARED_NEIGHBORS: usize = 2;

/// Number of neighbors that receive fresh facts at once.
const FRESH_RECEIVERS: usize = 2;

/// Outgoing message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outgoing {
    /// Robot that receives it.
    pub to: u32,
    /// Bytes for the receiver's [`Replica::receive`](super::Replica::receive).
    pub bytes: Vec<u8>,
}

/// Life with a newer version that was not sent yet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fresh {
    /// Version before the change.
    pub after: u64,
    /// Robot from which it was received; `None` for this robot.
    pub from: Option<u32>,
}

/// Offer of a life to a robot with an older version of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct LifeOffer {
    origin: u32,
    epoch: u64,
    base: u64,
    position: u64,
}

impl LifeOffer {
    pub fn whole(origin: u32, epoch: u64) -> Self {
        Self { origin, epoch, base: 0, position: 0 }
    }

    pub fn beyond(claim: &Claim) -> Self {
        Self { origin: claim.origin, epoch: claim.epoch, base: claim.base, position: claim.position }
    }
}

/// Dissemination: sends fresh facts to neighbors, and compares lives with theirs.
#[derive(Clone, Debug)]
pub(super) struct Disseminator {
    limits: Limits,
    random: Random,
    neighbors: Vec<u32>,
    /// Origin at which the next digest begins, if one has no room for all.
    cursor: u32,
    fresh: SortedMap<(u32, u64), Fresh>,
    outgoing: VecDeque<Outgoing>,
    /// Messages dropped because too many waited.
    pub dropped: u64,
}

impl Disseminator {
    pub fn new(limits: Limits, random: Random) -> Self {
        Self {
            limits,
            random,
            neighbors: Vec::new(),
            cursor: 0,
            fresh: SortedMap::new(),
            outgoing: VecDeque::new(),
            dropped: 0,
        }
    }

    /// Adds a neighbor that messages reach.
    pub fn add_neighbor(&mut self, robot: u32) {
        if let Err(at) = self.neighbors.binary_search(&robot) {
            self.neighbors.insert(at, robot);
        }
    }

    /// Removes a neighbor that messages no longer reach.
    /// Messages that wait for it are dropped.
    pub fn remove_neighbor(&mut self, robot: u32) {
        self.neighbors.retain(|neighbor| *neighbor != robot);
        self.outgoing.retain(|message| message.to != robot);
    }

    /// Marks a life as fresh, to be sent to neighbors.
    pub fn mark_fresh(&mut self, origin: u32, epoch: u64, fresh: Fresh) {
        // Facts beyond the limit are left to the comparison.
        if self.fresh.len() < self.limits.robots.saturating_mul(self.limits.lives) {
            self.fresh.entry((origin, epoch)).or_insert(fresh);
        }
    }

    /// Clears the fresh lives without sending them.
    pub fn clear_fresh(&mut self) {
        self.fresh.clear();
    }

    /// Returns the memory of messages, bytes.
    pub fn bytes(&self) -> usize {
        self.outgoing.iter().map(|message| message.bytes.len()).sum()
    }

    /// Sends a digest to some neighbors, for comparison.
    pub fn compare(&mut self, held: &HeldLives) {
        let (digest, next) = self.digest(held, self.cursor);
        self.cursor = next;
        for to in self.some_neighbors(COMPARED_NEIGHBORS) {
            self.send(to, digest.clone());
        }
    }

    /// Returns the next message to send, if any.
    pub fn next(&mut self, held: &HeldLives) -> Option<Outgoing> {
        if self.outgoing.is_empty() && !self.fresh.is_empty() {
            self.send_fresh(held);
        }
        self.outgoing.pop_front()
    }

    /// Sends fresh facts to some neighbors, as far as they fit into one message.
    /// The comparison covers the rest.
    fn send_fresh(&mut self, held: &HeldLives) {
        let fresh = std::mem::take(&mut self.fresh);
        for to in self.some_neighbors(FRESH_RECEIVERS) {
            let mut writer = Message::sections();
            for ((origin, epoch), Fresh { after, from }) in &fresh {
                if *from == Some(to) {
                    continue;
                }
                let offer = LifeOffer { origin: *origin, epoch: *epoch, base: *after, position: *after };
                self.write_offer(held, &mut writer, &offer);
            }
            if !writer.is_empty() {
                self.send(to, writer.finish());
            }
        }
    }

    fn some_neighbors(&mut self, count: usize) -> impl Iterator<Item = u32> + use<> {
        let length = self.neighbors.len();
        let begin = self.random.below(length);
        let (before, after) = self.neighbors.split_at(begin);
        after.iter().chain(before).copied().take(count).collect::<Vec<_>>().into_iter()
    }

    pub fn send(&mut self, to: u32, bytes: Vec<u8>) {
        if self.outgoing.len() < self.limits.outgoing {
            self.outgoing.push_back(Outgoing { to, bytes });
        } else {
            self.dropped += 1;
        }
    }

    /// Returns a digest of all lives from origin `first` on, as far as it has room.
    /// The second value is the origin at which the next digest begins.
    pub fn digest(&self, held: &HeldLives, first: u32) -> (Vec<u8>, u32) {
        let mut claims = WireWriter::new(&[]);
        // Reserve for the header.
        let limit = self.limits.message - 16;
        let mut last = u32::MAX;
        let (mut origin, mut begin) = (first, 0);
        for claim in held.claims(first) {
            if claim.origin != origin {
                (origin, begin) = (claim.origin, claims.length());
            }
            claim.write(&mut claims);
            if claims.length() > limit {
                claims.cut(begin);
                last = origin.saturating_sub(1);
                break;
            }
        }
        let mut writer = Message::digest(first, last);
        writer.bytes(&claims.finish());
        (writer.finish(), last.wrapping_add(1))
    }

    /// Sends as much of the offers as fits into one message.
    pub fn answer(&mut self, held: &HeldLives, to: u32, mut offers: Vec<LifeOffer>) {
        if offers.is_empty() {
            return;
        }
        // Each gets its turn to be the first, also when the other robot can't take some of them.
        let first = self.random.below(offers.len());
        offers.rotate_left(first);
        let mut writer = Message::sections();
        let more =
            offers.iter().fold(false, |more, offer| more | !self.write_offer(held, &mut writer, offer));
        if !writer.is_empty() {
            let mut bytes = writer.finish();
            if more {
                Message::set_more(&mut bytes);
            }
            self.send(to, bytes);
        }
    }

    /// Writes the part of a life that is newer than the offer.
    /// Returns false if not all of it had room.
    fn write_offer(&self, held: &HeldLives, writer: &mut WireWriter, offer: &LifeOffer) -> bool {
        let life = held.origins.get(&offer.origin).and_then(|origin| origin.life(offer.epoch));
        match life {
            Some(life) if life.version > offer.position && life.version >= offer.base => {
                let after = if life.floor > offer.base { 0 } else { offer.position };
                let through = write_section(writer, offer.origin, life, after, self.limits.message);
                through == Some(life.version)
            }
            _ => true,
        }
    }

    /// Requests lives that are newer than the claims.
    pub fn request(&mut self, to: u32, requests: Vec<Claim>) {
        if requests.is_empty() {
            return;
        }
        let mut claims = requests;
        claims.sort_by_key(Claim::life_id);
        claims.dedup_by_key(|claim| claim.life_id());
        let mut writer = Message::request();
        for claim in claims {
            let length = writer.length();
            claim.write(&mut writer);
            if writer.length() > self.limits.message {
                writer.cut(length);
                break;
            }
        }
        self.send(to, writer.finish());
    }
}
