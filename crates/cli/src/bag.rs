//! Recordings as files.

mod attachments;
mod layout;
mod show;
mod target;
mod viewer;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde_json::json;
use slate::bag::{self, Decoder, Error, Reader, Selection, Value};
use slate::logs::{self, Compared, Part};
use slate::runtime::printable;

use crate::failure::Failure;
use crate::output;
use crate::recording::{all_read, known, parse_offset};

#[derive(Debug, Subcommand)]
pub enum BagVerb {
    /// Show the contents of a recording, and verify it
    Info {
        /// File
        file: PathBuf,
        /// Print as JSON
        #[arg(long)]
        json: bool,
    },
    /// Verify checksums, indexes and statistics
    /// (exit code 1 if damaged, 2 if not a recording)
    Verify {
        /// File
        file: PathBuf,
    },
    /// Repair a truncated or damaged recording
    Repair {
        /// File
        file: PathBuf,
        /// Repaired file [default: replace the damaged one]
        #[arg(long)]
        out: Option<PathBuf>,
        /// Replace existing files
        #[arg(long)]
        force: bool,
        /// Print what was recovered and lost as JSON
        #[arg(long)]
        json: bool,
    },
    /// Print messages, one per line
    Cat {
        /// File
        file: PathBuf,
        /// Topics or patterns, such as `/r2/*` [default: all]
        topics: Vec<String>,
        #[command(flatten)]
        span: TimeSpan,
        /// Print each line as JSON
        #[arg(long)]
        json: bool,
    },
    /// Import a log of another system
    Import {
        /// File
        file: PathBuf,
        /// Format [default: recognized by content]
        #[arg(long, value_parser = format_named)]
        format: Option<logs::Format>,
        /// Skip and count invalid parts
        #[arg(long)]
        lenient: bool,
        /// Output file
        #[arg(long)]
        out: PathBuf,
        /// Replace existing files
        #[arg(long)]
        force: bool,
        /// Print the result as JSON
        #[arg(long)]
        json: bool,
    },
    /// Export as CSV, CARMEN log, or MCAP with ROS 2 messages
    Export(ExportOptions),
    /// Open a recording in a viewer such as Rerun or Foxglove,
    /// with ROS 2 messages
    Open(viewer::OpenOptions),
    /// Copy a part of a recording
    Filter {
        /// File
        file: PathBuf,
        /// Topics or patterns, such as `/r2/*` [default: all]
        #[arg(long, num_args = 1..)]
        topics: Vec<String>,
        /// Exclude topics or patterns
        #[arg(long, num_args = 1.., value_name = "TOPICS")]
        exclude: Vec<String>,
        #[command(flatten)]
        span: TimeSpan,
        /// Output file
        #[arg(long)]
        out: PathBuf,
        /// Replace existing files
        #[arg(long)]
        force: bool,
    },
    /// Merge recordings in the order of their times
    Merge {
        /// Files
        #[arg(required = true, num_args = 2..)]
        files: Vec<PathBuf>,
        /// Prefix for the topics of a file, given once per file in order, '' for none
        #[arg(long, value_name = "NAME", value_parser = prefix)]
        prefix: Vec<String>,
        /// Interleave messages of different runs even on the same topic
        #[arg(long)]
        interleave: bool,
        /// Output file
        #[arg(long)]
        out: PathBuf,
        /// Replace existing files
        #[arg(long)]
        force: bool,
    },
    /// Compare two recordings (exit code 1 if they differ)
    Diff {
        /// First recording
        a: PathBuf,
        /// Second recording
        b: PathBuf,
        /// Also compare wall-clock measurements, which differ from run to run
        #[arg(long)]
        all: bool,
        /// Compare only these topics or patterns, such as `/r2/**`
        #[arg(long, num_args = 1.., value_name = "TOPICS")]
        select: Vec<String>,
        /// Exclude topics or patterns
        #[arg(long, num_args = 1.., value_name = "TOPICS")]
        exclude: Vec<String>,
        /// Print the result as JSON
        #[arg(long)]
        json: bool,
    },
    /// List or extract attachments, such as the configuration of the run
    Attachments {
        /// File
        file: PathBuf,
        /// Extract into this folder
        #[arg(long, value_name = "FOLDER")]
        out: Option<PathBuf>,
        /// Replace existing files
        #[arg(long)]
        force: bool,
        /// Print as JSON
        #[arg(long)]
        json: bool,
    },
    /// Plot fields over time
    Plot {
        /// File
        file: PathBuf,
        /// Topic and field, such as `/r2/pose/theta` or `/r2/scan/ranges/3`
        #[arg(required = true)]
        fields: Vec<String>,
        #[command(flatten)]
        span: TimeSpan,
        /// SVG file
        #[arg(long, default_value = "plot.svg", value_parser = target::image)]
        out: PathBuf,
        /// Replace existing files
        #[arg(long)]
        force: bool,
    },
}

