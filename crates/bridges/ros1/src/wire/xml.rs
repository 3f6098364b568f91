//! XML-RPC: calls and answers of the master and of nodes.
//!
//! The crate `roxmltree` parses the XML. The encoding of values is own, as the crates for XML-RPC bring an HTTP client
//! and a second XML parser, and limit neither nesting nor the number of elements.

use std::fmt::Write;

use roxmltree::{Document, Node, ParsingOptions};

/// Maximum nesting of lists and structures.
const MAX_DEPTH: usize = 16;

/// Elements that a document may have.
const MAX_ELEMENTS: u32 = 100_000;

/// Value of XML-RPC.
#[derive(Clone, Debug, PartialEq)]
pub enum XmlValue {
    Integer(i32),
    Bool(bool),
    Double(f64),
    Text(String),
    List(Vec<XmlValue>),
    Structure(Vec<(String, XmlValue)>),
}

impl From<&str> for XmlValue {
    fn from(text: &str) -> Self {
        Self::Text(text.into())
    }
}

impl XmlValue {
    pub fn as_integer(&self) -> Option<i32> {
        if let Self::Integer(number) = self { Some(*number) } else { None }
    }

    pub fn as_text(&self) -> Option<&str> {
        if let Self::Text(text) = self { Some(text) } else { None }
    }

    pub fn as_list(&self) -> Option<&[Self]> {
        if let Self::List(list) = self { Some(list) } else { None }
    }

    fn write(&self, out: &mut String) {
        out.push_str("<value>");
        match self {
            Self::Integer(number) => put(out, "int", &number.to_string()),
            Self::Bool(truth) => put(out, "boolean", if *truth { "1" } else { "0" }),
            Self::Double(number) => put(out, "double", &format!("{number:?}")),
            Self::Text(text) => put(out, "string", text),
            Self::List(list) => {
                out.push_str("<array><data>");
                list.iter().for_each(|item| item.write(out));
                out.push_str("</data></array>");
            }
            Self::Structure(members) => {
                out.push_str("<struct>");
                for (name, value) in members {
                    out.push_str("<member>");
                    put(out, "name", name);
                    value.write(out);
                    out.push_str("</member>");
                }
                out.push_str("</struct>");
            }
        }
        out.push_str("</value>");
    }
}

fn put(out: &mut String, name: &str, text: &str) {
    // Writing to a text never fails.
    let _ = write!(out, "<{name}>");
    for letter in text.chars() {
        match letter {
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '&' => out.push_str("&amp;"),
            '\r' => out.push_str("&#13;"),
            // XML has no others below a space.
            '\t' | '\n' | ' '.. => out.push(letter),
            _ => out.push(' '),
        }
    }
    let _ = write!(out, "</{name}>");
}

/// Encodes a call.
pub fn call(method: &str, arguments: &[XmlValue]) -> String {
    let mut out = String::from("<?xml version=\"1.0\"?><methodCall>");
    put(&mut out, "methodName", method);
    parameters(&mut out, arguments);
    out + "</methodCall>"
}

/// Encodes an answer.
pub fn answer(value: XmlValue) -> String {
    let mut out = String::from("<?xml version=\"1.0\"?><methodResponse>");
    parameters(&mut out, &[value]);
    out + "</methodResponse>"
}

fn parameters(out: &mut String, values: &[XmlValue]) {
    out.push_str("<params>");
    for value in values {
        out.push_str("<param>");
        value.write(out);
        out.push_str("</param>");
    }
    out.push_str("</params>");
}

/// Parses the method and the arguments of a call.
///
/// # Errors
/// When it is no call, in words.
pub fn read_call(text: &str) -> Result<(String, Vec<XmlValue>), String> {
    let document = document(text)?;
    let root = document.root_element();
    let method = child(root, "methodName").and_then(|own| own.text());
    let method = method.filter(|_| root.has_tag_name("methodCall")).ok_or("it is no call of XML-RPC")?;
    Ok((method.trim().into(), read_parameters(root)?))
}

/// Parses the value of an answer.
///
/// # Errors
/// When it is no answer, or reports a fault, in words.
pub fn read_answer(text: &str) -> Result<XmlValue, String> {
    let document = document(text)?;
    let root = document.root_element();
    if !root.has_tag_name("methodResponse") {
        return Err("it is no answer of XML-RPC".into());
    }
    if let Some(value) = child(root, "fault").and_then(|fault| child(fault, "value")) {
        let fault = read_value(value, 0)?;
        let XmlValue::Structure(members) = fault else { return Err("a fault".into()) };
        let text = members.iter().find(|(name, _)| name == "faultString");
        return Err(text.and_then(|(_, value)| value.as_text()).unwrap_or("a fault").into());
    }
    read_parameters(root)?.into_iter().next().ok_or_else(|| "the answer is empty".into())
}

fn document(text: &str) -> Result<Document<'_>, String> {
    let options = ParsingOptions { nodes_limit: MAX_ELEMENTS, ..ParsingOptions::default() };
    Document::parse_with_options(text, options).map_err(|error| format!("it is no XML: {error}"))
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|own| own.has_tag_name(name))
}

fn read_parameters(root: Node<'_, '_>) -> Result<Vec<XmlValue>, String> {
    let all = child(root, "params").into_iter().flat_map(|all| all.children());
    let values = all.filter(|own| own.has_tag_name("param")).filter_map(|own| child(own, "value"));
    values.map(|value| read_value(value, 0)).collect()
}

fn read_value(value: Node<'_, '_>, depth: usize) -> Result<XmlValue, String> {
    if depth > MAX_DEPTH {
        return Err(format!("values stand more than {MAX_DEPTH} deep in each other"));
    }
    let Some(typed) = value.children().find(Node::is_element) else {
        return Ok(XmlValue::Text(value.text().unwrap_or_default().into()));
    };
    let text = typed.text().unwrap_or_default();
    let wrong =
        || format!("`{}` is not a {}", text.chars().take(40).collect::<String>(), typed.tag_name().name());
    let items = |node: Node<'_, '_>| {
        let values = node.children().filter(|own| own.has_tag_name("value"));
        values.map(|value| read_value(value, depth + 1)).collect::<Result<Vec<_>, _>>()
    };
    Ok(match typed.tag_name().name() {
        "int" | "i4" => XmlValue::Integer(text.trim().parse().map_err(|_| wrong())?),
        "boolean" => match text.trim() {
            "0" => XmlValue::Bool(false),
            "1" => XmlValue::Bool(true),
            _ => return Err(wrong()),
        },
        "double" => XmlValue::Double(text.trim().parse().map_err(|_| wrong())?),
        "array" => XmlValue::List(child(typed, "data").map_or(Ok(Vec::new()), items)?),
        "struct" => {
            let members = typed.children().filter(|own| own.has_tag_name("member"));
            let read = |member| {
                let name = child(member, "name").and_then(|own| own.text()).unwrap_or_default();
                let value = child(member, "value").ok_or("a member of a structure has no value")?;
                Ok::<_, String>((name.to_owned(), read_value(value, depth + 1)?))
            };
            XmlValue::Structure(members.map(read).collect::<Result<_, _>>()?)
        }
        // Dates and bytes, which no call of ROS has, but parameters of others may.
        _ => XmlValue::Text(text.into()),
    })
}
