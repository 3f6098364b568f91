//! Keys of teleoperation.

/// Pressed key, or one that is held and repeated by the terminal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Key {
    /// Forward and to the left, each from -1 to 1.
    Drive(f64, f64),
    /// Stop command.
    Halt,
    /// Stop all actuators.
    Stop,
    Faster,
    Slower,
    Quit,
}

const ESCAPE: u8 = 0x1b;

/// Returns the keys in one read from a terminal.
/// A terminal does not report released keys.
pub fn parse(mut bytes: &[u8]) -> Vec<Key> {
    let mut keys = Vec::new();
    while let Some((first, rest)) = bytes.split_first() {
        let (key, rest) = match (*first, rest) {
            // Arrows, with Shift and Ctrl or without.
            (ESCAPE, [b'[' | b'O', rest @ ..]) => {
                match rest.iter().position(|byte| (0x40..0x7f).contains(byte)) {
                    Some(end) => (arrow(rest[end]), &rest[end + 1..]),
                    None => (None, &[][..]),
                }
            }
            (ESCAPE, []) => (Some(Key::Quit), rest),
            // A key with Alt.
            (ESCAPE, [_, rest @ ..]) => (None, rest),
            (byte, rest) => (letter(byte), rest),
        };
        keys.extend(key);
        bytes = rest;
    }
    keys
}

fn arrow(end: u8) -> Option<Key> {
    Some(match end {
        b'A' => Key::Drive(1.0, 0.0),
        b'B' => Key::Drive(-1.0, 0.0),
        b'C' => Key::Drive(0.0, -1.0),
        b'D' => Key::Drive(0.0, 1.0),
        _ => return None,
    })
}

fn letter(byte: u8) -> Option<Key> {
    Some(match byte.to_ascii_lowercase() {
        b'w' => Key::Drive(1.0, 0.0),
        b's' => Key::Drive(-1.0, 0.0),
        b'a' => Key::Drive(0.0, 1.0),
        b'd' => Key::Drive(0.0, -1.0),
        b'q' => Key::Drive(1.0, 1.0),
        b'e' => Key::Drive(1.0, -1.0),
        b'z' => Key::Drive(-1.0, -1.0),
        b'c' => Key::Drive(-1.0, 1.0),
        b'x' => Key::Halt,
        b' ' => Key::Stop,
        b'+' | b'=' => Key::Faster,
        b'-' => Key::Slower,
        // Ctrl-C and Ctrl-D come as bytes, as the terminal makes no signals of them meanwhile.
        0x03 | 0x04 => Key::Quit,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn letters_arrows_and_end_are_distinguished() {
        assert_eq!(parse(b"w"), [Key::Drive(1.0, 0.0)]);
        assert_eq!(
            parse(b"\x1b[A\x1bOD\x1b[1;5C"),
            [Key::Drive(1.0, 0.0), Key::Drive(0.0, 1.0), Key::Drive(0.0, -1.0)]
        );
        assert_eq!(parse(b"Q +\x03"), [Key::Drive(1.0, 1.0), Key::Stop, Key::Faster, Key::Quit]);
        assert_eq!(parse(b"\x1b"), [Key::Quit]);
        // F5, Alt-w, and a sequence that breaks off.
        assert_eq!(parse(b"\x1b[15~\x1bw\x1b[1;"), []);
    }

    proptest! {
        #[test]
        fn any_terminal_input_is_read_to_its_end(bytes in proptest::collection::vec(any::<u8>(), 0..64)) {
            prop_assert!(parse(&bytes).len() <= bytes.len());
        }
    }
}
