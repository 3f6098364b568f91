//! Parser of the interfaces in a Rust source file.
//! It lays them out as the compiler does.

use super::syntax_error::SyntaxError;
use super::token::{SourceToken, tokens};
use super::word::identifier_error;
use slate::blackboard::interface::{Constant, Descriptor, Enumeration, Field, Kind, Primitive, schema_hash};
use slate_sorted::SortedMap;

/// Interface and its place.
#[derive(Clone, Debug)]
pub struct FoundInterface {
    pub line: usize,
    pub descriptor: &'static Descriptor,
}

/// Types that interfaces of a file may name.
/// First those that come with Slate, then those defined above them.
type KnownTypes = SortedMap<String, Kind>;

/// Leaks a value: the program is short-lived.
fn keep<T>(value: T) -> &'static T {
    Box::leak(Box::new(value))
}

fn keep_text(text: &str) -> &'static str {
    Box::leak(text.to_owned().into_boxed_str())
}

/// Reads all interfaces of a file, in their order.
pub fn interfaces(source: &str) -> Result<Vec<FoundInterface>, SyntaxError> {
    Ok(read(source)?.0)
}

/// Reads the [`interfaces`] of a source, and the number of its other enums.
pub fn read(source: &str) -> Result<(Vec<FoundInterface>, usize), SyntaxError> {
    let mut enumerations = 0;
    let mut reader = InterfaceParser { tokens: tokens(source)?, next: 0 };
    let (mut types, mut found) = (known(), Vec::new());
    while reader.next < reader.tokens.len() {
        let doc = reader.doc();
        let Some(representation) = reader.interface()? else {
            reader.next += 1;
            continue;
        };
        let line = reader.line();
        match reader.word("`struct` or `enum`")?.as_str() {
            "struct" => {
                let descriptor = reader.structure(&doc, &types)?;
                if found.iter().any(|one: &FoundInterface| one.descriptor.name == descriptor.name) {
                    return Err(SyntaxError {
                        line,
                        message: format!("`{}` is there already, above", descriptor.name),
                    });
                }
                types.insert(descriptor.name.into(), Kind::Nested(descriptor));
                found.push(FoundInterface { line, descriptor });
            }
            "enum" => {
                let enumeration = reader.enumeration(representation, &types)?;
                types.insert(enumeration.name.into(), Kind::Enumeration(enumeration));
                enumerations += 1;
            }
            other => {
                return Err(SyntaxError {
                    line,
                    message: format!("`{other}` is not an interface: expected a struct or an enum"),
                });
            }
        }
    }
    Ok((found, enumerations))
}

/// Returns the numbers, and Slate's interfaces that can be a field.
/// These are the ones without a tail.
fn known() -> KnownTypes {
    // A truth value is the type `Bool`, as not every byte is a `bool`.
    let numbers = Primitive::ALL.map(|primitive| match primitive {
        Primitive::Bool => ("Bool", Kind::Bool),
        number => (number.name(), Kind::Primitive(number)),
    });
    let fields = slate::interfaces::ALL.iter().copied().filter(|one| one.tail().is_none());
    let nested = fields.map(|one| (one.name.to_owned(), Kind::Nested(one)));
    numbers.into_iter().map(|(name, kind)| (name.to_owned(), kind)).chain(nested).collect()
}

struct InterfaceParser {
    tokens: Vec<(usize, SourceToken)>,
    next: usize,
}

impl InterfaceParser {
    fn line(&self) -> usize {
        let token = self.tokens.get(self.next).or(self.tokens.last());
        token.map_or(1, |(line, _)| *line)
    }

    fn peek(&self) -> Option<&SourceToken> {
        self.tokens.get(self.next).map(|(_, token)| token)
    }

    fn wrong<T>(&self, message: impl Into<String>) -> Result<T, SyntaxError> {
        Err(SyntaxError { line: self.line(), message: message.into() })
    }

    fn take(&mut self, sign: char) -> bool {
        let is_it = self.peek() == Some(&SourceToken::Sign(sign));
        self.next += usize::from(is_it);
        is_it
    }

    fn expect(&mut self, sign: char) -> Result<(), SyntaxError> {
        match self.take(sign) {
            true => Ok(()),
            false => self.wrong(format!("expected `{sign}`")),
        }
    }

    /// Reads a word that is a valid Rust name.
    fn name(&mut self, expected: &str) -> Result<String, SyntaxError> {
        let line = self.line();
        let word = self.word(expected)?;
        // A raw identifier may be a keyword.
        if let Some(name) = word.strip_prefix("r#") {
            return Ok(name.to_owned());
        }
        identifier_error(&word).map_or(Ok(word), |message| Err(SyntaxError { line, message }))
    }

