use slate_blackboard::SettingsCounter;
use slate_blackboard::channel::Latest;

/// Switch of a module: its property `enabled`.
#[repr(C)]
pub struct ModuleSwitch {
    /// Counter of settings by the host, in all modules.
    settings: SettingsCounter,
    /// Count of settings at the last read.
    last_count: Option<u64>,
    /// Last value of `enabled`.
    is_on: bool,
    /// True if another module switches this one.
    is_linked: bool,
    /// Reads `enabled`.
    reader: Box<Latest>,
}

impl ModuleSwitch {
    /// Returns a switch that is on; `reader` reads `enabled`.
    /// `settings` counts the settings in all modules.
    pub fn new(settings: SettingsCounter, reader: Latest, is_linked: bool) -> Self {
        Self { settings, last_count: None, is_on: true, is_linked, reader: Box::new(reader) }
    }

    /// Returns true if nothing was set in any module since the last read.
    #[inline]
    pub fn is_unchanged(&self) -> bool {
        self.last_count == Some(self.settings.count())
    }

    /// Reads the count of settings; true if something was set since the last read.
    pub fn check_settings(&mut self) -> bool {
        // One look, so that what is set meanwhile is seen with the next one.
        let count = Some(self.settings.count());
        count != std::mem::replace(&mut self.last_count, count)
    }

    /// Reads the switch; true if it is on.
    pub fn read(&mut self) -> bool {
        if self.reader.refresh() {
            let value = self.reader.value();
            self.is_on = value.is_none_or(|loan| loan.bytes().first().is_some_and(|byte| *byte != 0));
        }
        self.is_on
    }

    /// Returns true if it was on at the last read.
    pub fn is_on(&self) -> bool {
        self.is_on
    }

    /// Returns true if another module switches this one.
    pub fn is_linked(&self) -> bool {
        self.is_linked
    }

    /// Reads another property from now on; returns the reader of the one before.
    pub fn rewire(&mut self, reader: Latest, is_linked: bool) -> Latest {
        (self.is_linked, self.last_count) = (is_linked, None);
        std::mem::replace(&mut *self.reader, reader)
    }

    /// Returns the last value, and the cursor of its reader.
    pub fn snapshot(&self) -> (bool, u64) {
        (self.is_on, self.reader.cursor())
    }

    /// Resumes from a snapshot.
    /// The next read finds the same value unless it was set meanwhile.
    pub fn restore(&mut self, is_on: bool, cursor: u64) {
        (self.is_on, self.last_count) = (is_on, None);
        self.reader.resume(cursor);
    }
}
