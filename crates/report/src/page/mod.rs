//! Report of a run as one self-contained page for browsers and printers.
//! Its pictures (SVG) and tables (CSV) are beside it.
//!
//! A page is made of the folder that a run leaves ([`Report`](crate::Report)), of a recording, or of a log of another
//! system ([`slate_logs`]). The page of a folder with a recording in it has both.

mod beside;
mod decisions;
mod faults;
mod folder;
mod html;
mod recording;
mod robots;
mod table;
mod tracks;

use std::path::{Path, PathBuf};

use crate::{RocsLog, Scene, Trajectory};
use slate_bag::{Error, Unread, whole};

pub use slate_ros_messages::Followed;

use html::Html;
use table::Table;

/// Context of a recording, such as from the configuration attached to it.
#[derive(Clone, Debug, Default)]
pub struct Known {
    /// The world at the start.
    pub scene: Scene,
    /// Robots that the report follows; by default found by the types of their values.
    pub robots: Vec<Followed>,
}

/// A page that was written.
#[derive(Clone, Debug)]
pub struct Page {
    /// The files, the page first.
    pub files: Vec<PathBuf>,
    /// Messages of the recording that can't be read; the report leaves them out.
    pub unread: Vec<Unread>,
}

/// Maximum number of rows of a table on a page; its file has all.
const MAX_TABLE_ROWS: usize = 300;

/// Content of a page.
#[derive(Debug, Default)]
struct PageContent {
    title: String,
    /// Source of the content.
    source: String,
    sections: Vec<Section>,
    unread: Vec<Unread>,
    /// The world at the start, as far as known.
    scene: Scene,
    trajectory: Trajectory,
}

#[derive(Debug, Default)]
struct Section {
    heading: &'static str,
    parts: Vec<SectionPart>,
}

