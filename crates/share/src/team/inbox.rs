use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use slate_blackboard::wake::Wake;

use crate::peers::locked;

/// Messages that wait for the thread; more are lost, which later ones make good.
const WAITING: usize = 256;

/// What comes from other agents.
pub(crate) enum News {
    /// One is there.
    Connected(String),
    /// One is gone.
    Disconnected(String),
    /// One tells something.
    Told(String, Vec<u8>),
}

/// What came from other agents and was not looked at.
#[derive(Default)]
pub(crate) struct Inbox {
    news: Mutex<VecDeque<News>>,
    wake: Arc<Wake>,
}

impl Inbox {
    pub fn wake(&self) -> &Arc<Wake> {
        &self.wake
    }

    pub fn put(&self, news: News) {
        let mut all = locked(&self.news);
        if all.len() < WAITING || !matches!(news, News::Told(..)) {
            all.push_back(news);
        }
        drop(all);
        self.wake.notify(1);
    }

    pub fn take(&self) -> VecDeque<News> {
        std::mem::take(&mut locked(&self.news))
    }
}
