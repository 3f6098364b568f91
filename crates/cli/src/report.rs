//! Pages about runs.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;
use slate::report::RocsLog;
use slate::report::page::{self, Page};
use slate::runtime::printable;

use crate::failure::Failure;
use crate::output;
use crate::recording::{all_read, known};

#[derive(Debug, Args)]
pub struct ReportOptions {
    /// Recording, log, or report folder of a run
    pub path: PathBuf,

    /// Folder of the report [default: that of the run, or one beside the file]
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,

    /// Draw this log beside the run: lines `X, Y, T, Action`,
    /// as RoCS's authors publish them; may be repeated
    #[arg(long, value_name = "LOG")]
    pub beside: Vec<PathBuf>,

    /// Print the names of all files as JSON
    #[arg(long)]
    pub json: bool,
}

/// Writes a page; false when something of the recording can't be read.
pub fn report(options: &ReportOptions) -> Result<bool, Failure> {
    let recording = page::recording_of(&options.path)?;
    let known = recording.as_deref().and_then(known).unwrap_or_default();
    let out = options.out.clone().unwrap_or_else(|| page::usual_folder(&options.path));
    let logs = options.beside.iter().map(|path| RocsLog::read(path)).collect::<Result<Vec<_>, _>>()?;
    let Page { files, unread } = page::write_beside(&options.path, &known, &logs, &out)?;
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
