//! Recordings of runs, as read by a foreign library, and the same runs made again from them.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use common::{Running, exp1, folder, library, slate, text};
use mcap::read::Options;
use mcap::records::{Metadata, Record};
use mcap::{Message, MessageStream, Summary};
use serde_json::Value;
use slate::bag::{Compression, Reader, Writer};
use slate::ros_messages::Schema;

pub(crate) const ON: [&str; 2] = ["--set", "record.enabled=true"];

/// Records a run of EXP1; its file and its summary.
fn recorded(folder: &Path, arguments: &[&str]) -> (PathBuf, Value) {
    let (summary, code) = exp1(folder, &[&ON, &["--out", "here"], arguments].concat());
    assert!(matches!(code, Some(0 | 1)), "{summary}");
    (folder.join("here/run.mcap"), summary)
}

fn messages(file: &[u8]) -> Vec<Message<'_>> {
    MessageStream::new(file).unwrap().map(|message| message.unwrap()).collect()
}

/// All metadata, by name.
fn metadata(file: &[u8]) -> BTreeMap<String, BTreeMap<String, String>> {
    let summary = Summary::read(file).unwrap().unwrap();
    let read = |index| mcap::read::metadata(file, index).unwrap();
    summary.metadata_indexes.iter().map(read).map(|Metadata { name, metadata }| (name, metadata)).collect()
}

/// Makes a recorded run again: what is said of it in JSON, and the exit code.
fn verified(folder: &Path, file: &str) -> (Value, Option<i32>) {
    let output = slate(folder, &["replay", "--verify", "--json", file]);
    (common::json(&output), output.status.code())
}

/// Makes a recorded run again: what is said of it, and the exit code.
pub(crate) fn verify(folder: &Path, file: &str) -> (String, Option<i32>) {
    let output = slate(folder, &["replay", "--verify", file]);
    (text(&output.stdout) + &text(&output.stderr), output.status.code())
}

#[test]
fn every_value_of_every_property_is_in_the_file() {
    let folder = folder("record-all");
    let (file, summary) = recorded(&folder, &["--seed", "1"]);
    let file = std::fs::read(file).unwrap();
    let mut counts: BTreeMap<String, u32> = BTreeMap::new();
    for message in messages(&file) {
        let topic = &message.channel.topic;
        if message.channel.metadata.contains_key("access") {
            let count = counts.entry(topic.clone()).or_default();
            *count += 1;
            assert_eq!(message.sequence, *count, "a value of {topic} is missing");
            assert_eq!(message.log_time, message.publish_time);
        }
    }
    let ticks = summary["ticks"].as_u64().unwrap() as u32;
    assert_eq!(counts["/simulator/r2/truth"], ticks);
    for topic in ["/r2/planner/params", "/r2/wheels/command", "/r2/execute/status", "/loop/state"] {
        assert!(counts.contains_key(topic), "{topic} is not there");
    }
    let metadata = metadata(&file);
    assert_eq!(metadata["end"]["digest"], summary["digest"].as_str().unwrap());
    assert_eq!(metadata["end"]["dropped"], "0");
    assert_eq!((&*metadata["run"]["seed"], &*metadata["run"]["clock"]), ("1", "lockstep"));
    assert_eq!(metadata["modules"]["r2/planner"], "go_to_origin_planner");
    assert!(metadata["links"].len() > 10 && metadata["plugins"].contains_key("simulation"), "{metadata:?}");
}

#[test]
fn bag_shows_links_in_one_direction_and_names_of_constants() {
    let folder = folder("record-shown");
    let (file, _) = recorded(&folder, &["--seed", "3"]);
    let bag = |verb: &str, more: &[&str]| {
        let output = slate(&folder, &[&["bag", verb, file.to_str().unwrap()], more].concat());
        assert!(output.status.success(), "{output:?}");
        text(&output.stdout)
    };
    let info = bag("info", &[]);
    let line =
        |start: &str| info.lines().find(|line| line.trim_start().starts_with(start)).map(str::to_owned);
    assert!(line("r2/execute/plan ").is_some_and(|line| line.ends_with(" /r2/planner/plan")), "{info}");
    assert_eq!(line("r2/planner/plan "), None, "{info}");
    let status = bag("cat", &["/r2/execute/status"]);
    assert!(status.contains("route = \"DELIBERATIVE\"") && !status.contains("route = 1"), "{status}");
}

