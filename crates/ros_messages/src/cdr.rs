use super::Error;

/// Length of the encapsulation header of CDR, bytes.
/// Alignment counts from behind it.
const HEADER: usize = 4;

/// Layout of values in messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WireFormat {
    /// Layout of ROS 2: plain CDR (XCDR version 1) with its header.
    /// Numbers are aligned, texts end with a zero.
    Cdr,
    /// Layout of ROS 1: little-endian, without header, alignment or ends of texts.
    Ros1,
}

/// Appends a little-endian message.
pub struct CdrWriter<'a> {
    out: &'a mut Vec<u8>,
    origin: usize,
    format: WireFormat,
}

impl<'a> CdrWriter<'a> {
    /// A message in CDR at the end of `out`.
    pub fn new(out: &'a mut Vec<u8>) -> Self {
        Self::of(WireFormat::Cdr, out)
    }

    /// A message at the end of `out`.
    pub fn of(format: WireFormat, out: &'a mut Vec<u8>) -> Self {
        if format == WireFormat::Cdr {
            out.extend_from_slice(&[0, 1, 0, 0]);
        }
        Self { origin: out.len(), out, format }
    }

    /// Returns the number of bytes behind the header.
    pub fn written(&self) -> usize {
        self.out.len() - self.origin
    }

    fn align(&mut self, size: usize) {
        if self.format == WireFormat::Ros1 {
            return;
        }
        let padded = self.written().next_multiple_of(size);
        self.out.resize(self.origin + padded, 0);
    }

    /// Writes one byte.
    pub fn byte(&mut self, byte: u8) {
        self.out.push(byte);
    }

    /// Writes a message without fields: ROS 2 needs a byte.
    pub fn empty(&mut self) {
        if self.format == WireFormat::Cdr {
            self.byte(0);
        }
    }

    /// Writes bytes unchanged.
    pub fn raw(&mut self, bytes: &[u8]) {
        self.out.extend_from_slice(bytes);
    }

    /// Writes numbers of `size` bytes each from their memory.
    pub fn numbers(&mut self, memory: &[u8], size: usize) {
        if memory.is_empty() {
            return;
        }
        self.align(size);
        let start = self.out.len();
        self.out.extend_from_slice(memory);
        if cfg!(target_endian = "big") {
            self.out[start..].chunks_exact_mut(size).for_each(<[u8]>::reverse);
        }
    }

    /// Numbers of `size` bytes each, little end first.
    pub fn little(&mut self, bytes: &[u8], size: usize) {
        if !bytes.is_empty() {
            self.align(size);
            self.raw(bytes);
        }
    }

    /// Writes `count` numbers of `size` bytes each, all zero.
    pub fn zeros(&mut self, count: usize, size: usize) {
        if count > 0 {
            self.align(size);
            self.out.resize(self.out.len() + count * size, 0);
        }
    }

    /// Writes the number of what follows.
    pub fn length(&mut self, length: u32) {
        self.numbers(&length.to_ne_bytes(), 4);
    }

    /// Writes a text with its length.
    ///
    /// # Errors
    ///
    /// When it is longer than a message can say.
    pub fn text(&mut self, text: &str) -> Result<(), Error> {
        self.joined(&[text])
    }

    /// Writes a text made of several parts.
    ///
    /// # Errors
    ///
    /// When it is longer than a message can say.
    pub fn joined(&mut self, parts: &[&str]) -> Result<(), Error> {
        self.begin_text(parts.iter().map(|part| part.len()).sum())?;
        parts.iter().for_each(|part| self.raw(part.as_bytes()));
        self.end_text();
        Ok(())
    }

    /// Writes the length of a text, which precedes its bytes.
    ///
    /// # Errors
    ///
    /// When it is longer than a message can say.
    pub fn begin_text(&mut self, length: usize) -> Result<(), Error> {
        self.length(wire_length(length + self.end_of_text().len())?);
        Ok(())
    }

    /// Writes the end of a text.
    pub fn end_text(&mut self) {
        self.raw(self.end_of_text());
    }

    fn end_of_text(&self) -> &'static [u8] {
        if self.format == WireFormat::Cdr { &[0] } else { &[] }
    }
}

/// Converts a length to the 32 bits of messages.
pub(super) fn wire_length(length: usize) -> Result<u32, Error> {
    u32::try_from(length).map_err(|_| Error::Message {
        at: 0,
        reason: format!("{length} items are more than a message can have"),
    })
}

/// Reads a message; CDR of either byte order.
pub(super) struct CdrReader<'a> {
    bytes: &'a [u8],
    at: usize,
    swapped: bool,
    format: WireFormat,
}

impl<'a> CdrReader<'a> {
    pub fn of(format: WireFormat, bytes: &'a [u8]) -> Result<Self, Error> {
        match format {
            WireFormat::Cdr => Self::new(bytes),
            WireFormat::Ros1 => Ok(Self { bytes, at: 0, swapped: cfg!(target_endian = "big"), format }),
        }
    }

