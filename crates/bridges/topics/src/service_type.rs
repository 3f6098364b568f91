//! Types of services.

use slate_ros_messages::{Definition, WireFormat};

use crate::message_type::MessageType;
use crate::type_hash::type_hash;

/// Services that are known without a definition.
const STANDARD_SERVICES: [(&str, &str); 3] = [
    ("Empty", "---"),
    ("SetBool", "bool data\n---\nbool success\nstring message"),
    ("Trigger", "---\nbool success\nstring message"),
];

/// Line between request and response of a definition.
const SEPARATOR: &str = "---";

/// Messages of `service_msgs`, which the event of each service has.
const EVENT_INFO: &str = "\
====
MSG: service_msgs/ServiceEventInfo
uint8 event_type
builtin_interfaces/Time stamp
char[16] client_gid
int64 sequence_number
";

/// Type of a service: its request and its response.
#[derive(Clone, Debug, PartialEq)]
pub struct ServiceType {
    name: String,
    request: MessageType,
    response: MessageType,
}

/// Returns the prefix of a standard service name in a format.
fn folder(format: WireFormat) -> &'static str {
    if format == WireFormat::Ros1 { "std_srvs/" } else { "std_srvs/srv/" }
}

impl ServiceType {
    /// Returns a ROS service that needs no definition, such as `std_srvs/srv/SetBool`.
    /// In ROS 1 `std_srvs/SetBool`.
    ///
    /// # Errors
    /// The service needs a definition; the text lists those that don't.
    pub fn known(format: WireFormat, name: &str) -> Result<Self, String> {
        let short = name.strip_prefix(folder(format));
        let found = STANDARD_SERVICES.iter().find(|(known, _)| Some(*known) == short);
        let (_, definition) = found.ok_or_else(|| {
            let known = STANDARD_SERVICES.map(|(known, _)| format!("{}{known}", folder(format))).join(", ");
            format!("the definition of {name} is unknown; known ones: {known}")
        })?;
        Self::parse(format, name, definition)
    }

    /// Parses a `.srv` file.
    /// Messages in it follow, each after a line of `=` and `MSG: package/Name`.
    ///
    /// # Errors
    /// The name or the text is invalid; the reason in words.
    pub fn parse(format: WireFormat, name: &str, definition: &str) -> Result<Self, String> {
        let parts: Vec<_> = name.split('/').collect();
        let is_name = match (format, &parts[..]) {
            (WireFormat::Ros1, [package, own]) | (WireFormat::Cdr, [package, "srv", own]) => {
                !package.is_empty() && !own.is_empty()
            }
            _ => false,
        };
        if !is_name {
            return Err(format!("`{name}` is not a type of a service, such as {}SetBool", folder(format)));
        }
        Self::parse_named(format, name, definition)
    }

    /// Parses a service, including those of actions; see [`parse`](Self::parse).
    pub(crate) fn parse_named(format: WireFormat, name: &str, definition: &str) -> Result<Self, String> {
        let mut lines = definition.lines();
        let request: Vec<_> = lines.by_ref().take_while(|line| line.trim() != SEPARATOR).collect();
        let response: Vec<_> = lines.collect();
        if request.len() == definition.lines().count() {
            return Err(format!("no line `{SEPARATOR}` separates the response of {name} from its request"));
        }
        let inside = response.iter().position(|line| line.starts_with("==="));
        let messages = inside.map_or(&[][..], |first| &response[first..]);
        let between = if format == WireFormat::Ros1 { "" } else { "_" };
        let part =
            |part: &str, text: String| MessageType::parse(format, &format!("{name}{between}{part}"), &text);
        let request = part("Request", [&request, messages].concat().join("\n"))?;
        Ok(Self { name: name.into(), request, response: part("Response", response.join("\n"))? })
    }

    /// Returns the name in ROS, such as `std_srvs/srv/SetBool`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the request.
    pub fn request(&self) -> &MessageType {
        &self.request
    }

    /// Returns the response.
    pub fn response(&self) -> &MessageType {
        &self.response
    }

    /// Returns the hash by which ROS 2 nodes compare it.
    /// That of a type with its request, its response and its event.
    pub fn type_hash(&self) -> Option<String> {
        let (package, own) = (self.name.split('/').next()?, self.name.rsplit('/').next()?);
        let part = |part: &str, text: &str| format!("====\nMSG: {package}/{own}_{part}\n{text}\n");
        let event = format!(
            "service_msgs/ServiceEventInfo info\n{own}_Request[<=1] request\n{own}_Response[<=1] response"
        );
        let text = [
            format!(
                "{own}_Request request_message\n{own}_Response response_message\n{own}_Event event_message\n"
            ),
            part("Request", self.request.definition()),
            part("Response", self.response.definition()),
            part("Event", &event),
            EVENT_INFO.into(),
        ];
        type_hash(&Definition { name: self.name.clone(), text: text.concat() }).ok()
    }
}
