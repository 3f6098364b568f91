//! Definitions in the language of ROS 1's `.msg` files.

use slate_sorted::SortedMap;

use super::message::{BagMessageType, Count, Field, Item, Types};
use slate_ros_messages::Definition;

/// Maximum nesting depth of messages.
const MAX_NESTING: usize = 32;

impl Types {
    /// Parses the definition of the message `name`, such as `sensor_msgs/LaserScan`.
    /// `text` holds the definitions of nested messages as well.
    pub fn parse(name: &str, text: &str) -> Result<Self, String> {
        let mut sections: Vec<(String, Vec<(usize, &str)>)> = vec![(name.to_owned(), Vec::new())];
        let mut is_opened = false;
        for (i, line) in text.lines().enumerate() {
            let line = line.trim();
            if line.len() >= 3 && line.bytes().all(|byte| byte == b'=') {
                is_opened = true;
            } else if let (true, Some(section)) = (is_opened, line.strip_prefix("MSG:")) {
                sections.push((section.trim().to_owned(), Vec::new()));
                is_opened = false;
            } else if let Some((_, lines)) = sections.last_mut() {
                lines.push((i + 1, line));
            }
        }
        let mut known = SortedMap::new();
        for (i, (section, _)) in sections.iter().enumerate() {
            known.entry(section.clone()).or_insert(i);
        }
        let mut kinds = Vec::new();
        for (section, lines) in &sections {
            let mut kind =
                BagMessageType { name: section.clone(), fields: Vec::new(), constants: Vec::new() };
            for (number, line) in lines {
                kind.line(line, &known).map_err(|what| format!("line {number}: {what}"))?;
            }
            kinds.push(kind);
        }
        let types = Self { kinds };
        let mut heights = vec![None; types.kinds.len()];
        match types.height(0, 0, &mut heights) {
            Some(_) => Ok(types),
            None => Err(format!("messages stand in themselves, or more than {MAX_NESTING} deep")),
        }
    }

    fn height(&self, index: usize, depth: usize, known: &mut [Option<usize>]) -> Option<usize> {
        if depth > MAX_NESTING {
            return None;
        }
        if let Some(height) = known[index] {
            return (depth + height <= MAX_NESTING).then_some(height);
        }
        let mut own = 0;
        for field in &self.kinds[index].fields {
            if let Item::Message(inner) = field.item {
                own = own.max(1 + self.height(inner, depth + 1, known)?);
            }
        }
        known[index] = Some(own);
        Some(own)
    }

    /// Returns the definition of the same message in ROS 2.
    pub fn definition(&self, name: &str) -> Definition {
        let mut text = String::new();
        for (i, kind) in self.kinds.iter().enumerate() {
            if i > 0 {
                text.push_str(&format!("{SEPARATOR}\nMSG: {}\n", kind.name));
            }
            for constant in &kind.constants {
                text.push_str(&format!("{constant}\n"));
            }
            for field in kind.fields.iter().filter(|field| !kind.is_left_out(field)) {
                let of = match field.item {
                    Item::Number(_, name) => name,
                    Item::Bool => "bool",
                    Item::Text => "string",
                    Item::Time => "builtin_interfaces/Time",
                    Item::Duration => "builtin_interfaces/Duration",
                    Item::Message(inner) => self.kinds[inner].name.as_str(),
                };
                let count = match field.count {
                    Count::One => String::new(),
                    Count::Fixed(count) => format!("[{count}]"),
                    Count::Any => "[]".into(),
                };
                text.push_str(&format!("{of}{count} {}\n", field.name));
            }
        }
        for (item, name) in [(Item::Time, "Time"), (Item::Duration, "Duration")] {
            if self.kinds.iter().flat_map(|kind| &kind.fields).any(|field| field.item == item) {
                text.push_str(&format!(
                    "{SEPARATOR}\nMSG: builtin_interfaces/{name}\nint32 sec\nuint32 nanosec\n"
                ));
            }
        }
        let name = name
            .split_once('/')
            .map_or_else(|| name.to_owned(), |(package, name)| format!("{package}/msg/{name}"));
        Definition { name, text }
    }
}

const SEPARATOR: &str = "================================================================================";

impl BagMessageType {
    fn line(&mut self, line: &str, known: &SortedMap<String, usize>) -> Result<(), String> {
        let code = line.split('#').next().unwrap_or_default().trim();
        if code.is_empty() {
            return Ok(());
        }
        let wrong =
            || format!("expected a type and a name, not `{}`", code.chars().take(60).collect::<String>());
        let (of, rest) = code.split_once(char::is_whitespace).ok_or_else(wrong)?;
        let rest = rest.trim();
        if let Some((name, value)) = rest.split_once('=') {
            // The value of a text may contain the sign of a comment; reading does not need it.
            if let Some(Item::Number(_, of)) = primitive(of) {
                self.constants.push(format!("{of} {}={}", name.trim(), value.trim()));
            }
            return Ok(());
        }
        let is_name = |text: &str| {
            text.starts_with(|c: char| c.is_ascii_alphabetic())
                && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        };
        if !is_name(rest) {
            return Err(wrong());
        }
        let (of, count) = match of.strip_suffix(']').and_then(|of| of.split_once('[')) {
            None => (of, Count::One),
            Some((of, "")) => (of, Count::Any),
            Some((of, count)) => {
                let number =
                    count.parse::<u32>().map_err(|_| format!("`{count}` is not a number of items"))?;
                (of, Count::Fixed(number as usize))
            }
        };
        let item = match primitive(of) {
            Some(item) => item,
            None => {
                let package = self.name.split('/').next().unwrap_or_default();
                let own = format!("{package}/{of}");
                let name = match of {
                    "Header" => "std_msgs/Header",
                    of if of.contains('/') => of,
                    _ => &own,
                };
                let found = known.get(name).ok_or_else(|| format!("`{of}` is not defined in the text"))?;
                Item::Message(*found)
            }
        };
        self.fields.push(Field { name: rest.into(), item, count });
        Ok(())
    }

    /// Returns true if a field is omitted because ROS 2 lacks it.
    /// This is the counter of a ROS 1 header.
    pub fn is_left_out(&self, field: &Field) -> bool {
        self.name == "std_msgs/Header" && field.name == "seq"
    }
}

fn primitive(of: &str) -> Option<Item> {
    Some(match of {
        "bool" => Item::Bool,
        // In ROS 2, these two are others.
        "byte" => Item::Number(1, "int8"),
        "char" => Item::Number(1, "uint8"),
        "int8" => Item::Number(1, "int8"),
        "uint8" => Item::Number(1, "uint8"),
        "int16" => Item::Number(2, "int16"),
        "uint16" => Item::Number(2, "uint16"),
        "int32" => Item::Number(4, "int32"),
        "uint32" => Item::Number(4, "uint32"),
        "int64" => Item::Number(8, "int64"),
        "uint64" => Item::Number(8, "uint64"),
        "float32" => Item::Number(4, "float32"),
        "float64" => Item::Number(8, "float64"),
        "string" => Item::Text,
        "time" => Item::Time,
        "duration" => Item::Duration,
        _ => return None,
    })
}
