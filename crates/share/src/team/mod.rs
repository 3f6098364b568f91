//! The knowledge of a team, for an agent: what its blocks state reaches all robots that are reachable through any chain, and what
//! they state shows on its board, at `team/<topic>`.
//!
//! Blocks state facts in tables, which are outputs like any other ([`Layout`] says what a table looks like), and read tables. A
//! thread looks at the former several times a second and writes the latter: no tick waits for it. A [`Member`] is what it
//! works with, without threads.

mod inbox;
mod layout;
mod member;
mod number;
mod saved;
mod showing;
mod shown;
mod state;
mod stating;
mod work;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use slate_blackboard::interface::Descriptor;
use slate_blackboard::wake::Wake;
use slate_runtime::configuration::SharedKnowledge;
use slate_runtime::sharing::Site;

use crate::peers::{Peers, locked};
pub(crate) use inbox::{TeamInbox, TeamNews, TeamRoute};
pub use layout::Layout;
pub use member::{Known, Member};
pub use number::robot_number;
pub use saved::SavedKnowledge;
pub use state::TeamState;
use work::TeamWork;

/// The topics that modules read, and what their ports are.
pub(crate) type Topics = BTreeMap<String, Option<&'static Descriptor>>;

/// The thread of an agent that takes part in a team.
pub(crate) struct Team {
    post: Arc<TeamPost>,
    thread: Option<JoinHandle<()>>,
}

/// What the thread is told.
struct TeamPost {
    wake: Arc<Wake>,
    topics: Mutex<Option<Topics>>,
    ended: AtomicBool,
}

impl Team {
    /// Begins to take part, beside the peers that `inbox` hears of.
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
        let post = Arc::new(TeamPost {
            wake: Arc::clone(inbox.wake()),
            topics: Mutex::default(),
            ended: AtomicBool::new(false),
        });
        let mut work = TeamWork::new(site, knowledge, peers, inbox, random);
        let mail = Arc::clone(&post);
        let thread = std::thread::Builder::new().name("knowledge".into()).spawn(move || work.run(&mail));
        let thread = Some(thread.map_err(|error| format!("a thread can't be started: {error}"))?);
        Ok(Self { post, thread })
    }

    /// These topics are read from now on.
    pub fn want(&self, topics: Topics) {
        *locked(&self.post.topics) = Some(topics);
        self.post.wake.notify(1);
    }
}

impl Drop for Team {
    fn drop(&mut self) {
        self.post.ended.store(true, Ordering::Release);
        self.post.wake.notify(1);
        // One that panicked has ended, too.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}
