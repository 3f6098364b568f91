//! Characters of SCIP 2.0: six bits in each, and checksums of six bits.
//!
//! Hokuyo, *Communication Protocol Specification for SCIP2.0 Standard*, sections 3 and 4.

/// Returns the checksum of a line.
/// The lower six bits of the sum of its bytes, as a character.
///
/// ```
/// use slate_drivers::hokuyo::encoding::checksum;
///
/// assert_eq!(checksum(b"00"), b'P');
/// assert_eq!(checksum(b"99"), b'b');
/// ```
pub fn checksum(line: &[u8]) -> u8 {
    let sum = line.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
    (sum & 0x3F) + 0x30
}

/// Decodes a number of 6 bits per character, the highest first.
/// `None` if another character is among them.
///
/// ```
/// use slate_drivers::hokuyo::encoding::decode;
///
/// assert_eq!(decode(b"CB"), Some(1234));
/// assert_eq!(decode(b"1Dh"), Some(5432));
/// assert_eq!(decode(b"m2@0"), Some(16_000_000));
/// ```
pub fn decode(characters: &[u8]) -> Option<u32> {
    characters.iter().try_fold(0_u32, |number, character| {
        let bits = character.checked_sub(0x30).filter(|bits| *bits < 64)?;
        Some(number.checked_shl(6)? | u32::from(bits))
    })
}

/// Appends a number in `count` characters; higher bits are cut off.
pub fn encode(number: u32, count: usize, characters: &mut Vec<u8>) {
    for place in (0..count).rev() {
        let bits = number.checked_shr(6 * place as u32).unwrap_or(0) & 0x3F;
        characters.push(bits as u8 + 0x30);
    }
}

/// Characters in a line of data, without their checksum.
pub const BLOCK: usize = 64;

/// Appends data as lines of at most 64 characters, each with its checksum.
pub fn append_blocks(data: &[u8], bytes: &mut Vec<u8>) {
    for block in data.chunks(BLOCK) {
        append_line(block, bytes);
    }
}

/// Appends a line with its checksum.
pub fn append_line(line: &[u8], bytes: &mut Vec<u8>) {
    bytes.extend_from_slice(line);
    bytes.extend([checksum(line), b'\n']);
}
