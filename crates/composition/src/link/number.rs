//! Numbers of a fixed width, and exact representation of one by another.

use std::ops::RangeInclusive;

use slate_blackboard::interface::{Kind, Primitive};

/// The type of a number: a primitive other than a truth value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Number(Primitive);

impl Number {
    pub fn of(kind: &Kind) -> Option<Self> {
        match kind {
            Kind::Primitive(Primitive::Bool) => None,
            Kind::Primitive(primitive) => Some(Self(*primitive)),
            _ => None,
        }
    }

    /// Returns the smallest and the largest value of an integer type.
    pub fn range(self) -> Option<(i128, i128)> {
        self.0.integers().map(RangeInclusive::into_inner)
    }

    /// Returns the range of integers that the type represents without gaps.
    fn whole(self) -> (i128, i128) {
        let float = |bits: u32| (-(1_i128 << bits), 1_i128 << bits);
        match self.0 {
            Primitive::F32 => float(f32::MANTISSA_DIGITS),
            Primitive::F64 => float(f64::MANTISSA_DIGITS),
            _ => self.range().unwrap_or_default(),
        }
    }

    /// Returns whether `self` represents every `from` value times `factor` exactly.
    pub fn holds(self, from: Self, factor: u64) -> bool {
        let Some((low, high)) = from.range() else {
            // A product of a fraction is rounded, as a rule.
            return factor == 1 && (self == from || (from.0, self.0) == (Primitive::F32, Primitive::F64));
        };
        let (least, greatest) = self.whole();
        let within = |limit: i128| {
            limit.checked_mul(factor.into()).is_some_and(|limit| (least..=greatest).contains(&limit))
        };
        within(low) && within(high)
    }

    /// Reads it; there are enough bytes.
    #[inline]
    pub fn read(self, bytes: &[u8]) -> NumberValue {
        macro_rules! integer {
            ($type:ty) => {
                NumberValue::Whole(<$type>::from_ne_bytes(fixed(bytes)).into())
            };
        }
        match self.0 {
            Primitive::Bool | Primitive::U8 => integer!(u8),
            Primitive::U16 => integer!(u16),
            Primitive::U32 => integer!(u32),
            Primitive::U64 => integer!(u64),
            Primitive::I8 => integer!(i8),
            Primitive::I16 => integer!(i16),
            Primitive::I32 => integer!(i32),
            Primitive::I64 => integer!(i64),
            Primitive::F32 => NumberValue::Float(f32::from_ne_bytes(fixed(bytes)).into()),
            Primitive::F64 => NumberValue::Float(f64::from_ne_bytes(fixed(bytes))),
        }
    }

    /// Writes a number that it holds; there are enough bytes.
    #[inline]
    pub fn write(self, number: NumberValue, bytes: &mut [u8]) {
        macro_rules! write {
            ($type:ty) => {{
                let number = match number {
                    NumberValue::Whole(number) => number as $type,
                    NumberValue::Float(number) => number as $type,
                };
                bytes[..size_of::<$type>()].copy_from_slice(&number.to_ne_bytes());
            }};
        }
        match self.0 {
            Primitive::Bool | Primitive::U8 => write!(u8),
            Primitive::U16 => write!(u16),
            Primitive::U32 => write!(u32),
            Primitive::U64 => write!(u64),
            Primitive::I8 => write!(i8),
            Primitive::I16 => write!(i16),
            Primitive::I32 => write!(i32),
            Primitive::I64 => write!(i64),
            Primitive::F32 => write!(f32),
            Primitive::F64 => write!(f64),
        }
    }
}

/// A number that was read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum NumberValue {
    Whole(i128),
    Float(f64),
}

impl NumberValue {
    pub fn as_f64(self) -> f64 {
        match self {
            Self::Whole(number) => number as f64,
            Self::Float(number) => number,
        }
    }

    pub fn times(self, factor: u64) -> Self {
        match self {
            // It was checked that the product fits.
            Self::Whole(number) => Self::Whole(number.wrapping_mul(factor.into())),
            float => float,
        }
    }
}

fn fixed<const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut result = [0; N];
    result.copy_from_slice(&bytes[..N]);
    result
}