#[derive(Debug)]
enum SectionPart {
    Text(String),
    Table(Table),
    /// Picture that was just drawn: the name of its file, its caption, and its text.
    Drawn(&'static str, String, String),
    /// Picture that is already in a file of that name: its caption and its content.
    Found(&'static str, String, Vec<u8>),
}

impl Section {
    fn new(heading: &'static str) -> Self {
        Self { heading, parts: Vec::new() }
    }

    /// Adds a table, or the text `empty` if it has no rows.
    fn table(&mut self, table: Table, empty: &str) {
        self.parts.push(match table.is_empty() {
            true => SectionPart::Text(empty.into()),
            false => SectionPart::Table(table),
        });
    }

    fn has_table(&self) -> bool {
        self.parts.iter().any(|part| matches!(part, SectionPart::Table(_)))
    }

    fn text(&mut self, text: impl Into<String>) {
        self.parts.push(SectionPart::Text(text.into()));
    }
}

/// Returns true if a path is the folder of a run.
fn is_folder(path: &Path) -> bool {
    path.is_dir() && !path.join("metadata.yaml").is_file()
}

/// Returns the recording that a page about that path describes.
/// It is the path itself, or in a folder the recording of the run, `run.mcap`, or the only one. Among several others,
/// as triggers save them, it is `None` if the run has left its figures.
///
/// # Errors
/// When a folder has nothing but several recordings and none is that of the run, or can't be read.
pub fn recording_of(path: &Path) -> Result<Option<PathBuf>, Error> {
    if !is_folder(path) {
        return Ok(Some(path.into()));
    }
    let found = recordings(path)?;
    if let Some(own) = found.iter().find(|file| file.ends_with(OWN_RECORDING)) {
        return Ok(Some(own.clone()));
    }
    match &found[..] {
        [] => Ok(None),
        [one] => Ok(Some(one.clone())),
        _ if path.join("summary.json").exists() => Ok(None),
        [one, other, ..] => {
            let name = |file: &Path| file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let what =
                format!("it has several recordings, such as `{}` and `{}`; name one", name(one), name(other));
            Err(Error::Unfit { path: path.into(), what })
        }
    }
}

/// Default file of a run's own recording.
const OWN_RECORDING: &str = "run.mcap";

/// Returns the recordings in a folder, by name.
fn recordings(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let failed = |source| Error::Read { path: folder.into(), source };
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let file = entry.map_err(failed)?.path();
        if file.extension().is_some_and(|extension| extension == "mcap") {
            found.push(file);
        }
    }
    found.sort();
    Ok(found)
}

/// Returns the default folder of a page.
/// It is the folder of the run, or a folder beside the recording.
pub fn usual_folder(path: &Path) -> PathBuf {
    if is_folder(path) {
        return path.into();
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-report"))
}

/// Writes `report.html` about a run's folder, a recording or another log.
/// The folder `out` receives its pictures and tables as files as well.
///
/// # Errors
/// When something can't be read or is damaged, or `out` can't be written.
pub fn write(path: &Path, known: &Known, out: &Path) -> Result<Page, crate::Error> {
    write_beside(path, known, &[], out)
}

/// Writes the page of [`write`](fn@write) with published logs beside the run.
/// It has the pictures of the logs, and their use of the routes.
///
/// # Errors
/// As [`write`](fn@write).
pub fn write_beside(path: &Path, known: &Known, logs: &[RocsLog], out: &Path) -> Result<Page, crate::Error> {
    let recording = recording_of(path)?;
    let mut content = match (is_folder(path), recording) {
        // A run that was cut off has left no figures.
        (true, Some(file)) if !path.join("summary.json").exists() => {
            recording::Recording::read(&file, known)?.content(known)?
        }
        (true, recording) => folder::content(path, recording.as_deref(), known)?,
        (false, Some(file)) => recording::Recording::read(&file, known)?.content(known)?,
        (false, None) => PageContent::default(),
    };
    if !logs.is_empty() {
        let section = beside::section(&content.title, &content.scene, &content.trajectory, logs)?;
        // Behind the ways of the run.
        let index = content
            .sections
            .iter()
            .position(|section| section.heading == "Ways")
            .map_or(0, |path_pictures| path_pictures + 1);
        content.sections.insert(index, section);
    }
    let is_new = !out.exists();
    std::fs::create_dir_all(out).map_err(|source| Error::Write { path: out.into(), source })?;
    let files = put_all(&content, path, out).inspect_err(|_| {
        if is_new {
            // A folder with files in it stays.
            let _ = std::fs::remove_dir(out);
        }
    })?;
    Ok(Page { files, unread: content.unread })
}

fn put_all(content: &PageContent, path: &Path, out: &Path) -> Result<Vec<PathBuf>, Error> {
    let put = |name: String, text: &[u8]| {
        let path = out.join(name);
        whole::write(&path, |file| {
            std::io::Write::write_all(file, text)
                .map_err(|source| Error::Write { path: path.clone(), source })
        })?;
        Ok::<_, Error>(path)
    };
    let mut files = vec![put("report.html".into(), page(content).as_bytes())?];
    for part in content.sections.iter().flat_map(|section| &section.parts) {
        match part {
            SectionPart::Drawn(name, _, svg) => files.push(put(format!("{name}.svg"), svg.as_bytes())?),
            SectionPart::Table(table) => {
                files.push(put(format!("{}.csv", table.name), table.csv().as_bytes())?)
            }
            // Those of the folder are where they were.
            SectionPart::Found(name, _, picture) if path != out => {
                files.push(put((*name).into(), picture)?);
            }
            SectionPart::Text(_) | SectionPart::Found(..) => {}
        }
    }
    Ok(files)
}

fn page(content: &PageContent) -> String {
    let mut html = Html::new(&content.title);
    html.paragraph(&content.source, true);
    html.contents(content.sections.iter().map(|section| section.heading));
    for section in &content.sections {
        html.heading(section.heading);
        for part in &section.parts {
            match part {
                SectionPart::Text(text) => html.paragraph(text, false),
                SectionPart::Table(table) => html.table(table, MAX_TABLE_ROWS),
                SectionPart::Drawn(_, caption, svg) => html.drawn(svg, caption),
                SectionPart::Found(_, caption, svg) => html.found(svg, caption),
            }
        }
    }
    html.finish()
}
