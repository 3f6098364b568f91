use std::ops::{Deref, DerefMut};

use slate_module::PortSlot;

/// Slots of a frame, contiguous from the beginning of a cache line on.
/// So the slots of an input and an output share three lines, and not four. An odd number is padded with an unused slot.
pub struct Slots(Box<[Pair]>);

/// Two slots fill whole lines.
#[repr(C, align(64))]
struct Pair([PortSlot; 2]);

// So one slot follows the other also from one pair to the next.
const _: () = assert!(size_of::<Pair>() == 2 * size_of::<PortSlot>());

impl Slots {
    /// Returns the slots of `count` ports, each made by `slot`.
    pub fn new(count: usize, slot: impl Fn(usize) -> PortSlot) -> Self {
        let pair = |pair: usize| Pair([slot(2 * pair), slot((2 * pair + 1).min(count - 1))]);
        Self((0..count.div_ceil(2)).map(pair).collect())
    }
}

impl Deref for Slots {
    type Target = [PortSlot];

    #[inline]
    fn deref(&self) -> &[PortSlot] {
        // SAFETY: pairs are nothing but their slots, without a gap.
        unsafe { std::slice::from_raw_parts(self.0.as_ptr().cast(), 2 * self.0.len()) }
    }
}

impl DerefMut for Slots {
    #[inline]
    fn deref_mut(&mut self) -> &mut [PortSlot] {
        // SAFETY: as above.
        unsafe { std::slice::from_raw_parts_mut(self.0.as_mut_ptr().cast(), 2 * self.0.len()) }
    }
}
