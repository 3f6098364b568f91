use slate_blackboard::SettingsCounter;
use slate_blackboard::channel::Latest;

/// The switch of a module: its property `enabled`.
#[repr(C)]
pub struct ModuleSwitch {
    /// What the host has set in all modules.
    settings: SettingsCounter,
    /// How many settings had been made at the last look.
    seen: Option<u64>,
    /// What `enabled` said last.
    is_on: bool,
    /// Whether another module switches this one.
    is_linked: bool,
    /// Reads `enabled`.
    reader: Box<Latest>,
}

impl ModuleSwitch {
    /// A switch that is on, which `reader` reads; `settings` counts what is set in all modules.
    pub fn new(settings: SettingsCounter, reader: Latest, is_linked: bool) -> Self {
        Self { settings, seen: None, is_on: true, is_linked, reader: Box::new(reader) }
    }

    /// Whether nothing was set in any module since the last look.
    #[inline]
    pub fn is_unchanged(&self) -> bool {
        self.seen == Some(self.settings.count())
    }

    /// Takes note of what was set; whether something was since the last look.
    pub fn take_note(&mut self) -> bool {
        // One look, so that what is set meanwhile is seen with the next one.
        let count = Some(self.settings.count());
        count != std::mem::replace(&mut self.seen, count)
    }

    /// Reads the switch, and says whether it is on.
    pub fn read(&mut self) -> bool {
        if self.reader.refresh() {
            let value = self.reader.value();
            self.is_on = value.is_none_or(|loan| loan.bytes().first().is_some_and(|byte| *byte != 0));
        }
        self.is_on
    }

    /// Whether it was on at the last look.
    pub fn is_on(&self) -> bool {
        self.is_on
    }

    /// Whether another module switches this one.
    pub fn is_linked(&self) -> bool {
        self.is_linked
    }

    /// Reads another property from now on; returns the reader of the one before.
    pub fn rewire(&mut self, reader: Latest, is_linked: bool) -> Latest {
        (self.is_linked, self.seen) = (is_linked, None);
        std::mem::replace(&mut *self.reader, reader)
    }

    /// What it said last, and the value that said so.
    pub fn freeze(&self) -> (bool, u64) {
        (self.is_on, self.reader.cursor())
    }

    /// Goes on from there. It is looked at once more, which finds the same unless something was set meanwhile.
    pub fn thaw(&mut self, is_on: bool, cursor: u64) {
        (self.is_on, self.seen) = (is_on, None);
        self.reader.resume(cursor);
    }
}
