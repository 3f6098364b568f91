//! Output about recordings.

use std::path::Path;

use slate::bag::{Info, Repaired, seconds};
use slate::logs::Diff;
use slate::logs::{CarmenLog, Imported, RosLog};
use slate::runtime::printable;
use slate_sorted::{SortedMap, SortedSet};

use crate::output::{self, counted};

/// Long texts of metadata, such as configurations, are not for a terminal.
const MAX_METADATA_WIDTH: usize = 100;

pub fn written(file: &Path, messages: u64) {
    output::line(format_args!("{} has {}", printable(file), counted(messages, "message", "messages")));
}

pub fn table(file: &Path, topic: &str, rows: u64) {
    output::line(format_args!("{} has {} of {topic}", printable(file), counted(rows, "message", "messages")));
}

pub fn verified(file: &Path, info: &Info) {
    let chunks: u64 = info.chunks.values().map(|chunks| chunks.chunks).sum();
    output::line(format_args!(
        "{} is whole: {} in {}",
        printable(file),
        counted(info.messages, "message", "messages"),
        counted(chunks, "chunk", "chunks")
    ));
    unchecked(info);
}

fn unchecked(info: &Info) {
    if !info.unchecked.is_empty() {
        output::line(format_args!("unchecked  {}: no checksum covers them", info.unchecked.join(", ")));
    }
}

pub fn info(file: &Path, info: &Info) {
    output::line(format_args!("file       {}, {} bytes", printable(file), info.bytes));
    output::line(format_args!("profile    {}", if info.profile.is_empty() { "none" } else { &info.profile }));
    output::line(format_args!("library    {}", info.library));
    output::line(format_args!(
        "messages   {} in {} s, from {} to {}",
        info.messages,
        seconds(info.to - info.from),
        seconds(info.from),
        seconds(info.to)
    ));
    for (compression, chunks) in &info.chunks {
        let how = if compression.is_empty() { "not compressed" } else { compression };
        output::line(format_args!(
            "chunks     {}, {how}, {} bytes for {}",
            chunks.chunks, chunks.compressed, chunks.uncompressed
        ));
    }
    let dropped = info.metadata.iter().filter(|(name, _)| name == "dropped").flat_map(|(_, texts)| texts);
    let dropped: Vec<_> = dropped.map(|(topic, count)| format!("{count} of {topic}")).collect();
    if !dropped.is_empty() {
        output::line(format_args!("dropped    {}", dropped.join(", ")));
    }
    unchecked(info);
    output::line("");
    let head = ["topic", "type", "encoding", "messages", "rate"].map(String::from);
    let rows = info.channels.iter().map(|channel| {
        let rate = channel.rate.map_or_else(String::new, |rate| format!("{rate:.2} Hz"));
        let (topic, schema) = (channel.topic.clone(), channel.schema.clone());
        [topic, schema, channel.encoding.clone(), channel.messages.to_string(), rate]
    });
    output::columns([head].into_iter().chain(rows));
    if !info.attachments.is_empty() {
        output::line("");
        let head = ["attachment", "type", "bytes"].map(String::from);
        let rows = info.attachments.iter().map(|attachment| {
            [attachment.name.clone(), attachment.media_type.clone(), attachment.bytes.to_string()]
        });
        output::columns([head].into_iter().chain(rows));
    }
    let inboxes =
        info.metadata.iter().filter(|(name, _)| name == "inboxes").flat_map(|(_, texts)| texts.keys());
    let inboxes: SortedSet<&str> = inboxes.map(String::as_str).collect();
    for (name, texts) in &info.metadata {
        if name == "inboxes" {
            continue;
        }
        output::line("");
        if name == "links" {
            links(texts, &inboxes);
            continue;
        }
        output::line(format_args!("metadata {name}"));
        let rows = texts.iter().map(|(key, text)| {
            let line = text.lines().next().unwrap_or_default();
            let short: String = line.chars().take(MAX_METADATA_WIDTH).collect();
            let rest = if short.len() < text.len() { " ..." } else { "" };
            [format!("  {key}"), format!("{short}{rest}")]
        });
        output::columns(rows);
    }
}

/// Prints links, each as destination and source.
/// An outbox is recorded with the inbox that it sends to.
fn links(texts: &SortedMap<String, String>, inboxes: &SortedSet<&str>) {
    output::line("metadata links");
    let row = |(port, other): (&String, &String)| match inboxes.contains(other.as_str()) {
        true => [format!("  {}", other.trim_start_matches('/')), format!("/{port}")],
        false => [format!("  {port}"), other.clone()],
    };
    let mut rows: Vec<_> = texts.iter().map(row).collect();
    rows.sort();
    output::columns(rows);
}

