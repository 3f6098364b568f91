//! Names of nodes, topics and types, as ROS and DDS have them.

/// Name of a node: its namespace, such as `/` or `/robots/r2`, and its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeName {
    /// Begins with a slash.
    pub namespace: String,
    /// Name without a slash.
    pub name: String,
}

impl NodeName {
    /// Returns the node of an agent; characters that ROS forbids become `_`.
    pub fn of_agent(agent: &str) -> Self {
        let mut name: String =
            agent.chars().map(|own| if own.is_ascii_alphanumeric() { own } else { '_' }).collect();
        if name.starts_with(|first: char| first.is_ascii_digit()) {
            name.insert(0, '_');
        }
        Self { namespace: "/".into(), name }
    }

    /// Returns the whole name of a topic.
    /// `scan` is in the namespace, `~/scan` in that of the node.
    ///
    /// # Errors
    /// ROS forbids it; the reason in words.
    pub fn topic(&self, name: &str) -> Result<String, String> {
        let space = self.namespace.trim_end_matches('/');
        let whole = match name.strip_prefix('~') {
            Some(private) if private.starts_with('/') => format!("{space}/{}{private}", self.name),
            Some(_) => return Err("`~` is followed by a slash, as in ~/scan".into()),
            None if name.starts_with('/') => name.to_owned(),
            None => format!("{space}/{name}"),
        };
        check_topic(&whole)?;
        Ok(whole)
    }
}

#[cfg(feature = "wire")]
impl NodeName {
    /// Returns the whole name of a topic or service of the node itself.
    ///
    /// # Errors
    /// The name of the node is too long.
    pub fn private(&self, name: &str) -> Result<String, slate_topics::RosError> {
        self.topic(&format!("~/{name}")).map_err(|reason| slate_topics::RosError::Definition {
            name: name.into(),
            reason,
            help: "take a shorter name for the node: node = \"r2\" in [ros2]",
        })
    }
}

/// Maximum length of a topic name that `rmw` accepts.
const MAX_NAME_LENGTH: usize = 247;

/// Checks the whole name of a topic, such as `/r2/scan`.
///
/// # Errors
/// ROS forbids it; the reason in words.
pub fn check_topic(name: &str) -> Result<(), String> {
    let Some(parts) = name.strip_prefix('/') else { return Err("it does not begin with a slash".into()) };
    if name.len() > MAX_NAME_LENGTH {
        return Err(format!("it has {} letters, more than {MAX_NAME_LENGTH}", name.len()));
    }
    parts.split('/').try_for_each(check_part)
}

/// Checks the name of a node.
///
/// # Errors
/// ROS forbids it; the reason in words.
pub fn check_node(name: &str) -> Result<(), String> {
    check_part(name)
}

fn check_part(part: &str) -> Result<(), String> {
    let wrong = part.chars().find(|own| !own.is_ascii_alphanumeric() && *own != '_');
    match (part, wrong) {
        ("", _) => Err("a part of it is empty: single slashes separate parts, and none is at the end".into()),
        (_, Some(wrong)) => Err(format!("it has {wrong:?}, and ROS allows letters, digits, `_` and `/`")),
        _ if part.starts_with(|first: char| first.is_ascii_digit()) => {
            Err(format!("`{part}` begins with a digit"))
        }
        _ if part.contains("__") => Err(format!("`{part}` has two `_` in a row")),
        _ => Ok(()),
    }
}

/// Returns the topic of DDS: `/scan` is `rt/scan`.
pub fn wire_topic(topic: &str) -> String {
    format!("rt{topic}")
}

/// Returns the topic of a service's requests.
/// That of `/enable` is `rq/enableRequest`.
#[cfg(feature = "dds")]
pub fn request_topic(service: &str) -> String {
    format!("rq{service}Request")
}

/// Returns the topic of a service's responses.
/// That of `/enable` is `rr/enableReply`.
#[cfg(feature = "dds")]
pub fn reply_topic(service: &str) -> String {
    format!("rr{service}Reply")
}

/// Returns the DDS type of a message.
/// `sensor_msgs/msg/LaserScan` is `sensor_msgs::msg::dds_::LaserScan_`.
pub fn type_name(message: &str) -> String {
    match message.rsplit_once('/') {
        Some((package, name)) => format!("{}::dds_::{name}_", package.replace('/', "::")),
        None => message.into(),
    }
}

/// Returns the ROS message of a DDS type; other types stay unchanged.
#[cfg(feature = "wire")]
pub fn message_name(type_name: &str) -> String {
    let found = type_name.strip_suffix('_').and_then(|name| name.split_once("::dds_::"));
    found.map_or_else(
        || type_name.chars().take(120).collect(),
        |(package, name)| format!("{}/{name}", package.replace("::", "/")),
    )
}
