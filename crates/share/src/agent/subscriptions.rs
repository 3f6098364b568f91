//! Subscriptions that links share, as several may read fields of one property.

use std::sync::Arc;

use slate_sorted::SortedMap;

use crate::peers::{PeerError, Peers, Status, WantedProperty};

pub(super) struct Subscriptions {
    pub peers: Arc<Peers>,
    /// Subscriptions by agent and property, with the number of users.
    open: SortedMap<(String, String), (u32, usize)>,
}

impl Subscriptions {
    pub fn new(peers: Arc<Peers>) -> Self {
        Self { peers, open: SortedMap::new() }
    }

    /// Adds a user of a subscription; the first user creates it.
    /// The options are those of the first user.
    pub fn begin(&mut self, agent: &str, demand: WantedProperty) -> Result<(), PeerError> {
        let key = (agent.to_owned(), demand.path.clone());
        if let Some((_, users)) = self.open.get_mut(&key) {
            *users += 1;
            return Ok(());
        }
        let id = self.peers.subscribe(agent, demand)?;
        self.open.insert(key, (id, 1));
        Ok(())
    }

    /// Removes a user of a subscription.
    /// The last one ends it, and the property leaves the board.
    pub fn end(&mut self, agent: &str, property: &str) {
        let key = (agent.to_owned(), property.to_owned());
        let Some((id, users)) = self.open.get_mut(&key) else { return };
        *users -= 1;
        if *users == 0 {
            self.peers.unsubscribe(agent, *id);
            self.open.remove(&key);
        }
    }

    pub fn status(&self, agent: &str, property: &str) -> Option<Status> {
        let (id, _) = self.open.get(&(agent.to_owned(), property.to_owned()))?;
        self.peers.status(agent, *id)
    }
}
