/// Memory layout of one value: a fixed head, and for big payloads a tail of items.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Bytes of the head.
    pub size: usize,
    /// Alignment of the whole value, at most 16.
    pub align: usize,
    /// Bytes of one tail item; 0 when the type has no tail.
    pub item: usize,
    /// Items that the tail has room for.
    pub capacity: usize,
}

impl Shape {
    /// Creates the layout of a value without a tail.
    pub const fn fixed(size: usize, align: usize) -> Self {
        Self { size, align, item: 0, capacity: 0 }
    }

    /// Returns the size of a value with `items` tail items, bytes.
    /// It is rounded up to the alignment. A size beyond the address space is the largest number, for which no memory
    /// can be allocated.
    #[inline]
    pub const fn bytes(&self, items: usize) -> usize {
        let bytes = self.item.saturating_mul(items).saturating_add(self.size);
        let rounded = if self.align.is_power_of_two() {
            // A division would cost as much as the rest of a read.
            match bytes.checked_add(self.align - 1) {
                Some(bytes) => Some(bytes & !(self.align - 1)),
                None => None,
            }
        } else {
            bytes.checked_next_multiple_of(self.align)
        };
        match rounded {
            Some(bytes) => bytes,
            None => usize::MAX,
        }
    }
}
