//! Selection and timing of outgoing packets.

use super::event::Application;
use super::outbound::Outbound;
use super::wire::{
    Fragment, HEAD_SIZE, Hello, MAX_FRAGMENT_HEAD_SIZE, PacketFrame, SAMPLE_HEAD_SIZE, append,
};
use super::{GREETING_PERIOD, INITIAL_BEAT_PERIOD, Session};

/// Largest frame other than a fragment, bytes: a report with all its ranges.
const MAX_FRAME_SIZE: usize = 700;

/// Lower bound of the packet size, bytes.
/// Small control messages fill a packet together, so an item is not cut smaller.
const MIN_PACKET_SIZE: usize = 1024;

impl Session {
    /// Writes the next packet, of at most `largest` bytes (at least 1024).
    /// Returns false if nothing is to be sent.
    pub fn outgoing(
        &mut self,
        now: u64,
        largest: usize,
        packet: &mut Vec<u8>,
        application: &mut dyn Application,
    ) -> bool {
        if let Some(refusal) = self.refusal.take() {
            *packet = refusal;
            return self.count(packet);
        }
        let largest = largest.max(MIN_PACKET_SIZE);
        self.connection.head().begin(packet);
        if !self.connection.established {
            if now < self.connection.greet_at {
                return false;
            }
            self.connection.greet_at = now + GREETING_PERIOD;
            let own = &self.connection.own;
            let hello = Hello { agent: &own.agent, instance: own.instance, attempt: self.connection.attempt };
            append(&PacketFrame::Hello(hello), packet);
            return self.count(packet);
        }
        if self.owes_beat || now >= self.beat_at {
            self.owes_beat = false;
            let quick = !self.clock.is_settled();
            self.beat_at = now
                + if quick { INITIAL_BEAT_PERIOD.min(self.limits.heartbeat) } else { self.limits.heartbeat };
            append(&PacketFrame::Beat(self.clock.beat(now)), packet);
        }
        self.append_reports(now, largest, packet);
        self.append_announcements(now, largest, packet);
        self.append_control(now, largest, packet);
        self.append_values(now, largest, packet, application);
        self.knowledge.append(largest, packet);
        packet.len() > HEAD_SIZE && self.count(packet)
    }

    fn count(&mut self, packet: &[u8]) -> bool {
        self.counters.packets_sent += 1;
        self.counters.bytes_sent += packet.len() as u64;
        true
    }

    /// Returns the time of the next action, as far as it depends on time alone.
    pub fn deadline(&self, now: u64, application: &mut dyn Application) -> u64 {
        if self.refusal.is_some() {
            return now;
        }
        if !self.connection.established {
            return self.connection.greet_at;
        }
        let lost_at = self.connection.last_received.saturating_add(self.limits.silence + 1);
        let mut next = self.beat_at.min(lost_at);
        let mut sooner = |at: Option<u64>| next = at.map_or(next, |at| next.min(at));
        sooner((self.owes_beat || self.knowledge.is_waiting()).then_some(now));
        sooner(self.control_in.report_at(now));
        sooner(self.control_out.announce_at());
        sooner((self.control_out.has_fragment() || self.has_control()).then_some(now));
        for reading in self.readings.values() {
            sooner(reading.stream.report_at(now));
        }
        for (id, serving) in &self.servings {
            sooner(serving.stream.announce_at());
            sooner(serving.stream.has_fragment().then_some(now));
            if let Some(due) = serving.due()
                && application.has_update(*id)
            {
                sooner(Some(due));
            }
        }
        next
    }

    /// Returns whether a waiting control message can enter its stream.
    fn has_control(&self) -> bool {
        !self.control_queue.is_empty() && self.control_out.is_ready()
    }

    fn append_reports(&mut self, now: u64, largest: usize, packet: &mut Vec<u8>) {
        let streams = self.readings.iter_mut().map(|(id, reading)| (*id, &mut reading.stream));
        for (id, stream) in [(0, &mut self.control_in)].into_iter().chain(streams) {
            if packet.len() + MAX_FRAME_SIZE > largest {
                return;
            }
            if stream.report_at(now).is_some_and(|at| at <= now) {
                append(&PacketFrame::StreamReport(stream.report(id, now)), packet);
            }
        }
    }

    fn append_announcements(&mut self, now: u64, largest: usize, packet: &mut Vec<u8>) {
        let streams = self.servings.iter_mut().map(|(id, serving)| (*id, serving.epoch, &mut serving.stream));
        for (id, epoch, stream) in [(0, 0, &mut self.control_out)].into_iter().chain(streams) {
            if packet.len() + MAX_FRAME_SIZE > largest {
                return;
            }
            if stream.announce_at().is_some_and(|at| at <= now) {
                append(&PacketFrame::Announcement(stream.announcement(id, epoch, now)), packet);
            }
        }
    }

    fn append_control(&mut self, now: u64, largest: usize, packet: &mut Vec<u8>) {
        loop {
            if !append_fragments(&mut self.control_out, 0, now, largest, packet) {
                return;
            }
            if !self.control_out.is_ready() {
                return;
            }
            let Some(item) = self.control_queue.pop_front() else { return };
            self.control_queue_bytes -= item.len();
            self.control_out.push(item, largest - HEAD_SIZE - MAX_FRAGMENT_HEAD_SIZE);
        }
    }

    /// Appends a value of each due subscription.
    /// Begins with the one that did not fit into the last packet.
    fn append_values(
        &mut self,
        now: u64,
        largest: usize,
        packet: &mut Vec<u8>,
        application: &mut dyn Application,
    ) {
        let first = self.cursor;
        let mut more = true;
        while more {
            more = false;
            let order = |rest: bool| if rest { 0..first } else { first..u32::MAX };
            for range in [order(false), order(true)] {
                for (id, serving) in self.servings.range_mut(range) {
                    if !append_fragments(&mut serving.stream, *id, now, largest, packet) {
                        self.cursor = *id;
                        return;
                    }
                    if serving.due().is_none_or(|due| due > now) {
                        continue;
                    }
                    if !application.has_update(*id) {
                        serving.note_empty(now);
                        continue;
                    }
                    let mut item = vec![0; SAMPLE_HEAD_SIZE];
                    let Some(sample) = application.take(*id, &mut item) else { continue };
                    sample.write(serving.epoch, &mut item[..SAMPLE_HEAD_SIZE]);
                    serving.stream.sequence = sample.stamp.sequence;
                    serving.note_value(now);
                    serving.stream.push(item, largest - HEAD_SIZE - MAX_FRAGMENT_HEAD_SIZE);
                    more = true;
                    if !append_fragments(&mut serving.stream, *id, now, largest, packet) {
                        self.cursor = *id;
                        return;
                    }
                }
            }
        }
    }
}

/// Appends fragments of a stream; returns whether all fitted.
fn append_fragments(stream: &mut Outbound, id: u32, now: u64, largest: usize, packet: &mut Vec<u8>) -> bool {
    while stream.has_fragment() {
        if packet.len() + MAX_FRAGMENT_HEAD_SIZE + stream.next_length() > largest {
            return false;
        }
        let Some((number, part)) = stream.pop(now) else { return true };
        let bytes = super::wire::RawBytes(part.bytes());
        let (index, count) = (part.index, part.count);
        append(&PacketFrame::Fragment(Fragment { stream: id, number, index, count, bytes }), packet);
    }
    true
}
