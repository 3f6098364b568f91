//! Facts that every robot of a team comes to know.
//!
//! A [`Replica`] is what one robot holds of the team's knowledge. It [states](Replica::state) and
//! [retracts](Replica::retract) facts of its own, and gets to know those of others by messages. A fact is kept per key and
//! origin, so robots that state different things about one key never overwrite each other: a [`View`] chosen by the reader
//! settles what is seen.
//!
//! ```
//! use slate_share::knowledge::{Limits, Replica, Statement, View};
//!
//! // Robots 1 and 3 do not know each other; both know robot 2. The last number is random for each start.
//! let mut team: Vec<Replica> = [(1, 77), (2, 5), (3, 901)]
//!     .map(|(robot, random)| Replica::new(robot, random, Limits::default()))
//!     .into();
//! for (one, other) in [(1, 2), (2, 3)] {
//!     team[one - 1].meet(other as u32);
//!     team[other - 1].meet(one as u32);
//! }
//! let ball = Statement { schema: 0x5eed, certainty: 0.9, value: b"here" };
//! team[0].state(1_000, b"ball", ball)?;
//!
//! // What a host does: it carries messages to whom they are for, and lets the replicas tick 5 times a second or so.
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
//! # How it works
//! Each start of a robot in which it states something is a *life* of it, with an *epoch* that no other life has. A life
//! is a numbered list of statements and retractions of which only the last about each key is kept. Its robot is its only
//! author. A replica knows each life up to a *version*, the number of a statement, and the versions of all lives together
//! are what it compares with its neighbours' in *digests*: whoever has a newer version of a life sends what changed in it.
//! Fresh facts also go out at once to two neighbours, which pass them on. Loss, duplication and reordering only delay.
//!
//! # Invariants
//! 1. **A life is held exactly at its version.** What a replica holds of a life at version *v* is, to the byte, what its
//!    author had after statement *v*. Changes that need several messages are collected aside and take effect as a whole.
//!    So two replicas with the same versions hold the same bytes.
//! 2. **Versions only grow**, as long as the life is held. So nothing old comes back: at no version after a retraction is
//!    the fact there.
//! 3. **Forgotten retractions are not missed.** A life says up to which number its retractions are forgotten, its
//!    *floor*, as part of its state. Who knows it less far does not get what changed, but all of it, and drops what is
//!    not there.
//! 4. **A later life overrules an earlier one by key**, and lets all else of it stand. So facts of a robot that has lost
//!    its disk stay, and it can still retract them.
//! 5. **A robot that hears of a life of its own that is not older than its present one** begins another one and states
//!    everything of this run anew. So after a lost disk its word is the last again as soon as it hears of what it said before.
//! 6. A robot states anew what it hears of its lives from the middle of [`Limits::lives`] on, so that their end loses nothing.
//! 7. Who has to make room for retractions states anew all that stands of its earlier lives, and *closes* them in the
//!    same version of its present life: they are void wherever that version is known.
//!
//! # What is guaranteed
//! When nothing is stated any more and messages get through now and then along some chain between any two robots, all
//! replicas become identical. They hold each fact that any of them held and that its origin has not replaced or
//! retracted. A message has at most [`Limits::message`] bytes, and a replica at most [`Limits::memory`].
//!
//! # What is not
//! - **A fact that nobody else has heard** is gone with the memory of its robot, unless the host [saves](Replica::save) it.
//!   Nothing has to be saved in time: restoring old bytes is the same as coming back after a long absence.
//! - **Facts of a life that ended [`Limits::lives`] lives ago** are void. They are lost if their robot has not heard of
//!   them in its second or a later life after that one. The same holds for facts of earlier lives that it has not heard of when its
//!   present one has retracted more facts than a quarter of [`Limits::facts`].
//! - **A robot that lost its disk is overruled by its former self**, for the keys of which that spoke, until it hears of it.
//! - **No order between keys, no mutual exclusion, no agreement.** What may be done by one robot only needs a lease.
//! - **A lying neighbour.** Who is let in may speak for others; any bytes are survived, but what is well formed is believed.
//!   Who may connect is the carrier's matter.
//! - **Two robots of the same number** overrule each other; they stop soon, and [`Counters::contested`] tells.

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
