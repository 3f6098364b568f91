use std::collections::{BTreeMap, VecDeque};

use super::held::HeldLives;
use super::random::Random;
use crate::knowledge::Limits;
use crate::knowledge::wire::{Claim, Message, WireWriter, write_section};

/// To how many neighbours a tick compares what is known.
const COMPARED: usize = 2;

/// To how many neighbours fresh facts go at once.
const TOLD: usize = 2;

/// A message to send.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outgoing {
    /// The robot that it is for.
    pub to: u32,
    /// Give them to its [`Replica::receive`](super::Replica::receive).
    pub bytes: Vec<u8>,
}

/// A life of which a newer version is known, and nobody was told yet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fresh {
    /// The version that was known before.
    pub after: u64,
    /// Who told it.
    pub from: Option<u32>,
}

/// A life of which another robot knows less.
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

/// Tells neighbours what is new, and compares what is known with theirs.
#[derive(Clone, Debug)]
pub(super) struct Spreader {
    limits: Limits,
    random: Random,
    neighbours: Vec<u32>,
    /// Where the next digest begins, when one has no room for all.
    cursor: u32,
    fresh: BTreeMap<(u32, u64), Fresh>,
    outgoing: VecDeque<Outgoing>,
    /// Messages dropped as too many waited to be sent.
    pub dropped: u64,
}

impl Spreader {
    pub fn new(limits: Limits, random: Random) -> Self {
        Self {
            limits,
            random,
            neighbours: Vec::new(),
            cursor: 0,
            fresh: BTreeMap::new(),
            outgoing: VecDeque::new(),
            dropped: 0,
        }
    }

    /// Notes that messages reach that robot.
    pub fn meet(&mut self, robot: u32) {
        if let Err(at) = self.neighbours.binary_search(&robot) {
            self.neighbours.insert(at, robot);
        }
    }

    /// Notes that messages do not reach that robot any more; those that wait for it are dropped.
    pub fn part(&mut self, robot: u32) {
        self.neighbours.retain(|neighbour| *neighbour != robot);
        self.outgoing.retain(|message| message.to != robot);
    }

    /// Notes that neighbours are to be told of a life.
    pub fn tell_of(&mut self, origin: u32, epoch: u64, fresh: Fresh) {
        // What has no room is left to comparison.
        if self.fresh.len() < self.limits.robots.saturating_mul(self.limits.lives) {
            self.fresh.entry((origin, epoch)).or_insert(fresh);
        }
    }

    /// Tells nobody what was new until now.
    pub fn forget_fresh(&mut self) {
        self.fresh.clear();
    }

    /// The memory of messages, bytes.
    pub fn bytes(&self) -> usize {
        self.outgoing.iter().map(|message| message.bytes.len()).sum()
    }

    /// Compares what is known with some neighbours.
    pub fn compare(&mut self, held: &HeldLives) {
        let (digest, next) = self.digest(held, self.cursor);
        self.cursor = next;
        for to in self.some_neighbours(COMPARED) {
            self.send(to, digest.clone());
        }
    }

    /// The next message to send, as long as there are any.
    pub fn next(&mut self, held: &HeldLives) -> Option<Outgoing> {
        if self.outgoing.is_empty() && !self.fresh.is_empty() {
            self.tell(held);
        }
        self.outgoing.pop_front()
    }

    /// Tells some neighbours what is fresh, as far as it has room in one message; the rest is left to comparison.
    fn tell(&mut self, held: &HeldLives) {
        let fresh = std::mem::take(&mut self.fresh);
        for to in self.some_neighbours(TOLD) {
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

    fn some_neighbours(&mut self, count: usize) -> impl Iterator<Item = u32> + use<> {
        let length = self.neighbours.len();
        let begin = self.random.below(length);
        let (before, after) = self.neighbours.split_at(begin);
        after.iter().chain(before).copied().take(count).collect::<Vec<_>>().into_iter()
    }

    pub fn send(&mut self, to: u32, bytes: Vec<u8>) {
        if self.outgoing.len() < self.limits.outgoing {
            self.outgoing.push_back(Outgoing { to, bytes });
        } else {
            self.dropped += 1;
        }
    }

    /// All that is known of the origins from that one on, as far as it has room; and where the next digest begins.
    pub fn digest(&self, held: &HeldLives, first: u32) -> (Vec<u8>, u32) {
        let mut claims = WireWriter::new(&[]);
        // What the header may take.
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

    /// Writes what is newer than the offer says; false when not all of it had room.
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

    /// Asks for what is newer than the claims.
    pub fn request(&mut self, to: u32, wants: Vec<Claim>) {
        if wants.is_empty() {
            return;
        }
        let mut claims = wants;
        claims.sort_by_key(Claim::place);
        claims.dedup_by_key(|claim| claim.place());
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
