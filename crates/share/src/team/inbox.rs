use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use slate_blackboard::wake::Wake;
use slate_runtime::sharing::{TeamCarrier, TeamExchange};

use crate::peers::locked;

/// Largest number of waiting messages; later messages make up for dropped ones.
const WAITING: usize = 256;

/// Route to another robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum TeamRoute {
    /// Session of two agents.
    Session,
    /// Additional carrier, such as a network.
    Carrier,
}

/// Event from another robot.
pub(crate) enum TeamNews {
    /// Robot in reach.
    Connected(String, TeamRoute),
    /// Robot out of reach.
    Disconnected(String, TeamRoute),
    /// Message of a robot.
    Told(String, Vec<u8>),
}

/// Unread messages of other robots, and a carrier that reaches some of them.
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

    /// Returns the carrier in addition to the sessions.
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