    pub fn new(bytes: &'a [u8]) -> Result<Self, Error> {
        let wrong = |reason: String| Error::Message { at: 0, reason };
        let Some(header) = bytes.first_chunk::<HEADER>() else {
            return Err(wrong(format!("it has {} bytes, too few for the header of CDR", bytes.len())));
        };
        let big = match header[..2] {
            [0, 0] => true,
            [0, 1] => false,
            [first, second] => {
                let kind = u16::from_be_bytes([first, second]);
                return Err(wrong(format!(
                    "its encoding is {kind:#06x}, expected plain CDR, 0x0000 or 0x0001"
                )));
            }
            _ => return Err(wrong("it has no header".into())),
        };
        let swapped = big != cfg!(target_endian = "big");
        Ok(Self { bytes, at: HEADER, swapped, format: WireFormat::Cdr })
    }

    pub fn error<T>(&self, reason: impl Into<String>) -> Result<T, Error> {
        Err(Error::Message { at: self.at, reason: reason.into() })
    }

    pub fn left(&self) -> usize {
        self.bytes.len().saturating_sub(self.at)
    }

    pub fn raw(&mut self, length: usize) -> Result<&'a [u8], Error> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let Some(found) = rest.get(..length) else {
            return self.error(format!("{length} bytes should follow, there are {}", rest.len()));
        };
        self.at += length;
        Ok(found)
    }

    pub fn byte(&mut self) -> Result<u8, Error> {
        Ok(self.raw(1)?[0])
    }

    /// Reads a message without fields.
    pub fn empty(&mut self) -> Result<(), Error> {
        if self.format == WireFormat::Cdr {
            self.byte()?;
        }
        Ok(())
    }

    pub fn bool(&mut self) -> Result<bool, Error> {
        match self.byte()? {
            0 => Ok(false),
            1 => Ok(true),
            // ROS 1 does not say which bytes are true.
            _ if self.format == WireFormat::Ros1 => Ok(true),
            other => {
                self.at -= 1;
                self.error(format!("a truth value is {other}, not 0 or 1"))
            }
        }
    }

    /// Reads numbers of `size` bytes each into `memory`, in the machine's byte order.
    pub fn numbers(&mut self, memory: &mut [u8], size: usize) -> Result<(), Error> {
        if memory.is_empty() {
            return Ok(());
        }
        self.align(size);
        memory.copy_from_slice(self.raw(memory.len())?);
        if self.swapped && size > 1 {
            memory.chunks_exact_mut(size).for_each(<[u8]>::reverse);
        }
        Ok(())
    }

    /// Reads `count` numbers of `size` bytes each into new memory.
    /// The memory is allocated only if the message has that many.
    pub fn new_numbers(&mut self, count: usize, size: usize) -> Result<Vec<u8>, Error> {
        let bytes = count.checked_mul(size).filter(|bytes| *bytes <= self.left());
        let Some(bytes) = bytes else {
            return self.error(format!("{count} numbers should follow, there are {} bytes", self.left()));
        };
        let mut memory = vec![0; bytes];
        self.numbers(&mut memory, size)?;
        Ok(memory)
    }

    /// Skips `count` numbers of `size` bytes each.
    pub fn skip_numbers(&mut self, count: usize, size: usize) -> Result<(), Error> {
        let bytes = count.checked_mul(size).filter(|bytes| *bytes <= self.left());
        match bytes {
            Some(0) => Ok(()),
            Some(bytes) => {
                self.align(size);
                self.raw(bytes).map(drop)
            }
            None => self.error(format!("{count} numbers should follow, there are {} bytes", self.left())),
        }
    }

    fn align(&mut self, size: usize) {
        if self.format == WireFormat::Ros1 {
            return;
        }
        self.at = HEADER + (self.at - HEADER).next_multiple_of(size);
    }

    fn word(&mut self) -> Result<usize, Error> {
        let mut word = [0; 4];
        self.numbers(&mut word, 4)?;
        Ok(u32::from_ne_bytes(word) as usize)
    }

    /// Reads the length of a sequence, whose items take a byte each at least.
    pub fn length(&mut self) -> Result<usize, Error> {
        let length = self.word()?;
        if length > self.left() {
            return self.error(format!("{length} items should follow, there are {} bytes", self.left()));
        }
        Ok(length)
    }

    pub fn text(&mut self) -> Result<&'a str, Error> {
        let length = self.word()?;
        if self.format == WireFormat::Ros1 {
            let start = self.at;
            let text = std::str::from_utf8(self.raw(length)?);
            return text.map_err(|_| Error::Message { at: start, reason: "a text is not UTF-8".into() });
        }
        // Some write an empty text without the zero at its end.
        let Some(length) = length.checked_sub(1) else { return Ok("") };
        let start = self.at;
        let bytes = self.raw(length)?;
        let end = self.byte()?;
        match std::str::from_utf8(bytes) {
            Ok(text) if end == 0 => Ok(text),
            Ok(_) => Err(Error::Message { at: self.at - 1, reason: "a text has no zero at its end".into() }),
            Err(_) => Err(Error::Message { at: start, reason: "a text is not UTF-8".into() }),
        }
    }

    /// Checks that all has been read, except for the alignment of the next message.
    pub fn end(&self) -> Result<(), Error> {
        let most = if self.format == WireFormat::Cdr { HEADER - 1 } else { 0 };
        if self.left() > most {
            return self.error(format!("{} bytes are left over: it is another message", self.left()));
        }
        Ok(())
    }
}
