//! Pages for `man`.

use std::path::Path;

use clap::CommandFactory;

use crate::arguments::Arguments;
use crate::failure::Failure;
use crate::output;

/// Writes a page for each verb into a folder.
pub fn man(folder: &Path) -> Result<bool, Failure> {
    let failed = |source| Failure::File { path: folder.into(), source };
    std::fs::create_dir_all(folder).map_err(failed)?;
    clap_mangen::generate_to(Arguments::command(), folder).map_err(failed)?;
    let shown = slate::runtime::printable(folder);
    output::line(format_args!("{shown} has the pages of all verbs: man {shown}/slate.1"));
    Ok(true)
}
