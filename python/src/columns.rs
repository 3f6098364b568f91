//! Values of many messages as columns, one for each field.

use slate_bag::Value;
use slate_ros_messages as ros;

/// Messages of one topic as columns.
#[derive(Default)]
pub struct Columns {
    /// Times, ns, each of 8 bytes.
    times: Vec<u8>,
    rows: usize,
    columns: Vec<(String, Column)>,
    /// Column of the last cell, as fields have the same order in each message.
    last: usize,
}

/// Column of one field.
pub enum Column {
    /// Numbers of one type, each of its size.
    Numbers { dtype: &'static str, bytes: Vec<u8>, lengths: ListLengths },
    /// Texts.
    Texts { items: Vec<String>, lengths: ListLengths },
}

/// Lengths of the lists in a column, by row; of a column without lists each is 1.
#[derive(Default)]
pub struct ListLengths {
    by_row: Vec<u32>,
    is_list: bool,
}

/// Number, text, or list of them.
enum Cell<'a> {
    Number(&'static str, &'a [u8]),
    Numbers(&'static str, &'a [u8]),
    Text(&'a str),
}

impl Columns {
    /// Adds the value of a message at a time, ns.
    ///
    /// # Errors
    /// A field of another type than in the messages before.
    pub fn add(&mut self, time: u64, value: &Value) -> Result<(), String> {
        match value {
            Value::Message(value) => self.add_value("", value, false)?,
            Value::Json(value) => self.put("json", Cell::Text(&value.to_string()), false)?,
            Value::Unread { why, .. } => return Err(format!("a message can't be read: {why}")),
        }
        self.times.extend(time.to_ne_bytes());
        self.rows += 1;
        for (name, column) in &mut self.columns {
            let lengths = column.lengths_mut();
            lengths.by_row.resize(self.rows, 0);
            if !lengths.is_list && lengths.by_row.last() != Some(&1) {
                return Err(format!(
                    "message {} has no field `{name}`, so it does not form a table",
                    self.rows
                ));
            }
        }
        Ok(())
    }

    /// Returns the times and the columns.
    pub fn into_parts(self) -> (Vec<u8>, Vec<(String, Column)>) {
        (self.times, self.columns)
    }

    fn add_value(&mut self, path: &str, value: &ros::Value, in_list: bool) -> Result<(), String> {
        match value {
            ros::Value::Map(map) => {
                for (name, value) in map.iter() {
                    let path = if path.is_empty() { name.to_owned() } else { format!("{path}/{name}") };
                    self.add_value(&path, value, in_list)?;
                }
                Ok(())
            }
            // Those of a list of messages are a column for each field.
            ros::Value::List(items) => items.iter().try_for_each(|item| self.add_value(path, item, true)),
            ros::Value::Numbers(numbers) => {
                self.put(path, Cell::Numbers(dtype(numbers.kind()), numbers.bytes()), true)
            }
            ros::Value::Text(text) => self.put(path, Cell::Text(text), in_list),
            ros::Value::Bool(value) => self.put(path, Cell::Number("?", &[u8::from(*value)]), in_list),
            ros::Value::Signed(value) => self.put(path, Cell::Number("i8", &value.to_ne_bytes()), in_list),
            ros::Value::Unsigned(value) => self.put(path, Cell::Number("u8", &value.to_ne_bytes()), in_list),
            ros::Value::Single(value) => self.put(path, Cell::Number("f4", &value.to_ne_bytes()), in_list),
            ros::Value::Double(value) => self.put(path, Cell::Number("f8", &value.to_ne_bytes()), in_list),
        }
    }

    /// Appends a cell to its column, and creates the column if it is missing.
    fn put(&mut self, path: &str, cell: Cell<'_>, in_list: bool) -> Result<(), String> {
        let path = if path.is_empty() { "value" } else { path };
        let count = self.columns.len();
        let after = (0..count).map(|step| (self.last + 1 + step) % count);
        let found = after.into_iter().find(|index| self.columns[*index].0 == path);
        let index = match found {
            Some(index) => index,
            None if self.rows > 0 && !in_list => {
                return Err(format!(
                    "only message {} has a field `{path}`, so it does not form a table",
                    self.rows + 1
                ));
            }
            None => {
                self.columns.push((path.to_owned(), Column::new(&cell, in_list)));
                count
            }
        };
        self.last = index;
        let row = self.rows;
        let (name, column) = &mut self.columns[index];
        column.put(row, cell).ok_or_else(|| {
            format!("the field `{name}` of message {} is of another type than before", row + 1)
        })
    }
}

impl Column {
    fn new(cell: &Cell<'_>, is_list: bool) -> Self {
        let lengths = ListLengths { by_row: Vec::new(), is_list };
        match cell {
            Cell::Number(dtype, _) | Cell::Numbers(dtype, _) => {
                Self::Numbers { dtype, bytes: Vec::new(), lengths }
            }
            Cell::Text(_) => Self::Texts { items: Vec::new(), lengths },
        }
    }

    fn lengths_mut(&mut self) -> &mut ListLengths {
        match self {
            Self::Numbers { lengths, .. } | Self::Texts { lengths, .. } => lengths,
        }
    }

    /// Returns the type of the numbers as numpy names it; empty for texts.
    pub fn dtype(&self) -> &'static str {
        match self {
            Self::Numbers { dtype, .. } => dtype,
            Self::Texts { .. } => "",
        }
    }

    /// Returns the lengths of the lists by row, if it has lists.
    pub fn list_lengths(&self) -> Option<Vec<u32>> {
        let (Self::Numbers { lengths, .. } | Self::Texts { lengths, .. }) = self;
        lengths.is_list.then(|| lengths.by_row.clone())
    }

    /// Adds a cell of a row; `None` if it is of another type.
    fn put(&mut self, row: usize, cell: Cell<'_>) -> Option<()> {
        let count = match (&mut *self, cell) {
            (Self::Numbers { dtype, bytes, .. }, Cell::Number(own, number)) if *dtype == own => {
                bytes.extend(number);
                1
            }
            (Self::Numbers { dtype, bytes, .. }, Cell::Numbers(own, numbers)) if *dtype == own => {
                bytes.extend(numbers);
                let size = own[1..].parse().unwrap_or(1);
                numbers.len() / size
            }
            (Self::Texts { items, .. }, Cell::Text(text)) => {
                items.push(text.to_owned());
                1
            }
            _ => return None,
        };
        let lengths = &mut self.lengths_mut().by_row;
        lengths.resize(row + 1, 0);
        lengths[row] += u32::try_from(count).ok()?;
        Some(())
    }
}

/// Returns the type of a number as numpy names it, of native byte order.
pub fn dtype(kind: ros::Primitive) -> &'static str {
    match kind {
        ros::Primitive::Bool => "?",
        ros::Primitive::U8 => "u1",
        ros::Primitive::U16 => "u2",
        ros::Primitive::U32 => "u4",
        ros::Primitive::U64 => "u8",
        ros::Primitive::I8 => "i1",
        ros::Primitive::I16 => "i2",
        ros::Primitive::I32 => "i4",
        ros::Primitive::I64 => "i8",
        ros::Primitive::F32 => "f4",
        ros::Primitive::F64 => "f8",
    }
}
