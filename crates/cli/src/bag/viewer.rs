//! Viewers of other projects.

use std::fs::DirBuilder;
use std::io::ErrorKind;
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::{Args, ValueEnum};
use slate::bag::{self, Reader};
use slate::logs::{self, RosExport};
use slate::runtime::printable;

use super::{TimeSpan, layout, show, target};
use crate::failure::Failure;
use crate::interrupt;
use crate::output;
use crate::recording::{all_read, known};

#[derive(Debug, Args)]
pub struct OpenOptions {
    /// File
    file: PathBuf,
    /// Topics or patterns, such as `/r2/*` [default: all]
    topics: Vec<String>,
    /// Viewer [default: the first of these that is installed]
    #[arg(long, value_enum, value_name = "VIEWER")]
    with: Option<Viewer>,
    /// Keep the files for the viewer in this folder
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Replace existing files
    #[arg(long, requires = "out")]
    force: bool,
    #[command(flatten)]
    span: TimeSpan,
}

/// Program that shows recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Viewer {
    /// Rerun
    Rerun,
    /// Foxglove's desktop program
    Foxglove,
    /// Lichtblick
    Lichtblick,
    /// PlotJuggler
    Plotjuggler,
}

impl Viewer {
    /// Returns the name of the program.
    fn program(self) -> &'static str {
        match self {
            Self::Rerun => "rerun",
            Self::Foxglove => "foxglove-studio",
            Self::Lichtblick => "lichtblick",
            Self::Plotjuggler => "plotjuggler",
        }
    }

    /// Returns the options before the file.
    fn options(self) -> &'static [&'static str] {
        if self == Self::Plotjuggler { &["--datafile"] } else { &[] }
    }

    /// Returns true if it reads layouts of Foxglove.
    fn reads_layouts(self) -> bool {
        matches!(self, Self::Foxglove | Self::Lichtblick)
    }

    /// Returns the file of the program in `PATH`.
    fn installed(self) -> Option<PathBuf> {
        let folders = std::env::var_os("PATH")?;
        std::env::split_paths(&folders).map(|folder| folder.join(self.program())).find(|file| file.is_file())
    }

    /// Returns the viewer to use and its program.
    fn find(chosen: Option<Self>) -> Result<(Self, PathBuf), Failure> {
        let candidates: &[Self] = chosen.as_ref().map_or(Self::value_variants(), std::slice::from_ref);
        let found = candidates.iter().find_map(|viewer| Some((*viewer, viewer.installed()?)));
        found.ok_or_else(|| {
            let programs = candidates.iter().map(|viewer| viewer.program()).collect();
            Failure::NoViewer { programs }
        })
    }
}

/// Opens a recording in a viewer and waits for its end.
/// False when some messages can't be read, or the viewer fails.
pub fn open(options: &OpenOptions) -> Result<bool, Failure> {
    let (viewer, program) = Viewer::find(options.with)?;
    match &options.out {
        Some(folder) => open_in(options, viewer, &program, folder),
        None => {
            let folder = temporary_folder()?;
            let opened = open_in(options, viewer, &program, &folder);
            // Those with layouts may pass the files on to a window that is open, and end at once.
            if !viewer.reads_layouts() {
                // What is left of it is in the system's folder for such files.
                let _ = std::fs::remove_dir_all(folder);
            }
            opened
        }
    }
}

/// Makes a folder of the user's own.
fn temporary_folder() -> Result<PathBuf, Failure> {
    let mut number = 0;
    loop {
        let folder = std::env::temp_dir().join(format!("slate-open-{}-{number}", std::process::id()));
        match DirBuilder::new().mode(0o700).create(&folder) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => number += 1,
            Err(error) => return Err(failed(&folder)(error)),
            Ok(()) => return Ok(folder),
        }
    }
}

fn open_in(options: &OpenOptions, viewer: Viewer, program: &Path, folder: &Path) -> Result<bool, Failure> {
    let OpenOptions { file, topics, force, span, .. } = options;
    std::fs::create_dir_all(folder).map_err(failed(folder))?;
    let recording = folder.join(file.file_stem().unwrap_or("recording".as_ref())).with_extension("mcap");
    target::free(&recording, &[file], *force)?;
    let robots = known(file).unwrap_or_default().robots;
    let export = RosExport { robots: &robots, ..RosExport::default() };
    let log = logs::export_ros(file, &span.of(file, topics)?, &export, &recording)?;
    show::ros(&recording, &log);
    if viewer.reads_layouts() {
        let layout = folder.join("layout.json");
        target::free(&layout, &[file], *force)?;
        let info = bag::verify(&mut Reader::open(&recording)?)?;
        std::fs::write(&layout, layout::of(&info.channels)).map_err(failed(&layout))?;
        output::line(format_args!("{} is its layout: import it in the viewer", printable(&layout)));
    }
    // Ctrl-C ends the viewer, and this command with it.
    interrupt::catch();
    let mut command = Command::new(program);
    let status = command.args(viewer.options()).arg(&recording).status().map_err(failed(program))?;
    if !status.success() {
        eprintln!("{} ended with {status}", printable(program));
    }
    Ok(all_read(file, &log.unread) && status.success())
}

fn failed(path: &Path) -> impl FnOnce(std::io::Error) -> Failure {
    let path = path.to_owned();
    |source| Failure::File { path, source }
}
