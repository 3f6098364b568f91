use slate_module::blackboard::interface::{Kind, Primitive};
use slate_module::math;

/// Limits of one number of a command.
#[derive(Clone, Debug)]
pub(crate) struct Bound {
    /// Offset in the command, bytes.
    offset: usize,
    kind: Kind,
    range: Range,
    /// Rate limit, per second.
    rate: Option<f64>,
    /// Value of the newest passed command.
    /// It has the fraction of an integer, which a slow ramp needs.
    passed: f64,
    /// Newest value of the actuator.
    given: f64,
}

/// Closed interval, exact for its type: 64-bit integers don't fit into an `f64`.
#[derive(Clone, Copy, Debug)]
enum Range {
    Float(f64, f64),
    Integer(i128, i128),
}

#[derive(Clone, Copy)]
enum Number {
    Float(f64),
    Integer(i128),
}

impl Bound {
    /// Returns a bound without limits; `None` if the type is not a number.
    pub fn new(kind: Kind, offset: usize) -> Option<Self> {
        let range = match kind {
            Kind::Primitive(Primitive::F32) | Kind::Primitive(Primitive::F64) => {
                Range::Float(f64::NEG_INFINITY, f64::INFINITY)
            }
            Kind::Primitive(Primitive::U8) => Range::Integer(0, u8::MAX.into()),
            Kind::Primitive(Primitive::U16) => Range::Integer(0, u16::MAX.into()),
            Kind::Primitive(Primitive::U32) => Range::Integer(0, u32::MAX.into()),
            Kind::Primitive(Primitive::U64) => Range::Integer(0, u64::MAX.into()),
            Kind::Primitive(Primitive::I8) => Range::Integer(i8::MIN.into(), i8::MAX.into()),
            Kind::Primitive(Primitive::I16) => Range::Integer(i16::MIN.into(), i16::MAX.into()),
            Kind::Primitive(Primitive::I32) => Range::Integer(i32::MIN.into(), i32::MAX.into()),
            Kind::Primitive(Primitive::I64) => Range::Integer(i64::MIN.into(), i64::MAX.into()),
            _ => return None,
        };
        Some(Self { offset, kind, range, rate: None, passed: 0.0, given: 0.0 })
    }

    pub fn offset(&self) -> usize {
        self.offset
    }

    /// Sets limits; returns false if the type has no value between.
    pub fn limit(&mut self, low: f64, high: f64) -> bool {
        let Some(fresh) = Self::new(self.kind, self.offset) else { return false };
        self.range = match (fresh.range, self.kind) {
            (Range::Float(..), kind) => {
                let narrow = matches!(kind, Kind::Primitive(Primitive::F32));
                // Decimal text such as 0.1 means the nearest number of the field's own width.
                let nearest = |limit: f64| if narrow { f64::from(limit as f32) } else { limit };
                let (low, high) = (nearest(low), nearest(high));
                if low == f64::INFINITY || high == f64::NEG_INFINITY {
                    return false;
                }
                Range::Float(low, high)
            }
            (Range::Integer(least, greatest), _) => {
                let low = (low.ceil() as i128).max(least);
                let high = (high.floor() as i128).min(greatest);
                if low > high {
                    return false;
                }
                Range::Integer(low, high)
            }
        };
        true
    }

    pub fn rate_limit(&mut self, per_second: f64) {
        self.rate = Some(per_second);
    }

    /// Returns the values of the newest passed command and of the actuator.
    pub fn memory(&self) -> (f64, f64) {
        (self.passed, self.given)
    }

    /// Restores these values.
    pub fn remember(&mut self, (passed, given): (f64, f64)) {
        (self.passed, self.given) = (passed, given);
    }

    /// Notes that the actuator got the newest passed command.
    pub fn give_passed(&mut self) {
        self.given = self.passed;
    }

