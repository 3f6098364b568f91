use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use slate_blackboard::wake::Wake;
use slate_runtime::sharing::{TeamCarrier, TeamExchange};

use crate::peers::locked;

/// Messages that wait for the thread; more are lost, which later ones make good.
const WAITING: usize = 256;

/// How another robot is reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum TeamRoute {
    /// By a session of two agents.
    Session,
    /// By a carrier beside them, such as a network.
    Carrier,
}

/// What comes from other agents.
pub(crate) enum TeamNews {
    /// One is there.
    Connected(String, TeamRoute),
    /// One is gone.
    Disconnected(String, TeamRoute),
    /// One tells something.
    Told(String, Vec<u8>),
}

/// Messages of other agents that were not read yet, and a carrier that reaches some of them.
#[derive(Default)]
pub(crate) struct TeamInbox {
    news: Mutex<VecDeque<TeamNews>>,
    carrier: Mutex<Option<Arc<dyn TeamCarrier>>>,
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

    /// Carrier of messages beside the sessions.
    pub fn carrier(&self) -> Option<Arc<dyn TeamCarrier>> {
        locked(&self.carrier).clone()
    }
}

impl TeamExchange for TeamInbox {
    fn set_carrier(&self, carrier: Option<Arc<dyn TeamCarrier>>) {
        *locked(&self.carrier) = carrier;
    }

    fn meet(&self, robot: &str) {
        self.put(TeamNews::Connected(robot.into(), TeamRoute::Carrier));
    }

    fn part(&self, robot: &str) {
        self.put(TeamNews::Disconnected(robot.into(), TeamRoute::Carrier));
    }

    fn hear(&self, robot: &str, message: Vec<u8>) {
        self.put(TeamNews::Told(robot.into(), message));
    }
}
