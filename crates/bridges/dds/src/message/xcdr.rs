//! Encoding of numbers and texts: XCDR of both versions (DDS-XTypes 1.3, 7.4).

use slate_blackboard::interface::Primitive;

/// Bytes of the header before a message.
pub const HEADER: usize = 4;

/// Encoding of a message, by its header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Encapsulation {
    /// XCDR2 aligns to 4 bytes at most, and has lengths before appendable structs.
    pub is_second: bool,
    pub is_little: bool,
    /// Delimited encoding: the value as a whole is appendable, in XCDR2.
    pub is_delimited: bool,
}

impl Encapsulation {
    /// Returns the encoding of a message, from its header.
    ///
    /// # Errors
    /// The message is too short, or of a mutable type, in words.
    pub fn of(message: &[u8]) -> Result<Self, String> {
        let Some([0, kind, _, _]) = message.get(..HEADER) else {
            return Err("it has no header of CDR".into());
        };
        let is_little = kind % 2 == 1;
        match kind & !1 {
            0 => Ok(Self { is_second: false, is_little, is_delimited: false }),
            6 => Ok(Self { is_second: true, is_little, is_delimited: false }),
            8 => Ok(Self { is_second: true, is_little, is_delimited: true }),
            2 | 10 => Err("its type is mutable, which is not supported".into()),
            _ => Err(format!("its encoding 0x{kind:04x} is neither XCDR1 nor XCDR2")),
        }
    }

    /// Returns its number in a header.
    pub fn identifier(self) -> u8 {
        let kind = match (self.is_second, self.is_delimited) {
            (false, _) => 0,
            (true, false) => 6,
            (true, true) => 8,
        };
        kind + u8::from(self.is_little)
    }

    fn alignment(self, size: usize) -> usize {
        if self.is_second { size.min(4) } else { size }
    }
}

/// Number or truth value, of any size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum XcdrNumber {
    Integer(i128),
    Float(f64),
}

/// Loads the number in the first bytes of memory.
pub fn load(kind: Primitive, memory: &[u8]) -> XcdrNumber {
    use XcdrNumber::{Float, Integer};
    fn first<const N: usize>(memory: &[u8]) -> [u8; N] {
        let mut bytes = [0; N];
        bytes.copy_from_slice(&memory[..N]);
        bytes
    }
    match kind {
        Primitive::Bool | Primitive::U8 => Integer(memory[0].into()),
        Primitive::I8 => Integer(i8::from_ne_bytes(first(memory)).into()),
        Primitive::U16 => Integer(u16::from_ne_bytes(first(memory)).into()),
        Primitive::I16 => Integer(i16::from_ne_bytes(first(memory)).into()),
        Primitive::U32 => Integer(u32::from_ne_bytes(first(memory)).into()),
        Primitive::I32 => Integer(i32::from_ne_bytes(first(memory)).into()),
        Primitive::U64 => Integer(u64::from_ne_bytes(first(memory)).into()),
        Primitive::I64 => Integer(i64::from_ne_bytes(first(memory)).into()),
        Primitive::F32 => Float(f32::from_ne_bytes(first(memory)).into()),
        Primitive::F64 => Float(f64::from_ne_bytes(first(memory))),
    }
}

/// Puts a number into the first bytes of memory.
///
/// # Errors
/// It does not fit, in words.
pub fn store(kind: Primitive, number: XcdrNumber, memory: &mut [u8]) -> Result<(), String> {
    let wrong = || format!("{number:?} does not fit a {}", kind.name());
    let out = &mut memory[..kind.size()];
    match (number, kind) {
        (XcdrNumber::Integer(number), Primitive::Bool) => out[0] = u8::from(number != 0),
        (XcdrNumber::Float(number), Primitive::F32) => out.copy_from_slice(&(number as f32).to_ne_bytes()),
        (XcdrNumber::Float(number), Primitive::F64) => out.copy_from_slice(&number.to_ne_bytes()),
        (XcdrNumber::Integer(number), _) => {
            if !kind.integers().is_some_and(|range| range.contains(&number)) {
                return Err(wrong());
            }
            // In range, so the lowest bytes are the number.
            out.copy_from_slice(&number.to_le_bytes()[..kind.size()]);
            if cfg!(target_endian = "big") {
                out.reverse();
            }
        }
        (XcdrNumber::Float(_), _) => return Err(wrong()),
    }
    Ok(())
}

/// Reads a message.
pub struct XcdrReader<'a> {
    bytes: &'a [u8],
    at: usize,
    end: usize,
    pub encapsulation: Encapsulation,
}

impl<'a> XcdrReader<'a> {
    /// Reads a message with its header.
    pub fn new(message: &'a [u8]) -> Result<Self, String> {
        let encapsulation = Encapsulation::of(message)?;
        let bytes = &message[HEADER..];
        Ok(Self { bytes, at: 0, end: bytes.len(), encapsulation })
    }