    fn word(&mut self, expected: &str) -> Result<String, SyntaxError> {
        match self.peek() {
            Some(SourceToken::Word(word)) => {
                let word = word.clone();
                self.next += 1;
                Ok(word)
            }
            _ => self.wrong(format!("expected {expected}")),
        }
    }

    fn doc(&mut self) -> String {
        let mut doc: Vec<String> = Vec::new();
        while let Some(SourceToken::Doc(line)) = self.peek() {
            doc.push(line.clone());
            self.next += 1;
        }
        doc.join(" ")
    }

    /// Reads an attribute, and returns its words and texts.
    fn attribute(&mut self) -> Result<Option<Vec<String>>, SyntaxError> {
        if self.peek() != Some(&SourceToken::Sign('#'))
            || self.tokens.get(self.next + 1).is_none_or(|(_, next)| *next != SourceToken::Sign('['))
        {
            return Ok(None);
        }
        self.next += 2;
        let (mut depth, mut words) = (1, Vec::new());
        while depth > 0 {
            match self.peek() {
                Some(SourceToken::Sign('[')) => depth += 1,
                Some(SourceToken::Sign(']')) => depth -= 1,
                Some(SourceToken::Word(word) | SourceToken::Text(word)) => words.push(word.clone()),
                Some(_) => {}
                None => return self.wrong("an attribute is not closed"),
            }
            self.next += 1;
        }
        Ok(Some(words))
    }

    /// Skips the attributes of an interface, up to its `struct` or `enum`.
    /// Returns the integer of an enum's representation; `None` at an item that is not an interface.
    fn interface(&mut self) -> Result<Option<String>, SyntaxError> {
        let (begin, mut is_interface, mut representation) = (self.next, false, "u8".to_owned());
        while let Some(words) = self.attribute()? {
            is_interface |= words.first().is_some_and(|word| word == "interface");
            if let [first, name, ..] = &words[..]
                && first == "repr"
            {
                representation.clone_from(name);
            }
            self.doc();
        }
        if !is_interface {
            self.next = begin;
            return Ok(None);
        }
        self.visibility();
        Ok(Some(representation))
    }

    fn visibility(&mut self) {
        if self.peek() == Some(&SourceToken::Word("pub".into())) {
            self.next += 1;
            if self.take('(') {
                while !self.take(')') && self.peek().is_some() {
                    self.next += 1;
                }
            }
        }
    }

