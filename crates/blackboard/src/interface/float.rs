use super::{Descriptor, Kind, Primitive};

/// Where an interface holds floating-point numbers, so that a commit can check and canonicalise them quickly.
#[derive(Clone, Debug, Default)]
#[repr(C)]
pub struct FloatMap {
    /// Where the number is if there is one alone, of 64 bits. First, as then nothing else is looked at.
    only: Option<usize>,
    singles: Vec<usize>,
    doubles: Vec<usize>,
    tail: Option<(usize, usize, Box<FloatMap>)>,
}

impl FloatMap {
    /// The numbers of that interface.
    pub fn new(descriptor: &Descriptor) -> Self {
        let mut map = Self::default();
        map.add(descriptor, 0);
        map.only = match (&*map.doubles, &*map.singles, &map.tail) {
            ([offset], [], None) => Some(*offset),
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
                if !inner.singles.is_empty() || !inner.doubles.is_empty() {
                    self.tail = Some((offset, item.size(), Box::new(inner)));
                }
            }
            _ => {}
        }
    }

    /// Gives every not-a-number the one canonical bit pattern and says whether all numbers are finite.
    ///
    /// The bits of a NaN differ between builds and machines, so they must not reach a reader or a digest.
    #[inline]
    pub fn canonicalize(&self, bytes: &mut [u8], items: usize) -> bool {
        // Of what modules write most is a number, and is one.
        if let Some(offset) = self.only
            && let Some(number) = bytes.get(offset..).and_then(|bytes| bytes.first_chunk())
            && f64::from_ne_bytes(*number).is_finite()
        {
            return true;
        }
        self.canonicalize_all(bytes, items)
    }

    fn canonicalize_all(&self, bytes: &mut [u8], items: usize) -> bool {
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
                finite &= inner.canonicalize_all(item, 0);
            }
        }
        finite
    }
}
