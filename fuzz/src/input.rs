//! Fuzzer input as a script: parts of any length, all valid.

/// Rest of a script.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a>(pub &'a [u8]);

impl<'a> Input<'a> {
    /// A byte; 0 at the end.
    pub fn byte(&mut self) -> u8 {
        self.part(1).first().copied().unwrap_or_default()
    }

    /// A number of 16 bits, little end first.
    pub fn short(&mut self) -> u16 {
        u16::from(self.byte()) | u16::from(self.byte()) << 8
    }

    /// A number of 32 bits, little end first.
    pub fn word(&mut self) -> u32 {
        u32::from(self.short()) | u32::from(self.short()) << 16
    }

    /// Returns that many bytes, or fewer at the end.
    pub fn part(&mut self, length: usize) -> &'a [u8] {
        let (part, rest) = self.0.split_at(length.min(self.0.len()));
        self.0 = rest;
        part
    }

    /// Bytes whose length stands before them.
    pub fn counted(&mut self) -> &'a [u8] {
        let length = self.short();
        self.part(length.into())
    }

    /// Returns whether the script is at its end.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// Appends bytes with their length, as [`Input::counted`] reads them.
///
/// # Panics
/// When there are too many.
pub fn append_counted(bytes: &[u8], script: &mut Vec<u8>) {
    let length = u16::try_from(bytes.len()).expect("a script has short parts");
    script.extend(length.to_le_bytes());
    script.extend(bytes);
}
