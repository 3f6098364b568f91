//! Type and quality of service of a topic, as its file says.

use std::sync::Arc;

use slate_runtime::configuration::Table;
use slate_topics::{TableReader, TopicOptions};

use crate::idl::{IdlFile, IdlStruct};
use crate::quality::{Representation, TopicQuality};

const TYPE: &str = "write type = \"demo::Target\", idl = \"target.idl\", a path from the folder of this file";

/// Type and quality of service of a topic.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DdsTopic {
    /// Quality of service.
    pub quality: TopicQuality,
    /// Type; without one, that of ROS 2 for the interface.
    pub of: Option<TopicType>,
}

/// Type of a topic.
#[derive(Clone, Debug, PartialEq)]
pub struct TopicType {
    /// Name with its modules.
    pub name: String,
    /// Members; without them, those of the ROS message.
    pub structure: Option<Arc<IdlStruct>>,
    /// Data representation of messages.
    pub representation: Representation,
}

impl TopicOptions for DdsTopic {
    const READ_KEYS: &'static [&'static str] = &["reliable", "transient_local", "depth", "type", "idl"];
    const WRITE_KEYS: &'static [&'static str] =
        &["reliable", "transient_local", "depth", "type", "idl", "representation"];
    const HAS_DEFINITION: bool = false;

    fn read(reader: &mut TableReader<'_>, table: &Table) -> Self {
        Self { quality: TopicQuality::read(reader, table), of: topic_type(reader, table) }
    }
}

fn topic_type(reader: &mut TableReader<'_>, table: &Table) -> Option<TopicType> {
    let name = reader.text(table, "type", TYPE);
    let idl = reader.text(table, "idl", TYPE);
    let representation = representation(reader, table);
    let (name, span) = match (name, &idl) {
        (Some(name), _) => name,
        (None, Some((_, span))) => {
            reader.add(*span, "`idl` needs a `type` that names one of its structs", TYPE);
            return None;
        }
        (None, None) => {
            check_representation(reader, table, representation);
            return None;
        }
    };
    if let Err(reason) = check_type_name(&name) {
        reader.add(span, format!("`{name}` can't be the name of a type: {reason}"), TYPE);
        return None;
    }
    let Some((file, span)) = idl else {
        check_representation(reader, table, representation);
        return Some(TopicType { name, structure: None, representation });
    };
    let path = reader.configuration().folder_of(span).join(&file);
    let found = match IdlFile::read(&path) {
        Ok(found) => found,
        Err(error) => {
            reader.add(span, error.to_string(), "mend the file, which is OMG IDL 4.2");
            return None;
        }
    };
    let structure = found.structure(&name);
    if structure.is_none() {
        let known: Vec<_> = found.structures().take(20).collect();
        let help = format!("it has {}", if known.is_empty() { "none".into() } else { known.join(", ") });
        reader.add(span, format!("{} has no struct {name}", path.display()), &help);
    }
    Some(TopicType { name, structure: Some(structure?), representation })
}

fn representation(reader: &mut TableReader<'_>, table: &Table) -> Representation {
    const HELP: &str = "write representation = \"xcdr2\", as the readers request it";
    let Some((text, span)) = reader.text(table, "representation", HELP) else {
        return Representation::default();
    };
    match text.as_str() {
        "xcdr1" => Representation::Xcdr1,
        "xcdr2" => Representation::Xcdr2,
        other => {
            let message = format!("expected `representation` to be xcdr1 or xcdr2, found {other:?}");
            reader.add(span, message, HELP);
            Representation::default()
        }
    }
}

/// Messages of ROS are of version 1.
fn check_representation(reader: &mut TableReader<'_>, table: &Table, own: Representation) {
    if let (Representation::Xcdr2, Some(value)) = (own, table.get("representation")) {
        reader.add(value.span, "messages of ROS are xcdr1", TYPE);
    }
}

/// Longest name of a topic or a type, bytes.
const MAX_NAME: usize = 255;

/// Checks the name of a topic, which DDS uses unchanged.
///
/// # Errors
/// Characters that it may not have, in words.
pub fn check_topic(name: &str) -> Result<String, String> {
    let wrong = |own: char| own.is_whitespace() || own.is_control() || "*?[]\"'\\".contains(own);
    match name.chars().find(|own| wrong(*own)) {
        _ if name.is_empty() => Err("it is empty".into()),
        _ if name.len() > MAX_NAME => Err(format!("it has {} bytes, more than {MAX_NAME}", name.len())),
        Some(wrong) => Err(format!("it has {wrong:?}")),
        None => Ok(name.into()),
    }
}

fn check_type_name(name: &str) -> Result<(), String> {
    let is_word = |part: &str| {
        part.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && part.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    if name.len() > MAX_NAME {
        return Err(format!("it has {} bytes, more than {MAX_NAME}", name.len()));
    }
    match name.split("::").find(|part| !is_word(part)) {
        Some(part) => Err(format!("`{part}` is no identifier; `::` separates a module from its types")),
        None => Ok(()),
    }
}
