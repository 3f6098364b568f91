use slate_blackboard::channel::Latest;
use slate_module::Frame;

/// Reader of a module's parameters.
#[repr(C)]
pub struct ParameterReader {
    may_have_changed: bool,
    reader: Box<Latest>,
}

impl ParameterReader {
    /// Reads them there.
    pub fn new(reader: Latest) -> Self {
        Self { may_have_changed: true, reader: Box::new(reader) }
    }

    /// Signals that they may have changed.
    pub fn expect_change(&mut self) {
        self.may_have_changed = true;
    }

    /// Shows the newest ones to the next step.
    #[inline]
    pub fn show(&mut self, frame: &mut Frame) {
        if std::mem::take(&mut self.may_have_changed) {
            if self.reader.refresh() {
                frame.params_version += 1;
            }
            if let Some(loan) = self.reader.value() {
                frame.params = loan.as_ptr();
            }
        }
    }

    /// Returns the newest parameters, for a new instance; the next step reads them too.
    pub fn newest(&mut self) -> &[u8] {
        self.may_have_changed = true;
        self.present().unwrap_or_default()
    }

    /// Returns the newest parameters; `None` before the first write.
    pub fn present(&mut self) -> Option<&[u8]> {
        self.reader.refresh();
        self.reader.value().map(|loan| loan.bytes())
    }

    /// Returns the cursor of the last value read.
    pub fn cursor(&self) -> u64 {
        self.reader.cursor()
    }

    /// Resumes at that cursor.
    pub fn resume(&mut self, cursor: u64) {
        self.may_have_changed = true;
        self.reader.resume(cursor);
    }
}
