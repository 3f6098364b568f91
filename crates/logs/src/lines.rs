use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use flate2::bufread::MultiGzDecoder;

use slate_bag::Error;

/// The most bytes that a line may have: more than ten thousand beams.
const MAX_LINE_LENGTH: u64 = 1 << 20;

/// The lines of a text file.
pub(super) struct Lines {
    input: Box<dyn BufRead>,
    path: PathBuf,
    number: u64,
    bytes: Vec<u8>,
}

/// Returns the content of a file, unpacked if it is packed with gzip.
pub(super) fn plain(file: File) -> io::Result<Box<dyn BufRead>> {
    let mut input = BufReader::with_capacity(1 << 16, file);
    Ok(match input.fill_buf()?.starts_with(&[0x1f, 0x8b]) {
        true => Box::new(BufReader::with_capacity(1 << 16, MultiGzDecoder::new(input))),
        false => Box::new(input),
    })
}

impl Lines {
    pub fn open(path: &Path) -> Result<Self, Error> {
        let input = File::open(path).and_then(plain);
        let input = input.map_err(|source| Error::Read { path: path.into(), source })?;
        Ok(Self { input, path: path.into(), number: 0, bytes: Vec::new() })
    }

    /// Returns the next line without its end; `None` at the end of the file.
    /// A line that is too long or is not text is returned as a description of the fault.
    pub fn next(&mut self) -> Result<Option<Result<&str, String>>, Error> {
        self.number += 1;
        self.bytes.clear();
        let read = (&mut self.input).take(MAX_LINE_LENGTH).read_until(b'\n', &mut self.bytes);
        let read = read.map_err(|source| Error::Read { path: self.path.clone(), source })?;
        if read == 0 {
            return Ok(None);
        }
        if read as u64 == MAX_LINE_LENGTH && self.bytes.last() != Some(&b'\n') {
            self.input.skip_until(b'\n').map_err(|source| Error::Read { path: self.path.clone(), source })?;
            return Ok(Some(Err(format!("it has more than {MAX_LINE_LENGTH} bytes"))));
        }
        Ok(Some(match std::str::from_utf8(&self.bytes) {
            Ok(text) => Ok(text.trim()),
            Err(error) => Err(format!("it is not UTF-8 from byte {} on", error.valid_up_to())),
        }))
    }

    /// Returns the error of the line that was read last.
    pub fn error(&self, what: String) -> Error {
        Error::Line { path: self.path.clone(), line: self.number, what }
    }
}
