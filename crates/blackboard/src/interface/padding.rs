//! Padding: the bytes of a value that belong to no field.

use super::{Descriptor, Kind};

/// Zeros the padding of a value, so that its bytes depend on its fields alone.
///
/// A typed write leaves padding undefined. It is written here and never read, so it may be uninitialized.
///
/// # Safety
/// `data` is valid for writing a value of that interface with `items` tail items.
pub unsafe fn clear_padding(descriptor: &Descriptor, data: *mut u8, items: usize) {
    let mut clear = |offset: usize, length: usize| {
        // SAFETY: a gap lies inside the value, which the caller promises.
        unsafe { data.add(offset).write_bytes(0, length) };
    };
    for_each_gap(descriptor, 0, &mut clear);
    if let Some(item) = descriptor.tail().filter(|item| has_parts(item)) {
        (0..items).for_each(|i| of_kind(item, descriptor.size + i * item.size(), &mut clear));
    }
}

/// Returns true if a value has padding, its tail aside; evaluated at compile time.
pub(super) const fn has_gaps(descriptor: &Descriptor) -> bool {
    let (mut end, mut i) = (0, 0);
    while i < descriptor.fields.len() {
        let field = &descriptor.fields[i];
        if field.offset > end || kind_has_gaps(&field.kind) {
            return true;
        }
        end = field.offset + field.kind.size();
        i += 1;
    }
    descriptor.size > end
}

const fn kind_has_gaps(kind: &Kind) -> bool {
    match kind {
        Kind::Optional(item) | Kind::Array(item, _) | Kind::Sequence(item, _) => kind_has_gaps(item),
        Kind::Nested(descriptor) => has_gaps(descriptor),
        _ => false,
    }
}

/// Calls `gap` with offset and length of each gap of a value without its tail.
pub(super) fn for_each_gap(descriptor: &Descriptor, base: usize, gap: &mut dyn FnMut(usize, usize)) {
    let mut end = 0;
    for field in descriptor.fields {
        if field.offset > end {
            gap(base + end, field.offset - end);
        }
        of_kind(&field.kind, base + field.offset, gap);
        end = field.offset + field.kind.size();
    }
    if descriptor.size > end {
        gap(base + end, descriptor.size - end);
    }
}

/// Calls `gap` with the gaps of a part of a value.
pub(super) fn of_kind(kind: &Kind, base: usize, gap: &mut dyn FnMut(usize, usize)) {
    match kind {
        Kind::Optional(item) => of_kind(item, base + 8, gap),
        Kind::Array(item, count) if has_parts(item) => {
            (0..*count).for_each(|i| of_kind(item, base + i * item.size(), gap));
        }
        Kind::Sequence(item, count) if has_parts(item) => {
            (0..*count).for_each(|i| of_kind(item, base + 8 + i * item.size(), gap));
        }
        Kind::Nested(descriptor) => for_each_gap(descriptor, base, gap),
        _ => {}
    }
}

/// Returns true if a kind may have padding inside.
fn has_parts(kind: &Kind) -> bool {
    matches!(kind, Kind::Optional(_) | Kind::Array(..) | Kind::Sequence(..) | Kind::Nested(_))
}

/// Returns the size of the padding before the tail, bytes.
/// The fields each have a size and an alignment; the tail has items of `item_align`.
pub const fn gap_before_tail(fields: &[(usize, usize)], item_align: usize) -> usize {
    let (mut end, mut align, mut i) = (0_usize, item_align, 0);
    while i < fields.len() {
        let (field_size, field_align) = fields[i];
        end = end.next_multiple_of(field_align) + field_size;
        if field_align > align {
            align = field_align;
        }
        i += 1;
    }
    end.next_multiple_of(align) - end
}