pub fn repaired(file: &Path, repaired: &Repaired) {
    output::line(format_args!(
        "{} is whole, with {}, {} kept as they were, {} and {}",
        printable(file),
        counted(repaired.messages, "message", "messages"),
        counted(repaired.chunks, "chunk", "chunks"),
        counted(repaired.attachments, "attachment", "attachments"),
        counted(repaired.metadata, "record of metadata", "records of metadata"),
    ));
    if repaired.unfinished > 0 {
        let messages = counted(repaired.unfinished, "message is", "messages are");
        output::line(format_args!("{messages} of a chunk that was not finished, without a checksum"));
    }
    if repaired.unchecked > 0 {
        let messages = counted(repaired.unchecked, "message", "messages");
        output::line(format_args!("{messages} have no checksum"));
    }
    for lost in &repaired.lost {
        output::line(format_args!("lost: {} bytes at byte {}: {}", lost.bytes, lost.offset, lost.what));
    }
    if repaired.lost.is_empty() {
        output::line("nothing was lost");
    }
}

pub fn imported(file: &Path, imported: &Imported) {
    let messages = counted(imported.messages, "message", "messages");
    output::line(format_args!("{} has {messages} of a log of format {}", printable(file), imported.format));
    if imported.wrong > 0 {
        output::line(format_args!(
            "left out because it is wrong: {}",
            counted(imported.wrong, "part", "parts")
        ));
    }
    for wrong in &imported.wrongs {
        output::line(format_args!("  {wrong}"));
    }
    if imported.wrong > imported.wrongs.len() as u64 {
        output::line("  and so on");
    }
    for (name, count) in &imported.unread {
        output::line(format_args!("not read: {count} of {name}"));
    }
}

pub fn carmen(file: &Path, log: &CarmenLog) {
    output::line(format_args!(
        "{} has {}, {} and {}",
        printable(file),
        counted(log.scans, "sweep", "sweeps"),
        counted(log.odometry, "line of odometry", "lines of odometry"),
        counted(log.others, "other line", "other lines"),
    ));
    if log.left_out > 0 {
        let messages = counted(log.left_out, "message", "messages");
        output::line(format_args!("left out: {messages} that CARMEN has no line for"));
    }
}

pub fn ros(file: &Path, log: &RosLog) {
    output::line(format_args!(
        "{} has {} as ROS has them, {} as they were, and {}",
        printable(file),
        counted(log.standard, "message", "messages"),
        log.others,
        counted(log.transforms, "transform", "transforms"),
    ));
    for (topic, messages) in &log.left_out {
        let messages = counted(*messages, "message", "messages");
        output::line(format_args!(
            "left out: {messages} of {topic}, which are not CDR with a definition of ROS 2"
        ));
    }
}

pub fn diff(a: &Path, b: &Path, diff: &Diff) {
    let same: u64 = diff.topics.values().map(|counts| counts.same).sum();
    let Some(first) = &diff.first else {
        output::line(format_args!("identical, {}", counted(same, "message", "messages")));
        measured(diff);
        return;
    };
    output::line(format_args!(
        "first difference: {} s, message {} of {}, field {}",
        seconds(first.time),
        first.number,
        first.topic,
        first.field
    ));
    for (file, value) in [(a, &first.a), (b, &first.b)] {
        output::line(format_args!("  {}: {}", printable(file), value.as_deref().unwrap_or("nothing")));
    }
    output::line("");
    let head = ["topic", "same", "different", "only in the first", "only in the second"].map(String::from);
    let rows = diff.topics.iter().map(|(topic, counts)| {
        let [same, different, only_a, only_b] =
            [counts.same, counts.different, counts.only_a, counts.only_b].map(|count| count.to_string());
        [topic.clone(), same, different, only_a, only_b]
    });
    output::columns([head].into_iter().chain(rows));
    measured(diff);
}

/// Prints which topics were not compared.
fn measured(diff: &Diff) {
    let topics = diff.measured.len() as u64;
    if topics > 0 {
        let topics = counted(topics, "topic", "topics");
        output::line(format_args!("not compared: {topics} of wall-clock measurements; --all compares them"));
    }
}
