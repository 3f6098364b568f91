use std::sync::Arc;

use slate_blackboard::wake::Wake;

/// Wakes the thread that receives.
#[derive(Debug)]
pub struct ReaderWaker(pub Arc<Wake>);

impl std::task::Wake for ReaderWaker {
    fn wake(self: Arc<Self>) {
        self.0.notify(1);
    }
}
