//! Pages about runs: what they tell of a recording, and that nothing that comes from a file is markup.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use roxmltree::{Document, ParsingOptions};
use slate_bag::{Channel, Compression, Header, Metadata, Schema, Writer};
use slate_interfaces::{Clearance, Pose2};
use slate_module::blackboard::interface::{Interface, View};
use slate_report::{page, page::Followed, page::Known};
use slate_ros_messages as ros;

const SECOND: u64 = 1_000_000_000;

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("page-{name}"));
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// A recording that is made by hand.
struct File(Writer<Vec<u8>>, BTreeMap<String, u16>);

impl File {
    fn new() -> Self {
        let header = Header { profile: "ros2".into(), library: "test".into() };
        Self(Writer::new(Vec::new(), "test", &header, Compression::None).unwrap(), BTreeMap::new())
    }

    fn message(&mut self, topic: &str, time: u64, schema: &str, text: &str, encoding: &str, data: &[u8]) {
        let next = self.1.len() as u16 + 1;
        let id = *self.1.entry(topic.into()).or_insert(next);
        if id == next {
            let (name, encoding) =
                (schema.into(), if encoding == "cdr" { "ros2msg" } else { "jsonschema" }.into());
            self.0.schema(&Schema { id, name, encoding, data: text.as_bytes().to_vec() }).unwrap();
        }
        let (message_encoding, metadata) = (encoding.into(), [].into());
        let topic = topic.into();
        self.0.channel(&Channel { id, schema_id: id, topic, message_encoding, metadata }).unwrap();
        self.0.message(id, 0, time, time, data).unwrap();
    }

    /// A value as recordings have it.
    fn value<T: Interface + Copy>(&mut self, topic: &str, time: u64, value: &T) {
        let definition = ros::definition(T::DESCRIPTOR);
        let mut data = Vec::new();
        ros::encode(T::DESCRIPTOR, View::of(&mut { *value }).bytes(), &mut data).unwrap();
        self.message(topic, time, &definition.name, &definition.text, "cdr", &data);
    }

    /// A value of any type.
    fn json(&mut self, topic: &str, time: u64, schema: &str, value: &str) {
        self.message(topic, time, schema, "", "json", value.as_bytes());
    }

    fn texts(&mut self, name: &str, texts: &[(&str, &str)]) {
        let metadata = texts.iter().map(|(key, text)| ((*key).into(), (*text).into())).collect();
        self.0.metadata(&Metadata { name: name.into(), metadata }).unwrap();
    }

    fn write(self, path: &Path) {
        std::fs::write(path, self.0.finish().unwrap()).unwrap();
    }
}

/// The elements of a page, and all its text.
fn read(page: &str) -> (BTreeMap<String, usize>, String) {
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    let document =
        Document::parse_with_options(page, options).unwrap_or_else(|error| panic!("{error}\n{page}"));
    let mut elements = BTreeMap::new();
    for node in document.descendants().filter(|node| node.is_element()) {
        *elements.entry(node.tag_name().name().to_owned()).or_default() += 1;
        for attribute in node.attributes() {
            assert!(!attribute.name().starts_with("on"), "{attribute:?} would be run");
            let leads_out = attribute.value().contains("://") && attribute.name() != "xmlns";
            let is_link = ["href", "src"].contains(&attribute.name());
            assert!(!(leads_out && is_link), "{attribute:?} needs something from elsewhere");
        }
    }
    let text = document
        .descendants()
        .filter(|node| node.is_text() && !node.parent().unwrap().has_tag_name("style"))
        .filter_map(|node| node.text())
        .map(str::trim);
    let text = text.filter(|text| !text.is_empty());
    (elements, text.collect::<Vec<_>>().join("|"))
}

fn written(path: &Path, known: &Known, out: &Path) -> (BTreeMap<String, usize>, String, Vec<String>) {
    let files = page::write(path, known, out).unwrap().files;
    let names = files.iter().map(|file| file.file_name().unwrap().to_str().unwrap().to_owned()).collect();
    let (elements, text) = read(&std::fs::read_to_string(&files[0]).unwrap());
    (elements, text, names)
}

const HOSTILE: &str = r#"</td><script>alert(1)</script><img src=x onerror='a()'>"&\u0007\u202e]]>"#;

