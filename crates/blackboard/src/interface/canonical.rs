use super::{Descriptor, Kind, Primitive, padding};

/// Places of an interface at which equal values may have different bytes.
/// They are found once so that a commit is quick.
///
/// These are floating-point numbers, as the bits of a NaN differ between builds and machines, and padding.
#[derive(Clone, Debug, Default)]
#[repr(C)]
pub struct CanonicalForm {
    /// Offset of the number, if it is the only one, of 64 bits, without padding.
    /// It comes first, because nothing else is read in that case.
    only: Option<usize>,
    singles: Vec<usize>,
    doubles: Vec<usize>,
    /// Offset and length of each gap between fields.
    gaps: Vec<(usize, usize)>,
    tail: Option<(usize, usize, Box<CanonicalForm>)>,
}

impl CanonicalForm {
    /// Returns the canonical form of that interface.
    pub fn new(descriptor: &Descriptor) -> Self {
        let mut map = Self::default();
        map.add(descriptor, 0);
        padding::for_each_gap(descriptor, 0, &mut |offset, length| map.gaps.push((offset, length)));
        map.only = match (&*map.doubles, &*map.singles, &map.tail) {
            ([offset], [], None) if map.gaps.is_empty() => Some(*offset),
            _ => None,
        };
        map
    }

    fn add(&mut self, descriptor: &Descriptor, base: usize) {
        for field in descriptor.fields {
            self.add_kind(&field.kind, base + field.offset);
        }
    }

    fn add_kind(&mut self, kind: &Kind, offset: usize) {
        match kind {
            Kind::Primitive(Primitive::F32) => self.singles.push(offset),
            Kind::Primitive(Primitive::F64) => self.doubles.push(offset),
            Kind::Optional(item) => self.add_kind(item, offset + 8),
            Kind::Array(item, count) => {
                (0..*count).for_each(|i| self.add_kind(item, offset + i * item.size()))
            }
            Kind::Sequence(item, count) => {
                (0..*count).for_each(|i| self.add_kind(item, offset + 8 + i * item.size()))
            }
            Kind::Nested(descriptor) => self.add(descriptor, offset),
            Kind::Tail(item) => {
                let mut inner = Self::default();
                inner.add_kind(item, 0);
                padding::of_kind(item, 0, &mut |offset, length| inner.gaps.push((offset, length)));
                if !inner.singles.is_empty() || !inner.doubles.is_empty() || !inner.gaps.is_empty() {
                    self.tail = Some((offset, item.size(), Box::new(inner)));
                }
            }
            _ => {}
        }
    }

    /// Makes a value canonical; returns true if all numbers are finite.
    /// Every NaN gets the one canonical bit pattern, and padding becomes zero.
    ///
    /// So neither the bits of a NaN nor those of padding reach a reader or a digest.
    #[inline]
    pub fn canonicalize(&self, bytes: &mut [u8], items: usize) -> bool {
        // Of what modules write most is a number, and is one.
        if let Some(offset) = self.only
            && let Some(number) = bytes.get(offset..).and_then(|bytes| bytes.first_chunk())
            && f64::from_ne_bytes(*number).is_finite()
        {
            return true;
        }
        // SAFETY: the bytes are borrowed exclusively and initialized, and gaps beyond them are left out.
        unsafe { self.clear_gaps(bytes.as_mut_ptr(), bytes.len(), items) };
        self.canonicalize_numbers(bytes, items)
    }

    /// Canonicalizes as [`canonicalize`](Self::canonicalize), and lends its bytes.
    /// The value was written by its type, so its padding may be uninitialized.
    ///
    /// # Safety
    /// `data` is valid for `length` bytes, which hold a value of that interface with `items` tail items whose fields are
    /// initialized, and not used elsewhere during `'a`.
    #[inline]
    pub unsafe fn canonical<'a>(&self, data: *mut u8, length: usize, items: usize) -> &'a mut [u8] {
        let is_canonical = self.only.is_some_and(|offset| {
            // SAFETY: the number is a field, and so lies in the value and is initialized.
            unsafe { data.add(offset).cast::<f64>().read_unaligned() }.is_finite()
        });
        if !is_canonical {
            // SAFETY: passed on to the caller.
            unsafe { self.clear_gaps(data, length, items) };
        }
        // SAFETY: passed on to the caller; all bytes are initialized by now.
        let bytes = unsafe { std::slice::from_raw_parts_mut(data, length) };
        if !is_canonical {
            self.canonicalize_numbers(bytes, items);
        }
        bytes
    }

    /// Zeros the padding of a value, which may be uninitialized.
    ///
    /// # Safety
    /// As for [`canonical`](Self::canonical).
    pub unsafe fn clear_gaps(&self, data: *mut u8, length: usize, items: usize) {
        for &(offset, size) in self.gaps.iter().filter(|(offset, size)| offset + size <= length) {
            // SAFETY: the gap lies in the value.
            unsafe { data.add(offset).write_bytes(0, size) };
        }
        if let Some((start, size, inner)) = self.tail.as_ref().filter(|(_, _, inner)| !inner.gaps.is_empty())
        {
            for i in (0..items).take_while(|i| start + (i + 1) * size <= length) {
                // SAFETY: the item lies in the value.
                unsafe { inner.clear_gaps(data.add(start + i * size), *size, 0) };
            }
        }
    }

    fn canonicalize_numbers(&self, bytes: &mut [u8], items: usize) -> bool {
        let mut finite = true;
        for &offset in &self.doubles {
            let Some(slot) = bytes.get_mut(offset..offset + 8) else { continue };
            let number =
                f64::from_ne_bytes([slot[0], slot[1], slot[2], slot[3], slot[4], slot[5], slot[6], slot[7]]);
            if !number.is_finite() {
                finite = false;
                if number.is_nan() {
                    slot.copy_from_slice(&0x7ff8_0000_0000_0000_u64.to_ne_bytes());
                }
            }
        }
        for &offset in &self.singles {
            let Some(slot) = bytes.get_mut(offset..offset + 4) else { continue };
            let number = f32::from_ne_bytes([slot[0], slot[1], slot[2], slot[3]]);
            if !number.is_finite() {
                finite = false;
                if number.is_nan() {
                    slot.copy_from_slice(&0x7fc0_0000_u32.to_ne_bytes());
                }
            }
        }
        if let Some((start, size, inner)) = &self.tail {
            for i in 0..items {
                let Some(item) = bytes.get_mut(start + i * size..start + (i + 1) * size) else { break };
                finite &= inner.canonicalize_numbers(item, 0);
            }
        }
        finite
    }
}
