use super::wire::PacketHead;

/// Identity of an agent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// The agent's name.
    pub agent: String,
    /// Number unique to each start, which the host chooses.
    pub instance: u64,
}

/// State of the connection, with the identity of the other agent.
#[derive(Debug)]
pub(super) struct SessionConnection {
    pub own: Identity,
    /// Number of the connection attempt.
    pub attempt: u64,
    pub other: Option<OtherAgent>,
    /// Mutual greeting; true once both know of each other.
    pub established: bool,
    /// Time of the last received packet.
    pub last_received: u64,
    /// Time of the next greeting.
    pub greet_at: u64,
    /// Time of the connection.
    pub since: u64,
}

/// Other agent as of its last greeting.
#[derive(Clone, Debug)]
pub(super) struct OtherAgent {
    pub identity: Identity,
    pub token: u64,
    pub attempt: u64,
}

/// Classification of a greeting.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Greeting {
    /// Repeated greeting of a known agent.
    Known,
    /// Greeting of an unknown agent.
    /// It must receive a packet of this agent before it counts.
    New,
    /// Greeting of the connected agent that begins a new connection.
    Reconnect,
    /// Outdated greeting.
    Stale,
    /// Greeting of another agent with the connected agent's name.
    Duplicate,
}

impl SessionConnection {
    pub fn new(own: Identity) -> Self {
        Self { own, attempt: 1, other: None, established: false, last_received: 0, greet_at: 0, since: 0 }
    }

    /// Returns the token of this connection of this agent.
    pub fn token(&self) -> u64 {
        token(self.own.instance, self.attempt)
    }

    pub fn head(&self) -> PacketHead {
        PacketHead { from: self.token(), to: self.other.as_ref().map_or(0, |other| other.token) }
    }

    /// Returns whether a packet belongs to this connection.
    pub fn is_ours(&self, head: PacketHead) -> bool {
        head.to == self.token() && self.other.as_ref().is_some_and(|other| other.token == head.from)
    }

    /// Takes a greeting.
    pub fn greet(&mut self, from: u64, identity: Identity, attempt: u64) -> Greeting {
        let other = OtherAgent { identity, token: from, attempt };
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
        if self.established {
            return if same { Greeting::Reconnect } else { Greeting::Duplicate };
        }
        // Of those that may be old packets the one that is there continues greeting.
        self.other = Some(other);
        Greeting::New
    }

    /// Ends the connection; packets in transfer belong to no later one.
    pub fn end(&mut self, now: u64) {
        self.attempt += 1;
        self.other = None;
        self.established = false;
        self.greet_at = now;
    }
}

/// Returns a number unique to an instance and its attempt; never 0.
fn token(instance: u64, attempt: u64) -> u64 {
    // The finalizer of SplitMix64.
    let mut mixed = instance.wrapping_add(attempt.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (mixed ^ (mixed >> 31)).max(1)
}
