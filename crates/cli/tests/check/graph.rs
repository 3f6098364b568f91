//! Graph of a configuration that does not run, and its parts.

use serde_json::Value;

use super::common::Running;
use super::findings;

#[test]
fn what_is_there_and_no_file_is_not_said_to_be_missing() {
    let running = Running::new("check-folder");
    let folder = running.folder().join("robot");
    std::fs::create_dir(&folder).unwrap();
    running.fails(2, &["check", "robot"], &["`robot` is a folder"]);
    std::fs::write(folder.join("robot.toml"), "").unwrap();
    running.fails(2, &["check", "robot"], &["`robot` is a folder", "robot/robot.toml"]);
    running.fails(2, &["run", "/dev/null", "--headless"], &["`/dev/null` is a pipe or a device"]);
    running.fails(2, &["check", "nothing.toml"], &["no example or file is named `nothing.toml`"]);
}

#[test]
fn a_drawing_has_all_modules_and_links() {
    let mut running = Running::new("graph");
    let svg = running.done(&["graph", "exp3"]);
    let drawing = roxmltree::Document::parse(&svg).unwrap();
    let texts: Vec<_> = drawing.descendants().filter_map(|node| node.text()).collect();
    for name in ["simulator", "r2/planner", "r3/avoid_obstacle", "r2/wheels", "pursuit"] {
        assert!(texts.contains(&name), "{name}");
    }
    let edges = drawing.descendants().filter(|node| node.attribute("marker-end").is_some()).count();
    let graph: Value = serde_json::from_str(&running.done(&["graph", "exp3", "--format", "json"])).unwrap();
    // The links of the configuration, and what commands the two actuators.
    let counts = &findings(&running, 0, &["check", "exp3"])["counts"];
    let number = |what: &str| counts[what].as_u64().unwrap() as usize;
    assert!(number("links") > number("modules"), "{counts}");
    let expected = number("links") + number("actuators");
    assert_eq!((edges, graph["edges"].as_array().unwrap().len()), (expected, expected));
    let reflex = graph["edges"].as_array().unwrap().iter().find(|edge| edge["output"] == "reflex").unwrap();
    assert_eq!((&reflex["flow"], &reflex["input"]), (&"messages".into(), &"reflexes".into()), "{reflex}");

    // A drawing of nothing is one, too.
    let nothing = running.done(&["graph", "exp1", "--hide", "**"]);
    let drawing = roxmltree::Document::parse(&nothing).unwrap();
    let size = |side| drawing.root_element().attribute(side).and_then(|size| size.parse::<u32>().ok());
    assert!(size("width") > Some(0) && size("height") > Some(0), "{nothing}");

    assert!(running.done(&["graph", "exp1", "--format", "mermaid"]).starts_with("flowchart LR"));
    assert!(running.done(&["graph", "exp1", "--format", "dot"]).starts_with("digraph"));
    let hidden = running.done(&["graph", "exp3", "--format", "dot", "--hide", "r3/*", "--hide", "referee"]);
    assert!(
        hidden.contains("r2/planner") && !hidden.contains("r3/planner") && !hidden.contains("referee"),
        "{hidden}"
    );

    running.start("exp1", &["run", "exp1", "--headless", "--rate", "1"]);
    let live: Value = serde_json::from_str(&running.done(&["graph", "--format", "json"])).unwrap();
    let written: Value = serde_json::from_str(&running.done(&["graph", "exp1", "--format", "json"])).unwrap();
    assert_eq!(live["edges"].as_array().unwrap().len(), written["edges"].as_array().unwrap().len());
    assert!(live["nodes"].as_array().unwrap().iter().any(|node| node["note"] == "working"), "{live}");
    running.done(&["graph", "--out", "exp1.svg"]);
    // What is written is what the name says.
    running.done(&["graph", "exp1", "--out", "exp1.dot"]);
    assert!(std::fs::read_to_string(running.folder().join("exp1.dot")).unwrap().starts_with("digraph"));
    running.fails(2, &["graph", "exp1", "--out", "exp1.png"], &["exp1.png", ".svg"]);
    assert!(!running.folder().join("exp1.png").exists());
    // A drawing that can't be written leaves the one that is there.
    let output = running.on_full_disk(&["graph", "exp3", "--out", "exp1.dot"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(std::fs::read_to_string(running.folder().join("exp1.dot")).unwrap().contains("r2/planner"));
    assert!(!running.folder().join("exp1.dot.part").exists());
    let link = running.folder().join("link.dot");
    std::os::unix::fs::symlink("exp1.dot", &link).unwrap();
    running.done(&["graph", "exp3", "--out", "link.dot"]);
    assert!(link.is_symlink() && std::fs::read_to_string(&link).unwrap().contains("r3/planner"));
    let said = running.done(&["unlink", "r2/planner/goal"]);
    assert!(said.ends_with("-> none\n"), "{said}");
    assert!(running.folder().join("exp1.svg").is_file());
}
