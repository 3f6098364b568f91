//! Fields of `map.yaml`.
//!
//! Own code for the part of YAML that map files use, a flat mapping of scalars and one list of numbers: a handful of
//! lines, whose numbers are kept for errors of values, needs no crate.

use std::fmt::Write as _;
use std::path::Path;

use slate_interfaces::Pose2;

use crate::MapFileError;
use crate::occupancy::{MapFileOptions, MapMode};
use crate::quotes::{quoted, quoted_length, unquoted};

/// Content of `map.yaml`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Metadata {
    /// Path of the image as written, relative to the folder of the file.
    pub image: String,
    /// Line of the image's name.
    pub image_line: usize,
    pub resolution: f64,
    pub origin: Pose2,
    pub options: MapFileOptions,
}

/// Value of a field with its line, counted from 1.
/// Of a list of lines, the items joined with commas.
struct MetadataField<'a> {
    key: &'a str,
    value: String,
    line: usize,
}

impl Metadata {
    /// Parses the text of a file.
    /// Unknown fields are ignored, as `map_server` does.
    pub fn parse(file: &Path, text: &str) -> Result<Self, MapFileError> {
        let fields = MetadataFields { file, list: parse_fields(file, text)? };
        let image = fields.required("image", "the name of a .pgm or .png file")?;
        let resolution = fields.number("resolution", "a length above 0 m per cell")?;
        if !(resolution.is_finite() && resolution > 0.0) {
            return Err(fields.wrong("resolution", "a length above 0 m per cell"));
        }
        let options = MapFileOptions {
            mode: fields.mode()?,
            negate: fields.negate()?,
            occupied_thresh: fields.number("occupied_thresh", "a number from 0 to 1")?,
            free_thresh: fields.number("free_thresh", "a number from 0 to 1")?,
        };
        for (key, value) in
            [("occupied_thresh", options.occupied_thresh), ("free_thresh", options.free_thresh)]
        {
            if !(0.0..=1.0).contains(&value) {
                return Err(fields.wrong(key, "a number from 0 to 1"));
            }
        }
        if options.free_thresh >= options.occupied_thresh {
            return Err(fields.wrong("free_thresh", "a number below occupied_thresh"));
        }
        Ok(Self {
            image: image.value.clone(),
            image_line: image.line,
            resolution,
            origin: fields.origin()?,
            options,
        })
    }

    /// Returns the text of a file.
    pub fn text(&self) -> String {
        let Pose2 { x, y, theta } = self.origin;
        let MapFileOptions { mode, negate, occupied_thresh, free_thresh } = self.options;
        let mut text = String::new();
        // Writing to a text does not fail.
        let _ = write!(
            text,
            "image: {}\nmode: {}\nresolution: {:?}\norigin: [{x:?}, {y:?}, {theta:?}]\nnegate: {}\n\
            occupied_thresh: {occupied_thresh:?}\nfree_thresh: {free_thresh:?}\n",
            quoted(&self.image),
            mode.name(),
            self.resolution,
            u8::from(negate),
        );
        text
    }
}

fn parse_fields<'a>(file: &Path, text: &'a str) -> Result<Vec<MetadataField<'a>>, MapFileError> {
    let mut fields: Vec<MetadataField> = Vec::new();
    for (line, text) in (1..).zip(text.lines()) {
        let text = without_comment(text).trim_end();
        if text.trim().is_empty() || text == "---" || text == "..." {
            continue;
        }
        if let Some(item) = text.trim_start().strip_prefix("- ") {
            let field = fields.last_mut();
            let field = field.ok_or_else(|| MapFileError::at(file, line, "expected `key: value`"))?;
            if !field.value.is_empty() {
                field.value.push(',');
            }
            field.value.push_str(item.trim());
            continue;
        }
        let is_key = |key: &str| key.chars().all(|sign| sign.is_ascii_alphanumeric() || sign == '_');
        match text.split_once(':') {
            Some((key, value)) if !key.is_empty() && is_key(key) => {
                if fields.iter().any(|field| field.key == key) {
                    return Err(MapFileError::at(file, line, format!("`{key}` is there twice")));
                }
                let value = unquoted(value.trim());
                let value = value.ok_or_else(|| {
                    MapFileError::at(file, line, "invalid quoted text: expected matching quotes")
                })?;
                fields.push(MetadataField { key, value, line });
            }
            // A list may continue in the next line.
            _ => match fields.last_mut() {
                Some(field) if field.value.starts_with('[') && !field.value.ends_with(']') => {
                    field.value.push_str(text.trim());
                }
                _ => return Err(MapFileError::at(file, line, "expected `key: value`")),
            },
        }
    }
    Ok(fields)
}

/// Returns a line without its comment.
/// A comment begins at the line's start, or after a blank, and not within a quoted value.
fn without_comment(text: &str) -> &str {
    let value = text.split_once(':').map_or("", |(_, value)| value.trim_start());
    let quoted = quoted_length(value).map_or(0, |length| text.len() - value.len() + length);
    let is_start = |at: &usize| *at == 0 || text.as_bytes()[at - 1].is_ascii_whitespace();
    let end = text.match_indices('#').map(|(at, _)| at).find(|at| *at >= quoted && is_start(at));
    &text[..end.unwrap_or(text.len())]
}

struct MetadataFields<'a> {
    file: &'a Path,
    list: Vec<MetadataField<'a>>,
}

impl MetadataFields<'_> {
    fn get(&self, key: &str) -> Option<&MetadataField<'_>> {
        self.list.iter().find(|field| field.key == key)
    }

    fn required(&self, key: &str, expected: &str) -> Result<&MetadataField<'_>, MapFileError> {
        let field = self.get(key).filter(|field| !field.value.is_empty());
        field.ok_or_else(|| MapFileError::new(self.file, format!("no `{key}`: expected {expected}")))
    }

    fn wrong(&self, key: &str, expected: &str) -> MapFileError {
        match self.get(key) {
            Some(MetadataField { value, line, .. }) => {
                let reason = format!("invalid `{key}` `{value}`: expected {expected}");
                MapFileError::at(self.file, *line, reason)
            }
            None => MapFileError::new(self.file, format!("no `{key}`: expected {expected}")),
        }
    }

    fn number(&self, key: &str, expected: &str) -> Result<f64, MapFileError> {
        let field = self.required(key, expected)?;
        field.value.parse().map_err(|_| self.wrong(key, expected))
    }

    fn negate(&self) -> Result<bool, MapFileError> {
        let expected = "0 or 1";
        match self.required("negate", expected)?.value.as_str() {
            "0" | "false" => Ok(false),
            "1" | "true" => Ok(true),
            _ => Err(self.wrong("negate", expected)),
        }
    }

    fn mode(&self) -> Result<MapMode, MapFileError> {
        let Some(field) = self.get("mode") else { return Ok(MapMode::default()) };
        MapMode::parse(&field.value).ok_or_else(|| self.wrong("mode", "`trinary`, `scale` or `raw`"))
    }

    fn origin(&self) -> Result<Pose2, MapFileError> {
        let expected = "`[x, y, yaw]` of the lower left corner, m and rad";
        let value = &self.required("origin", expected)?.value;
        let list = value.strip_prefix('[').and_then(|list| list.strip_suffix(']')).unwrap_or(value);
        let numbers: Result<Vec<f64>, _> = list.split(',').map(|number| number.trim().parse()).collect();
        match numbers.as_deref() {
            Ok(&[x, y, theta]) if [x, y, theta].iter().all(|number| number.is_finite()) => {
                Ok(Pose2 { x, y, theta })
            }
            _ => Err(self.wrong("origin", expected)),
        }
    }
}
