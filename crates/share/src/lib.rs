//! Sharing between agents: their properties, and the knowledge of a team.
//!
//! A module with a link to another agent's property is unaware of the distance. The agent subscribes to that property
//! and maintains a mirror of it on its own board, at `agents/<agent>/<path>`, which its modules read like any other
//! property. Each subscription has its own rate, selection of values (all or the newest) and reliability. No tick and
//! no other agent ever waits for a slow or dead one: each has two threads and streams of its own, and values stay in
//! the property's own queue until they can be sent.
//!
//! [`session`] is the protocol of two agents, without sockets, clocks or threads. A [`carrier`] transports its packets:
//! [`carrier::local`] on one machine, `carrier::tls` (feature `tls`) between machines. [`peers`] connects both to a
//! board.
//!
//! [`knowledge`] is the protocol by which facts reach every robot that is reachable through any chain of robots in
//! contact. It is a state machine without sockets, clocks and threads: the host passes messages to it and sends its
//! messages, over any transport. [`team`] connects it to a board and to the sessions.
//!
//! ```
//! use std::sync::Arc;
//!
//! use slate_blackboard::Board;
//! use slate_share::peers::{Peers, Setup, WantedProperty};
//! use slate_share::session::{Identity, Options};
//!
//! // The host's clock, and a number for this start of the agent.
//! let clock = Arc::new(|| 0);
//! let identity = Identity { agent: "arm".into(), instance: 1 };
//! let board = Arc::new(Board::new("arm"));
//! let peers = Peers::start(&board, Setup::new(identity, clock))?;
//!
//! peers.connect("base", "local:base")?;
//! let every_50_ms = Options::default().periodic(50_000_000);
//! peers.subscribe("base", WantedProperty::new("localizer/pose", every_50_ms))?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod agent;
pub mod carrier;
pub mod encoding;
pub mod knowledge;
pub mod peers;
pub mod schema;
pub mod session;
pub mod team;
