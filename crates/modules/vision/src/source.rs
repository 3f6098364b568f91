use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// Source of a camera's pictures, parsed from a text.
///
/// | text | camera |
/// |---|---|
/// | `pattern:640x480@30` | test pattern at 30 Hz: a bright disc that circles in four seconds; equal in all runs |
/// | `file:/data/%04d.pgm@10` | PGM files (`P5`) with that many digits, from 0 or 1, and again from the first after the last; without `%` the same file again and again |
///
/// The default rate is 30 Hz.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ImageSource {
    /// Test pattern.
    Pattern {
        /// Pixels of a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Frame rate.
        rate: Rate,
    },
    /// Pictures from files.
    Files {
        /// Pattern of the files' names.
        files: Files,
        /// Frame rate.
        rate: Rate,
    },
}

/// Frame rate, Hz.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rate(u32);

impl Rate {
    /// Returns the frame period, nanoseconds.
    pub fn period(self) -> u64 {
        1_000_000_000 / u64::from(self.0)
    }
}

/// Files with numbers in their names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Files {
    before: String,
    /// Digits of the number; `None` for a single file.
    digits: Option<usize>,
    after: String,
}

impl Files {
    /// Returns the file of a number.
    pub fn path(&self, number: u64) -> PathBuf {
        match self.digits {
            Some(digits) => format!("{}{number:0digits$}{}", self.before, self.after).into(),
            None => self.before.as_str().into(),
        }
    }

    /// Returns whether it is a series of files.
    pub fn are_numbered(&self) -> bool {
        self.digits.is_some()
    }
}

/// Error of a camera's text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceError {
    text: String,
    problem: &'static str,
}

impl fmt::Display for SourceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "`{}` names no camera: {}, such as in `pattern:640x480@30` or `file:/data/%04d.pgm@10`",
            self.text, self.problem
        )
    }
}

impl std::error::Error for SourceError {}

/// Maximum width and height, pixels.
pub(crate) const LONGEST: u32 = 8192;
const FASTEST: u32 = 1000;

impl FromStr for ImageSource {
    type Err = SourceError;

    fn from_str(text: &str) -> Result<Self, SourceError> {
        let wrong = |problem| SourceError { text: text.into(), problem };
        let no_kind = || wrong("expected the kind `pattern` or `file` before a `:`");
        let (kind, rest) = text.split_once(':').ok_or_else(no_kind)?;
        let (what, rate) = match rest.rsplit_once('@') {
            Some((what, rate)) => {
                let rate = rate.parse().ok().filter(|rate| (1..=FASTEST).contains(rate));
                let no_rate = || wrong("expected a rate from 1 to 1000 images per second after `@`");
                (what, Rate(rate.ok_or_else(no_rate)?))
            }
            None => (rest, Rate(30)),
        };
        match kind {
            "pattern" => {
                let side = |text: &str| text.parse().ok().filter(|side| (1..=LONGEST).contains(side));
                let size = what.split_once('x').and_then(|(w, h)| Some((side(w)?, side(h)?)));
                let no_size = || wrong("expected a size from 1x1 to 8192x8192 pixels after `pattern:`");
                let (width, height) = size.ok_or_else(no_size)?;
                Ok(Self::Pattern { width, height, rate })
            }
            "file" => Ok(Self::Files { files: files(what).map_err(wrong)?, rate }),
            _ => Err(wrong("expected the kind `pattern` or `file` before `:`")),
        }
    }
}

fn files(path: &str) -> Result<Files, &'static str> {
    if path.is_empty() {
        return Err("expected a path after `file:`");
    }
    let Some((before, rest)) = path.split_once('%') else {
        return Ok(Files { before: path.into(), digits: None, after: String::new() });
    };
    let (digits, after) = rest.split_once('d').ok_or("expected a number of digits and `d` after `%`")?;
    let digits = if digits.is_empty() { Ok(1) } else { digits.parse() };
    let digits = digits.ok().filter(|digits| (1..=18).contains(digits));
    let digits = digits.ok_or("expected a number of digits from 1 to 18 after `%`")?;
    if after.contains('%') {
        return Err("expected at most one `%`");
    }
    Ok(Files { before: before.into(), digits: Some(digits), after: after.into() })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use std::path::Path;

    use proptest::prelude::*;

    use super::*;

    #[test]
    fn texts_name_cameras() {
        assert_eq!(
            "pattern:640x480@25".parse(),
            Ok(ImageSource::Pattern { width: 640, height: 480, rate: Rate(25) })
        );
        assert_eq!(Rate(25).period(), 40_000_000);
        let Ok(ImageSource::Files { files, rate }) = "file:/data/a@b-%04d.pgm@10".parse() else { panic!() };
        assert_eq!((files.path(7).as_path(), rate), (Path::new("/data/a@b-0007.pgm"), Rate(10)));
        assert!(files.are_numbered());
        let Ok(ImageSource::Files { files, rate }) = "file:one.pgm".parse() else { panic!() };
        assert_eq!((files.path(7).as_path(), rate), (Path::new("one.pgm"), Rate(30)));
        assert!(!files.are_numbered());
    }

    #[test]
    fn other_texts_are_refused_with_the_reason() {
        for (text, problem) in [
            ("", "expected the kind `pattern` or `file` before a `:`"),
            ("640x480", "expected the kind `pattern` or `file` before a `:`"),
            ("usb:0", "expected the kind `pattern` or `file` before `:`"),
            ("pattern:640", "expected a size from 1x1 to 8192x8192 pixels after `pattern:`"),
            ("pattern:0x480", "expected a size from 1x1 to 8192x8192 pixels after `pattern:`"),
            ("pattern:9000x480", "expected a size from 1x1 to 8192x8192 pixels after `pattern:`"),
            ("pattern:640x480@0", "expected a rate from 1 to 1000 images per second after `@`"),
            ("pattern:640x480@fast", "expected a rate from 1 to 1000 images per second after `@`"),
            ("file:", "expected a path after `file:`"),
            ("file:%04.pgm", "expected a number of digits and `d` after `%`"),
            ("file:%99d.pgm", "expected a number of digits from 1 to 18 after `%`"),
            ("file:%d-%d.pgm", "expected at most one `%`"),
        ] {
            let error = text.parse::<ImageSource>().unwrap_err().to_string();
            assert!(error.starts_with(&format!("`{text}` names no camera: {problem},")), "{error}");
        }
    }

    proptest! {
        #[test]
        fn no_text_makes_it_panic(text in "(pattern|file|x)?:?.{0,30}", number in any::<u64>()) {
            if let Ok(ImageSource::Files { files, rate }) = text.parse::<ImageSource>() {
                prop_assert!(rate.period() > 0);
                prop_assert!(!files.path(number).as_os_str().is_empty());
            }
        }
    }
}
