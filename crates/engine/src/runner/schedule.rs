use slate_module::Trigger;

/// When a module has its turn.
#[repr(C)]
pub struct TickSchedule {
    /// The time of the last tick, nanoseconds.
    last_tick: u64,
    /// Whether it has a turn in every cycle, whatever else it waits for.
    in_every_cycle: bool,
    /// Whether its links have changed since its last step: what they lead to is news.
    rewired: bool,
    /// When the next tick of a periodic module is due.
    due: u64,
    /// What makes it tick.
    trigger: Trigger,
}

impl TickSchedule {
    /// That of a trigger.
    pub fn new(trigger: Trigger) -> Self {
        let in_every_cycle = trigger == Trigger::Stage;
        Self { last_tick: 0, in_every_cycle, rewired: false, due: 0, trigger }
    }

    /// What makes the module tick.
    pub fn trigger(&self) -> &Trigger {
        &self.trigger
    }

    /// Whether it has a turn in every cycle.
    #[inline]
    pub fn is_in_every_cycle(&self) -> bool {
        self.in_every_cycle
    }

    /// The time of the last tick, nanoseconds.
    #[inline]
    pub fn last_tick(&self) -> u64 {
        self.last_tick
    }

    /// The time of the next tick of a periodic module, nanoseconds.
    pub fn due(&self) -> u64 {
        self.due
    }

    /// Takes note of a tick.
    #[inline]
    pub fn tick(&mut self, now: u64) {
        self.last_tick = now;
    }

    /// Says that the links have changed, or that this is no news.
    pub fn set_rewired(&mut self, rewired: bool) {
        self.rewired = rewired;
    }

    /// Whether a tick is due after so many.
    pub fn is_due(&mut self, now: u64, ticks: u64, has_news: impl FnOnce() -> bool) -> bool {
        match &self.trigger {
            Trigger::Stage => true,
            Trigger::Every(period) => {
                if now < self.due {
                    return false;
                }
                // Periods are counted from the first tick, so that they do not drift; missed ones are left out.
                self.due = match ticks {
                    0 => now + period,
                    _ => self.due + ((now - self.due) / period + 1) * period,
                };
                true
            }
            Trigger::On { timeout, .. } => {
                let waited = now.saturating_sub(self.last_tick);
                timeout.is_some_and(|timeout| ticks == 0 || waited >= timeout)
                    || has_news()
                    || std::mem::take(&mut self.rewired)
            }
        }
    }

    /// The times of the last and the next tick, and whether links have changed since the last one.
    pub fn freeze(&self) -> (u64, u64, bool) {
        (self.last_tick, self.due, self.rewired)
    }

    /// Goes on from there.
    pub fn thaw(&mut self, last_tick: u64, due: u64, rewired: bool) {
        (self.last_tick, self.due, self.rewired) = (last_tick, due, rewired);
    }
}
