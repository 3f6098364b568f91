//! Files attached to a recording.

use std::path::{Path, PathBuf};

use serde_json::json;
use slate::bag::{Attachment, Error};
use slate::logs;
use slate::record::CONFIGURATION;
use slate::runtime::configuration::Value;
use slate::runtime::printable;
use slate_sorted::SortedSet;

use super::target;
use crate::failure::Failure;
use crate::output;

/// Lists them, or writes them into a folder.
pub fn attachments(file: &Path, out: Option<&Path>, force: bool, json: bool) -> Result<(), Failure> {
    let mut reader = logs::open(file)?;
    let mut found = Vec::new();
    for number in 0..reader.attachments() {
        found.extend(reader.attachment(number)?);
    }
    let places = match out {
        Some(folder) => take_out(file, &mut found, folder, force)?,
        None => Vec::new(),
    };
    let place = |number: usize| places.get(number).map(|place| printable(place));
    if json {
        let entry = |(number, attachment): (usize, &Attachment)| {
            json!({
                "name": attachment.name,
                "media_type": attachment.media_type,
                "bytes": attachment.data.len(),
                "log_time": attachment.log_time,
                "file": place(number),
            })
        };
        let entries: Vec<_> = found.iter().enumerate().map(entry).collect();
        output::document("slate.bag.attachments/1", &json!({ "attachments": entries }));
        return Ok(());
    }
    if found.is_empty() {
        output::line(format_args!("{} has no attachments", printable(file)));
        return Ok(());
    }
    let head = ["attachment", "type", "bytes", if out.is_some() { "file" } else { "" }].map(String::from);
    let rows = found.iter().enumerate().map(|(number, attachment)| {
        let Attachment { name, media_type, data, .. } = attachment;
        [name.clone(), media_type.clone(), data.len().to_string(), place(number).unwrap_or_default()]
    });
    output::columns([head].into_iter().chain(rows));
    Ok(())
}

/// Writes the attachments, and returns their paths.
/// A configuration that names attached files then names the written ones.
fn take_out(
    file: &Path,
    found: &mut [Attachment],
    folder: &Path,
    force: bool,
) -> Result<Vec<PathBuf>, Failure> {
    let mut taken = SortedSet::new();
    let places: Vec<PathBuf> =
        found.iter().map(|attachment| folder.join(own_name(&attachment.name, &mut taken))).collect();
    for place in &places {
        target::free(place, &[file], force)?;
    }
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| Error::Write { path, source }
    };
    std::fs::create_dir_all(folder).map_err(failed(folder))?;
    let moved: Vec<_> = found.iter().zip(&places).filter(|(own, _)| own.name != CONFIGURATION).collect();
    let moved = moved.into_iter().map(|(own, place)| {
        let place = std::path::absolute(place).map_err(failed(place))?;
        Ok((quoted(&own.name), quoted(&place.to_string_lossy())))
    });
    let moved = moved.collect::<Result<Vec<_>, Error>>()?;
    for (attachment, place) in found.iter_mut().zip(&places) {
        if attachment.name == CONFIGURATION
            && let Ok(text) = std::str::from_utf8(&attachment.data)
        {
            attachment.data = pointed(text, &moved).into_bytes();
        }
        std::fs::write(place, &attachment.data).map_err(failed(place))?;
    }
    Ok(places)
}

/// Returns the configuration, a setting in each line, with its files' new names.
fn pointed(text: &str, moved: &[(String, String)]) -> String {
    let line = |line: &str| {
        let known = moved.iter().find_map(|(name, place)| {
            let setting = line.strip_suffix(name.as_str())?.strip_suffix(" = ")?;
            setting.starts_with("world.").then(|| format!("{setting} = {place}"))
        });
        known.unwrap_or_else(|| line.to_owned()) + "\n"
    };
    text.lines().map(line).collect()
}

fn quoted(text: &str) -> String {
    Value::Text(text.into()).to_string()
}

/// Returns a file name for an attachment: inside the folder, and unique.
fn own_name(name: &str, taken: &mut SortedSet<String>) -> String {
    let last = name.rsplit(['/', '\\']).next().unwrap_or_default();
    let last = if ["", ".", ".."].contains(&last) { "attachment" } else { last };
    let last: String = last.chars().filter(|letter| !letter.is_control()).collect();
    let (stem, extension) = match last.rsplit_once('.') {
        Some((stem, extension)) if !stem.is_empty() => (stem.to_owned(), format!(".{extension}")),
        _ => (last.clone(), String::new()),
    };
    let numbered = (1..).map(|number| format!("{stem}-{number}{extension}"));
    let own = std::iter::once(last).chain(numbered).find(|name| !taken.contains(name)).unwrap_or_default();
    taken.insert(own.clone());
    own
}