#[test]
fn the_last_pose_is_that_of_the_report() {
    let folder = folder("record-pose");
    let (file, _) = recorded(&folder, &["--seed", "2"]);
    let file = std::fs::read(file).unwrap();
    let last = messages(&file).into_iter().rfind(|message| message.channel.topic == "/simulator/r2/truth");
    let last = last.unwrap();
    let schema = last.channel.schema.clone().unwrap();
    assert_eq!((&*last.channel.message_encoding, &*schema.encoding), ("cdr", "ros2msg"));
    let schema = Schema::parse(&schema.name, std::str::from_utf8(&schema.data).unwrap()).unwrap();
    let pose = schema.decode(&last.data).unwrap();
    let csv = std::fs::read_to_string(folder.join("here/trajectory.csv")).unwrap();
    let row = csv.lines().rfind(|line| line.contains(",r2,")).unwrap().to_owned();
    let cells: Vec<_> = row.split(',').collect();
    let written = [2, 3, 4].map(|i| cells[i].parse::<f64>().unwrap());
    assert_eq!(
        ["x", "y", "theta"].map(|field| pose.get(field).and_then(|value| value.as_f64()).unwrap()),
        written
    );
    assert_eq!(last.log_time, (cells[0].parse::<f64>().unwrap() * 1e9).round() as u64);
}

#[test]
fn recording_changes_nothing_and_the_run_can_be_repeated() {
    let folder = folder("record-again");
    let (_, summary) = recorded(&folder, &["--seed", "3"]);
    let (without, _) = exp1(&folder, &["--seed", "3", "--out", "there"]);
    assert_eq!(summary["digest"], without["digest"]);
    let (said, code) = verify(&folder, "here/run.mcap");
    let cycles = format!(" values in {} cycles", summary["ticks"]);
    assert!(said.starts_with("identical, ") && said.contains(&cycles), "{said}");
    assert_eq!(code, Some(0));
    let (told, code) = verified(&folder, "here/run.mcap");
    assert_eq!((&told["schema"], &told["outcome"]), (&"slate.verify/1".into(), &"identical".into()));
    assert_eq!((&told["cycles"], &told["whole"]), (&summary["ticks"], &true.into()));
    assert!(said.starts_with(&format!("identical, {} values", told["values"])) && code == Some(0), "{told}");
}

/// Writes a recording anew with another message in the place of one.
fn changed(file: &[u8], topic: &str, number: u32, change: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    copied(file, |message| {
        if message.channel.topic == topic && message.sequence == number {
            change(message.data.to_mut());
        }
        true
    })
}

