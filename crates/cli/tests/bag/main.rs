//! `slate bag`: what it shows, writes and refuses, and the commands of the book.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;
mod open;
mod recording;

use std::path::Path;

use common::{folder, json, slate, text};
use recording::{recording, recording_of, unreadable};
use serde_json::Value;
use slate::bag::{Attachment, Channel, Compression, Header, Metadata, Schema, Writer};
use slate_sorted::SortedMap;

const BOOK: &str = include_str!("../../../../book/src/23-bags.md");

fn write(folder: &Path, name: &str, bytes: &[u8]) {
    std::fs::write(folder.join(name), bytes).unwrap();
}

/// A folder with that recording.
fn recorded(name: &str) -> std::path::PathBuf {
    let folder = folder(name);
    write(&folder, "run.mcap", &recording(12.25, Compression::None));
    folder
}

/// What a command prints that ends well.
fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = slate(folder, &[&["bag"], arguments].concat());
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {output:?}");
    text(&output.stdout)
}

/// A command ends with that code and these words on stderr.
fn fails(folder: &Path, code: i32, arguments: &[&str], words: &[&str]) -> String {
    let output = slate(folder, &[&["bag"], arguments].concat());
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {output:?}");
    for word in words {
        assert!(stderr.contains(word), "{arguments:?} does not say `{word}`: {stderr}");
    }
    stderr
}

#[test]
fn content_of_recording_is_shown() {
    let folder = recorded("bag-info");
    let said = done(&folder, &["info", "run.mcap"]);
    for words in [
        "ros2",
        "test 1",
        "100 in 4.900000000 s, from 2.000000000 to 6.900000000",
        "5, not compressed",
        "7 of /r2/image",
        "/r2/range  test/msg/Range  cdr       50        10.00 Hz",
        "robot.toml  application/toml  14",
        "metadata run",
        "seed   3",
    ] {
        assert!(said.contains(words), "`{words}` is missing in {said}");
    }
    let output = slate(&folder, &["bag", "info", "run.mcap", "--json"]);
    let info: Value = json(&output);
    assert_eq!(
        (info["messages"].as_u64(), info["channels"][0]["topic"].as_str()),
        (Some(100), Some("/r2/pose"))
    );
}

#[test]
fn damaged_recording_is_detected_and_repaired() {
    let folder = recorded("bag-repair");
    assert_eq!(done(&folder, &["verify", "run.mcap"]), "run.mcap is whole: 100 messages in 5 chunks\n");
    let mut bytes = recording(12.25, Compression::Lz4);
    // In a message of the first chunk.
    let place = bytes.windows(4).position(|bytes| bytes == b"odom").unwrap();
    bytes[place] ^= 4;
    write(&folder, "flipped.mcap", &bytes);
    let whole = recording(12.25, Compression::None);
    write(&folder, "cut.mcap", &whole[..whole.len() / 2]);
    write(&folder, "picture.jpeg", &[0xff; 100]);
    for file in ["flipped.mcap", "cut.mcap"] {
        let mend = format!("`slate bag repair {file}`");
        fails(&folder, 1, &["verify", file], &[file, "is damaged at byte", &mend]);
        fails(&folder, 2, &["info", file], &[file, "is damaged at byte", &mend]);
    }
    let said = done(&folder, &["repair", "flipped.mcap", "--out", "mended.mcap"]);
    assert!(
        said.contains("mended.mcap is whole, with 80 messages, 4 chunks kept") && said.contains("lost: "),
        "{said}"
    );
    assert_eq!(std::fs::read(folder.join("flipped.mcap")).unwrap(), bytes);
    done(&folder, &["verify", "mended.mcap"]);
    let told: Value = json(&slate(&folder, &["bag", "repair", "cut.mcap", "--json"]));
    let messages = told["messages"].as_u64().unwrap();
    assert!((40..60).contains(&messages) && told["unfinished"].as_u64().unwrap() > 0, "{told}");
    let said = done(&folder, &["verify", "cut.mcap"]);
    assert!(said.contains(&format!("{messages} messages")), "{said}");
    assert!(done(&folder, &["repair", "run.mcap"]).contains("nothing was lost"));
    // What is no recording stays as it is.
    fails(&folder, 2, &["verify", "picture.jpeg"], &["picture.jpeg` is not an MCAP file"]);
    write(&folder, "a.carmen", b"ODOM 1 2 0.5 0.4 -0.1 0 10.5 host 0.1\n");
    let words = ["a.carmen` is not an MCAP file: it is a log of format carmen", "slate bag import"];
    fails(&folder, 2, &["verify", "a.carmen"], &words);
    fails(&folder, 2, &["repair", "picture.jpeg"], &["picture.jpeg` is not an MCAP file"]);
    assert_eq!(std::fs::read(folder.join("picture.jpeg")).unwrap(), [0xff; 100]);
}

