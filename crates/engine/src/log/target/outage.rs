use std::io;

/// Outage of a target, reported once at its beginning and once at its end.
/// Not with every line.
#[derive(Debug, Default)]
pub(super) struct Outage {
    lost: u64,
    diagnostic: Option<String>,
}

impl Outage {
    /// Takes the result of writing a line to `name`.
    pub fn record_result(&mut self, name: &str, result: io::Result<()>) {
        match result {
            Ok(()) if self.lost > 0 => {
                self.diagnostic =
                    Some(format!("{name} can be written again; lines missing there: {}", self.lost));
                self.lost = 0;
            }
            Ok(()) => {}
            Err(error) => {
                if self.lost == 0 {
                    self.diagnostic =
                        Some(format!("{name} can't be written, so lines are missing there: {error}"));
                }
                self.lost += 1;
            }
        }
    }

    /// Returns true if the last line could not be written.
    pub fn is_on(&self) -> bool {
        self.lost > 0
    }

    /// Returns the message to report, once.
    pub fn diagnostic(&mut self) -> Option<String> {
        self.diagnostic.take()
    }
}
