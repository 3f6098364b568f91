use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use slate_runtime::replacement::Replacement;

use super::{HEADER, Sample, TrajectoryPosition, append_row};

/// Write period of new samples.
const WRITE_PERIOD: Duration = Duration::from_secs(1);

/// Writer of a trajectory to a file while it grows.
/// A process that is killed loses its last second at most.
///
/// A thread of its own writes, so that a slow disk holds no run up. When samples were removed, the file is replaced by one without
/// them. Samples that can't be written are left to the report at the end of the run, which gives the reason.
#[derive(Debug)]
pub struct TrajectoryStream {
    /// Dropped at the end.
    running: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl TrajectoryStream {
    /// Begins to write the samples of `read` to `path`.
    /// `read` returns the samples after a position, as [`ThinnedTrajectory::read`](super::ThinnedTrajectory::read)
    /// does.
    ///
    /// # Errors
    /// When there is no thread for it.
    pub fn start(
        path: &Path,
        read: impl Fn(&mut TrajectoryPosition) -> Vec<Sample> + Send + 'static,
    ) -> io::Result<Self> {
        let mut file =
            StreamedFile { path: path.into(), file: None, position: TrajectoryPosition::default() };
        let (running, ended) = channel::<()>();
        let thread = Builder::new().name("trajectory".into()).spawn(move || {
            slate_runtime::set_batch_scheduling();
            loop {
                let is_over = ended.recv_timeout(WRITE_PERIOD) != Err(RecvTimeoutError::Timeout);
                if file.follow(&read).is_err() || is_over {
                    return;
                }
            }
        })?;
        Ok(Self { running: Some(running), thread: Some(thread) })
    }
}

impl Drop for TrajectoryStream {
    /// Writes the remaining samples.
    fn drop(&mut self) {
        drop(self.running.take());
        if let Some(thread) = self.thread.take() {
            // A panic in it has said so.
            let _ = thread.join();
        }
    }
}

/// The file, and how much of the trajectory it has.
struct StreamedFile {
    path: PathBuf,
    file: Option<File>,
    position: TrajectoryPosition,
}

impl StreamedFile {
    /// Writes the new samples.
    fn follow(&mut self, read: &impl Fn(&mut TrajectoryPosition) -> Vec<Sample>) -> io::Result<()> {
        loop {
            let before = self.position;
            let samples = read(&mut self.position);
            match &mut self.file {
                Some(_) if self.position.follows(before) && samples.is_empty() => return Ok(()),
                Some(file) if self.position.follows(before) => file.write_all(rows(&samples).as_bytes())?,
                _ => self.replace(samples, read)?,
            }
        }
    }

    /// Replaces the file by a whole new one, and continues behind it.
    fn replace(
        &mut self,
        mut samples: Vec<Sample>,
        read: &impl Fn(&mut TrajectoryPosition) -> Vec<Sample>,
    ) -> io::Result<()> {
        let mut new = Replacement::create(&self.path)?;
        new.write_all(HEADER.as_bytes())?;
        while !samples.is_empty() {
            new.write_all(rows(&samples).as_bytes())?;
            let before = self.position;
            samples = read(&mut self.position);
            if !self.position.follows(before) {
                // Samples were removed meanwhile: the next turn begins anew.
                (self.file, self.position) = (None, TrajectoryPosition::default());
                return Ok(());
            }
        }
        new.keep()?;
        self.file = Some(OpenOptions::new().append(true).open(&self.path)?);
        Ok(())
    }
}

/// Rows of `trajectory.csv`.
fn rows(samples: &[Sample]) -> String {
    let mut text = String::new();
    samples.iter().for_each(|sample| append_row(sample, &mut text));
    text
}
