//! Additional channel with more depth, for a reader that comes later.
//! The writer of the first channel writes every value to both. Existing readers keep the first one, and do not notice.

use std::sync::Arc;

use super::{Budget, Channel, HandleChange, LinkError, Policy, QueueReader, Start, Writer};

impl Channel {
    /// Creates the writer of a channel for the same values that keeps `depth` of them.
    /// It is for this channel's writer, by [`deepen`](Writer::deepen). Its values are in private memory.
    ///
    /// # Errors
    /// When no memory is left for values.
    pub fn deeper(self: &Arc<Self>, depth: usize, budget: Budget) -> Result<Writer, LinkError> {
        let deeper = Self::new(self.shape, depth, budget);
        let own = Arc::downgrade(self);
        deeper.hook.set(move |link| {
            // Its readers are this channel's; its writer is this one's, which reports itself.
            if let (HandleChange::ReaderCame | HandleChange::ReaderLeft, Some(own)) = (link, own.upgrade()) {
                own.hook.call(link);
            }
        });
        Writer::new(&deeper)
    }

    /// Returns true if a new reader of every value can take `window` values at once.
    /// Twice as many are kept, so that it is far enough from being overtaken.
    pub fn keeps_enough(&self, window: usize) -> bool {
        match self.handles().deeper.clone() {
            Some(deeper) => deeper.keeps_enough(window),
            None => self.ring.len() >= window * 2 && usize::from(self.budget.window) >= window,
        }
    }
}

impl Writer {
    /// Creates a reader of every value of this writer's channel.
    /// As [`Channel::queue`].
    ///
    /// # Errors
    /// As there.
    pub fn queue(&self, policy: Policy, start: Start) -> Result<QueueReader, LinkError> {
        self.channel.queue(policy, start)
    }

    /// Writes to a [deeper](Channel::deeper) channel of this one too from now on.
    /// New readers of every value then read from it, except for those that hold the writer up. The values have the same
    /// numbers, times and generations as here, and the last one is there already. Each value is copied once more.
    pub fn deepen(&mut self, mut deeper: Writer) {
        if let Some(own) = &mut self.deeper {
            own.deepen(deeper);
            return self.drop_unread();
        }
        deeper.set_generation(self.generation());
        let (shown, last) = (self.channel.published(), self.last().sequence);
        if shown > 0 {
            let held = self.channel.pool.pin(self.channel.cell(shown));
            // SAFETY: the pin is given back after the copy.
            let loan = unsafe { held.lend() };
            deeper.place(loan.bytes(), loan.items(), loan.stamp(), shown);
            held.give_back();
        }
        deeper.skip(last - shown);
        self.channel.handles().deeper = Some(Arc::clone(&deeper.channel));
        self.deeper = Some(Box::new(deeper));
    }

    /// Drops an unread deeper channel if a still deeper one takes its place.
    /// So values are copied no more often than there are depths in use.
    fn drop_unread(&mut self) {
        let mut handles = self.channel.handles();
        let Some(own) = self.deeper.as_mut().filter(|own| !own.channel.has_readers()) else { return };
        let Some(next) = own.deeper.take() else { return };
        handles.deeper = Some(Arc::clone(&next.channel));
        let unread = self.deeper.replace(next);
        // Not under the lock, as it tells that it leaves.
        drop(handles);
        drop(unread);
    }
}
