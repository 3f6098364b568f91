/// Makes a message.
#[derive(Clone, Debug)]
pub(crate) struct WireWriter {
    bytes: Vec<u8>,
    header: usize,
}

/// How many bytes a number takes.
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

    /// Whether nothing was written after the header.
    pub fn is_empty(&self) -> bool {
        self.bytes.len() == self.header
    }

    pub fn finish(self) -> Vec<u8> {
        self.bytes
    }

    /// Takes back what was written beyond that length.
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