/// Writes a recording anew with those messages, as a program that knows nothing of runs does.
fn copied(file: &[u8], mut keep: impl FnMut(&mut Message<'_>) -> bool) -> Vec<u8> {
    let mut out = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::WriteOptions::new().compression(None).profile("ros2").create(&mut out).unwrap();
    let summary = Summary::read(file).unwrap().unwrap();
    for index in &summary.metadata_indexes {
        writer.write_metadata(&mcap::read::metadata(file, index).unwrap()).unwrap();
    }
    for index in &summary.attachment_indexes {
        writer.attach(&mcap::read::attachment(file, index).unwrap()).unwrap();
    }
    for mut message in messages(file) {
        if keep(&mut message) {
            writer.write(&message).unwrap();
        }
    }
    writer.finish().unwrap();
    drop(writer);
    out.into_inner()
}

#[test]
fn the_first_value_that_differs_is_named_with_its_field() {
    let folder = folder("record-differs");
    let (file, _) = recorded(&folder, &["--seed", "4"]);
    let file = std::fs::read(file).unwrap();
    // The second number of a pose, behind the header of four bytes.
    let other = changed(&file, "/simulator/r2/truth", 50, |data| {
        data[4 + 8..][..8].copy_from_slice(&7_f64.to_le_bytes())
    });
    std::fs::write(folder.join("other.mcap"), other).unwrap();
    let (said, code) = verify(&folder, "other.mcap");
    let expected = "first difference at 0.980 s: /simulator/r2/truth/y: recorded 7.0, replayed ";
    assert!(said.starts_with(expected), "{said}");
    assert_eq!(code, Some(1));
    let (told, code) = verified(&folder, "other.mcap");
    assert_eq!((&told["outcome"], &told["whole"], code), (&"different".into(), &true.into(), Some(1)));
    let first = &told["first"];
    assert_eq!((&first["url"], &first["field"]), (&"/simulator/r2/truth".into(), &"y".into()));
    assert_eq!((&first["time"], &first["recorded"]), (&980_000_000.into(), &"7.0".into()));
    assert!(expected.len() < said.len() && said.contains(first["replayed"].as_str().unwrap()), "{told}");
    let same = changed(&file, "/simulator/r2/truth", 50, |_| {});
    std::fs::write(folder.join("same.mcap"), same).unwrap();
    assert_eq!(verify(&folder, "same.mcap").1, Some(0));
}

#[test]
fn a_selective_recording_is_refused_for_a_rerun() {
    let folder = folder("record-selected");
    let select = ["--set", "record.select=[\"/r2/**\"]", "--set", "record.exclude=[\"/**/timing\"]"];
    let (file, _) = recorded(&folder, &select);
    let file = std::fs::read(file).unwrap();
    for message in messages(&file) {
        let topic = &message.channel.topic;
        let is_own = ["/log", "/record/change"].contains(&topic.as_str());
        assert!(is_own || topic.starts_with("/r2/") && !topic.ends_with("/timing"), "{topic}");
    }
    let (said, code) = verify(&folder, "here/run.mcap");
    assert!(
        said.contains("not covered: it is not a whole run: only a part of the values is recorded"),
        "{said}"
    );
    assert_eq!(code, Some(2));
}

#[test]
fn a_part_of_a_recording_is_not_judged_and_gaps_are_named() {
    let folder = folder("record-part");
    let (file, _) = recorded(&folder, &["--seed", "8"]);
    let done = |arguments: &[&str]| assert!(slate(&folder, arguments).status.success(), "{arguments:?}");
    done(&["bag", "filter", "here/run.mcap", "--topics", "/r2/**", "--out", "part.mcap"]);
    let (told, code) = verified(&folder, "part.mcap");
    assert_eq!((&told["outcome"], code), (&"not_covered".into(), Some(2)));
    let reason = told["reason"].as_str().unwrap();
    assert!(
        reason.contains("inputs not recorded: /simulator/") && reason.contains("slate bag filter"),
        "{reason}"
    );
    done(&["bag", "filter", "here/run.mcap", "--from", "1", "--out", "late.mcap"]);
    let (said, code) = verify(&folder, "late.mcap");
    assert!(said.contains("inputs recorded in part:") && code == Some(2), "{said}");
    done(&["run", "exp1", "--headless", "--seed", "9", "--set", "record.enabled=true", "--out", "there"]);
    done(&["bag", "merge", "here/run.mcap", "there/run.mcap", "--interleave", "--out", "both.mcap"]);
    let (said, code) = verify(&folder, "both.mcap");
    assert!(said.contains("recordings of several runs are merged in it") && code == Some(2), "{said}");
    // Copies by a program that knows nothing of runs.
    let bytes = std::fs::read(file).unwrap();
    let is_sonar = |message: &Message<'_>| message.channel.topic == "/r2/sonar/value";
    let thin = copied(&bytes, |message| !is_sonar(message) || message.sequence % 3 > 0);
    std::fs::write(folder.join("thin.mcap"), thin).unwrap();
    let (said, code) = verify(&folder, "thin.mcap");
    assert!(said.contains("values that were recorded") && said.contains("/r2/sonar/value ("), "{said}");
    assert_eq!(code, Some(2));
    let without = copied(&bytes, |message| !is_sonar(message));
    std::fs::write(folder.join("without.mcap"), without).unwrap();
    let (said, code) = verify(&folder, "without.mcap");
    let named =
        said.split_once("inputs not recorded: ").is_some_and(|(_, named)| named.contains("/r2/sonar/value"));
    assert!(named && code == Some(2), "{said}");
    // Nor do modules run on that, unless requested.
    for (file, words) in
        [("thin.mcap", "values of /r2/sonar/value"), ("without.mcap", "nothing of /r2/sonar/value")]
    {
        let replay =
            ["replay", file, "--rate", "max", "--recompute", "r2/avoid_obstacle,r2/planner,r2/execute"];
        for arguments in [&replay[..], &["try", "r2/avoid_obstacle", "--bag", file]] {
            let output = slate(&folder, arguments);
            let said = text(&output.stderr);
            assert_eq!(output.status.code(), Some(2), "{said}");
            assert!(said.contains(words) && said.contains("--partial"), "{said}");
        }
        let output = slate(&folder, &[&replay[..], &["--partial"]].concat());
        let said = text(&output.stdout) + &text(&output.stderr);
        assert!(said.contains("not as it was: ") && said.contains(words), "{said}");
        let is_told = said.contains("first difference") && output.status.code() == Some(2)
            || said.contains("identical, with incomplete inputs");
        assert!(is_told, "{said}");
    }
}

#[test]
fn a_damaged_recording_is_not_judged_and_a_cut_one_is_in_part() {
    let folder = folder("record-damaged");
    let (file, _) = recorded(&folder, &["--seed", "10"]);
    let bytes = std::fs::read(file).unwrap();
    let refused = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.join(name), bytes).unwrap();
        let (said, code) = verify(&folder, name);
        assert!(said.contains("is damaged at byte") && said.contains("slate bag repair"), "{name}: {said}");
        assert_eq!(code, Some(2), "{name}: {said}");
    };
    refused("twice.mcap", &[&bytes[..], &bytes[..]].concat());
    refused("joined.mcap", &[&bytes[..bytes.len() / 2], &bytes[..]].concat());
    let chunks = Summary::read(&bytes).unwrap().unwrap().chunk_indexes;
    let begin = chunks[chunks.len() / 2].chunk_start_offset as usize;
    // The frame of a chunk, its head, its records, and what is behind all chunks.
    let places = [begin, begin + 1, begin + 4, begin + 12, begin + 40, begin + 500, bytes.len() - 3];
    for (place, bit) in places.into_iter().flat_map(|place| [(place, 2), (place, 6)]) {
        let mut flipped = bytes.clone();
        flipped[place] ^= 1 << bit;
        refused("flipped.mcap", &flipped);
        // So it is when the file is cut off, too.
        if place < bytes.len() / 4 * 3 {
            refused("flipped.mcap", &flipped[..bytes.len() / 4 * 3]);
        }
    }
    std::fs::write(folder.join("cut.mcap"), &bytes[..bytes.len() / 2]).unwrap();
    let (said, code) = verify(&folder, "cut.mcap");
    assert!(
        said.starts_with("identical, ") && said.contains(", up to where the recording was cut off"),
        "{said}"
    );
    assert_eq!(code, Some(0));
    let (told, code) = verified(&folder, "cut.mcap");
    assert_eq!((&told["outcome"], &told["whole"], code), (&"identical".into(), &false.into(), Some(0)));
    assert!(told["values"].as_u64().unwrap() > 1000, "{told}");
    // There is nothing in it but what is known before the run.
    let first = chunks.iter().map(|chunk| chunk.chunk_start_offset).min().unwrap() as usize;
    std::fs::write(folder.join("none.mcap"), &bytes[..first]).unwrap();
    let (told, code) = verified(&folder, "none.mcap");
    assert_eq!(
        (&told["outcome"], &told["whole"], code),
        (&"nothing_to_compare".into(), &false.into(), Some(2))
    );
    let (said, code) = verify(&folder, "none.mcap");
    assert!(said.contains("nothing to compare: none.mcap has no value") && code == Some(2), "{said}");
}

