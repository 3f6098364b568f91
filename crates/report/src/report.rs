use crate::{
    Error, Scene, Summary, Trajectory,
    plot::{self, Drawing},
};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// The report of one run.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// The figures.
    pub summary: &'a Summary,
    /// The world at the start.
    pub scene: &'a Scene,
    /// Trajectories of the robots.
    pub trajectory: &'a Trajectory,
}

impl Report<'_> {
    fn drawing(&self, title: String) -> Drawing<'_> {
        Drawing { title, caption: self.summary.caption(), scene: self.scene, trajectory: self.trajectory }
    }

    /// Draws the start: the world from above with its obstacles, goals and robots.
    /// The robots have their wheels, headings, and the area that their range sensors cover up to the first obstacle.
    ///
    /// # Errors
    /// If the picture cannot be drawn.
    pub fn scene_svg(&self) -> Result<String, Error> {
        let Summary { example, seed, .. } = self.summary;
        plot::scene(&self.drawing(format!("{example}, seed {seed}: the start")))
    }

    /// Draws the path of each robot.
    /// Scripted robots are black; the others are red where the deliberative route commands them and blue where the
    /// reactive route does, with a square where the route changes and a dot where another action begins, whose shape is
    /// that of its kind. Samples that are not finite or further than 1000 km from the origin are left out.
    ///
    /// # Errors
    /// If the plot cannot be drawn.
    pub fn trajectory_svg(&self) -> Result<String, Error> {
        plot::map(&self.drawing(self.summary.title()))
    }

    /// Draws the plot over time: x and y of all robots, and a strip of their routes.
    /// Each robot that is not scripted has a strip with its route, with a square where the route changes.
    ///
    /// # Errors
    /// If the plot cannot be drawn.
    pub fn timeline_svg(&self) -> Result<String, Error> {
        plot::timeline(&self.drawing(self.summary.title()))
    }

    /// Draws the run as an animation that repeats for ever, at most 20 s long.
    /// Longer runs play faster. Trails and robots have the color of the route that commands them.
    ///
    /// # Errors
    /// If the picture cannot be drawn.
    pub fn animation_svg(&self) -> Result<String, Error> {
        plot::animation(&self.drawing(self.summary.title()))
    }

    /// Writes all plots, the trajectory and the summary into a directory.
    /// The files are `scene.svg`, `scene.json`, `trajectory.csv`, `trajectory.svg`, `timeline.svg`, `animation.svg` and
    /// `summary.json`. The directory is created if it is missing; files of an earlier run are replaced once all the new
    /// ones are on the disk.
    ///
    /// # Errors
    /// If a plot cannot be drawn, or if the directory or a file cannot be written.
    pub fn write(&self, directory: &Path) -> Result<(), Error> {
        let summary = serde_json::to_string_pretty(self.summary)? + "\n";
        let files = [
            ("trajectory.csv", self.trajectory.csv()),
            ("scene.svg", self.scene_svg()?),
            ("scene.json", serde_json::to_string_pretty(self.scene)? + "\n"),
            ("trajectory.svg", self.trajectory_svg()?),
            ("timeline.svg", self.timeline_svg()?),
            ("animation.svg", self.animation_svg()?),
            ("summary.json", summary),
        ];
        fs::create_dir_all(directory)
            .map_err(|source| Error::Write { path: directory.to_owned(), source })?;
        let partial = |name: &str| directory.join(format!("{name}.partial"));
        let result = write_partial(&files, partial).and_then(|()| {
            files.iter().try_for_each(|(name, _)| {
                let path = directory.join(name);
                fs::rename(partial(name), &path).map_err(|source| Error::Write { path, source })
            })
        });
        if result.is_err() {
            // The first error is the one to tell; what cannot be removed now is replaced by the next report.
            files.iter().for_each(|(name, _)| drop(fs::remove_file(partial(name))));
        }
        result
    }
}

fn write_partial(files: &[(&str, String)], partial: impl Fn(&str) -> PathBuf) -> Result<(), Error> {
    files.iter().try_for_each(|(name, text)| {
        let path = partial(name);
        fs::write(&path, text).map_err(|source| Error::Write { path, source })
    })
}
