use std::str::SplitAsciiWhitespace;

use slate_interfaces::Pose2;

/// The words of a line, one after the other.
#[derive(Clone)]
pub(super) struct Words<'a> {
    words: SplitAsciiWhitespace<'a>,
}

/// Shortens an invalid word for a message.
pub(super) fn shortened(word: &str) -> String {
    word.chars().take(40).collect()
}

impl<'a> Words<'a> {
    pub fn new(line: &'a str) -> Self {
        Self { words: line.split_ascii_whitespace() }
    }

    /// Returns the next word; `what` names the expected one in errors.
    pub fn word(&mut self, what: &str) -> Result<&'a str, String> {
        self.words.next().ok_or_else(|| format!("it ends where {what} should stand"))
    }

    fn parsed<T: std::str::FromStr>(&mut self, what: &str, kind: &str) -> Result<T, String> {
        let word = self.word(what)?;
        word.parse().map_err(|_| format!("`{}` should be {what}, {kind}", shortened(word)))
    }

    pub fn number(&mut self, what: &str) -> Result<f64, String> {
        let word = self.words.clone().next().unwrap_or_default();
        let number: f64 = self.parsed(what, "a number")?;
        match is_overflow(word, number) {
            true => Err(format!("`{}` should be {what}, and is too large", shortened(word))),
            false => Ok(number),
        }
    }

    pub fn whole(&mut self, what: &str) -> Result<i32, String> {
        self.parsed(what, "a whole number")
    }

    /// Reads a list of numbers whose count precedes them.
    pub fn list(&mut self, what: &str) -> Result<Vec<f32>, String> {
        let count: usize = self.parsed(&format!("how many {what} follow"), "a whole number")?;
        let mut numbers = Vec::new();
        for number in 0..count {
            let word = self.words.next();
            let word = word.ok_or_else(|| format!("it should have {count} {what}, and has {number}"))?;
            let parsed: Option<f32> =
                word.parse().ok().filter(|number: &f32| !is_overflow(word, (*number).into()));
            numbers.push(parsed.ok_or_else(|| {
                format!("`{}` should be number {number} of {count} {what}", shortened(word))
            })?);
        }
        Ok(numbers)
    }

    pub fn pose(&mut self, what: &str) -> Result<Pose2, String> {
        Ok(Pose2 { x: self.number(what)?, y: self.number(what)?, theta: self.number(what)? })
    }

    /// Seconds, as nanoseconds.
    pub fn seconds(&mut self, what: &str) -> Result<u64, String> {
        let word = self.word(what)?;
        nanoseconds(word).ok_or_else(|| {
            format!("`{}` should be {what}, seconds from 0 to {}", shortened(word), u64::MAX / 1_000_000_000)
        })
    }

    pub fn rest(&self) -> Vec<&'a str> {
        self.words.clone().collect()
    }

    pub fn end(&mut self) -> Result<(), String> {
        match self.words.next() {
            None => Ok(()),
            Some(word) => Err(format!("`{}` stands behind its end", shortened(word))),
        }
    }
}

/// Returns true if digits overflowed to infinity.
fn is_overflow(word: &str, number: f64) -> bool {
    number.is_infinite() && word.bytes().any(|byte| byte.is_ascii_digit())
}

/// Converts written seconds to nanoseconds.
/// The result is exact unless the number has an exponent.
fn nanoseconds(word: &str) -> Option<u64> {
    let (whole, part) = word.split_once('.').unwrap_or((word, ""));
    let is_plain = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if !whole.is_empty() && is_plain(whole) && is_plain(part) {
        let part: String = part.chars().chain("000000000".chars()).take(9).collect();
        let whole: u64 = whole.parse().ok()?;
        return whole.checked_mul(1_000_000_000)?.checked_add(part.parse().ok()?);
    }
    let nanoseconds = (word.parse::<f64>().ok()? * 1e9).round();
    (0.0..u64::MAX as f64).contains(&nanoseconds).then_some(nanoseconds as u64)
}
