//! Team knowledge for an agent.
//! Statements of its blocks reach all robots that are reachable through any chain, and theirs appear on its board, at
//! `team/<topic>`.
//!
//! Blocks state facts in tables, which are outputs like any other ([`Layout`] describes a table), and read tables. A
//! thread polls the former several times a second and writes the latter, so no tick waits for it. [`Member`] is its
//! state machine without threads.

mod inbox;
mod layout;
mod member;
mod number;
mod saved;
mod shown;
mod shown_topics;
mod state;
mod stated_topic;
mod work;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use slate_blackboard::interface::Descriptor;
use slate_blackboard::wake::Wake;
use slate_runtime::configuration::SharedKnowledge;
use slate_runtime::sharing::Site;
use slate_sorted::SortedMap;

use crate::peers::{Peers, lock};
pub(crate) use inbox::{TeamEvent, TeamInbox, TeamRoute};
pub use layout::Layout;
pub use member::{Member, TeamFact};
pub use number::robot_number;
pub use saved::SavedKnowledge;
pub use state::TeamState;
use work::TeamWork;

/// Topics that modules read, with the interfaces of their ports.
pub(crate) type Topics = SortedMap<String, Option<&'static Descriptor>>;

/// Thread of an agent that takes part in a team.
pub(crate) struct Team {
    requests: Arc<TeamRequests>,
    thread: Option<JoinHandle<()>>,
}

/// Requests to the thread.
struct TeamRequests {
    wake: Arc<Wake>,
    topics: Mutex<Option<Topics>>,
    ended: AtomicBool,
}

impl Team {
    /// Starts taking part with the peers that `inbox` reports.
    pub fn start(
        site: &Site,
        knowledge: SharedKnowledge,
        peers: Arc<Peers>,
        inbox: Arc<TeamInbox>,
        random: u32,
    ) -> Result<Self, String> {
        let own = site.board.agent();
        number::check(own, site.agents.keys().map(String::as_str))?;
        for (name, endpoint) in &site.agents {
            peers.connect(name, endpoint).map_err(|error| error.to_string())?;
        }
        let requests = Arc::new(TeamRequests {
            wake: Arc::clone(inbox.wake()),
            topics: Mutex::default(),
            ended: AtomicBool::new(false),
        });
        let mut work = TeamWork::new(site, knowledge, peers, inbox, random);
        let mail = Arc::clone(&requests);
        let thread = std::thread::Builder::new().name("knowledge".into()).spawn(move || work.run(&mail));
        let thread = Some(thread.map_err(|error| format!("a thread can't be started: {error}"))?);
        Ok(Self { requests, thread })
    }

    /// Sets the topics that are read.
    pub fn set_topics(&self, topics: Topics) {
        *lock(&self.requests.topics) = Some(topics);
        self.requests.wake.notify(1);
    }
}

impl Drop for Team {
    fn drop(&mut self) {
        self.requests.ended.store(true, Ordering::Release);
        self.requests.wake.notify(1);
        // One that panicked has ended, too.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}
