//! Recordings as files.

mod attachments;
mod show;
mod target;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde_json::json;
use slate::record::bag::{self, Compared, Decoder, Error, Part, Reader, Selection, Unread, Value};
use slate::record::logs;
use slate::runtime::printable;

use crate::failure::Failure;
use crate::output;

#[derive(Debug, Subcommand)]
pub enum BagVerb {
    /// Shows what is in a recording; all of it is read and checked.
    Info {
        /// The file.
        file: PathBuf,
        /// Prints it as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Checks all checksums, indexes and statistics of a recording; exit code 1 says that it is damaged, 2 that it is none.
    Verify {
        /// The file.
        file: PathBuf,
    },
    /// Makes a whole file of a truncated or damaged recording.
    Repair {
        /// The file.
        file: PathBuf,
        /// Where the whole file goes; it takes the place of the damaged one unless given.
        #[arg(long)]
        out: Option<PathBuf>,
        /// Replaces what is there already.
        #[arg(long)]
        force: bool,
        /// Prints what was kept and lost as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Prints messages, a line each.
    Cat {
        /// The file.
        file: PathBuf,
        /// Topics, or patterns such as `/r2/*`; all unless given.
        topics: Vec<String>,
        #[command(flatten)]
        span: Span,
        /// Prints each line as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Makes a recording of another system's log.
    Import {
        /// The file.
        file: PathBuf,
        /// What it is; told from its content unless given.
        #[arg(long, value_parser = format_named)]
        format: Option<logs::Format>,
        /// Leaves out what is wrong in it, and counts that.
        #[arg(long)]
        lenient: bool,
        /// The new file.
        #[arg(long)]
        out: PathBuf,
        /// Replaces what is there already.
        #[arg(long)]
        force: bool,
        /// Prints what became of it as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Writes messages as tables, a CSV file for each topic, as a log of CARMEN, or as a recording with the messages of ROS 2.
    #[command(group = clap::ArgGroup::new("form").args(["csv", "carmen", "ros"]).required(true))]
    Export {
        /// The file.
        file: PathBuf,
        /// Topics, or patterns such as `/r2/*`; all unless given.
        topics: Vec<String>,
        /// As tables of comma-separated values.
        #[arg(long)]
        csv: bool,
        /// As a log of CARMEN: sweeps of lasers and odometry.
        #[arg(long)]
        carmen: bool,
        /// As MCAP with the messages that ROS 2 has, such as `sensor_msgs/msg/LaserScan`, where it has one.
        #[arg(long)]
        ros: bool,
        /// The topic that tells where a robot is in the map, in the place of the one that the recorded configuration names.
        #[arg(long, value_name = "TOPIC", requires = "ros")]
        pose: Option<String>,
        /// The log or recording, or for tables a file that ends with `.csv` for one topic, else a folder.
        #[arg(long)]
        out: PathBuf,
        /// Replaces what is there already.
        #[arg(long)]
        force: bool,
        #[command(flatten)]
        span: Span,
    },
    /// Copies a part of a recording.
    Filter {
        /// The file.
        file: PathBuf,
        /// Topics, or patterns such as `/r2/*`; all unless given.
        #[arg(long, num_args = 1..)]
        topics: Vec<String>,
        /// Topics that are left out, or patterns.
        #[arg(long, num_args = 1.., value_name = "TOPICS")]
        exclude: Vec<String>,
        #[command(flatten)]
        span: Span,
        /// The new file.
        #[arg(long)]
        out: PathBuf,
        /// Replaces what is there already.
        #[arg(long)]
        force: bool,
    },
    /// Puts several recordings into one, in the order of their times.
    Merge {
        /// The files.
        #[arg(required = true, num_args = 2..)]
        files: Vec<PathBuf>,
        /// What the topics of a file stand under in the new one; given once for each file, in their order, or never. Nothing for ''.
        #[arg(long, value_name = "NAME", value_parser = prefix)]
        prefix: Vec<String>,
        /// Has messages of different runs stand among each other, also where they have the same topic.
        #[arg(long)]
        interleave: bool,
        /// The new file.
        #[arg(long)]
        out: PathBuf,
        /// Replaces what is there already.
        #[arg(long)]
        force: bool,
    },
    /// Compares the messages of two recordings; exit code 1 says that they differ.
    Diff {
        /// The one.
        a: PathBuf,
        /// The other one.
        b: PathBuf,
        /// Compares what was measured on the wall clock too, which differs from run to run.
        #[arg(long)]
        all: bool,
        /// Only these topics, or patterns such as `/r2/**`.
        #[arg(long, num_args = 1.., value_name = "TOPICS")]
        select: Vec<String>,
        /// Topics that are left out, or patterns.
        #[arg(long, num_args = 1.., value_name = "TOPICS")]
        exclude: Vec<String>,
        /// Prints the result as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Lists the files that a recording has with it, such as the configuration of its run, or takes them out.
    Attachments {
        /// The file.
        file: PathBuf,
        /// The folder that they are written into.
        #[arg(long, value_name = "FOLDER")]
        out: Option<PathBuf>,
        /// Replaces what is there already.
        #[arg(long)]
        force: bool,
        /// Prints them as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Draws numbers over time.
    Plot {
        /// The file.
        file: PathBuf,
        /// Topic and field, such as `/r2/pose/theta` or `/r2/scan/ranges/3`.
        #[arg(required = true)]
        fields: Vec<String>,
        #[command(flatten)]
        span: Span,
        /// The image.
        #[arg(long, default_value = "plot.svg", value_parser = target::image)]
        out: PathBuf,
        /// Replaces what is there already.
        #[arg(long)]
        force: bool,
    },
}

#[derive(Args, Clone, Copy, Debug)]
pub struct Span {
    /// From when on, seconds after the first message.
    #[arg(long, value_name = "SECONDS", value_parser = nanoseconds, allow_negative_numbers = true)]
    from: Option<u64>,
    /// Until when, seconds after the first message.
    #[arg(long, value_name = "SECONDS", value_parser = nanoseconds, allow_negative_numbers = true)]
    to: Option<u64>,
}

fn format_named(name: &str) -> Result<logs::Format, String> {
    logs::Format::named(name).ok_or_else(|| {
        let names: Vec<_> = logs::Format::ALL.iter().map(|format| format.name()).collect();
        format!("known are {}", names.join(", "))
    })
}

/// What topics stand under: names with slashes between them.
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

pub fn nanoseconds(text: &str) -> Result<u64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.0..=1e9).contains(&seconds) => Ok((seconds * 1e9).round() as u64),
        _ => Err("expected seconds after the first message, at least 0".into()),
    }
}

impl Span {
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

/// Does what is asked; false when a file is damaged, two differ, or messages can't be read.
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
        BagVerb::Export { file, topics, out, span, force, carmen: true, .. } => {
            target::free(out, &[file], *force)?;
            let log = logs::export_carmen(file, &span.of(file, topics)?, out)?;
            show::carmen(out, &log);
            return Ok(all_read(file, &log.unread));
        }
        BagVerb::Export { file, topics, pose, out, span, force, ros: true, .. } => {
            target::free(out, &[file], *force)?;
            let robots = crate::report::known(file).unwrap_or_default().robots;
            let (robots, pose) = (&robots[..], pose.as_deref());
            let export = logs::RosExport { robots, pose, ..logs::RosExport::default() };
            let log = logs::export_ros(file, &span.of(file, topics)?, &export, out)?;
            show::ros(out, &log);
            return Ok(all_read(file, &log.unread));
        }
        BagVerb::Export { file, topics, out, span, force, .. } => {
            target::free(out, &[file], *force)?;
            let (tables, unread) = bag::export_csv(file, &span.of(file, topics)?, out)?;
            for table in tables {
                let (path, topic) = (printable(&table.path), table.topic);
                let messages = output::counted(table.rows, "message", "messages");
                output::line(format_args!("{path} has {messages} of {topic}"));
            }
            return Ok(all_read(file, &unread));
        }
        BagVerb::Filter { file, topics, exclude, span, out, force } => {
            target::free(out, &[file], *force)?;
            let messages = bag::copy(file, out, &span.of(file, topics)?.without(exclude))?;
            show::written(out, messages);
        }
        BagVerb::Merge { files, prefix, interleave, out, force } => {
            merge((files, prefix), *interleave, out, *force)?
        }
        BagVerb::Diff { a, b, all, select, exclude, json } => {
            let selection = Selection::new(select).without(exclude);
            let diff = bag::diff_of(a, b, &Compared { selection, is_measured: *all })?;
            match json {
                true => output::document("slate.bag.diff/1", &diff),
                false => show::diff(a, b, &diff),
            }
            let is_read = [a, b]
                .into_iter()
                .zip(&diff.unread)
                .fold(true, |is_read, (file, unread)| all_read(file, unread) && is_read);
            return Ok(diff.first.is_none() && is_read);
        }
        BagVerb::Attachments { file, out, force, json } => {
            attachments::attachments(file, out.as_deref(), *force, *json)?;
        }
        BagVerb::Plot { file, fields, span, out, force } => {
            target::free(out, &[file], *force)?;
            let (points, unread) = bag::plot(file, fields, &span.of(file, &[])?, out)?;
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

/// Says what of a file can't be read; true when there is nothing.
pub fn all_read(file: &Path, unread: &[Unread]) -> bool {
    for unread in unread {
        eprintln!("{}: {}", printable(file), output::harmless(unread));
    }
    unread.is_empty()
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
    show::written(out, bag::merge(&parts, out, interleave)?);
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
            let what = match logs::recognise(file)? {
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

/// The longest message that is shown, bytes: more than any picture has, and little enough for its text.
const LONGEST_SHOWN: usize = 32 << 20;

fn cat(file: &Path, selection: &Selection, json: bool) -> Result<bool, Failure> {
    let mut decoder = Decoder::up_to(LONGEST_SHOWN);
    selection.visit(&mut logs::open(file)?, |message| {
        let value = decoder.decode(message);
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