#[test]
fn messages_are_printed_with_their_values() {
    let folder = recorded("bag-cat");
    let said = done(&folder, &["cat", "run.mcap", "/r2/range", "--from", "0.5", "--to", "0.6"]);
    let lines: Vec<_> = said.lines().collect();
    assert_eq!(lines.len(), 2, "{said}");
    assert!(lines[0].starts_with("2.500000000 /r2/range ") && lines[0].contains("range = 1.25"), "{said}");
    let said = done(&folder, &["cat", "run.mcap", "/*/pose", "--json", "--to", "0"]);
    let line: Value = serde_json::from_str(&said).unwrap();
    assert_eq!(
        (&line["topic"], &line["value"]["x"], &line["time"]),
        (&"/r2/pose".into(), &0.into(), &2_000_000_000_u64.into())
    );
    assert_eq!(done(&folder, &["cat", "run.mcap"]).lines().count(), 100);
}

#[test]
fn tables_have_a_row_for_each_message() {
    let folder = recorded("bag-csv");
    done(&folder, &["export", "run.mcap", "/r2/range", "--csv", "--out", "range.csv", "--to", "0.1"]);
    let table = std::fs::read_to_string(folder.join("range.csv")).unwrap();
    let rows = [
        "time_s,sequence,range,beams",
        "2.000000000,0,0,\"[1, 2]\"",
        "2.100000000,1,0.25,\"[1.25, 2.25]\"",
        "",
    ];
    assert_eq!(table.replace(".0", ""), rows.join("\n").replace(".0", ""));
    done(&folder, &["export", "run.mcap", "--csv", "--out", "tables"]);
    let table = std::fs::read_to_string(folder.join("tables/r2_pose.csv")).unwrap();
    assert_eq!(table.lines().count(), 51);
    assert_eq!(table.lines().nth(1), Some(r#"2.000000000,0,"map, ""odom""",0"#));
    let several = ["export", "run.mcap", "--csv", "--out", "all.csv"];
    fails(&folder, 2, &several, &["all.csv", "several topics", "name a folder"]);
    assert!(!folder.join("all.csv").exists() && !folder.join("all.csv.part").exists());
}

#[test]
fn joined_parts_equal_the_whole_or_name_the_first_difference() {
    let folder = recorded("bag-diff");
    done(&folder, &["filter", "run.mcap", "--topics", "/r2/range", "--out", "range.mcap"]);
    done(&folder, &["filter", "run.mcap", "--topics", "/r2/pose", "--to", "2", "--out", "early.mcap"]);
    done(&folder, &["filter", "run.mcap", "--topics", "/*/pose", "--from", "2.1", "--out", "late.mcap"]);
    let said = done(&folder, &["merge", "late.mcap", "range.mcap", "early.mcap", "--out", "again.mcap"]);
    assert_eq!(said, "again.mcap has 100 messages\n");
    done(&folder, &["verify", "again.mcap"]);
    assert_eq!(done(&folder, &["diff", "run.mcap", "again.mcap"]), "identical, 100 messages\n");
    write(&folder, "other.mcap", &recording(12.5, Compression::Lz4));
    let output = slate(&folder, &["bag", "diff", "run.mcap", "other.mcap"]);
    let said = text(&output.stdout);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    for words in [
        "first difference: 6.900000000 s, message 49 of /r2/range, field range",
        "run.mcap: 12.25",
        "other.mcap: 12.5",
        "/r2/range  49    1",
        "/r2/pose   50    0",
    ] {
        assert!(said.contains(words), "`{words}` is missing in {said}");
    }
    let output = slate(&folder, &["bag", "diff", "run.mcap", "range.mcap", "--json"]);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let diff: Value = json(&output);
    assert_eq!(
        (&diff["first"]["topic"], &diff["topics"]["/r2/pose"]["only_a"]),
        (&"/r2/pose".into(), &50.into())
    );
}

#[test]
fn a_part_of_a_run_does_not_say_that_it_is_whole() {
    let folder = recorded("bag-whole");
    done(&folder, &["filter", "run.mcap", "--out", "all.mcap"]);
    done(&folder, &["filter", "run.mcap", "--topics", "/r2/pose", "--out", "pose.mcap"]);
    done(&folder, &["filter", "run.mcap", "--to", "1", "--out", "early.mcap"]);
    done(&folder, &["merge", "run.mcap", "early.mcap", "--out", "both.mcap"]);
    for (file, whole) in
        [("run", "true"), ("all", "true"), ("pose", "false"), ("early", "false"), ("both", "false")]
    {
        let info = json(&slate(&folder, &["bag", "info", &format!("{file}.mcap"), "--json"]));
        for record in info["metadata"].as_array().unwrap() {
            let said = (record[0] != "run").then_some(whole).or(record[1]["whole"].as_str());
            assert_eq!(said, Some(whole), "{file}: {record}");
        }
    }
}

/// A record of metadata of a file.
fn about(folder: &Path, file: &str, name: &str) -> Value {
    let info = json(&slate(folder, &["bag", "info", file, "--json"]));
    let found = info["metadata"].as_array().unwrap().iter().find(|record| record[0] == name);
    found.unwrap_or_else(|| panic!("{file} has no {name}: {info}"))[1].clone()
}

#[test]
fn a_cut_recording_recounts_the_statistics_of_its_values() {
    let folder = recorded("bag-counts");
    for (name, arguments, values) in [
        ("all.mcap", &[][..], "107"),
        ("pose.mcap", &["--topics", "/r2/pose"], "50"),
        ("rest.mcap", &["--exclude", "/r2/pose"], "50"),
        ("early.mcap", &["--to", "1"], "22"),
    ] {
        done(&folder, &[&["filter", "run.mcap", "--out", name], arguments].concat());
        let end = about(&folder, name, "end");
        assert_eq!(end["values"], values, "{name}: {end}");
        assert_eq!(end.get("digest").is_some(), name != "early.mcap", "{name}: {end}");
    }
    assert_eq!(about(&folder, "pose.mcap", "dropped"), serde_json::json!({}), "images are not in it");
    assert_eq!(about(&folder, "pose.mcap", "end")["dropped"], "0");
    assert_eq!(about(&folder, "rest.mcap", "dropped")["/r2/image"], "7");
    let said =
        fails(&folder, 2, &["filter", "run.mcap", "--exclude", "/r2/pos", "--out", "x.mcap"], &["/r2/pose"]);
    assert!(said.contains("did you mean"), "{said}");
}

#[test]
fn drops_are_counted_in_the_part_that_is_copied() {
    let folder = folder("bag-drops");
    let mut writer = Writer::new(Vec::new(), "test", &Header::default(), Compression::None).unwrap();
    let texts =
        |all: &[(&str, &str)]| all.iter().map(|(key, text)| ((*key).into(), (*text).into())).collect();
    writer.metadata(&Metadata { name: "run".into(), metadata: texts(&[("run", "a")]) }).unwrap();
    let schema =
        Schema { id: 1, name: "slate_msgs/msg/Dropped".into(), encoding: "none".into(), data: vec![] };
    writer.schema(&schema).unwrap();
    for (id, topic) in [(0, "/record/dropped"), (1, "/image")] {
        let (topic, message_encoding, metadata) = (topic.into(), "json".into(), SortedMap::new());
        writer.channel(&Channel { id, schema_id: 1, topic, message_encoding, metadata }).unwrap();
    }
    for second in 0..10_u64 {
        let told = format!(r#"{{"url":"/image","values":{}}}"#, second * second);
        writer.message(0, 0, second * 1_000_000_000, 0, told.as_bytes()).unwrap();
        writer.message(1, 0, second * 1_000_000_000, 0, b"{}").unwrap();
    }
    writer.metadata(&Metadata { name: "dropped".into(), metadata: texts(&[("/image", "81")]) }).unwrap();
    let end = texts(&[("values", "10"), ("dropped", "81"), ("time_ns", "9000000000")]);
    writer.metadata(&Metadata { name: "end".into(), metadata: end }).unwrap();
    write(&folder, "run.mcap", &writer.finish().unwrap());
    done(&folder, &["filter", "run.mcap", "--from", "3", "--to", "5", "--out", "part.mcap"]);
    // Until the second before it were 4 of them, and until its end 25.
    assert_eq!(about(&folder, "part.mcap", "dropped")["/image"], "21");
    let end = about(&folder, "part.mcap", "end");
    assert_eq!([&end["values"], &end["dropped"], &end["time_ns"]], ["3", "21", "5000000000"], "{end}");
}

#[test]
fn recordings_merge_within_a_run_and_never_silently_across_runs() {
    let folder = recorded("bag-merge");
    write(&folder, "again.mcap", &recording(12.25, Compression::Lz4));
    write(&folder, "other.mcap", &recording_of("r2-2", 12.25, Compression::None));
    // What both recordings of the run have is there once.
    let said = done(&folder, &["merge", "run.mcap", "again.mcap", "--out", "one.mcap"]);
    assert_eq!(said, "one.mcap has 100 messages\n");
    assert_eq!(done(&folder, &["diff", "run.mcap", "one.mcap"]), "identical, 100 messages\n");
    assert_eq!(done(&folder, &["attachments", "one.mcap"]).matches("robot.toml").count(), 1);
    let two = ["merge", "run.mcap", "other.mcap", "--out", "two.mcap"];
    let two_and = |more: &[&'static str]| [&two, more].concat();
    let words = ["two.mcap", "different runs", "`/r2/pose`, `/r2/range`", "--prefix first", "--interleave"];
    fails(&folder, 2, &two, &words);
    assert!(!folder.join("two.mcap").exists() && !folder.join("two.mcap.part").exists());
    fails(&folder, 2, &two_and(&["--prefix", "a"]), &["2 files and 1 prefix", "once for each file"]);
    fails(&folder, 2, &two_and(&["--prefix", "a b", "--prefix", "c"]), &["expected a name such as"]);
    fails(&folder, 2, &two_and(&["--prefix", "a", "--prefix", "a"]), &["`/a/r2/pose`"]);
    done(&folder, &two_and(&["--prefix", "", "--prefix", "/second/"]));
    let info = json(&slate(&folder, &["bag", "info", "two.mcap", "--json"]));
    let topics = info["channels"].as_array().unwrap().iter().map(|channel| &channel["topic"]);
    let topics: Vec<_> = topics.map(|topic| topic.as_str().unwrap()).collect();
    assert_eq!(topics, ["/r2/pose", "/r2/range", "/second/r2/pose", "/second/r2/range"]);
    let ends = info["metadata"].as_array().unwrap().iter().filter(|record| record[0] == "end");
    let values: Vec<_> = ends.map(|end| end[1]["values"].as_str().unwrap()).collect();
    assert_eq!(values, ["100", "100"]);
    done(&folder, &two_and(&["--interleave", "--force"]));
    assert_eq!(done(&folder, &["verify", "two.mcap"]), "two.mcap is whole: 200 messages in 1 chunk\n");
    // Sequential recordings are distinguishable.
    done(&folder, &["filter", "run.mcap", "--to", "1", "--out", "early.mcap"]);
    done(&folder, &["filter", "other.mcap", "--from", "2", "--out", "late.mcap"]);
    done(&folder, &["merge", "late.mcap", "early.mcap", "--out", "both.mcap"]);
}

#[test]
fn each_verb_names_a_missing_value_goes_on_and_ends_with_1() {
    let folder = folder("bag-unread");
    write(&folder, "run.mcap", &unreadable());
    write(&folder, "same.mcap", &unreadable());
    let range = "3 messages of `/range` can't be read, the first at 1.000000000 s: ";
    let bare = "the message of `/bare` at 2.500000000 s can't be read: its channel has no schema";
    let verbs: [(&[&str], &str); 7] = [
        (&["bag", "info", "run.mcap"], "messages   7"),
        (&["bag", "cat", "run.mcap"], "4.000000000 /range"),
        (&["bag", "cat", "run.mcap", "--json"], "\"unread\":\"its channel has no schema\""),
        (&["bag", "export", "run.mcap", "--csv", "--out", "tables"], "3 messages of /range"),
        (&["bag", "export", "run.mcap", "--carmen", "--out", "log.carmen"], "left out: 3 messages"),
        (&["bag", "diff", "run.mcap", "same.mcap"], "identical, 7 messages"),
        (&["report", "run.mcap"], "report.html"),
    ];
    for (verb, words) in verbs {
        let output = slate(&folder, verb);
        let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
        assert_eq!(output.status.code(), Some(1), "{verb:?}: {output:?}");
        assert!(stdout.contains(words), "{verb:?}: {stdout}");
        for words in [range, bare] {
            assert!(stderr.contains(&format!("run.mcap: {words}")), "{verb:?}: {stderr}");
        }
    }
    let plot = slate(&folder, &["bag", "plot", "run.mcap", "/range/range"]);
    assert_eq!((plot.status.code(), &*text(&plot.stdout)), (Some(1), "plot.svg shows 3 values\n"));
    assert!(text(&plot.stderr).contains(range) && !text(&plot.stderr).contains(bare));
    let page = std::fs::read_to_string(folder.join("run-report/report.html")).unwrap();
    assert!(page.contains("its channel has no schema"), "{page}");
    // The unreadable part was not requested.
    done(&folder, &["cat", "run.mcap", "--to", "0.5"]);
    done(&folder, &["filter", "run.mcap", "--out", "copy.mcap"]);
}

#[test]
fn empty_recording_is_no_success() {
    let folder = folder("bag-empty");
    write(&folder, "empty.mcap", b"");
    write(&folder, "wrong.log", b"FLASER three beams\nODOM 1 2\n");
    let empty = "empty.mcap` is not an MCAP file: it is empty";
    fails(&folder, 2, &["repair", "empty.mcap"], &[empty]);
    fails(&folder, 2, &["repair", "empty.mcap", "--out", "mended.mcap"], &[empty]);
    let import = ["import", "wrong.log", "--format", "carmen", "--lenient", "--out", "log.mcap"];
    fails(
        &folder,
        2,
        &import,
        &["wrong.log", "it has no message: 2 parts are invalid, the first:", "line 1"],
    );
    assert_eq!(std::fs::read(folder.join("empty.mcap")).unwrap(), b"");
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2, "something is left behind");
    let nothing = Writer::new(Vec::new(), "test", &Header::default(), Compression::None).unwrap();
    write(&folder, "a.mcap", &nothing.finish().unwrap());
    fails(&folder, 2, &["diff", "a.mcap", "a.mcap"], &["a.mcap", "a message to compare"]);
}

#[test]
fn two_runs_of_a_seed_are_the_same_but_for_what_was_measured() {
    let folder = folder("bag-runs");
    for name in ["a", "b"] {
        common::exp1(&folder, &["--seed", "1", "--set", "record.enabled=true", "--out", name]);
    }
    let diff = |more: &[&'static str]| [&["diff", "a/run.mcap", "b/run.mcap"], more].concat();
    let said = done(&folder, &diff(&[]));
    assert!(said.starts_with("identical, ") && said.contains("not compared: "), "{said}");
    assert!(said.contains("--all"), "{said}");
    let told = json(&slate(&folder, &[&["bag"], &diff(&["--json"])[..]].concat()));
    assert!(told["topics"].get("/r2/execute/reflexes").is_some(), "messages are compared too: {told}");
    let is_measured = |topic: &str| told["measured"].as_array().unwrap().iter().any(|own| own == topic);
    assert!(
        is_measured("/loop/state") && is_measured("/r2/planner/timing") && !is_measured("/r2/planner/state")
    );
    let all = slate(&folder, &[&["bag"], &diff(&["--all"])[..]].concat());
    assert_eq!(all.status.code(), Some(1), "{all:?}");
    let some = ["--all", "--select", "/r2/**", "/simulator/**", "--exclude", "/**/timing", "/**/histogram"];
    assert!(!done(&folder, &diff(&some)).contains("not compared"));
    fails(&folder, 2, &diff(&["--select", "/**/timing"]), &["nothing is left to compare", "--all"]);
    fails(&folder, 2, &diff(&["--select", "/r2/plannr/state"]), &["did you mean `/r2/planner/state`"]);
}

#[test]
fn an_extracted_configuration_and_world_give_the_same_run() {
    let folder = folder("bag-attachments");
    let world = include_str!("../../../../worlds/rocs_arena.toml");
    std::fs::create_dir(folder.join("worlds")).unwrap();
    std::fs::write(folder.join("worlds/mine.toml"), world).unwrap();
    let arguments = ["--seed", "2", "--set", "record.enabled=true", "--out", "here"];
    let mine = ["--set", "world.arena=worlds/mine.toml"];
    let (summary, _) = common::exp1(&folder, &[&arguments[..], &mine].concat());
    let listed = done(&folder, &["attachments", "here/run.mcap"]);
    assert!(listed.contains("configuration.toml  application/toml  "), "{listed}");
    assert!(listed.contains("worlds/mine.toml"), "{listed}");
    let out = ["attachments", "here/run.mcap", "--out", "taken"];
    let listed = done(&folder, &out);
    assert!(listed.contains("taken/configuration.toml") && listed.contains("taken/mine.toml"), "{listed}");
    fails(&folder, 2, &out, &["taken/configuration.toml", "exists already", "--force"]);
    // What the run was made of is gone.
    std::fs::remove_dir_all(folder.join("worlds")).unwrap();
    let again =
        slate(&folder, &["run", "taken/configuration.toml", "--headless", "--json", "--out", "again"]);
    assert_eq!(json(&again)["digest"], summary["digest"], "{again:?}");
}

#[test]
fn attachments_are_written_into_the_folder_and_nowhere_else() {
    let folder = folder("bag-hostile");
    let mut writer = Writer::new(Vec::new(), "test", &Header::default(), Compression::None).unwrap();
    for name in ["../../evil.toml", "/etc/evil.toml", "..", "evil.toml", "a\u{7}b"] {
        writer
            .attachment(&Attachment { name: name.into(), data: b"x".to_vec(), ..Attachment::default() })
            .unwrap();
    }
    write(&folder, "run.mcap", &writer.finish().unwrap());
    done(&folder, &["attachments", "run.mcap", "--out", "deep/files"]);
    let mut names: Vec<_> = std::fs::read_dir(folder.join("deep/files"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["ab", "attachment", "evil-1.toml", "evil-2.toml", "evil.toml"]);
    let listed = json(&slate(&folder, &["bag", "attachments", "run.mcap", "--json"]));
    assert_eq!(listed["attachments"].as_array().unwrap().len(), 5, "{listed}");
}

#[test]
fn numbers_are_drawn_over_time() {
    let folder = recorded("bag-plot");
    let said = done(&folder, &["plot", "run.mcap", "/r2/range/beams/1", "/r2/pose/x", "--out", "x.svg"]);
    assert_eq!(said, "x.svg shows 100 values\n");
    let image = std::fs::read_to_string(folder.join("x.svg")).unwrap();
    let document = roxmltree::Document::parse(&image).unwrap();
    let texts: Vec<_> = document.descendants().filter_map(|node| node.text()).map(str::trim).collect();
    for name in ["/r2/range/beams/1", "/r2/pose/x", "time [s]", "run.mcap"] {
        assert!(texts.contains(&name), "{name} is missing in {texts:?}");
    }
    let lines = document.descendants().filter(|node| node.has_tag_name("polyline"));
    assert!(lines.filter_map(|line| line.attribute("points")).any(|points| points.split(' ').count() >= 50));
}

#[test]
fn output_replaces_files_only_on_request_and_never_its_input() {
    let folder = recorded("bag-force");
    let whole = std::fs::read(folder.join("run.mcap")).unwrap();
    write(&folder, "old.mcap", b"old");
    write(&folder, "old.svg", b"old");
    std::fs::create_dir(folder.join("tables")).unwrap();
    write(&folder.join("tables"), "r2_pose.csv", b"old");
    let verbs: [(&[&str], &str); 6] = [
        (&["filter", "run.mcap"], "old.mcap"),
        (&["merge", "run.mcap", "run.mcap"], "old.mcap"),
        (&["import", "run.mcap"], "old.mcap"),
        (&["repair", "run.mcap"], "old.mcap"),
        (&["plot", "run.mcap", "/r2/pose/x"], "old.svg"),
        (&["export", "run.mcap", "--csv"], "tables"),
    ];
    for (verb, old) in verbs {
        let to = |out| [verb, &["--out", out]].concat();
        fails(&folder, 2, &to(old), &[old, "exists already", "`--force`"]);
        done(&folder, &[&to(old)[..], &["--force"]].concat());
        if verb[0] != "plot" {
            let itself = [&to("./run.mcap")[..], &["--force"]].concat();
            fails(&folder, 2, &itself, &["run.mcap", "it is an input"]);
        }
        assert_eq!(std::fs::read(folder.join("run.mcap")).unwrap(), whole, "{verb:?}");
    }
}

#[test]
fn errors_name_file_place_and_remedy() {
    let folder = recorded("bag-refusals");
    fails(&folder, 2, &["info", "nowhere.mcap"], &["nowhere.mcap` can't be read"]);
    fails(&folder, 2, &["cat", "run.mcap", "/r2/rnge"], &["run.mcap", "no topic `/r2/rnge`", "/r2/range"]);
    fails(&folder, 2, &["cat", "run.mcap", "--from=-1"], &["--from", "at least 0"]);
    fails(&folder, 2, &["cat", "run.mcap", "--from", "-5"], &["--from", "at least 0"]);
    fails(
        &folder,
        2,
        &["cat", "run.mcap", "--from", "5", "--to", "1"],
        &["run.mcap", "`--to` must not be before"],
    );
    fails(&folder, 2, &["cat", "run.mcap", "--from", "soon"], &["seconds after the first message"]);
    fails(&folder, 2, &["plot", "run.mcap", "/r2/pose/x", "--out", "x.png"], &["x.png", "`.svg`"]);
    fails(
        &folder,
        2,
        &["plot", "run.mcap", "/r2/range/rang"],
        &["no number `/r2/range/rang`", "/r2/range/range"],
    );
    fails(
        &folder,
        2,
        &["plot", "run.mcap", "/r2/range/beams"],
        &["no number `/r2/range/beams`", "/r2/range/beams/0"],
    );
    fails(&folder, 2, &["plot", "run.mcap", "/r2/pose/frame"], &["/r2/pose/frame", "/r2/pose/x"]);
    fails(
        &folder,
        2,
        &["plot", "run.mcap", "/r2/range/range", "--from", "1000"],
        &["`/r2/range/range` has no value in that time span"],
    );
    let to = ["filter", "run.mcap", "--out", "nowhere/x.mcap"];
    fails(&folder, 2, &to, &["nowhere/x.mcap` can't be written"]);
    fails(&folder, 2, &["filter", "run.mcap", "--topics", "/r9/**", "--out", "x.mcap"], &["/r9/**"]);
    fails(&folder, 2, &["export", "run.mcap", "--out", "x.csv"], &["--csv|--carmen|--ros"]);
    fails(&folder, 2, &["merge", "run.mcap", "--out", "x.mcap"], &["<FILES>"]);
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "something is left behind");
}

#[test]
fn padding_fields_are_shown_by_no_verb() {
    let folder = folder("bag-shown");
    common::exp1(&folder, &["--seed", "1", "--set", "record.enabled=true", "--out", "here"]);
    let scans = done(&folder, &["cat", "here/run.mcap", "/simulator/r2/sonar", "--to", "1"]);
    assert!(scans.contains("echoes = [{ range = ") && scans.contains(", heard = "), "{scans}");
    let export = ["export", "here/run.mcap", "/simulator/r2/sonar", "/r2/planner/state"];
    done(&folder, &[&export[..], &["--csv", "--out", "tables"]].concat());
    let table = std::fs::read_to_string(folder.join("tables/simulator_r2_sonar.csv")).unwrap();
    assert_eq!(
        table.lines().next().unwrap(),
        "time_s,sequence,field_of_view,range_min,range_max,placements,echoes"
    );
    done(&folder, &[&export[..], &["--ros", "--out", "ros.mcap"]].concat());
    let ros = done(&folder, &["cat", "ros.mcap", "/r2/planner/state"]);
    assert!(ros.contains("{ ticks = 1, panics = 0, condition = \"WORKING\", waiting_for = "), "{ros:.2000}");
    let definitions = String::from_utf8_lossy(&std::fs::read(folder.join("ros.mcap")).unwrap()).into_owned();
    for text in [&scans, &table, &ros, &definitions] {
        assert!(!text.contains("reserved") && !text.contains("memory"), "{text:.2000}");
    }
    // Slate itself still has every bit.
    assert!(slate(&folder, &["replay", "--verify", "here/run.mcap"]).status.success());
}

#[test]
fn the_commands_of_the_book_do_what_it_says() {
    let folder = folder("bag-book");
    let run = ["run", "exp1", "--headless", "--set", "record.enabled=true", "--out", "here"];
    assert!(slate(&folder, &run).status.success());
    let block = BOOK.split_once("```sh\n").unwrap().1.split_once("```").unwrap().0;
    let commands: Vec<_> = block.lines().map(|line| line.split('#').next().unwrap().trim()).collect();
    assert!(commands.len() >= 9, "{commands:?}");
    for command in commands {
        let words = command.strip_prefix("slate bag ").unwrap().split_whitespace();
        let words: Vec<_> = words.map(|word| word.trim_matches('\'')).collect();
        done(&folder, &words);
    }
}

#[test]
fn too_long_message_is_reported_and_not_read() {
    let folder = folder("bag-long");
    write(&folder, "long.mcap", &recording::with_a_long_message(33 << 20));
    let said = fails(&folder, 1, &["cat", "long.mcap"], &["33554432 are the most"]);
    assert!(said.len() < 10_000, "{}", said.len());
    let output = slate(&folder, &["bag", "cat", "long.mcap"]);
    let lines = text(&output.stdout);
    assert!(lines.contains("\"short\"") && lines.len() < 10_000, "what is short is shown: {}", lines.len());
}
