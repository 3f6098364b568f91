//! The page of a run's folder.

use std::path::{Path, PathBuf};

use super::decisions::Decisions;
use super::recording::{Recording, between, distances};
use super::table::Table;
use super::{Known, PageContent, Section, SectionPart};
use crate::{Route, Sample, Scene, Summary, Trajectory};
use slate_bag::Error;

/// Maximum size of a picture or log, bytes.
const MAX_FILE_SIZE: u64 = 64 << 20;

pub(super) fn content(
    path: &Path,
    recording: Option<&Path>,
    known: &Known,
) -> Result<PageContent, crate::Error> {
    let file = path.join("summary.json");
    let text =
        text(&file)?.ok_or_else(|| Error::Unfit { path: path.into(), what: missing_figures_help(path) })?;
    let summary: Summary = serde_json::from_str(&text).map_err(|error| Error::Unfit {
        path: file,
        what: format!("it is not a summary of a run: {error}"),
    })?;
    let trajectory = trajectory(&path.join("trajectory.csv"))?;
    let mut sections = vec![figures(&summary), pictures(path)?];
    let recorded = recording.map(|file| Recording::read(file, known)).transpose()?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut source = format!("From the folder {name}.");
    let mut unread = Vec::new();
    let others = super::recordings(path)?.into_iter().filter(|other| Some(other.as_path()) != recording);
    let others: Vec<_> =
        others.map(|other| other.file_name().unwrap_or_default().to_string_lossy().into_owned()).collect();
    match recorded {
        Some(mut recorded) => {
            let file = recording.and_then(Path::file_name).unwrap_or_default().to_string_lossy();
            source = format!("From the folder {name} and its recording {file}.");
            sections.push(recorded.distances(&trajectory)?);
            sections.extend(recorded.sections());
            unread = recorded.unread();
        }
        None => {
            let mut apart = Section::new("Distances");
            distances(&mut apart, between(&trajectory))?;
            sections.push(apart);
            sections.push(decisions(&trajectory));
            sections.push(log(&path.join("log.txt"))?);
            let mut more = Section::new("Missing data");
            more.text(
                "The folder has no recording of the run, so timing, faults, changes and dropped values are missing. \
                 A run leaves one with --set record.enabled=true.",
            );
            sections.push(more);
        }
    }
    if !others.is_empty() {
        let which = if recording.is_some() { "others" } else { "recordings" };
        source += &format!(" It has {which}, which are reported when they are named: {}.", others.join(", "));
    }
    let scene = scene(&path.join("scene.json"), known)?;
    Ok(PageContent { title: summary.headline(), source, sections, unread, scene, trajectory })
}

/// Returns the help for a folder without figures.
fn missing_figures_help(path: &Path) -> String {
    let entries = std::fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path());
    let is_left = |folder: &PathBuf| folder.join("summary.json").is_file();
    let mut agents: Vec<_> = entries.filter(is_left).collect();
    agents.sort();
    let Some(first) = agents.first() else {
        return "it has no `summary.json`, so no run has left it; name the folder of a run, or a recording"
            .into();
    };
    let name = |folder: &PathBuf| folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let names: Vec<_> = agents.iter().map(name).collect();
    let (names, first) = (names.join(", "), slate_runtime::printable(first));
    format!(
        "it has the runs of several agents, each in a folder of its own: {names}; name one, such as {first}"
    )
}

/// Returns a file's text; `None` if there is no such file.
fn text(path: &Path) -> Result<Option<String>, Error> {
    let failed = |source| Error::Read { path: path.into(), source };
    match std::fs::metadata(path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(failed(error)),
        Ok(metadata) if metadata.len() > MAX_FILE_SIZE => {
            let what = format!("it has more than {MAX_FILE_SIZE} bytes, which no run leaves");
            return Err(Error::Unfit { path: path.into(), what });
        }
        Ok(_) => {}
    }
    std::fs::read_to_string(path).map(Some).map_err(failed)
}

fn figures(summary: &Summary) -> Section {
    let mut section = Section::new("Summary");
    let mut table = Table::new("summary", &["what", "value"]);
    for (name, value) in summary.rows() {
        table.row([name, value]);
    }
    section.table(table, "The summary is empty.");
    section
}