#[test]
fn a_compressed_copy_is_made_again_like_the_recording_itself() {
    let folder = folder("record-compressed");
    let (file, _) = recorded(&folder, &["--seed", "11"]);
    let mut reader = Reader::open(&file).unwrap();
    let mut writer = Writer::new(Vec::new(), "small.mcap", reader.header(), Compression::Lz4).unwrap();
    while let Some(message) = reader.next_message().unwrap() {
        message.schema.map(|schema| writer.schema(schema)).transpose().unwrap();
        writer.channel(message.channel).unwrap();
        let (sequence, time) = (message.sequence, message.log_time);
        writer.message(message.channel.id, sequence, time, message.publish_time, message.data).unwrap();
    }
    reader.metadata().unwrap().iter().for_each(|metadata| writer.metadata(metadata).unwrap());
    for number in 0..reader.attachments() {
        writer.attachment(&reader.attachment(number).unwrap().unwrap()).unwrap();
    }
    let bytes = writer.finish().unwrap();
    assert!(bytes.len() < std::fs::metadata(&file).unwrap().len() as usize);
    std::fs::write(folder.join("small.mcap"), bytes).unwrap();
    assert_eq!(verify(&folder, "small.mcap"), verify(&folder, "here/run.mcap"));
}

/// The run continues for this long, whatever happens, and it is quick enough for a test.
pub(crate) const LONG: [&str; 6] = [
    "--set",
    "modules.referee.params.time_limit=20.0",
    "--set",
    "modules.referee.params.goal_tolerance=0.0",
    "--rate",
    "4",
];

