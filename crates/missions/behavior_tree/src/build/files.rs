//! File of a tree, and those that it includes.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use roxmltree::{Document, Node};

use crate::error::TreeError;

/// Greatest size of all files, bytes.
const MOST_BYTES: usize = 4 << 20;
/// Maximum number of files.
const MOST_FILES: usize = 64;

/// Text of a file.
pub(super) struct TreeText {
    /// Included file; `None` for the first one.
    pub included: Option<PathBuf>,
    pub text: String,
}

impl TreeText {
    /// Reads a file and those that it includes, each once.
    pub fn read(file: &Path) -> Result<Vec<Self>, TreeError> {
        let mut left = MOST_BYTES;
        let mut texts = vec![Self { included: None, text: text_of(file, &mut left)? }];
        let mut known = vec![whole(file)];
        let mut number = 0;
        while let Some(Self { included, text }) = texts.get(number) {
            let place = included.as_deref().unwrap_or(file).to_owned();
            for other in included_files(&place, text).map_err(|error| error.of_file(&place))? {
                if known.contains(&whole(&other)) {
                    continue;
                }
                if known.len() == MOST_FILES {
                    return Err(
                        TreeError::new(format!("expected at most {MOST_FILES} files")).of_file(&other)
                    );
                }
                known.push(whole(&other));
                let text = text_of(&other, &mut left)?;
                texts.push(Self { included: Some(other), text });
            }
            number += 1;
        }
        Ok(texts)
    }

    /// Parses the bytes of a file.
    pub fn parse(bytes: &[u8]) -> Result<Self, TreeError> {
        if bytes.len() > MOST_BYTES {
            return Err(too_long());
        }
        Ok(Self { included: None, text: decoded(bytes)?.into() })
    }
}

/// Parses the XML of a text.
pub(super) fn parsed(text: &str) -> Result<Document<'_>, TreeError> {
    Document::parse(text)
        .map_err(|error| TreeError::at(error.pos().row as usize, format!("expected XML: {error}")))
}

/// Files that a text includes, by paths from its own folder.
fn included_files(file: &Path, text: &str) -> Result<Vec<PathBuf>, TreeError> {
    let document = parsed(text)?;
    let elements = document.root_element().children().filter(|child| child.has_tag_name("include"));
    let path = |element: Node<'_, '_>| match (element.attribute("path"), element.attribute("ros_pkg")) {
        (Some(path), None) => Ok(file.parent().unwrap_or(Path::new("")).join(path)),
        (_, Some(_)) => Err("no packages of ROS are known here: write the path from the folder of this file"),
        (None, None) => Err("expected the attribute `path` of `include`"),
    };
    let line = |element: &Node<'_, '_>| document.text_pos_at(element.range().start).row as usize;
    elements.map(|element| path(element).map_err(|reason| TreeError::at(line(&element), reason))).collect()
}

/// Reads a text of at most `left` bytes, and subtracts them.
fn text_of(file: &Path, left: &mut usize) -> Result<String, TreeError> {
    let unreadable = |error: std::io::Error| TreeError::new(format!("can't be read: {error}")).of_file(file);
    if !std::fs::metadata(file).map_err(unreadable)?.is_file() {
        return Err(TreeError::new("expected a file").of_file(file));
    }
    let mut bytes = Vec::new();
    let opened = File::open(file).map_err(unreadable)?;
    opened.take(*left as u64 + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    *left = left.checked_sub(bytes.len()).ok_or_else(|| too_long().of_file(file))?;
    decoded(&bytes).map(str::to_owned).map_err(|error| error.of_file(file))
}

fn too_long() -> TreeError {
    TreeError::new(format!("expected a file of at most {MOST_BYTES} bytes, with those that it includes"))
}

fn decoded(bytes: &[u8]) -> Result<&str, TreeError> {
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let line = bytes[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n').count() + 1;
        TreeError::at(line, "expected UTF-8; save the file in that encoding")
    })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

/// Returns the absolute path of a file, its identity.
fn whole(file: &Path) -> PathBuf {
    file.canonicalize().unwrap_or_else(|_| file.to_owned())
}
