//! Types of services.

use slate_record::ros::Schema;

/// Services that are known without a definition.
const KNOWN: [(&str, &str); 3] = [
    ("std_srvs/srv/Empty", "---"),
    ("std_srvs/srv/SetBool", "bool data\n---\nbool success\nstring message"),
    ("std_srvs/srv/Trigger", "---\nbool success\nstring message"),
];

/// Line between request and response of a definition.
const MIDDLE: &str = "---";

/// The type of a service: its request and its response.
#[derive(Clone, Debug)]
pub struct ServiceType {
    name: String,
    definition: String,
    /// What a client sends.
    pub request: Schema,
    /// What the server answers.
    pub response: Schema,
}

impl PartialEq for ServiceType {
    fn eq(&self, other: &Self) -> bool {
        (&self.name, &self.definition) == (&other.name, &other.definition)
    }
}

impl ServiceType {
    /// A service of ROS that needs no definition, such as `std_srvs/srv/SetBool`.
    ///
    /// # Errors
    /// The service needs a definition; the text lists those that don't.
    pub fn known(name: &str) -> Result<Self, String> {
        let found = KNOWN.iter().find(|(known, _)| *known == name);
        let (_, definition) = found.ok_or_else(|| {
            let known = KNOWN.map(|(known, _)| known).join(", ");
            format!("the definition of {name} is not known here, as those of {known} are")
        })?;
        Self::parse(name, definition)
    }

    /// Reads the text of a `.srv` file. Messages in it follow, each behind a line of `=` and `MSG: package/Name`.
    ///
    /// # Errors
    /// What is wrong with the name or the text, in words.
    pub fn parse(name: &str, definition: &str) -> Result<Self, String> {
        let mut parts = name.split('/');
        if !matches!((parts.next(), parts.next(), parts.next(), parts.next()), (Some(package), Some("srv"), Some(own), None) if !package.is_empty() && !own.is_empty())
        {
            return Err(format!("`{name}` is no type of a service, such as std_srvs/srv/SetBool"));
        }
        let mut lines = definition.lines();
        let request: Vec<_> = lines.by_ref().take_while(|line| line.trim() != MIDDLE).collect();
        let response: Vec<_> = lines.collect();
        if request.len() == definition.lines().count() {
            return Err(format!("no line `{MIDDLE}` separates the response of {name} from its request"));
        }
        let inside = response.iter().position(|line| line.starts_with("==="));
        let messages = inside.map_or(&[][..], |first| &response[first..]);
        let schema = |suffix: &str, lines: &[&str]| {
            Schema::parse(&format!("{name}_{suffix}"), &lines.join("\n")).map_err(|error| error.to_string())
        };
        Ok(Self {
            name: name.into(),
            definition: definition.into(),
            request: schema("Request", &[&request, messages].concat())?,
            response: schema("Response", &response)?,
        })
    }

    /// As ROS calls it, such as `std_srvs/srv/SetBool`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The request as ROS calls it.
    pub fn request_name(&self) -> String {
        format!("{}_Request", self.name)
    }

    /// The response as ROS calls it.
    pub fn response_name(&self) -> String {
        format!("{}_Response", self.name)
    }
}
