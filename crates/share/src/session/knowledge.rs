//! Messages of the team's knowledge between two agents: best effort, cut into pieces, behind everything else. What is
//! lost or has no room is made good by later ones.

use std::collections::VecDeque;

use super::wire::{FRAGMENT_HEAD, KnowledgePiece, PacketFrame, RawBytes, append};

/// The longest message, bytes.
pub const LONGEST: usize = 64 << 10;

/// Bytes of messages that wait to be sent.
const WAITING: usize = 512 << 10;

/// A smaller room at the end of a packet is not worth a piece of its own, bytes.
const SMALLEST: usize = 512;

/// What waits to be sent, and what is being put together.
#[derive(Debug, Default)]
pub(super) struct Knowledge {
    waiting: VecDeque<Vec<u8>>,
    bytes: usize,
    /// How much of the first message that waits is sent, and its number.
    sent: usize,
    number: u32,
    /// The message that is being received: its number, and its pieces so far.
    partial: Option<(u32, Vec<u8>)>,
}

impl Knowledge {
    /// Lets a message wait; false when there is no room.
    pub fn push(&mut self, message: &[u8]) -> bool {
        let has_room = message.len() <= LONGEST && self.bytes + message.len() <= WAITING;
        if has_room {
            self.bytes += message.len();
            self.waiting.push_back(message.to_vec());
        }
        has_room
    }

    /// Whether something waits to be sent.
    pub fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Fills what is left of a packet.
    pub fn append(&mut self, largest: usize, packet: &mut Vec<u8>) {
        while let Some(message) = self.waiting.front() {
            let room = largest.saturating_sub(packet.len() + FRAGMENT_HEAD);
            let left = message.len() - self.sent;
            if room < left.min(SMALLEST) {
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

    /// Takes a piece; a message comes out with its last one, unless a piece of it was lost. Nothing at all when the
    /// piece makes no sense.
    pub fn receive(&mut self, piece: &KnowledgePiece<'_>) -> Option<Option<Vec<u8>>> {
        let at = piece.at as usize;
        let end = at.checked_add(piece.bytes.0.len()).filter(|end| *end <= LONGEST)?;
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
