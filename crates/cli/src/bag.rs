//! Recordings as files.

mod show;
mod target;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde_json::json;
use slate::record::bag::{self, Decoder, Error, Reader, Selection};
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
    /// Checks all checksums, indexes and statistics of a recording; exit code 1 says that it is damaged.
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
    /// Writes messages as tables, a CSV file for each topic, or as a log of CARMEN.
    Export {
        /// The file.
        file: PathBuf,
        /// Topics, or patterns such as `/r2/*`; all unless given.
        topics: Vec<String>,
        /// As tables of comma-separated values.
        #[arg(long, required_unless_present = "carmen")]
        csv: bool,
        /// As a log of CARMEN: sweeps of lasers and odometry.
        #[arg(long, conflicts_with = "csv")]
        carmen: bool,
        /// The log, or for tables a file that ends with `.csv` for one topic, else a folder.
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
        /// Prints the result as JSON.
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

/// Does what is asked; false when a file is damaged, or two differ.
pub fn bag(verb: &BagVerb) -> Result<bool, Failure> {
    match verb {
        BagVerb::Info { file, json } => {
            let info = bag::verify(&mut logs::open(file)?)?;
            match json {
                true => output::document("slate.bag.info/1", &info),
                false => show::info(file, &info),
            }
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
        BagVerb::Cat { file, topics, span, json } => cat(file, &span.of(file, topics)?, *json)?,
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
            show::carmen(out, &logs::export_carmen(file, &span.of(file, topics)?, out)?);
        }
        BagVerb::Export { file, topics, out, span, force, .. } => {
            target::free(out, &[file], *force)?;
            for table in bag::export_csv(file, &span.of(file, topics)?, out)? {
                let (path, topic) = (printable(&table.path), table.topic);
                output::line(format_args!("{path} has {} messages of {topic}", table.rows));
            }
        }
        BagVerb::Filter { file, topics, span, out, force } => {
            target::free(out, &[file], *force)?;
            let messages = bag::copy(&[file], out, &span.of(file, topics)?)?;
            output::line(format_args!("{} has {messages} messages", printable(out)));
        }
        BagVerb::Merge { files, out, force } => {
            let files: Vec<&Path> = files.iter().map(PathBuf::as_path).collect();
            target::free(out, &files, *force)?;
            let messages = bag::copy(&files, out, &Selection::default())?;
            output::line(format_args!("{} has {messages} messages", printable(out)));
        }
        BagVerb::Diff { a, b, json } => {
            let diff = bag::diff(a, b)?;
            match json {
                true => output::document("slate.bag.diff/1", &diff),
                false => show::diff(a, b, &diff),
            }
            return Ok(diff.first.is_none());
        }
        BagVerb::Plot { file, fields, span, out, force } => {
            target::free(out, &[file], *force)?;
            let points = bag::plot(file, fields, &span.of(file, &[])?, out)?;
            let points: usize = points.iter().sum();
            output::line(format_args!("{} shows {points} values", printable(out)));
        }
    }
    Ok(true)
}

fn verify(file: &Path) -> Result<bool, Failure> {
    match Reader::open(file).and_then(|mut reader| bag::verify(&mut reader)) {
        Ok(info) => {
            show::verified(file, &info);
            Ok(true)
        }
        Err(error @ (Error::Damaged { .. } | Error::NoBag { .. })) => {
            Failure::from(error).print();
            Ok(false)
        }
        Err(error) => Err(error.into()),
    }
}

fn cat(file: &Path, selection: &Selection, json: bool) -> Result<(), Failure> {
    let mut decoder = Decoder::default();
    selection.visit(&mut logs::open(file)?, |message| {
        let value = decoder.decode(message);
        let topic = &message.channel.topic;
        match json {
            true => output::json(&json!({
                "schema": "slate.bag.cat/1",
                "time": message.log_time,
                "publish_time": message.publish_time,
                "topic": topic,
                "sequence": message.sequence,
                "value": value,
            })),
            false => output::line(format_args!("{} {topic} {value}", bag::seconds(message.log_time))),
        }
        Ok(!output::is_unread())
    })?;
    Ok(())
}
