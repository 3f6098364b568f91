//! Keys of `rmw_zenoh`: messages, and liveliness tokens of nodes and endpoints.

use slate_dds::TopicQuality;
use xxhash_rust::xxh3::xxh3_128;

use super::attachment::Gid;
use super::quality;
use crate::name::NodeName;

/// First part of tokens.
const ADMINISTRATION: &str = "@ros2_lv";

/// Replacement of `/` in names.
const SLASH: char = '%';

/// Maximum length of a token, bytes.
const MAX_LENGTH: usize = 2_000;

/// Kind of a node's endpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EndpointKind {
    Publisher,
    Subscription,
    Server,
    Client,
}

impl EndpointKind {
    const ALL: [(Self, &'static str); 4] =
        [(Self::Publisher, "MP"), (Self::Subscription, "MS"), (Self::Server, "SS"), (Self::Client, "SC")];

    /// Returns the other end.
    pub fn other(self) -> Self {
        match self {
            Self::Publisher => Self::Subscription,
            Self::Subscription => Self::Publisher,
            Self::Server => Self::Client,
            Self::Client => Self::Server,
        }
    }

    /// Returns the word of ROS for it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Publisher => "publisher",
            Self::Subscription => "subscription",
            Self::Server => "server",
            Self::Client => "client",
        }
    }

    fn text(self) -> &'static str {
        Self::ALL.iter().find(|(kind, _)| *kind == self).map_or("", |(_, text)| text)
    }
}

/// Publisher, a subscription, or an end of a service.
#[derive(Clone, Debug, PartialEq)]
pub struct GraphEndpoint {
    pub kind: EndpointKind,
    /// Topic or service, such as `/scan`.
    pub name: String,
    /// Type in DDS, such as `sensor_msgs::msg::dds_::LaserScan_`.
    pub type_name: String,
    pub hash: String,
    pub quality: TopicQuality,
}

impl GraphEndpoint {
    /// Returns the key of its messages.
    pub fn key(&self, domain: u16) -> String {
        format!("{domain}/{}/{}/{}", self.name.trim_matches('/'), self.type_name, self.hash)
    }
}

/// Node that owns tokens.
#[derive(Clone, Debug)]
pub struct TokenOwner {
    pub domain: u16,
    /// Session of Zenoh.
    pub session: String,
    pub node: NodeName,
}

impl TokenOwner {
    /// Returns the token of the node.
    pub fn node_token(&self) -> String {
        self.token("0", "NN")
    }

    /// Returns the token of one of its endpoints, distinguished by a number.
    pub fn endpoint_token(&self, endpoint: &GraphEndpoint, number: usize) -> String {
        let GraphEndpoint { kind, name, type_name, hash, quality } = endpoint;
        format!(
            "{}/{}/{}/{}/{}",
            self.token(&number.to_string(), kind.text()),
            mangled(name),
            mangled(type_name),
            mangled(hash),
            quality::encode(*quality)
        )
    }

    fn token(&self, number: &str, kind: &str) -> String {
        let Self { domain, session, node } = self;
        let (space, name) = (mangled(&node.namespace), mangled(&node.name));
        // The agent is one node of its session, in no enclave.
        format!("{ADMINISTRATION}/{domain}/{session}/0/{number}/{kind}/{SLASH}/{space}/{name}")
    }
}

/// Returns the key expression of all tokens of a domain.
pub fn tokens_of(domain: u16) -> String {
    format!("{ADMINISTRATION}/{domain}/**")
}

/// Returns the identity of an endpoint, as all nodes compute it from its token.
pub fn gid(token: &str) -> Gid {
    xxh3_128(token.as_bytes()).to_le_bytes()
}

/// Entity that another session's token announces.
#[derive(Clone, Debug, PartialEq)]
pub struct Entity {
    pub session: String,
    /// Node, such as `/robots/r2`.
    pub node: String,
    /// Endpoint; `None` for the node itself.
    pub endpoint: Option<GraphEndpoint>,
}

impl Entity {
    /// Parses a token; `None` if it is invalid.
    pub fn parse(token: &str) -> Option<Self> {
        let parts: Vec<_> = token.split('/').collect();
        if token.len() > MAX_LENGTH || parts.iter().any(|part| part.is_empty()) {
            return None;
        }
        let [ADMINISTRATION, _, session, _, _, kind, _, space, name, ..] = parts[..] else { return None };
        let node = format!("{}/{}", plain(space).trim_end_matches('/'), plain(name));
        let endpoint = match (kind, &parts[9..]) {
            ("NN", _) => None,
            (kind, [name, type_name, hash, quality, ..]) => Some(GraphEndpoint {
                kind: EndpointKind::ALL.iter().find(|(_, text)| *text == kind)?.0,
                name: plain(name),
                type_name: plain(type_name),
                hash: plain(hash),
                quality: quality::decode(quality)?,
            }),
            _ => return None,
        };
        Some(Self { session: session.into(), node, endpoint })
    }
}

fn mangled(name: &str) -> String {
    name.replace('/', &SLASH.to_string())
}

fn plain(name: &str) -> String {
    name.replace(SLASH, "/")
}