#[test]
fn rerun_repeats_changes_of_the_run() {
    let mut running = Running::new("record-changes");
    let run = ["run", "exp1", "--headless", "--seed", "5", "--out", "here"];
    running.start("exp1", &[&run[..], &ON, &LONG].concat());
    running.done(&["config", "set", "robots.r2.modules.planner.params.max_linear_velocity=0.21"]);
    running.done(&["module", "disable", "r2/avoid_obstacle"]);
    running.done(&["unlink", "r2/avoid_wall/sonar"]);
    running.done(&["plugin", "reload", "slate-wheeled", &library("libslate_wheeled.so")]);
    running.done(&["module", "enable", "r2/avoid_obstacle"]);
    let output = running.finish();
    assert!(matches!(output.status.code(), Some(0 | 1)), "{output:?}");
    let file = std::fs::read(running.folder().join("here/run.mcap")).unwrap();
    let all = messages(&file);
    let of = |topic: &str| all.iter().filter(|message| message.channel.topic == topic).collect::<Vec<_>>();
    assert_eq!(of("/record/change").len(), 5);
    // The log says it too, as other tools know logs.
    let said = of("/log").into_iter().map(|line| {
        let schema = line.channel.schema.as_ref().unwrap();
        assert_eq!(schema.name, "rcl_interfaces/msg/Log");
        let schema = Schema::parse(&schema.name, std::str::from_utf8(&schema.data).unwrap()).unwrap();
        let line = schema.decode(&line.data).unwrap();
        line.get("msg").and_then(|value| value.as_str()).unwrap().to_owned()
    });
    assert!(said.into_iter().any(|line| line.contains("links changed, of these modules: r2/avoid_wall")));
    let (said, code) = verify(running.folder(), "here/run.mcap");
    assert!(said.starts_with("identical, "), "{said}");
    assert_eq!(code, Some(0));
    // Modules that run on the recording continue with other code where they did.
    let modules = "r2/planner,r2/execute,r2/avoid_obstacle,r2/avoid_wall,r2/pass_position";
    let output = running.call(&["replay", "here/run.mcap", "--rate", "max", "--recompute", modules]);
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("identical") && !said.contains("can't be made again"), "{said}");
    assert_eq!(output.status.code(), Some(0));
}

