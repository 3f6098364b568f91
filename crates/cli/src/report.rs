//! Pages about runs.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;
use slate::record::page::{self, Followed, Known, Page};
use slate::record::replay::Run;
use slate::runtime::printable;

use crate::bag::all_read;
use crate::failure::Failure;
use crate::{output, scene};

#[derive(Debug, Args)]
pub struct ReportOptions {
    /// A recording or another log, or the folder that a run has left.
    pub path: PathBuf,

    /// Where the page goes, with its pictures and tables; into the folder of the run unless given, or one beside the file.
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,

    /// Prints the names of all files as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Writes a page; false when something of the recording can't be read.
pub fn report(options: &ReportOptions) -> Result<bool, Failure> {
    let recording = page::recording_of(&options.path)?;
    let known = recording.as_deref().and_then(known).unwrap_or_default();
    let out = options.out.clone().unwrap_or_else(|| page::usual_folder(&options.path));
    let Page { files, unread } = page::write(&options.path, &known, &out)?;
    if options.json {
        output::document("slate.report/1", &json!({ "files": files }));
    } else if let [page, others @ ..] = &files[..] {
        output::line(format_args!(
            "{}, with {} pictures and tables beside it",
            printable(page),
            others.len()
        ));
    }
    Ok(all_read(recording.as_deref().unwrap_or(&options.path), &unread))
}

/// What the configuration that a recording has with it says of its world and robots; nothing if it has none that can still
/// be read, as the rest of it can be told without.
pub fn known(recording: &Path) -> Option<Known> {
    let database = Run::read(recording).ok()?.configuration(Vec::new()).ok()?;
    let configuration = database.current();
    let scene = scene::of(&configuration).unwrap_or_default();
    Some(Known { scene, robots: Followed::of(&configuration) })
}
