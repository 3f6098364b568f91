use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::random::Random;

/// Microseconds of virtual time between two ticks of a robot.
pub const ROUND: u64 = 200_000;

/// What happens next, and when.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
pub struct Event {
    pub time: u64,
    /// Keeps the order of events at the same time.
    number: u64,
    pub to: u32,
    pub what: What,
}

#[derive(PartialEq, Eq, PartialOrd, Ord)]
pub enum What {
    Tick,
    Message { from: u32, bytes: Vec<u8> },
}

/// How bad the network is.
#[derive(Clone, Copy)]
pub struct Weather {
    /// Thousandths of messages lost.
    pub loss: u64,
    /// Thousandths of messages that arrive twice.
    pub duplication: u64,
    /// Thousandths of messages that are late by up to three rounds, and so overtaken by others.
    pub delay: u64,
}

/// Which robots know each other, which of them reach each other now, and what is under way.
pub struct Network {
    pub neighbors: Vec<Vec<u32>>,
    /// The part of the partition that each robot is in.
    pub part: Vec<u8>,
    events: BinaryHeap<Reverse<Event>>,
    count: u64,
    pub sent: u64,
    pub bytes: u64,
}

impl Network {
    /// A ring, and so many more acquaintances of each robot.
    pub fn new(robots: u32, more: u32, random: &mut Random) -> Self {
        let mut network = Self {
            neighbors: vec![Vec::new(); robots as usize],
            part: vec![0; robots as usize],
            events: BinaryHeap::new(),
            count: 0,
            sent: 0,
            bytes: 0,
        };
        for robot in 0..robots {
            network.acquaint(robot, (robot + 1) % robots);
            for _ in 0..more {
                network.acquaint(robot, random.below(robots.into()) as u32);
            }
        }
        network
    }

    pub fn acquaint(&mut self, one: u32, other: u32) {
        if one != other && !self.neighbors[one as usize].contains(&other) {
            self.neighbors[one as usize].push(other);
            self.neighbors[other as usize].push(one);
        }
    }

    pub fn reaches(&self, from: u32, to: u32) -> bool {
        self.part[from as usize] == self.part[to as usize]
    }

    pub fn push(&mut self, time: u64, to: u32, what: What) {
        self.count += 1;
        self.events.push(Reverse(Event { time, number: self.count, to, what }));
    }

    pub fn send(
        &mut self,
        now: u64,
        from: u32,
        to: u32,
        bytes: Vec<u8>,
        weather: &Weather,
        random: &mut Random,
    ) {
        self.sent += 1;
        self.bytes += bytes.len() as u64;
        let arrival = |random: &mut Random| {
            let late = if random.chance(weather.delay) { random.below(3 * ROUND) } else { 0 };
            now + 500 + random.below(ROUND / 10) + late
        };
        if random.chance(weather.duplication) {
            let time = arrival(random);
            self.push(time, to, What::Message { from, bytes: bytes.clone() });
        }
        if !random.chance(weather.loss) {
            let time = arrival(random);
            self.push(time, to, What::Message { from, bytes });
        }
    }

    /// The next event before that time.
    pub fn next(&mut self, before: u64) -> Option<Event> {
        if self.events.peek()?.0.time >= before {
            return None;
        }
        self.events.pop().map(|event| event.0)
    }
}
