use std::time::Duration;

/// Pause before the next attempt, doubled with each that fails.
#[derive(Clone, Debug)]
pub struct Backoff {
    first: Duration,
    most: Duration,
    next: Duration,
}

impl Backoff {
    /// Returns a backoff that begins with the first pause.
    pub fn new(first: Duration, most: Duration) -> Self {
        Self { first, most, next: first }
    }

    /// Returns the pause after one more failure.
    pub fn fail(&mut self) -> Duration {
        let pause = self.next;
        self.next = (pause * 2).min(self.most);
        pause
    }

    /// Resets to the first pause, after a success.
    pub fn succeed(&mut self) {
        self.next = self.first;
    }
}