    /// Bytes that are left, of the innermost part with a length.
    pub fn left(&self) -> usize {
        self.end - self.at
    }

    /// Checks that so many bytes follow.
    pub fn check(&self, count: usize) -> Result<(), String> {
        match count > self.left() {
            true => Err(format!("{count} bytes should follow, there are {}", self.left())),
            false => Ok(()),
        }
    }

    fn raw(&mut self, count: usize) -> Result<&'a [u8], String> {
        self.check(count)?;
        let raw = &self.bytes[self.at..self.at + count];
        self.at += count;
        Ok(raw)
    }

    fn align(&mut self, size: usize) {
        let aligned = self.at.next_multiple_of(self.encapsulation.alignment(size));
        self.at = aligned.min(self.end);
    }

    /// Fills memory with numbers of a size.
    pub fn numbers(&mut self, memory: &mut [u8], size: usize) -> Result<(), String> {
        if memory.is_empty() {
            return Ok(());
        }
        self.align(size);
        memory.copy_from_slice(self.raw(memory.len())?);
        if self.encapsulation.is_little != cfg!(target_endian = "little") {
            memory.chunks_exact_mut(size).for_each(<[u8]>::reverse);
        }
        Ok(())
    }

    /// Goes past numbers.
    pub fn skip(&mut self, count: usize, size: usize) -> Result<(), String> {
        if count > 0 {
            self.align(size);
            self.raw(count.saturating_mul(size))?;
        }
        Ok(())
    }

    pub fn number(&mut self, kind: Primitive) -> Result<XcdrNumber, String> {
        let mut memory = [0; 8];
        self.numbers(&mut memory[..kind.size()], kind.size())?;
        Ok(load(kind, &memory))
    }

    /// Reads a length or a count of items with at least a byte each.
    pub fn length(&mut self) -> Result<usize, String> {
        let mut memory = [0; 4];
        self.numbers(&mut memory, 4)?;
        let length = u32::from_ne_bytes(memory) as usize;
        match length <= self.left() {
            true => Ok(length),
            false => Err(format!("{length} items or bytes should follow, there are {} bytes", self.left())),
        }
    }

    pub fn text(&mut self) -> Result<&'a str, String> {
        let length = self.length()?;
        let bytes = self.raw(length)?;
        // Some write an empty text without the zero at its end.
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        std::str::from_utf8(bytes).map_err(|_| "a text is not UTF-8".into())
    }

    /// Begins a part that has its length before it; returns the end of the outer part.
    pub fn begin(&mut self) -> Result<usize, String> {
        let length = self.length()?;
        Ok(std::mem::replace(&mut self.end, self.at + length))
    }

    /// Ends the part, and skips the rest of it.
    pub fn finish(&mut self, around: usize) {
        self.at = self.end;
        self.end = around;
    }
}

/// Writes a message, little end first.
pub struct XcdrWriter<'a> {
    out: &'a mut Vec<u8>,
    /// Start of the message, after its header.
    start: usize,
    pub encapsulation: Encapsulation,
}

impl<'a> XcdrWriter<'a> {
    /// Appends a message with its header.
    pub fn new(out: &'a mut Vec<u8>, encapsulation: Encapsulation) -> Self {
        out.extend([0, encapsulation.identifier(), 0, 0]);
        let start = out.len();
        Self { out, start, encapsulation }
    }

    fn align(&mut self, size: usize) {
        let length = self.out.len() - self.start;
        let aligned = length.next_multiple_of(self.encapsulation.alignment(size));
        self.out.resize(self.start + aligned, 0);
    }

    /// Appends numbers of a size from memory.
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

    pub fn length(&mut self, length: usize) -> Result<(), String> {
        let length = u32::try_from(length).map_err(|_| "a message has at most 4 GiB".to_owned())?;
        self.numbers(&length.to_ne_bytes(), 4);
        Ok(())
    }

    pub fn text(&mut self, text: &str) -> Result<(), String> {
        self.length(text.len() + 1)?;
        self.out.extend_from_slice(text.as_bytes());
        self.out.push(0);
        Ok(())
    }

    /// Begins a part that has its length before it; returns where that is.
    pub fn begin(&mut self) -> usize {
        self.numbers(&[0; 4], 4);
        self.out.len()
    }

    /// Ends it.
    pub fn finish(&mut self, begun: usize) -> Result<(), String> {
        let length = u32::try_from(self.out.len() - begun);
        let length = length.map_err(|_| "a message has at most 4 GiB".to_owned())?;
        self.out[begun - 4..begun].copy_from_slice(&length.to_le_bytes());
        Ok(())
    }
}
