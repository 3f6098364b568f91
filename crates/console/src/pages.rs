//! Files of the console's page.
//! A browser gets them without a token: they hold no secret, and send a token with each request for data.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::json;

use slate_control::Page;
use slate_control::operations::{PROJECT_FOLDER, is_plain};

/// Files that are built in, by their paths.
pub(crate) const BUILT_IN: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/pages.rs"));

/// Path prefix of a project's own files.
const PROJECT_PREFIX: &str = "/project/";

/// Maximum size of a file of a project or of `console.assets`, bytes.
const MAX_FILE_SIZE: u64 = 8 << 20;

/// Sources of the page's files.
pub(crate) struct Pages {
    /// Pages that the program adds.
    given: Vec<Page>,
    /// Folder that replaces the built-in files.
    assets: Option<PathBuf>,
    project: PathBuf,
    /// Built-in files with gzip, each compressed at its first request.
    small: Vec<OnceLock<Vec<u8>>>,
}

impl Pages {
    pub fn new(given: Vec<Page>, assets: Option<PathBuf>) -> Self {
        let small = BUILT_IN.iter().map(|_| OnceLock::new()).collect();
        Self { given, assets, project: PROJECT_FOLDER.into(), small }
    }

    /// Returns the page at a path.
    pub fn find(&self, path: &str) -> Option<Page> {
        if let Some(page) = self.given.iter().find(|page| page.path == path) {
            return Some(page.clone());
        }
        if path == "/panels.json" {
            let content = json!(self.panels()).to_string().into_bytes();
            return Some(Page { path: path.into(), kind: "application/json".into(), content });
        }
        let path = if path == "/" { "/index.html" } else { path };
        let kind = kind(path)?;
        let content = if let Some(own) = path.strip_prefix(PROJECT_PREFIX) {
            read(&self.project, own)?
        } else if let Some(assets) = &self.assets {
            read(assets, path.strip_prefix('/')?)?
        } else {
            BUILT_IN.iter().find(|(known, _)| *known == path)?.1.to_vec()
        };
        Some(Page { path: path.into(), kind: kind.into(), content })
    }

    /// Returns a built-in page with gzip, if that makes it smaller.
    pub fn smaller(&self, page: &Page) -> Option<Vec<u8>> {
        let place =
            BUILT_IN.iter().position(|(path, content)| *path == page.path && *content == page.content)?;
        let small = self.small[place].get_or_init(|| {
            let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
            let written = encoder.write_all(&page.content).and_then(|()| encoder.finish());
            written.unwrap_or_default()
        });
        (!small.is_empty() && small.len() < page.content.len()).then(|| small.clone())
    }

    /// Returns the panels of the page, then those of the project.
    /// The latter replace panels of the same name.
    fn panels(&self) -> Vec<String> {
        let mut panels: Vec<String> = match &self.assets {
            Some(assets) => scripts(&assets.join("panels"), "/panels/"),
            None => {
                let built_in = BUILT_IN.iter().map(|(path, _)| *path);
                built_in.filter(|path| path.starts_with("/panels/")).map(ToOwned::to_owned).collect()
            }
        };
        panels.extend(scripts(&self.project.join("panels"), &format!("{PROJECT_PREFIX}panels/")));
        panels
    }
}

/// Returns the scripts in a folder, sorted by name; none if it can't be read.
fn scripts(folder: &Path, prefix: &str) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    let mut scripts: Vec<_> = names
        .filter(|name| is_plain(name) && name.ends_with(".js"))
        .map(|name| format!("{prefix}{name}"))
        .collect();
    scripts.sort();
    scripts
}

/// Reads a file in a folder and nowhere else.
fn read(folder: &Path, path: &str) -> Option<Vec<u8>> {
    if !path.split('/').all(is_plain) {
        return None;
    }
    let file = folder.join(path);
    let is_fit = fs::metadata(&file).is_ok_and(|about| about.is_file() && about.len() <= MAX_FILE_SIZE);
    if is_fit { fs::read(file).ok() } else { None }
}

fn kind(path: &str) -> Option<&'static str> {
    Some(match path.rsplit_once('.')?.1 {
        "html" => "text/html; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "svg" => "image/svg+xml",
        _ => return None,
    })
}
