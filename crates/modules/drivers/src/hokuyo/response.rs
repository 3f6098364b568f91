//! Responses of SCIP 2.0: command echo, status, lines with checksums.
//! An empty line ends each.

use super::encoding::checksum;

/// Maximum length of a response, bytes.
/// A scan with intensities has 6 characters for each of 1,440 steps.
pub const LARGEST: usize = 16 * 1024;

/// Response whose checksums are right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScipResponse<'a> {
    /// Command, as the scanner repeats it.
    pub echo: &'a [u8],
    /// Status, such as `00`.
    pub status: [u8; 2],
    /// Lines with their checksums, separated by line feeds.
    /// Empty for a response without data.
    lines: &'a [u8],
}

impl<'a> ScipResponse<'a> {
    /// Parses a response without the empty line at its end.
    /// `None` if a checksum is wrong.
    pub fn parse(bytes: &'a [u8]) -> Option<Self> {
        let (echo, rest) = split_line(bytes);
        let (status, lines) = split_line(rest);
        let [first, second, sum] = *status else { return None };
        let response = Self { echo, status: [first, second], lines };
        let is_scan = response.status == *b"99";
        let is_right = |line| is_right(line) || !is_scan && is_right_text(line);
        let is_whole = checksum(&[first, second]) == sum && response.raw_lines().all(is_right);
        is_whole.then_some(response)
    }

    /// Returns the lines of data, without their checksums.
    pub fn lines(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        self.raw_lines().map(|line| line.split_last().map_or(line, |(_, line)| line))
    }

    fn raw_lines(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let lines = self.lines;
        lines.split(|byte| *byte == b'\n').filter(|line| !line.is_empty())
    }

    /// Returns the value of a line such as `DMIN:23;7`.
    /// The line is of the responses to `VV`, `PP` and `II`.
    pub fn value(&self, key: &str) -> Option<&'a str> {
        let text = self.lines().find_map(|line| line.strip_prefix(key.as_bytes())?.strip_prefix(b":"))?;
        let text = text.strip_suffix(b";").unwrap_or(text);
        std::str::from_utf8(text).ok().map(str::trim)
    }
}

fn is_right(line: &[u8]) -> bool {
    line.split_last().is_some_and(|(sum, data)| checksum(data) == *sum)
}

/// Lines of text end with a semicolon, which the checksum leaves out.
fn is_right_text(line: &[u8]) -> bool {
    matches!(line, [text @ .., b';', sum] if checksum(text) == *sum)
}

fn split_line(bytes: &[u8]) -> (&[u8], &[u8]) {
    match bytes.iter().position(|byte| *byte == b'\n') {
        Some(end) => (&bytes[..end], &bytes[end + 1..]),
        None => (bytes, &[]),
    }
}

/// Returns true if a line may be a command: two capital letters and arguments.
fn may_be_command(line: &[u8]) -> bool {
    matches!(line, [first, second, ..] if first.is_ascii_uppercase() && second.is_ascii_uppercase())
        && line.len() < 64
}

/// Decoder of responses from a byte stream in arbitrary pieces, with garbage.
///
/// It holds at most one response. Garbage before the echo spoils that response alone, or none when it ends a line.
#[derive(Clone, Debug, Default)]
pub struct ScipDecoder {
    held: Vec<u8>,
    damaged: u64,
    /// True while the rest of an oversized response is skipped.
    skips: bool,
}

impl ScipDecoder {
    /// Decodes bytes, and calls `take` with each complete response.
    pub fn receive(&mut self, bytes: &[u8], mut take: impl FnMut(ScipResponse<'_>)) {
        for byte in bytes {
            if *byte == b'\r' {
                continue;
            }
            let ends = *byte == b'\n' && self.held.last() == Some(&b'\n');
            if !ends {
                self.hold(*byte);
                continue;
            }
            // An empty line alone is between responses.
            if !self.skips && self.held.len() > 1 {
                match find(&self.held[..self.held.len() - 1]) {
                    Some(response) => take(response),
                    None => self.damaged += 1,
                }
            }
            self.skips = false;
            self.held.clear();
        }
    }

    fn hold(&mut self, byte: u8) {
        if self.held.len() == LARGEST {
            self.damaged += u64::from(!self.skips);
            self.skips = true;
            self.held.clear();
        }
        self.held.push(byte);
    }

    /// Forgets the beginning of a response whose end will not come.
    pub fn clear(&mut self) {
        self.held.clear();
        self.skips = false;
    }

    /// Returns the number of responses with a wrong checksum.
    pub fn damaged(&self) -> u64 {
        self.damaged
    }
}

/// Returns the response in the bytes before an empty line.
/// Lines before the echo are garbage.
fn find(bytes: &[u8]) -> Option<ScipResponse<'_>> {
    let mut rest = bytes;
    for _ in 0..4 {
        if may_be_command(split_line(rest).0)
            && let Some(response) = ScipResponse::parse(rest)
        {
            return Some(response);
        }
        rest = split_line(rest).1;
        if rest.is_empty() {
            return None;
        }
    }
    None
}
