use crate::knowledge::MessageError;

/// Bounds-checked reader from the front of bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WireReader<'a> {
    rest: &'a [u8],
    length: usize,
}

impl<'a> WireReader<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, length: bytes.len() }
    }

    pub fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    /// Returns the error of unexpected content at this position.
    pub fn expected(&self, expected: &'static str) -> MessageError {
        MessageError { at: self.length - self.rest.len(), length: self.length, expected }
    }

    pub fn bytes(&mut self, length: usize) -> Result<&'a [u8], MessageError> {
        let (bytes, rest) =
            self.rest.split_at_checked(length).ok_or_else(|| self.expected("as many bytes as its length"))?;
        self.rest = rest;
        Ok(bytes)
    }

    pub fn byte(&mut self) -> Result<u8, MessageError> {
        let (byte, rest) = self.rest.split_first().ok_or_else(|| self.expected("another byte"))?;
        self.rest = rest;
        Ok(*byte)
    }

    pub fn flag(&mut self) -> Result<bool, MessageError> {
        match self.byte()? {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(self.expected("0 or 1")),
        }
    }

    pub fn fixed<const N: usize>(&mut self) -> Result<[u8; N], MessageError> {
        let (bytes, rest) = self.rest.split_first_chunk().ok_or_else(|| self.expected("a number"))?;
        self.rest = rest;
        Ok(*bytes)
    }

    pub fn number(&mut self) -> Result<u64, MessageError> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            let part = u64::from(byte & 0x7f);
            if shift == 63 && part > 1 {
                break;
            }
            number |= part << shift;
            if byte & 0x80 == 0 {
                return Ok(number);
            }
        }
        Err(self.expected("a number of 64 bits"))
    }

    pub fn small(&mut self) -> Result<u32, MessageError> {
        let number = self.number()?;
        u32::try_from(number).map_err(|_| self.expected("a number of 32 bits"))
    }

    /// Reads a length within a limit.
    pub fn length(&mut self, limit: usize) -> Result<usize, MessageError> {
        let length = self.number()?;
        (usize::try_from(length).ok().filter(|length| *length <= limit))
            .ok_or_else(|| self.expected("a length within the limits"))
    }

    /// Returns the bytes between here and a later reader of the same bytes.
    pub fn until(&self, later: &WireReader<'a>) -> WireReader<'a> {
        let length = self.rest.len() - later.rest.len();
        Self { rest: self.rest.get(..length).unwrap_or_default(), length }
    }
}