fn pictures(path: &Path) -> Result<Section, Error> {
    let mut section = Section::new("Ways");
    let pictures = [
        ("trajectory.svg", "The ways of the robots, by route."),
        ("timeline.svg", "x and y over time, and the route."),
        ("scene.svg", "The start, seen from above."),
    ];
    for (name, caption) in pictures {
        if let Some(svg) = text(&path.join(name))? {
            section.parts.push(SectionPart::Found(name, caption.into(), svg.into_bytes()));
        }
    }
    if section.parts.is_empty() {
        section.text("The folder has no pictures.");
    }
    Ok(section)
}

/// Decisions of robots, from their trajectories.
fn decisions(trajectory: &Trajectory) -> Section {
    let mut section = Section::new("Decisions");
    section.text("Changes of route and action at the samples of the path; a recording has more.");
    let mut decisions = Decisions::default();
    for robot in trajectory.robots() {
        let mut last: Option<&Sample> = None;
        for sample in trajectory.of(robot) {
            let name = |route: Option<Route>| route.map_or("idle", Route::name);
            if let Some(last) = last.filter(|last| last.route != sample.route) {
                let detail = format!("{} to {}", name(last.route), name(sample.route));
                decisions.row(sample.time, robot, "route", detail);
            }
            if last.is_none_or(|last| last.action != sample.action) && !sample.action.is_empty() {
                decisions.row(sample.time, robot, "action began", sample.action.clone());
            }
            last = Some(sample);
        }
    }
    decisions.sort();
    section.table(decisions.table(), "No robot did anything.");
    section
}

/// Returns the scene that the run left, or else that of its recording.
fn scene(path: &Path, known: &Known) -> Result<Scene, Error> {
    let Some(text) = text(path)? else { return Ok(known.scene.clone()) };
    serde_json::from_str(&text).map_err(|error| Error::Unfit {
        path: path.into(),
        what: format!("it is not the scene of a run: {error}"),
    })
}

fn log(path: &Path) -> Result<Section, Error> {
    let mut section = Section::new("Faults and warnings");
    let Some(text) = text(path)? else {
        section.text("The folder has no log; the run printed it.");
        return Ok(section);
    };
    let mut table = Table::new("log", &["line"]);
    let is_told = |line: &&str| {
        let words = line.split_whitespace().take(3).map(str::to_lowercase);
        words.into_iter().any(|word| word == "warn" || word == "error")
    };
    for line in text.lines().filter(is_told) {
        table.row([line.to_owned()]);
    }
    section.table(table, "The log has no line of level warn or above.");
    Ok(section)
}

/// Reads the text of [`Trajectory::csv`].
fn trajectory(path: &Path) -> Result<Trajectory, Error> {
    let Some(text) = text(path)? else { return Ok(Trajectory::default()) };
    let mut samples = Vec::new();
    for (number, row) in rows(&text).into_iter().enumerate().skip(1) {
        let wrong =
            |what: &str| Error::Line { path: path.into(), line: number as u64 + 1, what: what.into() };
        let [time, robot, x, y, theta, route, action] = &row[..] else {
            return Err(wrong("it should have time, robot, x, y, theta, route and action"));
        };
        let numbers = [time, x, y, theta].map(|text| text.parse::<f64>());
        let [Ok(time), Ok(x), Ok(y), Ok(theta)] = numbers else {
            return Err(wrong("time, x, y and theta should be numbers"));
        };
        let route = [Route::Deliberative, Route::Reactive].into_iter().find(|known| known.name() == route);
        let (robot, action) = (robot.clone(), action.clone());
        samples.push(Sample { time: (time * 1e9).round() as u64, robot, x, y, theta, route, action });
    }
    Ok(Trajectory { samples })
}

/// Returns the rows of a table of comma-separated values.
/// Cells may be quoted.
fn rows(text: &str) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    let (mut row, mut cell, mut is_quoted) = (Vec::new(), String::new(), false);
    let mut letters = text.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '"' if is_quoted && letters.peek() == Some(&'"') => cell.extend(letters.next()),
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => row.push(std::mem::take(&mut cell)),
            '\n' if !is_quoted => {
                row.push(std::mem::take(&mut cell));
                rows.push(std::mem::take(&mut row));
            }
            letter => cell.push(letter),
        }
    }
    if !row.is_empty() || !cell.is_empty() {
        row.push(cell);
        rows.push(row);
    }
    rows
}
