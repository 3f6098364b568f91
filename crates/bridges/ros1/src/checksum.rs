//! Checksums of definitions, by which ROS 1 nodes compare types.

use slate_sorted::SortedMap;

/// Types that a message has no definition for.
const BUILTIN: [&str; 16] = [
    "bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64",
    "string", "time", "duration", "char", "byte",
];

/// Returns the MD5 checksum of a message definition.
/// The definition is followed by those of the messages in it, each after a line of `=` and `MSG: package/Name`.
///
/// # Errors
/// A message that is not defined, in words.
pub fn message_checksum(name: &str, definition: &str) -> Result<String, String> {
    MessageDefinitions::read(name, definition).text(name, 0).map(|text| digest(&text))
}

/// Returns the checksum of a service.
/// It is computed from the definitions of its request and its response.
///
/// # Errors
/// A message that is not defined, in words.
pub fn service_checksum(name: &str, request: &str, response: &str) -> Result<String, String> {
    let text = |definition| MessageDefinitions::read(name, definition).text(name, 0);
    Ok(digest(&(text(request)? + &text(response)?)))
}

fn digest(text: &str) -> String {
    format!("{:x}", md5::compute(text))
}

/// Lines of definitions, by the message.
struct MessageDefinitions<'a>(SortedMap<&'a str, Vec<&'a str>>);

impl<'a> MessageDefinitions<'a> {
    fn read(name: &'a str, definition: &'a str) -> Self {
        let mut all: SortedMap<&str, Vec<&str>> = SortedMap::new();
        let mut own = name;
        for line in definition.lines() {
            if line.starts_with("===") {
                continue;
            }
            match line.strip_prefix("MSG:") {
                Some(next) => own = next.trim(),
                None => all.entry(own).or_default().push(line),
            }
        }
        all.entry(name).or_default();
        Self(all)
    }

    /// Returns the text under the checksum.
    /// Constants, then fields, those of messages with their checksums.
    fn text(&self, name: &str, depth: usize) -> Result<String, String> {
        let lines =
            self.0.get(name).filter(|_| depth < 32).ok_or_else(|| format!("{name} is not defined"))?;
        let package = name.split('/').next().unwrap_or_default();
        let (mut constants, mut fields) = (Vec::new(), Vec::new());
        for line in lines {
            let code = line.split('#').next().unwrap_or_default().trim();
            let Some((of, rest)) = code.split_once(char::is_whitespace) else { continue };
            if let Some((own, value)) = rest.split_once('=') {
                // A text is all that follows.
                let value =
                    if of == "string" { line.split_once('=').map_or("", |(_, all)| all) } else { value };
                constants.push(format!("{of} {}={}", own.trim(), value.trim()));
                continue;
            }
            let base = of.split('[').next().unwrap_or_default();
            let field = rest.trim();
            if BUILTIN.contains(&base) {
                fields.push(format!("{of} {field}"));
                continue;
            }
            let whole = match base {
                "Header" => "std_msgs/Header".to_owned(),
                _ if base.contains('/') => base.to_owned(),
                _ => format!("{package}/{base}"),
            };
            fields.push(format!("{} {field}", digest(&self.text(&whole, depth + 1)?)));
        }
        constants.extend(fields);
        Ok(constants.join("\n"))
    }
}
