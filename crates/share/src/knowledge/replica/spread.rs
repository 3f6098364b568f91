use super::Replica;
use crate::knowledge::wire::{Claim, Message, Writer, write_section};

/// To how many neighbours a tick compares what is known.
const COMPARED: usize = 2;

/// To how many neighbours fresh facts go at once.
const TOLD: usize = 2;

/// A message to send.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outgoing {
    /// The robot that it is for.
    pub to: u32,
    /// Give them to its [`Replica::receive`].
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
pub(super) struct Offer {
    origin: u32,
    epoch: u64,
    base: u64,
    position: u64,
}

impl Offer {
    pub fn whole(origin: u32, epoch: u64) -> Self {
        Self { origin, epoch, base: 0, position: 0 }
    }

    pub fn beyond(claim: &Claim) -> Self {
        Self { origin: claim.origin, epoch: claim.epoch, base: claim.base, position: claim.position }
    }
}

impl Replica {
    /// Compares what is known with some neighbours. Call it regularly: 5 times a second is usual. The time between two
    /// calls is what the team's clocks, which are not asked, are replaced by.
    pub fn tick(&mut self) {
        self.stages.retain(|_, stage| stage.wait());
        let (digest, next) = self.digest(self.cursor);
        self.cursor = next;
        for to in self.some_neighbours(COMPARED) {
            self.send(to, digest.clone());
        }
    }

    /// A message that says nothing but that a robot is there: the digest of no origins.
    pub fn greeting() -> Vec<u8> {
        Message::digest(1, 0).finish()
    }

    /// The next message to send, as long as there are any.
    pub fn outgoing(&mut self) -> Option<Outgoing> {
        if self.outgoing.is_empty() && !self.fresh.is_empty() {
            self.tell();
        }
        self.outgoing.pop_front()
    }

    /// Tells some neighbours what is fresh, as far as it has room in one message; the rest is left to comparison.
    fn tell(&mut self) {
        let fresh = std::mem::take(&mut self.fresh);
        for to in self.some_neighbours(TOLD) {
            let mut writer = Message::sections();
            for ((origin, epoch), Fresh { after, from }) in &fresh {
                if *from == Some(to) {
                    continue;
                }
                let offer = Offer { origin: *origin, epoch: *epoch, base: *after, position: *after };
                self.write_offer(&mut writer, &offer);
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

    pub(super) fn send(&mut self, to: u32, bytes: Vec<u8>) {
        if self.outgoing.len() < self.limits.outgoing {
            self.outgoing.push_back(Outgoing { to, bytes });
        } else {
            self.counters.dropped += 1;
        }
    }

    /// All that is known of the origins from that one on, as far as it has room; and where the next digest begins.
    pub(super) fn digest(&self, first: u32) -> (Vec<u8>, u32) {
        let mut claims = Writer::new(&[]);
        // What the header may take.
        let limit = self.limits.message - 16;
        let mut last = u32::MAX;
        let (mut origin, mut begin) = (first, 0);
        for claim in self.claims(first) {
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

    /// What is held or being received, from that origin on.
    fn claims(&self, first: u32) -> Vec<Claim> {
        let mut claims: Vec<Claim> = (self.origins.range(first..))
            .flat_map(|(origin, held)| {
                let lives = held.lives.iter();
                lives.map(|life| Claim::known(*origin, life.epoch, life.version))
            })
            .collect();
        if !self.stages.is_empty() {
            claims.retain(|claim| !self.stages.contains_key(&(claim.origin, claim.epoch)));
            let staged = self.stages.keys().filter(|(origin, _)| *origin >= first);
            claims.extend(staged.map(|(origin, epoch)| self.claim(*origin, *epoch)));
            claims.sort_by_key(Claim::place);
        }
        claims
    }

    /// Sends as much of the offers as fits into one message.
    pub(super) fn answer(&mut self, to: u32, mut offers: Vec<Offer>) {
        if offers.is_empty() {
            return;
        }
        // Each gets its turn to be the first, also when the other robot can't take some of them.
        let first = self.random.below(offers.len());
        offers.rotate_left(first);
        let mut writer = Message::sections();
        let more = offers.iter().fold(false, |more, offer| more | !self.write_offer(&mut writer, offer));
        if !writer.is_empty() {
            let mut bytes = writer.finish();
            if more {
                Message::set_more(&mut bytes);
            }
            self.send(to, bytes);
        }
    }

    /// Writes what is newer than the offer says; false when not all of it had room.
    fn write_offer(&self, writer: &mut Writer, offer: &Offer) -> bool {
        let life = self.origins.get(&offer.origin).and_then(|origin| origin.life(offer.epoch));
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
    pub(super) fn request(&mut self, to: u32, wants: Vec<Claim>) {
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
