//! Reports of the controller at 10 Hz: the standard server information packet.

/// Range of one sonar.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Range {
    /// Sonar number, from 0.
    pub sonar: u8,
    /// Range in the controller's units.
    pub range: u16,
}

/// Maximum number of ranges that a packet has room for.
pub const RANGES: usize = 71;

/// Standard report, in the controller's own units.
/// The robot's [`Model`](crate::model::Model) gives their meaning.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Motion state: true if the robot moves.
    pub moving: bool,
    /// Place along x; wraps around.
    pub x: u16,
    /// Place along y; wraps around.
    pub y: u16,
    /// Heading, counter-clockwise; wraps around.
    pub heading: i16,
    /// Speed of the left wheel.
    pub left: i16,
    /// Speed of the right wheel.
    pub right: i16,
    /// Battery, tenths of volts.
    pub battery: u8,
    /// Stall of the left wheel (bit 0) and buttons of the back bumper.
    pub left_stall_and_back_bumper: u8,
    /// Stall of the right wheel (bit 0) and buttons of the front bumper.
    pub right_stall_and_front_bumper: u8,
    /// Heading that its servo holds.
    pub control: i16,
    /// Flags of the report.
    /// Bit 0: motors on; 1 to 4: sonar arrays on; 5: stop button pressed; 10: on the charger.
    pub flags: u16,
    /// Heading of the compass, in units of two degrees; 0 without one.
    pub compass: u8,
    /// Ranges that are new.
    pub ranges: Vec<Range>,
    /// Turn, tenths of degrees per second, of controllers that say it.
    pub rotation: Option<i16>,
}

/// Motors on.
pub const MOTORS: u16 = 1;
/// Any array of sonars on.
pub const SONARS: u16 = 0b11110;
/// Flag of the stop button: set while it is pressed.
pub const STOP_BUTTON: u16 = 1 << 5;

impl Report {
    /// Parses a standard report; `None` for other or truncated data.
    pub fn decode(data: &[u8]) -> Option<Self> {
        let mut rest = Rest(data);
        let moving = match rest.byte()? {
            0x32 => false,
            0x33 => true,
            _ => return None,
        };
        let mut report = Self {
            moving,
            x: rest.word()?,
            y: rest.word()?,
            heading: rest.word()?.cast_signed(),
            left: rest.word()?.cast_signed(),
            right: rest.word()?.cast_signed(),
            battery: rest.byte()?,
            left_stall_and_back_bumper: rest.byte()?,
            right_stall_and_front_bumper: rest.byte()?,
            control: rest.word()?.cast_signed(),
            flags: rest.word()?,
            compass: rest.byte()?,
            ranges: Vec::new(),
            rotation: None,
        };
        for _ in 0..rest.byte()? {
            report.ranges.push(Range { sonar: rest.byte()?, range: rest.word()? });
        }
        // Gripper, chosen analog port and its value, digital inputs and outputs, battery once more, charger; older
        // controllers end before.
        let skipped = (|| {
            (0..5).try_for_each(|_| rest.byte().map(|_| ()))?;
            rest.word()?;
            rest.byte()
        })();
        if skipped.is_some() {
            report.rotation = rest.word().map(u16::cast_signed);
        }
        Some(report)
    }

    /// Returns the report's data, as a controller sends them.
    pub fn encode(&self) -> Vec<u8> {
        let mut data = vec![if self.moving { 0x33 } else { 0x32 }];
        let mut word = |value: u16| data.extend_from_slice(&value.to_le_bytes());
        word(self.x);
        word(self.y);
        for value in [self.heading, self.left, self.right] {
            word(value.cast_unsigned());
        }
        data.extend([self.battery, self.left_stall_and_back_bumper, self.right_stall_and_front_bumper]);
        data.extend_from_slice(&self.control.to_le_bytes());
        data.extend_from_slice(&self.flags.to_le_bytes());
        let count = self.ranges.len().min(RANGES);
        data.extend([self.compass, count as u8]);
        for Range { sonar, range } in &self.ranges[..count] {
            data.push(*sonar);
            data.extend_from_slice(&range.to_le_bytes());
        }
        if let Some(rotation) = self.rotation {
            data.extend_from_slice(&[0; 5]);
            data.extend_from_slice(&u16::from(self.battery).to_le_bytes());
            data.push(0);
            data.extend_from_slice(&rotation.to_le_bytes());
        }
        data
    }

    /// Returns true if the motors are on.
    pub fn motors(&self) -> bool {
        self.flags & MOTORS != 0
    }

    /// Returns true if any sonar array is on.
    pub fn sonars(&self) -> bool {
        self.flags & SONARS != 0
    }

    /// Returns true if the stop button is pressed.
    pub fn stop_button(&self) -> bool {
        self.flags & STOP_BUTTON != 0
    }

    /// Returns the stall state of the left and of the right wheel.
    /// True if the wheel can't turn though it should.
    pub fn stalls(&self) -> (bool, bool) {
        (self.left_stall_and_back_bumper & 1 != 0, self.right_stall_and_front_bumper & 1 != 0)
    }

    /// Returns the contacts of the front and the rear bumper; true if pressed.
    pub fn bumpers(&self) -> (bool, bool) {
        (self.right_stall_and_front_bumper >> 1 != 0, self.left_stall_and_back_bumper >> 1 != 0)
    }
}

/// Identity of a controller, from its answer to the synchronization.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Identity {
    /// Robot's own name.
    pub name: String,
    /// Class of the robot, such as `Pioneer`.
    pub class: String,
    /// Model of the robot, such as `p3dx-sh`.
    pub model: String,
}

impl Identity {
    /// Parses three texts that end with zero. Missing ones are empty.
    pub fn decode(data: &[u8]) -> Self {
        let mut texts = data.split(|byte| *byte == 0).map(|text| {
            // Text from the line is arbitrary, and goes to terminals.
            let printable = |byte: &u8| if matches!(byte, b' '..=b'~') { char::from(*byte) } else { '_' };
            text.iter().map(printable).collect()
        });
        let mut next = || texts.next().unwrap_or_default();
        Self { name: next(), class: next(), model: next() }
    }

    /// Returns the report's data, as a controller sends them.
    pub fn encode(&self) -> Vec<u8> {
        [&self.name, &self.class, &self.model].iter().flat_map(|text| text.bytes().chain([0])).collect()
    }
}

/// Bytes that are read one after the other; numbers are little-endian.
struct Rest<'a>(&'a [u8]);

impl Rest<'_> {
    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    fn word(&mut self) -> Option<u16> {
        let (first, rest) = self.0.split_first_chunk::<2>()?;
        self.0 = rest;
        Some(u16::from_le_bytes(*first))
    }
}
