use super::wire::PacketHead;

/// Who an agent is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// The agent's name.
    pub agent: String,
    /// Another number after each start, which the host chooses.
    pub instance: u64,
}

/// Whether the other agent is there, and which one it is.
#[derive(Debug)]
pub(super) struct SessionConnection {
    pub own: Identity,
    /// Counts the connections that were begun.
    pub attempt: u64,
    pub other: Option<Other>,
    /// Whether both know of each other.
    pub together: bool,
    /// When something was heard last.
    pub heard: u64,
    /// When this agent greets again.
    pub greet_at: u64,
    /// When both came together.
    pub since: u64,
}

/// The other agent, as its last greeting says.
#[derive(Clone, Debug)]
pub(super) struct Other {
    pub identity: Identity,
    pub token: u64,
    pub attempt: u64,
}

/// What a greeting means.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Greeting {
    /// Who is known greets again.
    Known,
    /// Who was not known; it has to hear of this agent before it counts.
    New,
    /// The agent that is connected begins anew.
    Again,
    /// An old packet.
    Stale,
    /// Another one of the name of the agent that is connected.
    Duplicate,
}

impl SessionConnection {
    pub fn new(own: Identity) -> Self {
        Self { own, attempt: 1, other: None, together: false, heard: 0, greet_at: 0, since: 0 }
    }

    /// Identifies this connection of this agent.
    pub fn token(&self) -> u64 {
        token(self.own.instance, self.attempt)
    }

    pub fn head(&self) -> PacketHead {
        PacketHead { from: self.token(), to: self.other.as_ref().map_or(0, |other| other.token) }
    }

    /// Whether a packet belongs to this connection.
    pub fn is_ours(&self, head: PacketHead) -> bool {
        head.to == self.token() && self.other.as_ref().is_some_and(|other| other.token == head.from)
    }

    /// Takes a greeting.
    pub fn greet(&mut self, from: u64, identity: Identity, attempt: u64) -> Greeting {
        let other = Other { identity, token: from, attempt };
        let Some(known) = &self.other else {
            self.other = Some(other);
            return Greeting::New;
        };
        if known.token == from {
            return Greeting::Known;
        }
        let same = known.identity == other.identity;
        if same && known.attempt > attempt {
            return Greeting::Stale;
        }
        if self.together {
            return if same { Greeting::Again } else { Greeting::Duplicate };
        }
        // Of those that may be old packets the one that is there goes on greeting.
        self.other = Some(other);
        Greeting::New
    }

    /// Begins anew, so that nothing that is under way belongs to this connection.
    pub fn end(&mut self, now: u64) {
        self.attempt += 1;
        self.other = None;
        self.together = false;
        self.greet_at = now;
    }
}

/// A number that differs between instances and their connections, and is never 0.
fn token(instance: u64, attempt: u64) -> u64 {
    // The finaliser of SplitMix64.
    let mut mixed = instance.wrapping_add(attempt.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (mixed ^ (mixed >> 31)).max(1)
}
