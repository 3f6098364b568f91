//! Slate's own messages as shown to readers.
//! They have the fields of the interface, without fields for the layout alone and without the whole value as memory.

use std::sync::Arc;

use super::cdr::{CdrReader, CdrWriter, wire_length};
use super::constants::constants;
use super::definition::{PACKAGE, memory};
use super::names::is_padding;
use super::schema::{Count, FieldType, Item, take};
use super::{Definition, Error, Primitive, RosPrimitive, Schema};

/// Returns true if a definition of that name is one of Slate's.
fn is_own(name: &str) -> bool {
    name.strip_prefix(PACKAGE).is_some_and(|rest| rest.starts_with('/'))
}

/// Reduction of messages to the shown fields.
#[derive(Clone, Debug)]
pub struct Shown {
    definition: Definition,
    schema: Schema,
}

impl Shown {
    /// Returns the reduction of one of Slate's definitions.
    /// The definition is one that [`definition`](super::definition()) has made. `None` if all of its messages is shown.
    ///
    /// # Errors
    /// When it can't be read.
    pub fn of(definition: &Definition) -> Result<Option<Self>, Error> {
        let Definition { name, text } = definition;
        let schema = Schema::parse_shown(name, text)?;
        let is_whole = schema.records().iter().all(|record| record.types.iter().all(|field| field.is_shown));
        let definition = Definition { name: name.clone(), text: reduced(text) };
        let left = Schema::parse(name, &definition.text)?;
        // Others may write a definition in other ways than Slate does.
        let is_same = schema.records().iter().zip(left.records()).all(|(whole, left)| {
            whole.name == left.name
                && (whole.shown == left.names || whole.shown.is_empty() && left.names.len() == 1)
        });
        Ok((!is_whole && is_same).then_some(Self { definition, schema }))
    }

    /// Returns the remaining definition.
    pub fn definition(&self) -> &Definition {
        &self.definition
    }

    /// Appends the reduction of a message.
    ///
    /// # Errors
    /// When it is not a message of the whole definition; `out` has a part of it then.
    pub fn encode(&self, message: &[u8], out: &mut Vec<u8>) -> Result<(), Error> {
        // Bytes are copied without a look at what they mean.
        self.schema.check(message)?;
        let (mut reader, mut writer) = (CdrReader::new(message)?, CdrWriter::new(out));
        let mut room = message.len();
        self.schema.copy_record(&mut reader, &mut writer, 0, &mut room)?;
        reader.end()
    }
}

impl Schema {
    /// Parses a definition as [`parse`](Schema::parse), for reduced messages.
    /// A decoded message of Slate's own has the fields of the interface, without unused ones.
    ///
    /// # Errors
    /// As [`parse`](Schema::parse).
    pub fn parse_shown(name: &str, text: &str) -> Result<Self, Error> {
        let mut schema = Self::parse(name, text)?;
        if !is_own(name) {
            return Ok(schema);
        }
        let (memory, constants) = (memory(text), constants(text));
        for (record, own) in schema.records_mut().iter_mut().zip(constants) {
            record.constants = own;
        }
        for (index, record) in schema.records_mut().iter_mut().enumerate() {
            for (name, field) in record.names.iter().zip(&mut record.types) {
                let is_memory = index == 0 && Some(name.as_str()) == memory;
                let is_number = matches!(field.item, Item::Primitive(kind) if kind.integers().is_some());
                field.is_shown = !(is_memory || is_number && is_padding(name));
            }
            let shown = record.names.iter().zip(&record.types).filter(|(_, field)| field.is_shown);
            record.shown = Arc::new(shown.map(|(name, _)| name.clone()).collect());
        }
        Ok(schema)
    }

    fn copy_record(
        &self,
        reader: &mut CdrReader<'_>,
        writer: &mut CdrWriter<'_>,
        index: usize,
        room: &mut usize,
    ) -> Result<(), Error> {
        take(reader, room)?;
        let record = &self.records()[index];
        if record.types.is_empty() {
            reader.byte()?;
        }
        for field in &record.types {
            match field.is_shown {
                true => self.copy_field(reader, writer, *field, room)?,
                false => self.check_field(reader, *field, room)?,
            }
        }
        if record.shown.is_empty() {
            writer.byte(0);
        }
        Ok(())
    }

    fn copy_field(
        &self,
        reader: &mut CdrReader<'_>,
        writer: &mut CdrWriter<'_>,
        field: FieldType,
        room: &mut usize,
    ) -> Result<(), Error> {
        let count = match field.count {
            Count::One => return self.copy_item(reader, writer, field.item, room),
            Count::Fixed(count) => count,
            Count::Any => {
                let count = reader.length()?;
                writer.length(wire_length(count)?);
                count
            }
        };
        take(reader, room)?;
        if let Item::Primitive(kind) = field.item {
            writer.numbers(&reader.new_numbers(count, kind.size())?, kind.size());
            return Ok(());
        }
        (0..count).try_for_each(|_| self.copy_item(reader, writer, field.item, room))
    }

    fn copy_item(
        &self,
        reader: &mut CdrReader<'_>,
        writer: &mut CdrWriter<'_>,
        item: Item,
        room: &mut usize,
    ) -> Result<(), Error> {
        let kind = match item {
            Item::Record(index) => return self.copy_record(reader, writer, index, room),
            Item::Text => {
                take(reader, room)?;
                return writer.text(reader.text()?);
            }
            Item::Primitive(kind) => kind,
        };
        take(reader, room)?;
        let mut memory = [0; 8];
        let memory = &mut memory[..kind.size()];
        reader.numbers(memory, kind.size())?;
        writer.numbers(memory, kind.size());
        Ok(())
    }
}

/// Returns a definition of Slate's own without the lines of hidden fields.
fn reduced(text: &str) -> String {
    let memory = memory(text);
    let mut lines: Vec<&str> = Vec::new();
    let (mut is_top, mut has_fields) = (true, false);
    let close = |lines: &mut Vec<&str>, has_fields: bool| {
        if !has_fields {
            lines.push("uint8 structure_needs_at_least_one_member");
        }
    };
    for line in text.lines() {
        if line.starts_with("===") {
            close(&mut lines, has_fields);
            (is_top, has_fields) = (false, false);
        }
        let field = line
            .split_once(' ')
            .filter(|(of, name)| !(of.starts_with(['#', '=']) || *of == "MSG:" || name.contains('=')));
        let Some((of, name)) = field else {
            lines.push(line);
            continue;
        };
        let is_number = || {
            let item = of.split('[').next().unwrap_or_default();
            Primitive::named(item).and_then(Primitive::integers).is_some()
        };
        if is_top && Some(name) == memory || is_padding(name) && is_number() {
            // Its comment goes with it.
            lines.pop_if(|before| before.starts_with('#'));
            continue;
        }
        has_fields = true;
        lines.push(line);
    }
    close(&mut lines, has_fields);
    lines.push("");
    lines.join("\n")
}