    fn structure(&mut self, doc: &str, types: &KnownTypes) -> Result<&'static Descriptor, SyntaxError> {
        let name = self.name("a name")?;
        self.expect('{')?;
        let (mut fields, mut size, mut align) = (Vec::new(), 0_usize, 1);
        while !self.take('}') {
            if let Some(Field { kind: Kind::Tail(_), .. }) = fields.last() {
                return self.wrong("only the last field may be a slice: the tail");
            }
            let (mut field_doc, mut unit) = (self.doc(), String::new());
            while let Some(words) = self.attribute()? {
                if let [first, text] = &words[..]
                    && first == "unit"
                {
                    unit.clone_from(text);
                }
                let more = self.doc();
                if field_doc.is_empty() {
                    field_doc = more;
                }
            }
            self.visibility();
            let field_line = self.line();
            let field = self.name("the name of a field")?;
            if fields.iter().any(|known: &Field| known.name == field) {
                return Err(SyntaxError {
                    line: field_line,
                    message: format!("there are two fields `{field}`: rename one"),
                });
            }
            self.expect(':')?;
            let kind = self.kind(types, true)?;
            align = align.max(kind.align());
            let offset =
                size.next_multiple_of(if matches!(kind, Kind::Tail(_)) { align } else { kind.align() });
            size = offset + kind.size();
            fields.push(Field {
                name: keep_text(&field),
                doc: keep_text(&field_doc),
                unit: keep_text(&unit),
                offset,
                kind,
            });
            if !self.take(',') {
                self.expect('}')?;
                break;
            }
        }
        let size = size.next_multiple_of(align);
        let fields: &'static [Field] = Box::leak(fields.into_boxed_slice());
        let hash = schema_hash(&name, fields);
        Ok(keep(Descriptor {
            name: keep_text(&name),
            doc: keep_text(doc),
            ros: "",
            fields,
            size,
            align,
            hash,
        }))
    }

    fn enumeration(
        &mut self,
        carrier: String,
        types: &KnownTypes,
    ) -> Result<&'static Enumeration, SyntaxError> {
        let Some(carrier) = types.get(&carrier).copied() else {
            return self.wrong(format!("`{carrier}` carries no enum"));
        };
        let name = self.name("a name")?;
        self.expect('{')?;
        let mut constants = Vec::new();
        while !self.take('}') {
            let doc = self.doc();
            while self.attribute()?.is_some() {}
            let variant_line = self.line();
            let variant = self.name("the name of a constant")?;
            if constants.iter().any(|known: &Constant| known.name == upper_case(&variant)) {
                let message = format!("there are two constants `{variant}`: rename one");
                return Err(SyntaxError { line: variant_line, message });
            }
            let mut value = constants.len() as i64;
            if self.take('=') {
                let negative = self.take('-');
                let text = self.word("a number")?;
                let Ok(number) = text.replace('_', "").parse::<i64>() else {
                    return self.wrong(format!("`{text}` is not a number that can be read here"));
                };
                value = if negative { -number } else { number };
            }
            constants.push(Constant { name: keep_text(&upper_case(&variant)), value, doc: keep_text(&doc) });
            if !self.take(',') {
                self.expect('}')?;
                break;
            }
        }
        let constants: &'static [Constant] = Box::leak(constants.into_boxed_slice());
        Ok(keep(Enumeration { name: keep_text(&name), carrier, constants }))
    }

    fn count(&mut self) -> Result<usize, SyntaxError> {
        let text = self.word("a number")?;
        match text.replace('_', "").parse() {
            Ok(count) => Ok(count),
            Err(_) => self.wrong(format!("`{text}` is not a number that can be read here: write it out")),
        }
    }

    fn kind(&mut self, types: &KnownTypes, may_be_tail: bool) -> Result<Kind, SyntaxError> {
        if self.take('[') {
            let item = keep(self.kind(types, false)?);
            if self.take(';') {
                let count = self.count()?;
                self.expect(']')?;
                return Ok(Kind::Array(item, count));
            }
            self.expect(']')?;
            return match may_be_tail {
                true => Ok(Kind::Tail(item)),
                false => self.wrong("a slice must be the last field"),
            };
        }
        let name = self.word("a type")?;
        match name.as_str() {
            "Text" => {
                self.expect('<')?;
                let capacity = self.count()?;
                self.expect('>')?;
                Ok(Kind::Text(capacity))
            }
            "Sequence" => {
                self.expect('<')?;
                let item = keep(self.kind(types, false)?);
                self.expect(',')?;
                let capacity = self.count()?;
                self.expect('>')?;
                Ok(Kind::Sequence(item, capacity))
            }
            "Optional" => {
                self.expect('<')?;
                let item = keep(self.kind(types, false)?);
                self.expect('>')?;
                Ok(Kind::Optional(item))
            }
            "bool" => self.wrong("a truth value is `Bool`, as not every byte is a `bool`"),
            "String" | "str" => self.wrong("a text is `Text<32>`, with room for so many bytes"),
            "Vec" => self.wrong("a list is `Sequence<T, 16>`, with room for so many, or `[T]` at the end"),
            "usize" | "isize" => {
                self.wrong("its size differs from computer to computer: take `u64` or `i64`")
            }
            name => match types.get(name) {
                Some(kind) => Ok(*kind),
                None => {
                    let near = slate::blackboard::nearest_names(name, types.keys().map(String::as_str));
                    let near = if near.is_empty() {
                        String::new()
                    } else {
                        format!("; did you mean {}?", near.join(" or "))
                    };
                    self.wrong(format!(
                        "`{name}` is not an interface above this one, nor one that comes with Slate{near}"
                    ))
                }
            },
        }
    }
}