#[test]
fn text_of_files_is_never_markup() {
    let folder = folder("hostile");
    let name = "</title><script>x</script>";
    let mut file = File::new();
    file.texts("run", &[("agent", name), ("seed", "<b>3")]);
    file.texts("dropped", &[(name, "7")]);
    for i in 0..3_u32 {
        let time = u64::from(i) * SECOND;
        let pose = Pose2 { x: i.into(), y: f64::NAN, theta: 0.0 };
        file.value(&format!("/{name}/truth"), time, &pose);
        file.value(&format!("/{name}/clearance"), time, &Clearance { distance: 1.5 });
        file.json(
            "/log",
            time,
            "rcl_interfaces/msg/Log",
            &format!(
                r#"{{"level":30,"name":"{}","msg":"{}"}}"#,
                HOSTILE.replace('"', "\\\""),
                HOSTILE.replace('"', "\\\"")
            ),
        );
        file.json("/a/params", time, name, &format!(r#"{{"{name}":{i}}}"#));
        file.json("/a/metrics", time, name, &format!(r#"{{"{name}":"{name}"}}"#));
    }
    file.write(&folder.join("<i>.mcap"));
    let known = Known {
        robots: vec![Followed {
            name: name.into(),
            pose: format!("/{name}/truth"),
            status: None,
            clearance: Some(format!("/{name}/clearance")),
        }],
        ..Known::default()
    };
    let (elements, text, _) = written(&folder.join("<i>.mcap"), &known, &folder.join("out"));
    for element in ["script", "b", "i"] {
        assert!(!elements.contains_key(element), "{element}: {elements:?}");
    }
    assert_eq!((elements.get("img"), elements.get("title")), (None, Some(&1)), "{elements:?}");
    for words in [
        name,
        "</td><script>alert(1)</script><img src=x onerror='a()'>\"&\u{fffd}\u{fffd}]]>",
        "From the recording <i>.mcap.",
        "seed <b>3",
    ] {
        assert!(text.contains(words), "{words:?} is missing in {text}");
    }
}

#[test]
fn a_page_shows_decisions_timing_faults_changes_and_gaps() {
    let folder = folder("story");
    let mut file = File::new();
    file.texts("run", &[("agent", "rover"), ("seed", "3"), ("clock", "lockstep")]);
    let status = |ticket: u32, reflexes: u32, route: u32, running: &str, ended: &str| {
        format!(
            r#"{{"ticket":{ticket},"reflexes":{reflexes},"route":{route},"running":"{running}","tree":"{running} > Turn","replan":false,"route_switches":{reflexes},"ended":[{ended}]}}"#
        )
    };
    // The names of numbers stand in definitions, which JSON has none of: those of CDR are tested with real runs.
    let path = "/r2/execute/status";
    for (time, value) in [
        (0, status(1, 0, 1, "GoTo", "")),
        (2, status(1, 1, 2, "Avoid", r#"{"number":1,"kind":"GoTo","ending":2}"#)),
        (3, status(1, 2, 2, "Avoid", r#"{"number":1,"kind":"GoTo","ending":2}"#)),
        (4, status(2, 2, 1, "GoTo", r#"{"number":2,"kind":"Avoid","ending":0}"#)),
    ] {
        file.json(path, time * SECOND, "slate_msgs/msg/ExecuteStatus", &value);
        file.value("/r2/truth", time * SECOND, &Pose2 { x: time as f64, y: 1.0, theta: 0.0 });
        file.value("/r2/clearance", time * SECOND, &Clearance { distance: 2.0 - time as f64 / 4.0 });
    }
    let state = |condition: u32, panics: u32| format!(r#"{{"condition":{condition},"panics":{panics}}}"#);
    file.json("/r2/eye/state", 4 * SECOND, "slate_msgs/msg/ModuleState", &state(5, 2));
    // One row for all that stop at once, and one that continues.
    for module in 1..=17 {
        file.json(&format!("/r3/m{module}/state"), 4 * SECOND, "slate_msgs/msg/ModuleState", &state(6, 0));
    }
    for (refused, time) in [(0, 0), (1, 10), (2, 11), (5, 12), (6, 30)] {
        let gate = format!(r#"{{"refused":{refused},"expired":0,"limited":0}}"#);
        for wheels in ["/r2/wheels", "/r3/wheels"] {
            file.json(&format!("{wheels}/gate"), time * SECOND / 10, "slate_msgs/msg/GateState", &gate);
        }
    }
    let histogram = r#"{"count":400,"p50":1500,"p90":2500,"p99":3500,"max":9500.0}"#;
    file.json("/r2/eye/histogram", 4 * SECOND, "slate_msgs/msg/TimingHistogram", histogram);
    file.json("/r2/eye/timing", 4 * SECOND, "slate_msgs/msg/ModuleTiming", r#"{"misses":6}"#);
    file.json("/loop/state", 4 * SECOND, "slate_msgs/msg/LoopState", r#"{"overruns":8}"#);
    for (time, speed) in [(0, 0.5), (3, 0.25)] {
        file.json("/r2/plan/params", time * SECOND, "x", &format!(r#"{{"speed":{speed}}}"#));
    }
    for (level, message) in [(20, "all is well"), (30, "it is dark"), (40, "it is broken")] {
        let line = format!(r#"{{"level":{level},"name":"r2/eye","msg":"{message}"}}"#);
        file.json("/log", 4 * SECOND, "rcl_interfaces/msg/Log", &line);
    }
    let change =
        r#"{"cycle":9,"setting":"modules.eye.params.gain","has_value":true,"value":"7","plugin":""}"#;
    file.json("/record/change", 4 * SECOND, "slate_msgs/msg/Change", change);
    for (action, has_value, value, plugin, library) in [
        ("stop", true, "by a person", "", ""),
        ("reset", false, "", "", ""),
        ("arm", false, "", "", ""),
        ("arm", true, "r2/wheels", "", ""),
        ("load", false, "", "lidar", "libeye.so"),
        ("unload", false, "", "lidar", ""),
        ("", false, "", "eye", "libnew.so"),
    ] {
        let change = format!(
            r#"{{"cycle":9,"setting":"","has_value":{has_value},"value":"{value}","plugin":"{plugin}","file":"{library}","action":"{action}"}}"#
        );
        file.json("/record/change", 4 * SECOND, "slate_msgs/msg/Change", &change);
    }
    file.json("/record/dropped", 4 * SECOND, "slate_msgs/msg/Dropped", r#"{"url":"/r2/image","values":11}"#);
    file.json(
        "/referee/verdict",
        4 * SECOND,
        "slate_msgs/msg/Verdict",
        r#"{"state":1,"reason":"goal reached"}"#,
    );
    file.json("/referee/metrics", 4 * SECOND, "x", r#"{"path_length":4.12345,"collisions":2}"#);
    let path = folder.join("run.mcap");
    file.write(&path);
    let (elements, text, names) = written(&path, &Known::default(), &folder.join("out"));
    for words in [
        "rover, seed 3: goal reached after 4.0 s",
        "referee: path length|4.123|",
        "referee: collisions|2|",
        "r2: reflexes|2|",
        "|2.000|3.000|2|r2|reflex|Avoid|2.000|",
        "|2.000|2.000|1|r2|action ended|GoTo: ending 2|",
        "|4.000|4.000|1|r2|action began|GoTo > Turn|1.250|",
        "/r2/eye|400|1.5|2.5|3.5|9.5|6|",
        "4.000|/r2/eye|is condition 5|",
        "4.000|/r2/eye|panics: 2 more, 2 in all|",
        "4.000|4.000|17 modules|/r3/m1, /r3/m2, /r3/m3, ",
        "1.000|1.200|/r2/wheels, /r3/wheels|commands refused: 5 more, 5 in all|",
        "3.000|3.000|/r2/wheels, /r3/wheels|commands refused: 1 more, 6 in all|",
        "4.000|/loop|cycles left out: 8 more, 8 in all|",
        "4.000|warn|r2/eye|it is dark|",
        "4.000|error|r2/eye|it is broken|",
        "3.000|/r2/plan/params/speed|0.5|0.25|",
        "4.000|from outside: modules.eye.params.gain|7|",
        "4.000|from outside: stop|by a person|",
        "4.000|from outside: reset|done|",
        "4.000|from outside: arm|all actuators|",
        "4.000|from outside: arm|r2/wheels|",
        "4.000|from outside: plugin lidar|loaded from libeye.so|",
        "4.000|from outside: plugin lidar|unloaded|",
        "4.000|from outside: plugin eye|reloaded from libnew.so|",
        "/r2/image|11|",
        "r2: to anything|1.000|4.000|1.375|",
    ] {
        assert!(text.contains(words), "`{words}` is missing in {text}");
    }
    assert!(!text.contains("all is well"), "{text}");
    assert_eq!(elements["svg"], 3, "{elements:?}");
    for name in [
        "report.html",
        "trajectory.svg",
        "timeline.svg",
        "distances.svg",
        "decisions.csv",
        "timing.csv",
        "faults.csv",
        "log.csv",
        "changes.csv",
        "dropped.csv",
        "topics.csv",
        "summary.csv",
        "distances.csv",
    ] {
        assert!(names.iter().any(|known| known == name), "{name} is missing in {names:?}");
    }
    let faults = std::fs::read_to_string(folder.join("out/faults.csv")).unwrap();
    assert_eq!(faults.lines().filter(|line| line.contains("/r3/m")).count(), 1, "{faults}");
    let table = std::fs::read_to_string(folder.join("out/timing.csv")).unwrap();
    assert!(table.starts_with("of_what,measured,p50_µs,p90_µs,p99_µs,max_µs,late\n"), "{table}");
    assert!(table.contains("\n/r2/eye,400,1.5,2.5,3.5,9.5,6\n"), "{table}");
}

#[test]
fn a_log_of_another_system_has_its_paths_and_lacks_its_gaps() {
    let folder = folder("carmen");
    let lines: String = (0..50).map(|i| format!("ODOM {i} 2 0 0 0 0 {i}.5 host 0\n")).collect();
    let path = folder.join("corridor.log");
    std::fs::write(&path, lines).unwrap();
    let (elements, text, names) = written(&path, &Known::default(), &folder.join("out"));
    assert!(text.contains("corridor.log: recorded for 49.0 s"), "{text}");
    assert_eq!((elements["svg"], elements["h2"]), (2, 3), "{text}");
    assert!(!text.contains("Timing") && text.contains("/odom|slate_msgs/msg/Odometry|50|"), "{text}");
    assert!(names.contains(&"trajectory.svg".to_owned()), "{names:?}");
}

#[test]
fn folder_without_run_is_refused_with_remedy() {
    let folder = folder("refused");
    let refused = |path: &Path, words: &str| {
        let out = folder.join("out");
        let error = page::write(path, &Known::default(), &out).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
        assert!(!out.exists());
    };
    refused(&folder.join("nowhere.mcap"), "nowhere.mcap` can't be read");
    let empty = folder.join("empty");
    std::fs::create_dir(&empty).unwrap();
    refused(&empty, "empty`: it has no `summary.json`, so no run has left it; name the folder of a run");
    std::fs::write(empty.join("summary.json"), "{}").unwrap();
    refused(&empty, "summary.json`: it is not a summary of a run: missing field");
    for name in ["a.mcap", "b.mcap"] {
        std::fs::write(empty.join(name), "").unwrap();
    }
    std::fs::remove_file(empty.join("summary.json")).unwrap();
    refused(&empty, "it has several recordings, such as `a.mcap` and `b.mcap`; name one");
    let team = folder.join("team");
    for agent in ["a", "b"] {
        std::fs::create_dir_all(team.join(agent)).unwrap();
        std::fs::write(team.join(agent).join("summary.json"), "{}").unwrap();
    }
    refused(&team, "each in a folder of its own: a, b; name one, such as ");
    std::fs::write(folder.join("letter"), "Dear reader,").unwrap();
    refused(&folder.join("letter"), "letter` is not an MCAP file");
}

#[test]
fn the_page_of_a_folder_is_that_of_its_run_and_names_others() {
    let folder = folder("several");
    let recording = |name: &str, agent: &str| {
        let mut file = File::new();
        file.texts("run", &[("agent", agent), ("seed", "3")]);
        file.value("/r2/truth", SECOND, &Pose2 { x: 1.0, y: 1.0, theta: 0.0 });
        file.write(&folder.join(name));
    };
    recording("flight-fault-1.mcap", "flight");
    recording("run-1.mcap", "earlier");
    recording("run.mcap", "rover");
    // As a run leaves it that was killed.
    let (_, text, _) = written(&folder, &Known::default(), &folder.join("cut"));
    assert!(text.contains("rover, seed 3") && text.contains("From the recording run.mcap."), "{text}");
    let mut summary = common::summary(3);
    let figures = [("collisions_caused", 0.0), ("minimum_clearance", 0.227)];
    summary.robots.insert("r3".into(), figures.map(|(name, value)| (name.to_owned(), value)).into());
    summary.units.insert("minimum_clearance".into(), "m".into());
    std::fs::write(folder.join("summary.json"), summary.json_line().unwrap()).unwrap();
    let (_, text, _) = written(&folder, &Known::default(), &folder.join("out"));
    assert!(text.contains("its recording run.mcap. It has others"), "{text}");
    assert!(text.contains("named: flight-fault-1.mcap, run-1.mcap."), "{text}");
    // Names longer than the column of the terminal stay whole.
    for words in ["r3: collisions caused|0|", "r3: minimum clearance|0.227 m|"] {
        assert!(text.contains(words), "`{words}` is missing in {text}");
    }
    // What triggers have saved is not the run, and no reason to tell nothing.
    std::fs::remove_file(folder.join("run.mcap")).unwrap();
    let (_, text, _) = written(&folder, &Known::default(), &folder.join("saved"));
    let words = "It has recordings, which are reported when they are named: flight-fault-1.mcap, run-1.mcap.";
    assert!(text.contains(words) && text.contains("r3: collisions caused|0|"), "{text}");
    let table = std::fs::read_to_string(folder.join("out/summary.csv")).unwrap();
    assert!(table.contains("\nr3: minimum clearance,0.227 m\n"), "{table}");
}