/// Records a run that continues while something is done to it, and makes it again.
fn done_again(name: &str, commands: &[&[&str]]) {
    let mut running = Running::new(name);
    let run = ["run", "exp1", "--headless", "--seed", "5", "--out", "here"];
    running.start("exp1", &[&run[..], &ON, &LONG].concat());
    for command in commands {
        running.done(command);
    }
    let output = running.finish();
    assert!(matches!(output.status.code(), Some(0 | 1)), "{output:?}");
    let file = std::fs::read(running.folder().join("here/run.mcap")).unwrap();
    // Another order of the modules follows from what was done.
    let is_done = |message: &Message<'_>| {
        let schema = message.channel.schema.as_ref().unwrap();
        let schema = Schema::parse(&schema.name, std::str::from_utf8(&schema.data).unwrap()).unwrap();
        let change = schema.decode(&message.data).unwrap();
        change.get("action").and_then(|action| action.as_str()) != Some("order")
    };
    let changes = messages(&file).into_iter().filter(|message| message.channel.topic == "/record/change");
    assert_eq!(changes.filter(is_done).count(), commands.len());
    let (said, code) = verify(running.folder(), "here/run.mcap");
    assert!(said.starts_with("identical, "), "{said}");
    assert_eq!(code, Some(0));
}

#[test]
fn rerun_repeats_manual_actuator_commands() {
    let again: [&[&str]; 5] = [&["stop", "a cable"], &["reset"], &["arm"], &["stop"], &["reset"]];
    done_again("record-stop", &again);
}

#[test]
fn one_actuator_that_is_armed_is_armed_again() {
    done_again("record-arm", &[&["stop"], &["reset"], &["arm", "r2/wheels"]]);
}

#[test]
fn plugins_that_left_and_came_during_the_run_do_so_again() {
    let library = library("libslate_wheeled.so");
    let again: [&[&str]; 4] = [
        &["plugin", "unload", "slate-wheeled"],
        &["plugin", "load", "slate-wheeled"],
        &["plugin", "unload", "slate-wheeled"],
        &["plugin", "load", &library],
    ];
    done_again("record-plugins", &again);
}

#[test]
fn unrepeatable_changes_are_not_covered() {
    let mut running = Running::new("record-other");
    let run = ["run", "exp1", "--headless", "--seed", "5", "--out", "here"];
    running.start("exp1", &[&run[..], &ON, &LONG].concat());
    running.done(&["snapshot", "save", "here.snapshot"]);
    // Else the snapshot could change nothing.
    let status = || running.read("exp1", "/r2/execute/status");
    let saved = status();
    common::wait_for("another state of Execute", || status() != saved);
    running.done(&["snapshot", "load", "here.snapshot"]);
    running.finish();
    let (said, code) = verify(running.folder(), "here/run.mcap");
    assert!(
        said.contains("not covered: after cycle") && said.contains("a restore from a snapshot"),
        "{said}"
    );
    assert_eq!(code, Some(2));
    // Nor is it said of a module that it writes something else.
    let tried = slate(running.folder(), &["try", "r2/execute", "--bag", "here/run.mcap"]);
    let said = text(&tried.stdout);
    assert!(said.contains("a restore from a snapshot, which can't be repeated and may explain"), "{said}");
    assert_eq!(tried.status.code(), Some(2));
}

/// The messages that can be read of a file that may end anywhere, and whether it is at its end.
pub(crate) fn readable(file: &[u8]) -> (usize, bool) {
    let mut count = 0;
    for record in mcap::read::ChunkFlattener::new_with_options(file, Options::IgnoreEndMagic.into()).unwrap()
    {
        match record {
            Ok(Record::Message { .. }) => count += 1,
            Ok(Record::DataEnd(_)) => return (count, true),
            Ok(_) => {}
            Err(mcap::McapError::UnexpectedEof | mcap::McapError::UnexpectedEoc) => return (count, false),
            Err(error) => panic!("{error}"),
        }
    }
    (count, false)
}

