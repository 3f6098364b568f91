//! Numbers of a fixed width, and which of them hold which.

use slate_blackboard::interface::Kind;

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    U8,
    U16,
    U32,
    U64,
    I8,
    I16,
    I32,
    I64,
    F32,
    F64,
}

impl Number {
    pub fn of(kind: &Kind) -> Option<Self> {
        Some(match kind {
            Kind::U8 => Self::U8,
            Kind::U16 => Self::U16,
            Kind::U32 => Self::U32,
            Kind::U64 => Self::U64,
            Kind::I8 => Self::I8,
            Kind::I16 => Self::I16,
            Kind::I32 => Self::I32,
            Kind::I64 => Self::I64,
            Kind::F32 => Self::F32,
            Kind::F64 => Self::F64,
            _ => return None,
        })
    }

    /// The least and the greatest value of an integer.
    pub fn range(self) -> Option<(i128, i128)> {
        Some(match self {
            Self::U8 => (0, u8::MAX.into()),
            Self::U16 => (0, u16::MAX.into()),
            Self::U32 => (0, u32::MAX.into()),
            Self::U64 => (0, u64::MAX.into()),
            Self::I8 => (i8::MIN.into(), i8::MAX.into()),
            Self::I16 => (i16::MIN.into(), i16::MAX.into()),
            Self::I32 => (i32::MIN.into(), i32::MAX.into()),
            Self::I64 => (i64::MIN.into(), i64::MAX.into()),
            Self::F32 | Self::F64 => return None,
        })
    }

    /// The integers that it holds without gaps.
    fn whole(self) -> (i128, i128) {
        let float = |bits: u32| (-(1_i128 << bits), 1_i128 << bits);
        match self {
            Self::F32 => float(f32::MANTISSA_DIGITS),
            Self::F64 => float(f64::MANTISSA_DIGITS),
            integer => integer.range().unwrap_or_default(),
        }
    }

    /// Whether it holds every value of `from`, multiplied by the factor, exactly.
    pub fn holds(self, from: Self, factor: u64) -> bool {
        let Some((low, high)) = from.range() else {
            // A product of a fraction is rounded, as a rule.
            return factor == 1 && (self == from || (from, self) == (Self::F32, Self::F64));
        };
        let (least, greatest) = self.whole();
        let within = |limit: i128| {
            limit.checked_mul(factor.into()).is_some_and(|limit| (least..=greatest).contains(&limit))
        };
        within(low) && within(high)
    }

    /// Reads it; there are enough bytes.
    #[inline]
    pub fn read(self, bytes: &[u8]) -> Read {
        macro_rules! integer {
            ($type:ty) => {
                Read::Whole(<$type>::from_ne_bytes(fixed(bytes)).into())
            };
        }
        match self {
            Self::U8 => integer!(u8),
            Self::U16 => integer!(u16),
            Self::U32 => integer!(u32),
            Self::U64 => integer!(u64),
            Self::I8 => integer!(i8),
            Self::I16 => integer!(i16),
            Self::I32 => integer!(i32),
            Self::I64 => integer!(i64),
            Self::F32 => Read::Float(f32::from_ne_bytes(fixed(bytes)).into()),
            Self::F64 => Read::Float(f64::from_ne_bytes(fixed(bytes))),
        }
    }

    /// Writes a number that it holds; there are enough bytes.
    #[inline]
    pub fn write(self, number: Read, bytes: &mut [u8]) {
        macro_rules! write {
            ($type:ty) => {{
                let number = match number {
                    Read::Whole(number) => number as $type,
                    Read::Float(number) => number as $type,
                };
                bytes[..size_of::<$type>()].copy_from_slice(&number.to_ne_bytes());
            }};
        }
        match self {
            Self::U8 => write!(u8),
            Self::U16 => write!(u16),
            Self::U32 => write!(u32),
            Self::U64 => write!(u64),
            Self::I8 => write!(i8),
            Self::I16 => write!(i16),
            Self::I32 => write!(i32),
            Self::I64 => write!(i64),
            Self::F32 => write!(f32),
            Self::F64 => write!(f64),
        }
    }
}

/// A number that was read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Read {
    Whole(i128),
    Float(f64),
}

impl Read {
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
