//! Types of services.

use serde_json::Value as Json;
use slate_record::ros::{Schema, WireFormat, encode_json_in};

/// Services that are known without a definition.
const KNOWN: [(&str, &str); 3] = [
    ("Empty", "---"),
    ("SetBool", "bool data\n---\nbool success\nstring message"),
    ("Trigger", "---\nbool success\nstring message"),
];

/// Line between request and response of a definition.
const MIDDLE: &str = "---";

/// The type of a service: its request and its response.
#[derive(Clone, Debug)]
pub struct ServiceType {
    format: WireFormat,
    name: String,
    /// Definitions of request and response.
    definitions: (String, String),
    request: Schema,
    response: Schema,
}

impl PartialEq for ServiceType {
    fn eq(&self, other: &Self) -> bool {
        (self.format, &self.name, &self.definitions) == (other.format, &other.name, &other.definitions)
    }
}

/// Prefix of a standard service name in a format.
fn folder(format: WireFormat) -> &'static str {
    if format == WireFormat::Ros1 { "std_srvs/" } else { "std_srvs/srv/" }
}

impl ServiceType {
    /// A service of ROS that needs no definition, such as `std_srvs/srv/SetBool`; in ROS 1 `std_srvs/SetBool`.
    ///
    /// # Errors
    /// The service needs a definition; the text lists those that don't.
    pub fn known(format: WireFormat, name: &str) -> Result<Self, String> {
        let short = name.strip_prefix(folder(format));
        let found = KNOWN.iter().find(|(known, _)| Some(*known) == short);
        let (_, definition) = found.ok_or_else(|| {
            let known = KNOWN.map(|(known, _)| format!("{}{known}", folder(format))).join(", ");
            format!("the definition of {name} is not known here, as those of {known} are")
        })?;
        Self::parse(format, name, definition)
    }

    /// Reads the text of a `.srv` file. Messages in it follow, each behind a line of `=` and `MSG: package/Name`.
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
            return Err(format!("`{name}` is no type of a service, such as {}SetBool", folder(format)));
        }
        let mut lines = definition.lines();
        let request: Vec<_> = lines.by_ref().take_while(|line| line.trim() != MIDDLE).collect();
        let response: Vec<_> = lines.collect();
        if request.len() == definition.lines().count() {
            return Err(format!("no line `{MIDDLE}` separates the response of {name} from its request"));
        }
        let inside = response.iter().position(|line| line.starts_with("==="));
        let messages = inside.map_or(&[][..], |first| &response[first..]);
        let definitions = ([&request, messages].concat().join("\n"), response.join("\n"));
        let schema = |text| Schema::parse(name, text).map_err(|error| error.to_string());
        let (request, response) = (schema(&definitions.0)?, schema(&definitions.1)?);
        Ok(Self { format, name: name.into(), definitions, request, response })
    }

    /// As ROS calls it, such as `std_srvs/srv/SetBool`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The request as ROS calls it.
    pub fn request_name(&self) -> String {
        self.part("Request")
    }

    /// The response as ROS calls it.
    pub fn response_name(&self) -> String {
        self.part("Response")
    }

    fn part(&self, part: &str) -> String {
        let between = if self.format == WireFormat::Ros1 { "" } else { "_" };
        format!("{}{between}{part}", self.name)
    }

    /// Definitions of request and response.
    pub fn definitions(&self) -> (&str, &str) {
        (&self.definitions.0, &self.definitions.1)
    }

    /// Fields of the request.
    pub fn request(&self) -> &Schema {
        &self.request
    }

    /// Fields of the response.
    pub fn response(&self) -> &Schema {
        &self.response
    }

    /// The message of a request; a field that it lacks is zero or empty.
    ///
    /// # Errors
    /// A value does not fit; the reason in words.
    pub fn encode_request(&self, request: &Json) -> Result<Vec<u8>, String> {
        encode_json_in(self.format, &self.request, request).map_err(|error| error.to_string())
    }

    /// The request of a message.
    ///
    /// # Errors
    /// When it is none, in words.
    pub fn decode_request(&self, message: &[u8]) -> Result<Json, String> {
        self.decode(&self.request, message)
    }

    /// The message of a response; a field that it lacks is zero or empty.
    ///
    /// # Errors
    /// A value does not fit; the reason in words.
    pub fn encode_response(&self, response: &Json) -> Result<Vec<u8>, String> {
        encode_json_in(self.format, &self.response, response).map_err(|error| error.to_string())
    }

    /// The response of a message.
    ///
    /// # Errors
    /// When it is none, in words.
    pub fn decode_response(&self, message: &[u8]) -> Result<Json, String> {
        self.decode(&self.response, message)
    }

    fn decode(&self, schema: &Schema, message: &[u8]) -> Result<Json, String> {
        let value = schema.decode_in(self.format, message).map_err(|error| error.to_string())?;
        serde_json::to_value(value).map_err(|error| error.to_string())
    }
}