#[test]
fn a_run_is_made_again_in_the_world_that_it_was_in() {
    let folder = folder("record-world");
    std::fs::create_dir(folder.join("worlds")).unwrap();
    let world = folder.join("worlds/mine.toml");
    std::fs::write(&world, include_str!("../../../worlds/rocs_arena.toml")).unwrap();
    let own = ["--seed", "2", "--set", "world.arena=worlds/mine.toml"];
    let own = [&own[..], &["--set", "modules.referee.params.time_limit=2.0"]].concat();
    recorded(&folder, &own);
    let (identical, code) = verify(&folder, "here/run.mcap");
    assert!(identical.starts_with("identical, ") && code == Some(0), "{identical}");
    std::fs::write(&world, "it = \"is another one\"").unwrap();
    let (said, code) = verify(&folder, "here/run.mcap");
    let remark = "worlds/mine.toml has changed since; the recorded version is used\n";
    assert_eq!((said, code), (format!("{identical}{remark}"), Some(0)));
    assert_eq!(verified(&folder, "here/run.mcap").0["replaced"], serde_json::json!(["worlds/mine.toml"]));
    std::fs::remove_file(&world).unwrap();
    assert_eq!(verify(&folder, "here/run.mcap"), (identical.clone(), Some(0)));
    // One without it may be another one.
    let path = folder.join("here/run.mcap");
    let (mut reader, mut all) = (Reader::open(&path).unwrap(), Vec::new());
    all.extend((0..reader.attachments()).map(|number| reader.attachment(number).unwrap().unwrap()));
    let mut writer = Writer::new(Vec::new(), &path, reader.header(), Compression::None).unwrap();
    while let Some(message) = reader.next_message().unwrap() {
        writer.schema(message.schema.unwrap()).unwrap();
        writer.channel(message.channel).unwrap();
        let (sequence, time) = (message.sequence, message.log_time);
        writer.message(message.channel.id, sequence, time, message.publish_time, message.data).unwrap();
    }
    reader.metadata().unwrap().iter().for_each(|metadata| writer.metadata(metadata).unwrap());
    all.iter().filter(|own| own.name == "configuration.toml").for_each(|own| writer.attachment(own).unwrap());
    std::fs::write(folder.join("without.mcap"), writer.finish().unwrap()).unwrap();
    std::fs::write(&world, include_str!("../../../worlds/rocs_arena.toml")).unwrap();
    let (said, code) = verify(&folder, "without.mcap");
    let remark = "worlds/mine.toml is not in the recording; that of this disk is taken\n";
    assert_eq!((said, code), (format!("{identical}{remark}"), Some(0)));
}

#[test]
fn a_file_that_is_no_recording_is_refused_in_words() {
    let folder = folder("record-none");
    std::fs::write(folder.join("none.mcap"), "no recording").unwrap();
    let (said, code) = verify(&folder, "none.mcap");
    assert!(said.contains("`none.mcap` is not an MCAP file: it begins with"), "{said}");
    assert_eq!(code, Some(2));
    let (said, code) = verify(&folder, "nowhere.mcap");
    assert!(said.contains("nowhere.mcap") && code == Some(2), "{said}");
}

#[test]
fn on_the_wall_clock_nothing_can_be_made_again() {
    let folder = folder("record-wall");
    let all =
        [&ON[..], &["--mode", "threaded", "--set", "modules.referee.params.time_limit=1.0", "--rate", "4"]];
    let (file, _) = recorded(&folder, &all[1..].concat());
    assert!(readable(&std::fs::read(file).unwrap()).1);
    let (said, code) = verify(&folder, "here/run.mcap");
    assert!(said.contains("not covered: the run was not in lockstep"), "{said}");
    assert_eq!(code, Some(2));
}
