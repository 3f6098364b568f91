//! Recordings of ROS 2: a folder with `metadata.yaml` and its MCAP files.
//! One or several MCAP files are one recording.

use std::path::{Component, Path, PathBuf};

use slate_bag::Error;

/// Name of the file that describes the folder.
pub const DESCRIPTION: &str = "metadata.yaml";

/// Returns the files of a folder, in their order.
pub fn files(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let path = folder.join(DESCRIPTION);
    let text = std::fs::read_to_string(&path).map_err(|source| Error::Read { path: path.clone(), source })?;
    let unfit = |what: String| Error::Unfit { path: path.clone(), what };
    let about = Description::parse(&text);
    match about.storage.as_deref() {
        Some("mcap") => {}
        Some(other) => {
            let name = folder.file_name().unwrap_or_default().to_string_lossy();
            return Err(unfit(format!(
                "its messages are kept as `{other}`, and those kept as `mcap` are read; `ros2 bag convert` makes one of the other \
                 (-i {name} -o convert.yaml, with storage_id: mcap)"
            )));
        }
        None => {
            return Err(unfit("it has no `storage_identifier`, so it describes no recording".into()));
        }
    }
    if let Some(how) = about.compressed {
        let what =
            format!("its files are packed as a whole ({how}); unpack them, and take compression out of it");
        return Err(unfit(what));
    }
    if about.files.is_empty() {
        return Err(unfit("it names no files in `relative_file_paths`".into()));
    }
    let inside = |name: String| {
        let file = PathBuf::from(&name);
        // Only files inside the folder are read.
        match file.components().all(|part| matches!(part, Component::Normal(_))) {
            true => Ok(folder.join(file)),
            false => Err(unfit(format!("the file `{name}` is not in the folder"))),
        }
    };
    about.files.into_iter().map(inside).collect()
}

/// The used part of a description.
/// One program writes it, always in the same manner.
#[derive(Default)]
struct Description {
    storage: Option<String>,
    compressed: Option<String>,
    files: Vec<String>,
}

impl Description {
    fn parse(text: &str) -> Self {
        let mut about = Self::default();
        let mut is_list = false;
        for line in text.lines().map(str::trim) {
            if let (true, Some(item)) = (is_list, line.strip_prefix("- ")) {
                about.files.push(unquoted(item).to_owned());
                continue;
            }
            is_list = false;
            let Some((key, value)) = line.split_once(':') else { continue };
            let value = unquoted(value);
            match key {
                "storage_identifier" => about.storage = Some(value.to_owned()),
                // Chunks that are made smaller one by one are read.
                "compression_mode" if value.eq_ignore_ascii_case("file") => {
                    about.compressed = Some(value.to_owned())
                }
                "compression_mode" if value.eq_ignore_ascii_case("message") => {
                    about.compressed = Some(value.to_owned())
                }
                "relative_file_paths" => {
                    is_list = true;
                    let items = value.strip_prefix('[').and_then(|items| items.strip_suffix(']'));
                    let items = items.into_iter().flat_map(|items| items.split(','));
                    about.files =
                        items.map(|item| unquoted(item).to_owned()).filter(|item| !item.is_empty()).collect();
                }
                _ => {}
            }
        }
        about
    }
}

fn unquoted(value: &str) -> &str {
    let value = value.trim();
    let inside = |quote| value.strip_prefix(quote).and_then(|value: &str| value.strip_suffix(quote));
    inside('"').or_else(|| inside('\'')).unwrap_or(value)
}
