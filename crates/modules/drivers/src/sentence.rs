//! Sentences of text with a checksum: `$`, body, `*`, two digits, line feed.
//!
//! NMEA 0183, section 5.3; VectorNav's ASCII protocol has them, too.

/// Maximum length of a sentence, characters.
/// NMEA allows 82, and some receivers send more.
pub const LONGEST: usize = 255;

/// Returns the checksum of a body, between `$` and `*`: exclusive or of its bytes.
///
/// ```
/// use slate_drivers::sentence::checksum;
///
/// assert_eq!(checksum(b"GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,"), 0x47);
/// ```
pub fn checksum(body: &[u8]) -> u8 {
    body.iter().fold(0, |sum, byte| sum ^ byte)
}

/// Appends the sentence of a body.
pub fn append(body: &str, bytes: &mut Vec<u8>) {
    bytes.push(b'$');
    bytes.extend_from_slice(body.as_bytes());
    bytes.extend_from_slice(format!("*{:02X}\r\n", checksum(body.as_bytes())).as_bytes());
}

/// Decoder of sentences from a byte stream in arbitrary pieces, with garbage.
///
/// It holds at most one sentence. A sentence that is cut off by the beginning of another one counts as damaged.
#[derive(Clone, Debug, Default)]
pub struct SentenceDecoder {
    held: Vec<u8>,
    /// True if a sentence has begun.
    is_inside: bool,
    damaged: u64,
}

impl SentenceDecoder {
    /// Decodes bytes, and calls `take` with the body of each complete sentence.
    pub fn receive(&mut self, bytes: &[u8], mut take: impl FnMut(&str)) {
        for byte in bytes {
            match byte {
                b'$' => {
                    self.damaged += u64::from(self.is_inside);
                    self.is_inside = true;
                    self.held.clear();
                }
                _ if !self.is_inside => {}
                b'\r' | b'\n' => {
                    self.is_inside = false;
                    match body(&self.held) {
                        Some(body) => take(body),
                        None => self.damaged += 1,
                    }
                }
                b' '..=b'~' if self.held.len() < LONGEST => self.held.push(*byte),
                _ => {
                    self.is_inside = false;
                    self.damaged += 1;
                }
            }
        }
    }

    /// Forgets the beginning of a sentence whose end will not come.
    pub fn clear(&mut self) {
        self.is_inside = false;
    }

    /// Returns the number of sentences with a wrong checksum, or none.
    pub fn damaged(&self) -> u64 {
        self.damaged
    }
}

/// Returns the body of a sentence whose checksum is right.
fn body(sentence: &[u8]) -> Option<&str> {
    let (body, sum) = sentence.split_last_chunk::<3>()?;
    let sum = std::str::from_utf8(sum).ok()?.strip_prefix('*')?;
    // `from_str_radix` would take a sign.
    let is_hexadecimal = sum.bytes().all(|digit| digit.is_ascii_hexdigit());
    let sum = u8::from_str_radix(sum, 16).ok().filter(|_| is_hexadecimal)?;
    if checksum(body) == sum { std::str::from_utf8(body).ok() } else { None }
}

/// Returns a field as a finite number.
pub(crate) fn number(field: &str) -> Option<f64> {
    // Rust reads more than digits: names of infinities and exponents.
    let is_plain = field.bytes().all(|byte| byte.is_ascii_digit() || matches!(byte, b'+' | b'-' | b'.'));
    field.parse::<f64>().ok().filter(|number| is_plain && number.is_finite())
}