#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("form").args(["csv", "carmen", "ros"]).required(true))]
pub struct ExportOptions {
    /// File
    file: PathBuf,
    /// Topics or patterns, such as `/r2/*` [default: all]
    topics: Vec<String>,
    /// Export a CSV table per topic
    #[arg(long)]
    csv: bool,
    /// Export laser scans and odometry as a CARMEN log
    #[arg(long)]
    carmen: bool,
    /// Export MCAP with ROS 2 messages
    /// such as `sensor_msgs/msg/LaserScan` where they exist
    #[arg(long)]
    ros: bool,
    /// Topic of the robot's pose in the map [default: as recorded in the configuration]
    #[arg(long, value_name = "TOPIC", requires = "ros")]
    pose: Option<String>,
    /// Output file; for CSV a folder,
    /// or a file that ends with `.csv` for a single topic
    #[arg(long)]
    out: PathBuf,
    /// Replace existing files
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    span: TimeSpan,
}

#[derive(Args, Clone, Copy, Debug)]
pub struct TimeSpan {
    /// Start, seconds after the first message
    #[arg(long, value_name = "SECONDS", value_parser = parse_offset, allow_negative_numbers = true)]
    from: Option<u64>,
    /// End, seconds after the first message
    #[arg(long, value_name = "SECONDS", value_parser = parse_offset, allow_negative_numbers = true)]
    to: Option<u64>,
}

fn format_named(name: &str) -> Result<logs::Format, String> {
    logs::Format::named(name).ok_or_else(|| {
        let names: Vec<_> = logs::Format::ALL.iter().map(|format| format.name()).collect();
        format!("known: {}", names.join(", "))
    })
}

/// Parses a prefix: names separated by slashes.
fn prefix(text: &str) -> Result<String, String> {
    let name = text.trim_matches('/');
    let is_name = |name: &str| {
        let allowed = |letter: char| letter.is_alphanumeric() || "-_.".contains(letter);
        !name.is_empty() && name.chars().all(allowed)
    };
    match name.is_empty() || name.split('/').all(is_name) {
        true => Ok(name.into()),
        false => Err("expected a name such as `first` or `team/r1`".into()),
    }
}

impl TimeSpan {
    fn of(self, file: &Path, topics: &[String]) -> Result<Selection, Error> {
        if let (Some(from), Some(to)) = (self.from, self.to)
            && from > to
        {
            let [from, to] = [from, to].map(bag::seconds);
            let what = format!("nothing is from {from} s to {to} s; `--to` must not be before `--from`");
            return Err(Error::Unfit { path: file.into(), what });
        }
        let mut selection = Selection::new(topics);
        (selection.from, selection.to) = (self.from, self.to);
        Ok(selection)
    }
}

/// Runs the command; false on damage, differences or unreadable messages.
/// Differences count where two recordings are compared.
pub fn bag(verb: &BagVerb) -> Result<bool, Failure> {
    match verb {
        BagVerb::Info { file, json } => {
            let info = bag::verify(&mut logs::open(file)?)?;
            match json {
                true => output::document("slate.bag.info/1", &info),
                false => show::info(file, &info),
            }
            return Ok(all_read(file, &info.unread));
        }
        BagVerb::Verify { file } => return verify(file),
        BagVerb::Repair { file, out, force, json } => {
            if let Some(out) = out {
                target::free(out, &[file], *force)?;
            }
            let repaired = bag::repair(file, out.as_deref())?;
            match json {
                true => output::document("slate.bag.repair/1", &repaired),
                false => show::repaired(out.as_ref().unwrap_or(file), &repaired),
            }
        }
        BagVerb::Cat { file, topics, span, json } => return cat(file, &span.of(file, topics)?, *json),
        BagVerb::Import { file, format, lenient, out, force, json } => {
            target::free(out, &[file], *force)?;
            let options = logs::Options { format: *format, is_lenient: *lenient };
            let imported = logs::import(file, out, &options)?;
            match json {
                true => output::document("slate.bag.import/1", &imported),
                false => show::imported(out, &imported),
            }
        }
        BagVerb::Export(options) => return export(options),
        BagVerb::Open(options) => return viewer::open(options),
        BagVerb::Filter { file, topics, exclude, span, out, force } => {
            target::free(out, &[file], *force)?;
            let messages = logs::copy(file, out, &span.of(file, topics)?.without(exclude))?;
            show::written(out, messages);
        }
        BagVerb::Merge { files, prefix, interleave, out, force } => {
            merge((files, prefix), *interleave, out, *force)?
        }
        BagVerb::Diff { a, b, all, select, exclude, json } => {
            let selection = Selection::new(select).without(exclude);
            return diff((a, b), &Compared { selection, is_measured: *all }, *json);
        }
        BagVerb::Attachments { file, out, force, json } => {
            attachments::attachments(file, out.as_deref(), *force, *json)?;
        }
        BagVerb::Plot { file, fields, span, out, force } => {
            target::free(out, &[file], *force)?;
            let (points, unread) = slate::report::plot_values(file, fields, &span.of(file, &[])?, out)?;
            let points = points.iter().sum::<usize>() as u64;
            output::line(format_args!(
                "{} shows {}",
                printable(out),
                output::counted(points, "value", "values")
            ));
            return Ok(all_read(file, &unread));
        }
    }
    Ok(true)
}

