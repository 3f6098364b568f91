//! Replicated facts of a team of robots.
//!
//! A [`Replica`] is one robot's copy of the team's knowledge. It [states](Replica::state) and
//! [retracts](Replica::retract) its own facts, and receives those of others by messages. A fact is stored per key and
//! origin, so different statements of robots about one key never overwrite each other: the reader selects by a
//! [`View`].
//!
//! ```
//! use slate_share::knowledge::{Limits, Replica, Statement, View};
//!
//! // Robots 1 and 3 do not know each other; both know robot 2. The last number is random for each start.
//! let mut team: Vec<Replica> = [(1, 77), (2, 5), (3, 901)]
//!     .map(|(robot, random)| Replica::new(robot, random, Limits::default()))
//!     .into();
//! for (one, other) in [(1, 2), (2, 3)] {
//!     team[one - 1].add_neighbor(other as u32);
//!     team[other - 1].add_neighbor(one as u32);
//! }
//! let ball = Statement { schema: 0x5eed, certainty: 0.9, value: b"here" };
//! team[0].state(1_000, b"ball", ball)?;
//!
//! // The host carries messages to their receivers, and calls `tick` of the replicas at about 5 Hz.
//! for round in 0..4 {
//!     for robot in 0..team.len() {
//!         team[robot].tick();
//!         while let Some(message) = team[robot].outgoing() {
//!             team[message.to as usize - 1].receive(robot as u32 + 1, &message.bytes)?;
//!         }
//!     }
//! }
//! let seen = team[2].view(b"ball", View::Newest);
//! assert_eq!((seen[0].origin, seen[0].statement), (1, ball));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Protocol
//! Each start of a robot in which it states something is a *life* of that robot, with a unique *epoch*. A life is a
//! numbered list of statements and retractions, of which only the last about each key is kept. Only its robot writes
//! it. A replica stores each life up to a *version*, the number of a statement. It compares the versions of all lives
//! with its neighbors' in *digests*; the replica with a newer version of a life sends the changes. Fresh facts also go
//! at once to two neighbors, which pass them on. Loss, duplication and reordering only cause delay.
//!
//! # Invariants
//! 1. **A life is stored exactly at its version.** A replica's copy of a life at version *v* equals, to the byte, its
//!    author's state after statement *v*. Changes that need several messages are collected separately and applied as a
//!    whole. So two replicas with the same versions have the same bytes.
//! 2. **Versions only grow**, as long as the life is stored. So nothing old returns: a retracted fact does not exist at
//!    any version after its retraction.
//! 3. **Forgotten retractions are not missed.** The state of a life includes its *floor*: the number up to which its
//!    retractions are forgotten. A replica with a version below the floor receives the whole life, not the changes, and
//!    drops entries that are not in it.
//! 4. **A later life overrules an earlier one by key**; other entries of the earlier one remain valid. So facts of a
//!    robot that has lost its disk stay, and it can still retract them.
//! 5. **A robot that receives a life of its own that is not older than its current one** begins another life and states
//!    everything of this run again. So after a lost disk its statements are the last again as soon as it receives its
//!    earlier ones.
//! 6. A robot states the facts of its lives from the middle of [`Limits::lives`] on again when it receives them, so the
//!    end of these lives loses nothing.
//! 7. A robot that needs room for retractions states all valid facts of its earlier lives again, and *closes* these
//!    lives in the same version of its current life: they are void wherever that version is known.
//!
//! # Guarantees
//! If statements cease and messages get through occasionally along some chain between any two robots, all replicas
//! become identical. They contain each fact that any of them contained and that its origin has not replaced or
//! retracted. A message has at most [`Limits::message`] bytes, and a replica at most [`Limits::memory`].
//!
//! # Limitations
//! - **A fact that no other robot has received** is lost with the memory of its robot, unless the host
//!   [saves](Replica::save) it. Saving has no deadline: restoring old bytes is equivalent to returning after a long
//!   absence.
//! - **Facts of a life that ended [`Limits::lives`] lives ago** are void. They are lost if their robot has not received
//!   them in its second or a later life after that one. The same holds for facts of earlier lives that it has not
//!   received when its current one has retracted more facts than a quarter of [`Limits::facts`].
//! - **A robot that lost its disk is overruled by its former self**, for the keys of its former statements, until it
//!   receives them.
//! - **No order between keys, no mutual exclusion, no agreement.** An action that only one robot may perform needs a
//!   lease.
//! - **A lying neighbor.** An admitted robot may speak for others; any bytes are survived, but well-formed messages
//!   are believed. The carrier decides on admission.
//! - **Two robots of the same number** overrule each other; they stop soon, and [`Counters::contested`] indicates it.

mod error;
mod fact;
mod life;
mod limits;
mod replica;
mod version;
mod wire;

pub use error::{MessageError, Refusal, RestoreError};
pub use fact::{Fact, Statement, View};
pub use limits::Limits;
pub use replica::{Changed, Counters, Outgoing, Replica};
pub use version::Version;
