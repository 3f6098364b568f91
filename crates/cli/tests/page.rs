//! `slate report`: the page of a run's folder and that of its recording.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::path::Path;

use common::{exp1, folder, json, slate, text};
use roxmltree::{Document, ParsingOptions};

/// The text of a page, and how many pictures it has.
fn read(page: &Path) -> (String, usize) {
    let page = std::fs::read_to_string(page).unwrap();
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    let document = Document::parse_with_options(&page, options).unwrap();
    let texts = document
        .descendants()
        .filter(|node| node.is_text() && !node.parent().unwrap().has_tag_name("style"))
        .filter_map(|node| node.text());
    let pictures = document.descendants().filter(|node| node.has_tag_name("figure")).count();
    (texts.map(str::trim).filter(|text| !text.is_empty()).collect::<Vec<_>>().join("|"), pictures)
}

/// The colors of the lines of a picture, and how many lines there are of each.
fn colors(picture: &Path) -> Vec<String> {
    let picture = std::fs::read_to_string(picture).unwrap();
    let document = Document::parse(&picture).unwrap();
    let lines = document.descendants().filter(|node| node.has_tag_name("polyline"));
    let mut colors: Vec<_> = lines.filter_map(|line| line.attribute("stroke")).map(String::from).collect();
    colors.sort();
    colors.dedup();
    colors
}

#[test]
fn the_page_of_a_recording_tells_what_that_of_its_run_tells() {
    let folder = folder("page");
    exp1(&folder, &["--seed", "1", "--out", "run", "--set", "record.enabled=true"]);
    let output = slate(&folder, &["report", "run/run.mcap", "--out", "recorded"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(text(&output.stdout).contains("recorded/report.html, with 9 pictures and tables"), "{output:?}");
    let files = json(&slate(&folder, &["report", "run", "--json"]));
    assert_eq!(files["files"][0], "run/report.html");
    std::fs::create_dir(folder.join("alone")).unwrap();
    for name in ["summary.json", "trajectory.csv", "trajectory.svg", "timeline.svg", "scene.svg"] {
        std::fs::copy(folder.join("run").join(name), folder.join("alone").join(name)).unwrap();
    }
    slate(&folder, &["report", "alone"]);
    let pages = ["recorded", "run", "alone"].map(|name| read(&folder.join(name).join("report.html")));
    for (name, (page, pictures)) in ["recorded", "run", "alone"].iter().zip(&pages) {
        for words in [
            "exp1, seed 1: goal reached after",
            "Decisions",
            "Distances",
            "reactive to deliberative",
            "r1 to r2: centers",
        ] {
            assert!(page.contains(words), "{name} lacks `{words}`");
        }
        assert_eq!(*pictures, 4, "{name}");
    }
    for page in [&pages[0].0, &pages[1].0] {
        for words in [
            "|r2|reflex|AvoidObstacle|",
            "|r2|action ended|GoToOrigin: dropped|",
            "|r2|action began|GoToOrigin > SetWheelSpeed|",
            "|r2|noticed|/r2/pass_position|",
            "|r2|noticed|/r2/pass_range: crowded true|",
            "/r2/execute|",
            "r2: to anything",
            "No module left its work",
            "/simulator/r2/truth|slate_msgs/msg/Pose2|",
        ] {
            assert!(page.contains(words), "`{words}` is missing");
        }
    }
    assert!(pages[2].0.contains("--set record.enabled=true"), "{}", pages[2].0);
    // The same picture, drawn from other samples.
    for name in ["trajectory.svg", "timeline.svg", "scene.svg"] {
        let [recorded, run] = ["recorded", "run"].map(|place| colors(&folder.join(place).join(name)));
        assert_eq!(recorded, run, "{name}");
    }
    let summary =
        json(&slate(&folder, &["run", "exp1", "--headless", "--json", "--seed", "1", "--out", "again"]));
    for (name, key) in [("r2: reflexes", "reflexes"), ("r2: route switches", "route_switches")] {
        assert!(pages[0].0.contains(&format!("{name}|{}|", summary[key])), "{name} is not as in {summary}");
    }
}

#[test]
fn a_report_elsewhere_has_all_pictures_of_its_page_beside_it() {
    let folder = folder("page-elsewhere");
    exp1(&folder, &["--seed", "1", "--out", "run", "--set", "record.enabled=true"]);
    let output = slate(&folder, &["report", "run", "--out", "elsewhere"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let (_, pictures) = read(&folder.join("elsewhere/report.html"));
    let files = std::fs::read_dir(folder.join("elsewhere")).unwrap();
    let names: Vec<_> = files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    let drawn: Vec<_> = names.iter().filter(|name| name.ends_with(".svg")).collect();
    assert_eq!((pictures, drawn.len()), (4, 4), "{names:?}");
    for name in ["trajectory.svg", "timeline.svg", "scene.svg"] {
        let [own, run] =
            ["elsewhere", "run"].map(|place| std::fs::read(folder.join(place).join(name)).unwrap());
        assert_eq!(own, run, "{name}");
    }
}

#[test]
fn folder_without_run_is_refused() {
    let folder = folder("page-refused");
    for (arguments, words) in [
        (&["report", "nowhere"][..], "nowhere` can't be read"),
        (&["report", "."][..], "it has no `summary.json`"),
    ] {
        let output = slate(&folder, arguments);
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        assert!(text(&output.stderr).contains(words), "{output:?}");
    }
}
