//! Best-effort messages of the team's knowledge between two agents.
//! They are cut into pieces and have the lowest priority. Later messages make up for lost and dropped ones.

use std::collections::VecDeque;

use super::wire::{KnowledgePiece, MAX_FRAGMENT_HEAD_SIZE, PacketFrame, RawBytes, append};

/// The longest message, bytes.
pub const MAX_MESSAGE_SIZE: usize = 64 << 10;

/// Largest size of waiting messages, bytes.
const MAX_WAITING_SIZE: usize = 512 << 10;

/// Smallest piece of a message, bytes; less room in a packet stays unused.
const MIN_PIECE_SIZE: usize = 512;

/// Messages that wait to be sent, and the message being assembled.
#[derive(Debug, Default)]
pub(super) struct Knowledge {
    waiting: VecDeque<Vec<u8>>,
    bytes: usize,
    /// Sent bytes of the first waiting message, and its number.
    sent: usize,
    number: u32,
    /// Message being received: its number, and its pieces so far.
    partial: Option<(u32, Vec<u8>)>,
}

impl Knowledge {
    /// Queues a message; false if the queue is full.
    pub fn push(&mut self, message: &[u8]) -> bool {
        let has_room = message.len() <= MAX_MESSAGE_SIZE && self.bytes + message.len() <= MAX_WAITING_SIZE;
        if has_room {
            self.bytes += message.len();
            self.waiting.push_back(message.to_vec());
        }
        has_room
    }

    /// Returns whether a message waits to be sent.
    pub fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Fills the rest of a packet.
    pub fn append(&mut self, largest: usize, packet: &mut Vec<u8>) {
        while let Some(message) = self.waiting.front() {
            let room = largest.saturating_sub(packet.len() + MAX_FRAGMENT_HEAD_SIZE);
            let left = message.len() - self.sent;
            if room < left.min(MIN_PIECE_SIZE) {
                return;
            }
            let end = self.sent + left.min(room);
            let piece = KnowledgePiece {
                number: self.number,
                // The longest message has a length of 32 bits.
                at: self.sent as u32,
                is_last: end == message.len(),
                bytes: RawBytes(&message[self.sent..end]),
            };
            append(&PacketFrame::Knowledge(piece), packet);
            self.sent = end;
            if end == message.len() {
                self.bytes -= message.len();
                self.waiting.pop_front();
                (self.number, self.sent) = (self.number.wrapping_add(1), 0);
            }
        }
    }

    /// Takes a piece; its last one returns the message, unless a piece was lost.
    /// `None` for an invalid piece.
    pub fn receive(&mut self, piece: &KnowledgePiece<'_>) -> Option<Option<Vec<u8>>> {
        let at = piece.at as usize;
        let end = at.checked_add(piece.bytes.0.len()).filter(|end| *end <= MAX_MESSAGE_SIZE)?;
        if at == 0 {
            self.partial = Some((piece.number, Vec::with_capacity(end)));
        }
        let Some((_, partial)) =
            self.partial.as_mut().filter(|(number, partial)| *number == piece.number && partial.len() == at)
        else {
            self.partial = None;
            return Some(None);
        };
        partial.extend(piece.bytes.0);
        let whole = if piece.is_last { self.partial.take() } else { None };
        Some(whole.map(|(_, message)| message))
    }
}
