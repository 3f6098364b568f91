//! Agents on a network of [Zenoh](https://zenoh.io).
//! A property `slate://arm/localizer/pose` is the key `slate/arm/localizer/pose`, and any program of Zenoh reads it,
//! sets it if the agent lets it, and sees that the agent runs.
//!
//! | key | what it is |
//! |---|---|
//! | `slate/AGENT/PATH` | a property: published when it changes, answers with its newest value |
//! | `slate/AGENT/@read/OPTIONS/PATH` | the same for readers with [`ReadOptions`], which begin with a query |
//! | `slate/AGENT/@set/PATH` | sets a property or sends a message, by a query with a payload |
//! | `slate/AGENT/@alive` | liveliness token: the agent is there; answers with its name, as JSON |
//! | `slate/AGENT/@tree` | answers with the list of its properties, as JSON; `@tree/NAME` with those that NAME may use |
//! | `slate/AGENT/@team` | liveliness token: the agent takes part in its team; messages to another one are at `@team/NAME` |
//! | `slate/AGENT/@schema/INTERFACE` | answers with the definition of an interface, as JSON |
//!
//! Values are CDR as in recordings, `application/cdr;slate_msgs/msg/NAME`, with a [`SampleAttachment`] beside them.
//!
//! A [`NetworkSettings`] is the table `[network]` of a configuration, and its links with `zenoh:`. `AgentNetwork` needs the
//! feature `zenoh`.

#[cfg(feature = "zenoh")]
mod access;
mod attachment;
mod check;
#[cfg(feature = "zenoh")]
mod duplicate_name;
mod endpoint;
mod error;
mod key;
#[cfg(feature = "zenoh")]
mod links;
#[cfg(feature = "zenoh")]
mod messages;
#[cfg(feature = "zenoh")]
mod network;
mod options;
#[cfg(feature = "zenoh")]
mod order;
mod payload;
#[cfg(feature = "zenoh")]
mod publisher;
#[cfg(feature = "zenoh")]
mod publishing;
#[cfg(feature = "zenoh")]
mod reading;
#[cfg(feature = "zenoh")]
mod recovery;
#[cfg(feature = "zenoh")]
mod refusal;
#[cfg(feature = "zenoh")]
mod rejections;
#[cfg(feature = "zenoh")]
mod requests;
#[cfg(feature = "zenoh")]
mod session;
mod settings;
#[cfg(feature = "zenoh")]
mod shared;
#[cfg(feature = "zenoh")]
mod streams;
#[cfg(feature = "zenoh")]
mod subscriber;
#[cfg(feature = "zenoh")]
mod team;

#[cfg(feature = "zenoh")]
pub use access::router_access_control;
pub use attachment::{AttachmentError, SampleAttachment};
pub use check::check_properties;
pub use endpoint::NetworkEndpoint;
pub use error::NetworkError;
pub use key::{
    InputSource, alive_agent, alive_key, property_key, read_key, schema_key, set_key, team_key,
    team_token_key, tree_key, tree_key_of,
};
#[cfg(feature = "zenoh")]
pub use network::AgentNetwork;
pub use options::{ReadMode, ReadOptions, ReadRate, ReadValues};
pub use payload::{Decoded, Payload, PayloadError, encoding};
#[cfg(feature = "zenoh")]
pub use reading::ReadingStatus;
#[cfg(feature = "zenoh")]
pub use rejections::log_rejections;
#[cfg(feature = "zenoh")]
pub use session::open_client;
pub use settings::{
    NetworkFile, NetworkInput, NetworkMode, NetworkOutput, NetworkRights, NetworkSecurity, NetworkSettings,
    SCHEME, TABLE,
};
