use slate_blackboard::channel::Latest;
use slate_module::Frame;

/// What a module reads its parameters from.
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

    /// Says that they may have changed.
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

    /// The newest ones, for a new instance; the next step is shown them too.
    pub fn newest(&mut self) -> &[u8] {
        self.may_have_changed = true;
        self.present().unwrap_or_default()
    }

    /// The newest ones, if there are any.
    pub fn present(&mut self) -> Option<&[u8]> {
        self.reader.refresh();
        self.reader.value().map(|loan| loan.bytes())
    }

    /// The value that was seen last.
    pub fn cursor(&self) -> u64 {
        self.reader.cursor()
    }

    /// Goes on from that value.
    pub fn resume(&mut self, cursor: u64) {
        self.may_have_changed = true;
        self.reader.resume(cursor);
    }
}
