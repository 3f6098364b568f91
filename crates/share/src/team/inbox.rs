use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use slate_blackboard::wake::Wake;

use crate::peers::locked;

/// Messages that wait for the thread; more are lost, which later ones make good.
const WAITING: usize = 256;

/// What comes from other agents.
pub(crate) enum TeamNews {
    /// One is there.
    Connected(String),
    /// One is gone.
    Disconnected(String),
    /// One tells something.
    Told(String, Vec<u8>),
}

/// What came from other agents and was not looked at.
#[derive(Default)]
pub(crate) struct TeamInbox {
    news: Mutex<VecDeque<TeamNews>>,
    wake: Arc<Wake>,
}

impl TeamInbox {
    pub fn wake(&self) -> &Arc<Wake> {
        &self.wake
    }

    pub fn put(&self, news: TeamNews) {
        let mut all = locked(&self.news);
        if all.len() < WAITING || !matches!(news, TeamNews::Told(..)) {
            all.push_back(news);
        }
        drop(all);
        self.wake.notify(1);
    }

    pub fn take(&self) -> VecDeque<TeamNews> {
        std::mem::take(&mut locked(&self.news))
    }
}
