use std::fmt;

use super::Kind;

/// A type that fields of an interface can have.
///
/// # Safety
/// `repr(C)` or primitive, no pointers, every bit pattern valid, laid out as [`KIND`](Plain::KIND) says; padding only in
/// nested interfaces.
pub unsafe trait Plain: Copy + Send + Sync + 'static {
    /// Kind of the memory's content.
    const KIND: Kind;
}

macro_rules! primitive {
    ($($type:ty => $kind:ident),* $(,)?) => { $(
        // SAFETY: a primitive number has neither padding nor invalid bit patterns.
        unsafe impl Plain for $type { const KIND: Kind = Kind::$kind; }
    )* };
}
primitive!(u8 => U8, u16 => U16, u32 => U32, u64 => U64, i8 => I8, i16 => I16, i32 => I32, i64 => I64, f32 => F32, f64 => F64);

// SAFETY: an array lays its items out one after the other.
unsafe impl<T: Plain, const N: usize> Plain for [T; N] {
    const KIND: Kind = Kind::Array(&T::KIND, N);
}

/// Boolean that accepts every byte: 0 is false, anything else true.
#[repr(transparent)]
#[derive(Clone, Copy, Default)]
pub struct Bool(u8);

impl Bool {
    /// False.
    pub const FALSE: Self = Self(0);
    /// True.
    pub const TRUE: Self = Self(1);

    /// Returns the boolean.
    pub const fn get(self) -> bool {
        self.0 != 0
    }
}

impl From<bool> for Bool {
    fn from(value: bool) -> Self {
        Self(value.into())
    }
}

impl From<Bool> for bool {
    fn from(value: Bool) -> Self {
        value.get()
    }
}

impl PartialEq for Bool {
    fn eq(&self, other: &Self) -> bool {
        self.get() == other.get()
    }
}

impl Eq for Bool {}

impl fmt::Debug for Bool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.get().fmt(f)
    }
}

// SAFETY: one byte, of which every value is valid.
unsafe impl Plain for Bool {
    const KIND: Kind = Kind::Bool;
}

/// UTF-8 text of at most `N` bytes (a multiple of 4), stored in place.
/// It is checked when it is read.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Text<const N: usize> {
    length: u32,
    bytes: [u8; N],
}

impl<const N: usize> Text<N> {
    const NO_PADDING: () = assert!(N.is_multiple_of(4), "the capacity of a Text is a multiple of 4 bytes");

    /// Stores as much of `text` as fits, cut at a character.
    pub fn new(text: &str) -> Self {
        const { Self::NO_PADDING };
        let mut end = text.len().min(N);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let mut bytes = [0; N];
        bytes[..end].copy_from_slice(&text.as_bytes()[..end]);
        Self { length: end as u32, bytes }
    }

    /// Returns the text without invalid UTF-8, which a damaged value may have.
    pub fn as_str(&self) -> &str {
        let bytes = &self.bytes[..(self.length as usize).min(N)];
        match std::str::from_utf8(bytes) {
            Ok(text) => text,
            // The prefix up to the first bad byte is valid by the error's contract.
            Err(error) => std::str::from_utf8(&bytes[..error.valid_up_to()]).unwrap_or_default(),
        }
    }
}

/// Appends as much as fits, cut at a character.
impl<const N: usize> fmt::Write for Text<N> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let length = self.as_str().len();
        let mut end = text.len().min(N - length);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        self.bytes[length..length + end].copy_from_slice(&text.as_bytes()[..end]);
        self.length = (length + end) as u32;
        Ok(())
    }
}

impl<const N: usize> Default for Text<N> {
    fn default() -> Self {
        Self::new("")
    }
}

impl<const N: usize> From<&str> for Text<N> {
    fn from(text: &str) -> Self {
        Self::new(text)
    }
}

impl<const N: usize> PartialEq for Text<N> {
    fn eq(&self, other: &Self) -> bool {
        self.as_str() == other.as_str()
    }
}

impl<const N: usize> Eq for Text<N> {}

impl<const N: usize> fmt::Debug for Text<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.as_str().fmt(f)
    }
}

impl<const N: usize> fmt::Display for Text<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

// SAFETY: a length and bytes without padding, as `N` is a multiple of 4; a length beyond `N` is clamped on reading.
unsafe impl<const N: usize> Plain for Text<N> {
    const KIND: Kind = {
        let () = Self::NO_PADDING;
        Kind::Text(N)
    };
}

/// At most `N` items, stored in place.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Sequence<T, const N: usize> {
    length: u32,
    reserved: u32,
    items: [T; N],
}

impl<T: Plain + Default, const N: usize> Sequence<T, N> {
    /// Stores as many of `items` as fit.
    pub fn new(items: &[T]) -> Self {
        const { assert!(size_of::<Self>() == 8 + N * size_of::<T>(), "a Sequence must not have padding") };
        let length = items.len().min(N);
        let mut all = [T::default(); N];
        all[..length].copy_from_slice(&items[..length]);
        Self { length: length as u32, reserved: 0, items: all }
    }
}

impl<T: Plain, const N: usize> std::ops::Deref for Sequence<T, N> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.items[..(self.length as usize).min(N)]
    }
}

impl<T: Plain + Default, const N: usize> Default for Sequence<T, N> {
    fn default() -> Self {
        Self::new(&[])
    }
}

impl<T: Plain + PartialEq, const N: usize> PartialEq for Sequence<T, N> {
    fn eq(&self, other: &Self) -> bool {
        self[..] == other[..]
    }
}

impl<T: Plain + fmt::Debug, const N: usize> fmt::Debug for Sequence<T, N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self[..].fmt(f)
    }
}

// SAFETY: two lengths and plain items; `new` asserts that nothing pads them, and no value exists without it.
unsafe impl<T: Plain, const N: usize> Plain for Sequence<T, N> {
    const KIND: Kind = {
        assert!(size_of::<Self>() == 8 + N * size_of::<T>(), "a Sequence must not have padding");
        Kind::Sequence(&T::KIND, N)
    };
}

/// A value that may be missing: a flag and the value.
#[repr(C)]
#[derive(Clone, Copy, Default)]
pub struct Optional<T> {
    present: u32,
    reserved: u32,
    value: T,
}

impl<T: Plain + Default> Optional<T> {
    /// Returns an absent value.
    pub fn none() -> Self {
        const { assert!(size_of::<Self>() == 8 + size_of::<T>(), "an Optional must not have padding") };
        Self { present: 0, reserved: 0, value: T::default() }
    }

    /// Returns a present value.
    pub fn some(value: T) -> Self {
        const { assert!(size_of::<Self>() == 8 + size_of::<T>(), "an Optional must not have padding") };
        Self { present: 1, reserved: 0, value }
    }
}

impl<T: Plain> Optional<T> {
    /// Returns the value, if it is present.
    pub fn get(&self) -> Option<&T> {
        (self.present != 0).then_some(&self.value)
    }
}

impl<T: Plain + fmt::Debug> fmt::Debug for Optional<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.get().fmt(f)
    }
}

impl<T: Plain + PartialEq> PartialEq for Optional<T> {
    fn eq(&self, other: &Self) -> bool {
        self.get() == other.get()
    }
}

// SAFETY: a flag and a plain value, without padding as the constructors assert.
unsafe impl<T: Plain> Plain for Optional<T> {
    const KIND: Kind = {
        assert!(size_of::<Self>() == 8 + size_of::<T>(), "an Optional must not have padding");
        Kind::Optional(&T::KIND)
    };
}
