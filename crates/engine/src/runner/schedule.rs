use slate_module::Trigger;

/// Schedule of a module's ticks.
#[repr(C)]
pub struct TickSchedule {
    /// Time of the last tick, ns.
    last_tick: u64,
    /// True if it has a turn in every cycle, whatever else it waits for.
    in_every_cycle: bool,
    /// True if its links have changed since its last step.
    /// Values of the new links are news.
    rewired: bool,
    /// Time of the next tick of a periodic module, ns.
    due: u64,
    /// Trigger of its ticks.
    trigger: Trigger,
}

impl TickSchedule {
    /// Returns the schedule of a trigger.
    pub fn new(trigger: Trigger) -> Self {
        let in_every_cycle = trigger == Trigger::Stage;
        Self { last_tick: 0, in_every_cycle, rewired: false, due: 0, trigger }
    }

    /// Returns the trigger of the module's ticks.
    pub fn trigger(&self) -> &Trigger {
        &self.trigger
    }

    /// Returns true if the module has a turn in every cycle.
    #[inline]
    pub fn is_in_every_cycle(&self) -> bool {
        self.in_every_cycle
    }

    /// Returns the time of the last tick, ns.
    #[inline]
    pub fn last_tick(&self) -> u64 {
        self.last_tick
    }

    /// Returns the time of the next tick of a periodic module, ns.
    pub fn due(&self) -> u64 {
        self.due
    }

    /// Records a tick.
    #[inline]
    pub fn tick(&mut self, now: u64) {
        self.last_tick = now;
    }

    /// Sets whether the links have changed.
    pub fn set_rewired(&mut self, rewired: bool) {
        self.rewired = rewired;
    }

    /// Returns true if a tick is due at `now`, ns, after `ticks` earlier ones.
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

    /// Returns the times of the last and the next tick, ns, and the `rewired` flag.
    /// The flag is true if links have changed since the last tick.
    pub fn snapshot(&self) -> (u64, u64, bool) {
        (self.last_tick, self.due, self.rewired)
    }

    /// Resumes from a snapshot.
    pub fn restore(&mut self, last_tick: u64, due: u64, rewired: bool) {
        (self.last_tick, self.due, self.rewired) = (last_tick, due, rewired);
    }
}