    /// Notes that the actuator got its safe command.
    pub fn give(&mut self, safe: &[u8]) {
        self.given = match self.read(safe) {
            Some(Number::Float(value)) => value,
            Some(Number::Integer(value)) => value as f64,
            None => self.given,
        };
    }

    /// Limits the number of a finite command; returns whether it was changed.
    ///
    /// A rate-limited value moves by as much as `seconds` allow, but always into its limits: they take precedence over the rate.
    pub fn apply(&mut self, command: &mut [u8], seconds: f64) -> bool {
        let Some(number) = self.read(command) else { return false };
        let moved = |wanted: f64| match self.rate {
            Some(rate) => math::clamp(wanted, self.given - rate * seconds, self.given + rate * seconds),
            None => wanted,
        };
        match (number, self.range) {
            (Number::Float(wanted), Range::Float(low, high)) => {
                let result = math::clamp(moved(wanted), low, high);
                self.passed = result;
                if result == wanted {
                    return false;
                }
                self.write(command, Number::Float(result));
            }
            (Number::Integer(wanted), Range::Integer(low, high)) => {
                let fraction = moved(wanted as f64);
                let slowed = fraction != wanted as f64;
                let whole = if slowed { fraction.round() as i128 } else { wanted };
                let result = whole.clamp(low, high);
                self.passed = if slowed && result == whole { fraction } else { result as f64 };
                if result == wanted {
                    return false;
                }
                self.write(command, Number::Integer(result));
            }
            // A bound's range is made for its type, in `new`.
            _ => return false,
        }
        true
    }

    fn read(&self, command: &[u8]) -> Option<Number> {
        let bytes = command.get(self.offset..)?;
        macro_rules! read {
            ($type:ty, $number:ident) => {
                Number::$number(<$type>::from_ne_bytes(*bytes.first_chunk()?).into())
            };
        }
        Some(match self.kind {
            Kind::Primitive(Primitive::F64) => read!(f64, Float),
            Kind::Primitive(Primitive::F32) => read!(f32, Float),
            Kind::Primitive(Primitive::U8) => read!(u8, Integer),
            Kind::Primitive(Primitive::U16) => read!(u16, Integer),
            Kind::Primitive(Primitive::U32) => read!(u32, Integer),
            Kind::Primitive(Primitive::U64) => read!(u64, Integer),
            Kind::Primitive(Primitive::I8) => read!(i8, Integer),
            Kind::Primitive(Primitive::I16) => read!(i16, Integer),
            Kind::Primitive(Primitive::I32) => read!(i32, Integer),
            Kind::Primitive(Primitive::I64) => read!(i64, Integer),
            _ => return None,
        })
    }

    fn write(&self, command: &mut [u8], number: Number) {
        let Some(bytes) = command.get_mut(self.offset..) else { return };
        macro_rules! write {
            ($value:expr, $type:ty) => {
                if let Some(place) = bytes.first_chunk_mut() {
                    *place = ($value as $type).to_ne_bytes();
                }
            };
        }
        match (number, self.kind) {
            (Number::Float(value), Kind::Primitive(Primitive::F64)) => write!(value, f64),
            (Number::Float(value), Kind::Primitive(Primitive::F32)) => write!(value, f32),
            (Number::Integer(value), Kind::Primitive(Primitive::U8)) => write!(value, u8),
            (Number::Integer(value), Kind::Primitive(Primitive::U16)) => write!(value, u16),
            (Number::Integer(value), Kind::Primitive(Primitive::U32)) => write!(value, u32),
            (Number::Integer(value), Kind::Primitive(Primitive::U64)) => write!(value, u64),
            (Number::Integer(value), Kind::Primitive(Primitive::I8)) => write!(value, i8),
            (Number::Integer(value), Kind::Primitive(Primitive::I16)) => write!(value, i16),
            (Number::Integer(value), Kind::Primitive(Primitive::I32)) => write!(value, i32),
            (Number::Integer(value), Kind::Primitive(Primitive::I64)) => write!(value, i64),
            _ => {}
        }
    }
}
