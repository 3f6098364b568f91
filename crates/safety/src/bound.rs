use slate_module::blackboard::interface::Kind;
use slate_module::math;

/// What holds one number of a command.
#[derive(Clone, Debug)]
pub(crate) struct Bound {
    /// Bytes from the beginning of the command.
    offset: usize,
    kind: Kind,
    range: Range,
    /// Greatest change per second.
    rate: Option<f64>,
    /// The value in the command that passed last. Of an integer it keeps the fraction, without which a slow ramp
    /// would never leave its first step.
    passed: f64,
    /// The value that the actuator got last.
    given: f64,
}

/// A closed interval, exact for its type: 64-bit integers don't fit into an `f64`.
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
    /// A bound that holds nothing yet, or nothing if that type is no number.
    pub fn new(kind: Kind, offset: usize) -> Option<Self> {
        let range = match kind {
            Kind::F32 | Kind::F64 => Range::Float(f64::NEG_INFINITY, f64::INFINITY),
            Kind::U8 => Range::Integer(0, u8::MAX.into()),
            Kind::U16 => Range::Integer(0, u16::MAX.into()),
            Kind::U32 => Range::Integer(0, u32::MAX.into()),
            Kind::U64 => Range::Integer(0, u64::MAX.into()),
            Kind::I8 => Range::Integer(i8::MIN.into(), i8::MAX.into()),
            Kind::I16 => Range::Integer(i16::MIN.into(), i16::MAX.into()),
            Kind::I32 => Range::Integer(i32::MIN.into(), i32::MAX.into()),
            Kind::I64 => Range::Integer(i64::MIN.into(), i64::MAX.into()),
            _ => return None,
        };
        Some(Self { offset, kind, range, rate: None, passed: 0.0, given: 0.0 })
    }

    pub fn offset(&self) -> usize {
        self.offset
    }

    /// Holds the value in a closed interval; false if the type has no value in it.
    pub fn limit(&mut self, low: f64, high: f64) -> bool {
        let Some(fresh) = Self::new(self.kind, self.offset) else { return false };
        self.range = match (fresh.range, self.kind) {
            (Range::Float(..), kind) => {
                let narrow = matches!(kind, Kind::F32);
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

    /// The value in the command that passed last, and the one that the actuator got last.
    pub fn memory(&self) -> (f64, f64) {
        (self.passed, self.given)
    }

    /// Goes on from those.
    pub fn remember(&mut self, (passed, given): (f64, f64)) {
        (self.passed, self.given) = (passed, given);
    }

    /// The actuator got the command that passed last.
    pub fn give_passed(&mut self) {
        self.given = self.passed;
    }

    /// The actuator got its safe command.
    pub fn give(&mut self, safe: &[u8]) {
        self.given = match self.read(safe) {
            Some(Number::Float(value)) => value,
            Some(Number::Integer(value)) => value as f64,
            None => self.given,
        };
    }

    /// Holds the number in a command whose numbers are finite; says whether that changed it. A rate-limited value
    /// moves by as much as `seconds` allow, but always into its limits: they stand above the rate.
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
            Kind::F64 => read!(f64, Float),
            Kind::F32 => read!(f32, Float),
            Kind::U8 => read!(u8, Integer),
            Kind::U16 => read!(u16, Integer),
            Kind::U32 => read!(u32, Integer),
            Kind::U64 => read!(u64, Integer),
            Kind::I8 => read!(i8, Integer),
            Kind::I16 => read!(i16, Integer),
            Kind::I32 => read!(i32, Integer),
            Kind::I64 => read!(i64, Integer),
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
            (Number::Float(value), Kind::F64) => write!(value, f64),
            (Number::Float(value), Kind::F32) => write!(value, f32),
            (Number::Integer(value), Kind::U8) => write!(value, u8),
            (Number::Integer(value), Kind::U16) => write!(value, u16),
            (Number::Integer(value), Kind::U32) => write!(value, u32),
            (Number::Integer(value), Kind::U64) => write!(value, u64),
            (Number::Integer(value), Kind::I8) => write!(value, i8),
            (Number::Integer(value), Kind::I16) => write!(value, i16),
            (Number::Integer(value), Kind::I32) => write!(value, i32),
            (Number::Integer(value), Kind::I64) => write!(value, i64),
            _ => {}
        }
    }
}