/// Converts `GoalReached` to `GOAL_REACHED`, as the macro does.
pub fn upper_case(name: &str) -> String {
    let (mut text, mut is_behind_small) = (String::new(), false);
    for letter in name.chars() {
        if letter.is_uppercase() && is_behind_small {
            text.push('_');
        }
        is_behind_small = letter.is_lowercase() || letter.is_ascii_digit();
        text.extend(letter.to_uppercase());
    }
    text
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use slate::blackboard::interface::Interface;

    use super::*;

    /// Returns the hash of an interface of that name in a source.
    fn hash(source: &str, name: &str) -> u64 {
        let found = interfaces(source).unwrap();
        found.iter().find(|found| found.descriptor.name == name).unwrap().descriptor.hash
    }

    #[test]
    fn shipped_interfaces_have_the_layout_of_the_compiler() {
        use slate::interfaces::{
            Contacts, Image, LaserScan, Odometry, Pose2, Sightings, SonarScan, Verdict, WheelSpeeds,
        };
        let pose = include_str!("../../../interfaces/src/pose.rs");
        assert_eq!(hash(pose, "Pose2"), Pose2::DESCRIPTOR.hash);
        assert_eq!(hash(pose, "Odometry"), Odometry::DESCRIPTOR.hash);
        let range = include_str!("../../../interfaces/src/range.rs");
        assert_eq!(hash(range, "SonarScan"), SonarScan::DESCRIPTOR.hash);
        assert_eq!(hash(range, "LaserScan"), LaserScan::DESCRIPTOR.hash);
        let drive = include_str!("../../../interfaces/src/drive.rs");
        assert_eq!(hash(drive, "WheelSpeeds"), WheelSpeeds::DESCRIPTOR.hash);
        let mission = include_str!("../../../interfaces/src/mission.rs");
        assert_eq!(hash(mission, "Verdict"), Verdict::DESCRIPTOR.hash);
        let contact = include_str!("../../../interfaces/src/contact.rs");
        assert_eq!(hash(contact, "Contacts"), Contacts::DESCRIPTOR.hash);
        let sighting = include_str!("../../../interfaces/src/sighting.rs");
        assert_eq!(hash(sighting, "Sightings"), Sightings::DESCRIPTOR.hash);
        let image = include_str!("../../../interfaces/src/image.rs");
        assert_eq!(hash(image, "Image"), Image::DESCRIPTOR.hash);
    }

    #[test]
    fn constants_and_raw_fields_are_named_as_by_the_macro() {
        use slate::module::{Plain, interface};

        #[interface]
        #[allow(dead_code)]
        enum Level {
            NotANumber,
            AB,
            L2Norm,
        }
        #[interface]
        struct Own {
            r#type: u8,
            level: Level,
        }
        let source = "#[interface] enum Level { NotANumber, AB, L2Norm }\n#[interface] struct Own { r#type: u8, level: Level }";
        assert_eq!(hash(source, "Own"), Own::DESCRIPTOR.hash);
        assert_eq!(Own::DESCRIPTOR.fields[0].name, "type");
        let Kind::Enumeration(level) = Level::KIND else { panic!() };
        let names = ["NotANumber", "AB", "L2Norm"].map(upper_case);
        assert_eq!(level.constants.iter().map(|constant| constant.name).collect::<Vec<_>>(), names);
    }

    #[test]
    fn a_field_is_any_shipped_interface_without_a_tail() {
        for known in slate::interfaces::ALL {
            let source = format!("#[interface] pub struct Own {{ a: {} }}", known.name);
            assert_eq!(interfaces(&source).is_ok(), known.tail().is_none(), "{}", known.name);
        }
    }

    #[test]
    fn an_invalid_interface_is_refused_with_line_and_remedy() {
        for (source, line, words) in [
            ("#[interface]\npub struct A {\n a: bool }", 3, "`Bool`"),
            ("#[interface] pub struct A { a: Strin }", 1, "not an interface above"),
            ("#[interface] pub struct A { a: [u8], b: u8 }", 1, "only the last field"),
            ("#[interface] pub struct A { a: Sequence<f64, LIMIT> }", 1, "write it out"),
            ("#[interface] pub union A {}", 1, "expected a struct or an enum"),
            ("#[interface] pub struct A { a u8 }", 1, "expected `:`"),
            ("#[interface]\npub struct A {\n a: u8,\n a: u8 }", 4, "two fields `a`"),
            ("#[interface]\npub struct A { type: u8 }", 2, "`type` is a keyword of Rust"),
            ("#[interface]\npub struct A { 9a: u8 }", 2, "begins with a digit"),
            ("#[interface]\npub enum A { Go, Go }", 2, "two constants `Go`"),
            ("#[interface] struct A { a: u8 }\n#[interface] struct A { a: u8 }", 2, "there already"),
            ("\nfn main() {", 2, "expected `}`"),
            ("fn main() {\n let x = [1);\n}", 2, "expected `]` for the `[` of line 2"),
            ("}", 1, "closes nothing"),
            ("/* /* */ fn", 1, "expected `*/`"),
            ("\n\"text", 2, "a text begins here"),
            ("r#\"text\"", 1, "a raw text"),
        ] {
            let wrong = interfaces(source).unwrap_err();
            assert!(wrong.line == line && wrong.message.contains(words), "{source}: {wrong:?}");
        }
        assert!(interfaces("pub struct A { a: String }\n// #[interface]\n").unwrap().is_empty());
        // Brackets in texts, characters and comments do not count.
        let source = "fn a<'a>(x: &'a str) { ('{', '\\'', '\\u{7b}', b'(', \"{\", r#\"\"{\"#, br\"[\") /* { /* ( */ */ // [\n}";
        assert!(interfaces(source).unwrap().is_empty());
    }

    proptest! {
        #[test]
        fn no_source_makes_it_fall(source in "(#\\[interface\\]|pub|struct|enum|A|\\{|\\}|:|u8|f64|\\[|\\]|;|<|>|,|\"|/|\n| |3){0,24}") {
            let _ = interfaces(&source);
        }
    }
}
