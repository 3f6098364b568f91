use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use slate_blackboard::wake::Wake;
use slate_runtime::sharing::{TeamCarrier, TeamExchange};

use crate::peers::lock;

/// Largest number of waiting messages; later messages make up for dropped ones.
const MAX_WAITING_MESSAGES: usize = 256;

/// Route to another robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum TeamRoute {
    /// Session of two agents.
    Session,
    /// Additional carrier, such as a network.
    Carrier,
}

/// Event from another robot.
pub(crate) enum TeamEvent {
    /// Robot in reach.
    Connected(String, TeamRoute),
    /// Robot out of reach.
    Disconnected(String, TeamRoute),
    /// Message of a robot.
    Message(String, Vec<u8>),
}

/// Unread messages of other robots, and a carrier that reaches some of them.
#[derive(Default)]
pub(crate) struct TeamInbox {
    events: Mutex<VecDeque<TeamEvent>>,
    carrier: Mutex<Option<Arc<dyn TeamCarrier>>>,
    wake: Arc<Wake>,
}

impl TeamInbox {
    pub fn wake(&self) -> &Arc<Wake> {
        &self.wake
    }

    pub fn put(&self, events: TeamEvent) {
        let mut all = lock(&self.events);
        if all.len() < MAX_WAITING_MESSAGES || !matches!(events, TeamEvent::Message(..)) {
            all.push_back(events);
        }
        drop(all);
        self.wake.notify(1);
    }

    pub fn take(&self) -> VecDeque<TeamEvent> {
        std::mem::take(&mut lock(&self.events))
    }

    /// Returns the carrier in addition to the sessions.
    pub fn carrier(&self) -> Option<Arc<dyn TeamCarrier>> {
        lock(&self.carrier).clone()
    }
}

impl TeamExchange for TeamInbox {
    fn set_carrier(&self, carrier: Option<Arc<dyn TeamCarrier>>) {
        *lock(&self.carrier) = carrier;
    }

    fn meet(&self, robot: &str) {
        self.put(TeamEvent::Connected(robot.into(), TeamRoute::Carrier));
    }

    fn part(&self, robot: &str) {
        self.put(TeamEvent::Disconnected(robot.into(), TeamRoute::Carrier));
    }

    fn receive(&self, robot: &str, message: Vec<u8>) {
        self.put(TeamEvent::Message(robot.into(), message));
    }
}