/// Exports messages; false when some can't be read.
fn export(options: &ExportOptions) -> Result<bool, Failure> {
    let ExportOptions { file, topics, carmen, ros, pose, out, span, force, csv: _ } = options;
    target::free(out, &[file], *force)?;
    let selection = span.of(file, topics)?;
    let unread = match (carmen, ros) {
        (true, _) => {
            let log = logs::export_carmen(file, &selection, out)?;
            show::carmen(out, &log);
            log.unread
        }
        (_, true) => {
            let robots = known(file).unwrap_or_default().robots;
            let (robots, pose) = (&robots[..], pose.as_deref());
            let export = logs::RosExport { robots, pose, ..logs::RosExport::default() };
            let log = logs::export_ros(file, &selection, &export, out)?;
            show::ros(out, &log);
            log.unread
        }
        _ => {
            let (tables, unread) = logs::export_csv(file, &selection, out)?;
            tables.iter().for_each(|table| show::table(&table.path, &table.topic, table.rows));
            unread
        }
    };
    Ok(all_read(file, &unread))
}

/// Compares two recordings; false when they differ or can't be read in full.
fn diff((a, b): (&Path, &Path), compared: &Compared, json: bool) -> Result<bool, Failure> {
    let diff = logs::diff_of(a, b, compared)?;
    match json {
        true => output::document("slate.bag.diff/1", &diff),
        false => show::diff(a, b, &diff),
    }
    let mut is_read = true;
    for (file, unread) in [a, b].into_iter().zip(&diff.unread) {
        is_read &= all_read(file, unread);
    }
    Ok(diff.first.is_none() && is_read)
}

fn merge(
    (files, prefixes): (&[PathBuf], &[String]),
    interleave: bool,
    out: &Path,
    force: bool,
) -> Result<(), Failure> {
    let paths: Vec<&Path> = files.iter().map(PathBuf::as_path).collect();
    target::free(out, &paths, force)?;
    if !prefixes.is_empty() && prefixes.len() != files.len() {
        let (files, prefixes) = (files.len(), output::counted(prefixes.len() as u64, "prefix", "prefixes"));
        let what = format!(
            "there are {files} files and {prefixes}: give `--prefix` once for each file, '' for none"
        );
        return Err(Error::Unfit { path: out.into(), what }.into());
    }
    let prefixes = prefixes.iter().map(String::as_str).chain(std::iter::repeat(""));
    let parts: Vec<_> = paths.into_iter().zip(prefixes).map(|(file, prefix)| Part { file, prefix }).collect();
    show::written(out, logs::merge(&parts, out, interleave)?);
    Ok(())
}

fn verify(file: &Path) -> Result<bool, Failure> {
    match Reader::open(file).and_then(|mut reader| bag::verify(&mut reader)) {
        Ok(info) => {
            show::verified(file, &info);
            Ok(true)
        }
        Err(error @ Error::Damaged { .. }) => {
            Failure::from(error).print();
            Ok(false)
        }
        Err(Error::NoBag { path, what }) => {
            let what = match logs::recognize(file)? {
                Some(format) if format != logs::Format::Mcap => {
                    format!("it is a log of format {format}, which has no checksums")
                }
                _ => what,
            };
            Err(Error::NoBag { path, what }.into())
        }
        Err(error) => Err(error.into()),
    }
}

/// Maximum size of a message that is shown, bytes.
/// It is more than any image has, and little enough for its text.
const MAX_MESSAGE_SIZE: usize = 32 << 20;

fn cat(file: &Path, selection: &Selection, json: bool) -> Result<bool, Failure> {
    let mut decoder = Decoder::up_to(MAX_MESSAGE_SIZE);
    selection.visit(&mut logs::open(file)?, |message| {
        let value = decoder.decode_named(message);
        let topic = &message.channel.topic;
        if json {
            let mut line = json!({
                "schema": "slate.bag.cat/1",
                "time": message.log_time,
                "publish_time": message.publish_time,
                "topic": topic,
                "sequence": message.sequence,
                "value": value,
            });
            if let Value::Unread { why, .. } = &value {
                line["unread"] = json!(why);
            }
            output::json(&line);
        } else {
            output::line(format_args!("{} {topic} {value}", bag::seconds(message.log_time)));
        }
        Ok(!output::is_unread())
    })?;
    Ok(all_read(file, &decoder.into_unread()))
}
