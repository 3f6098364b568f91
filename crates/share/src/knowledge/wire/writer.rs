/// Writer of a message.
#[derive(Clone, Debug)]
pub(crate) struct WireWriter {
    bytes: Vec<u8>,
    header: usize,
}

/// Returns the encoded length of a number, bytes.
pub(crate) fn number_length(number: u64) -> usize {
    // A zero takes one byte as well.
    (70 - (number | 1).leading_zeros() as usize) / 7
}

impl WireWriter {
    pub fn new(header: &[u8]) -> Self {
        // Most messages have a fact or two.
        let mut bytes = Vec::with_capacity(128);
        bytes.extend_from_slice(header);
        Self { bytes, header: header.len() }
    }

    pub fn length(&self) -> usize {
        self.bytes.len()
    }

    /// Returns whether nothing follows the header.
    pub fn is_empty(&self) -> bool {
        self.bytes.len() == self.header
    }

    pub fn finish(self) -> Vec<u8> {
        self.bytes
    }

    /// Truncates the message to that length.
    pub fn cut(&mut self, length: usize) {
        self.bytes.truncate(length);
    }

    pub fn byte(&mut self, byte: u8) {
        self.bytes.push(byte);
    }

    pub fn bytes(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    pub fn number(&mut self, mut number: u64) {
        while number >= 0x80 {
            self.bytes.push(number as u8 | 0x80);
            number >>= 7;
        }
        self.bytes.push(number as u8);
    }
}
