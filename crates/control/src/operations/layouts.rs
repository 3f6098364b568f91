//! Layouts of the console's page: positions of the panels.
//! A project keeps them beside its configuration.

use std::fs;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::sync::Arc;

use hyper::StatusCode;
use serde_json::{Map, Value as Json, json};

use super::shape;
use crate::Role;
use crate::answer::OperationAnswer;
use crate::operation::{Operation, OperationRequest, Pace};
use crate::problem::Problem;
use crate::surface::ControlSurface;

/// Folder of a project with the files of the console's page.
pub const PROJECT_FOLDER: &str = "console";

/// Returns whether a name is a plain file name, in no other folder and not hidden.
pub fn is_plain(name: &str) -> bool {
    let known = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_' | b'.');
    !name.is_empty() && !name.starts_with('.') && name.bytes().all(known)
}

pub(super) const LIST: Operation =
    Operation::get("/layouts", "layouts", Role::Viewer, "Layouts of the page in the project, by name")
        .answers(|| json!({ "type": "object" }), list);

pub(super) const SAVE: Operation = Operation::put(
    "/layouts/{layout}",
    "save_layout",
    Role::Developer,
    "Writes a layout into the project, as console/layouts/NAME.json where the agent was started",
    Pace::Slow,
)
.body(|| {
    json!({
        "type": "object",
        "properties": { "title": shape::text(), "columns": { "type": "array", "minItems": 1 } },
        "required": ["title", "columns"],
    })
})
.answers(|| shape::object(&[("file", shape::text())]), save);

pub(super) const REMOVE: Operation = Operation::delete(
    "/layouts/{layout}",
    "remove_layout",
    Role::Developer,
    "Deletes a layout of the project",
    Pace::Slow,
)
.answers(|| json!({ "type": "object", "maxProperties": 0 }), remove);

/// Maximum size of a layout, bytes; larger than any number of panels needs.
const MAX_SIZE: u64 = 64 << 10;

/// Maximum number of layouts in a list.
const MAX_LAYOUTS: usize = 64;

fn folder() -> PathBuf {
    PathBuf::from(PROJECT_FOLDER).join("layouts")
}

pub(super) fn list(_: &Arc<ControlSurface>, _: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let entries = fs::read_dir(folder()).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .filter_map(|entry| {
            entry.file_name().into_string().ok()?.strip_suffix(".json").map(ToOwned::to_owned)
        })
        .filter(|name| is_plain(name))
        .collect();
    names.sort();
    names.truncate(MAX_LAYOUTS);
    // Other files in that folder are left out.
    let read = |name: String| {
        let file = folder().join(format!("{name}.json"));
        fs::metadata(&file).ok().filter(|about| about.is_file() && about.len() <= MAX_SIZE)?;
        Some((name, serde_json::from_slice(&fs::read(file).ok()?).ok()?))
    };
    let layouts: Map<String, Json> = names.into_iter().filter_map(read).collect();
    Ok(OperationAnswer::json(Json::Object(layouts)))
}

/// Returns the file of a layout.
fn file(request: &OperationRequest) -> Result<PathBuf, Problem> {
    let name = request.part("layout")?;
    if !is_plain(name) || name.len() > 64 || name.contains('.') {
        let help = "it has at most 64 letters, digits, _ and -";
        return Err(Problem::bad(format!("`{name}` can't be the name of a layout"), help));
    }
    Ok(folder().join(format!("{name}.json")))
}

fn unwritable(error: &std::io::Error) -> Problem {
    let message = format!("the folder {} can't be used: {error}", folder().display());
    Problem::new(StatusCode::CONFLICT, message, "start the agent in a folder that it may write to")
}

pub(super) fn save(_: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let file = file(request)?;
    let layout: Map<String, Json> = request.body()?;
    let is_fit = layout.get("title").is_some_and(Json::is_string)
        && layout.get("columns").and_then(Json::as_array).is_some_and(|columns| !columns.is_empty());
    if !is_fit {
        let help = r#"such as {"title": "Mine", "columns": [{"share": 1, "tiles": [{"panel": "map", "share": 1}]}]}"#;
        return Err(Problem::unfit("a layout has a title and columns", help));
    }
    let text = format!("{:#}\n", Json::Object(layout));
    if text.len() as u64 > MAX_SIZE {
        return Err(Problem::unfit(
            format!("the layout is longer than {MAX_SIZE} bytes"),
            "show fewer panels",
        ));
    }
    fs::create_dir_all(folder()).and_then(|()| fs::write(&file, text)).map_err(|error| unwritable(&error))?;
    Ok(OperationAnswer::json(json!({ "file": file })))
}

pub(super) fn remove(
    _: &Arc<ControlSurface>,
    request: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    match fs::remove_file(file(request)?) {
        Ok(()) => Ok(OperationAnswer::Nothing),
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let message = format!("there is no layout `{}`", request.part("layout")?);
            Err(Problem::not_found(message, "GET /api/v1/layouts lists them"))
        }
        Err(error) => Err(unwritable(&error)),
    }
}
