//! `slate bag` and `slate report` with logs of other systems, and the commands of the book.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::path::Path;

use common::{folder, json, slate, text};

const LOGS: &str = include_str!("../../../book/src/26-logs-of-others.md");
const REPORTS: &str = include_str!("../../../book/src/25-reports.md");

/// The beginning of a log as RoCS's authors publish them.
const ROCS: &str = "X, Y, T, Action\n0.60, 0.80, 0.0, GoAhead\n0.61, 0.80, 0.0, GoAhead\n\
                    0.61, 0.81, 0.1, ReactionWall\n";

/// A log of CARMEN with sweeps and odometry.
fn corridor() -> String {
    let lines = (0..20).map(|i| {
        let (time, x) = (format!("{}.{:03}", 10 + i / 10, i % 10 * 100), f64::from(i) / 8.0);
        format!("ODOM {x} 0.5 0 0.25 0 0 {time} robot 0\nFLASER 3 1.5 {x} 2.5 {x} 0.5 0 {x} 0.5 0 {time} robot 0\n")
    });
    format!("# CARMEN Logfile\n{}", lines.collect::<String>())
}

/// What a command prints that ends well.
fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = slate(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {output:?}");
    text(&output.stdout)
}

/// The commands of a page, without their comments.
fn commands(page: &str) -> Vec<Vec<&str>> {
    let block = page.split_once("```sh\n").unwrap().1.split_once("```").unwrap().0;
    let lines = block.lines().map(|line| line.split('#').next().unwrap().trim());
    lines.map(|line| line.strip_prefix("slate ").unwrap().split_whitespace().collect()).collect()
}

#[test]
fn the_commands_of_the_book_do_what_it_says() {
    let folder = folder("logs-book");
    std::fs::write(folder.join("corridor.log"), corridor()).unwrap();
    std::fs::write(folder.join("pos_and_actions_p3dx.txt"), ROCS).unwrap();
    for page in [LOGS, REPORTS] {
        let commands = commands(page);
        assert!(commands.len() >= 4, "{commands:?}");
        for command in commands {
            done(&folder, &command);
        }
    }
    // A log that is read and written again says the same.
    let said = |name: &str| {
        let text = std::fs::read_to_string(folder.join(name)).unwrap();
        let lines = text.lines().filter(|line| !line.starts_with('#'));
        // But for the time at which it was logged, and digits of times that say nothing.
        lines.map(|line| line.rsplit_once(' ').unwrap().0.replace("000 robot", " robot")).collect::<Vec<_>>()
    };
    let original: Vec<_> =
        said("corridor.log").iter().map(|line| line.replace("000 robot", " robot")).collect();
    assert_eq!(said("again.log").len(), original.len());
    for (again, original) in said("again.log").iter().zip(&original) {
        let words = |line: &str| {
            let words = line.split(' ').filter_map(|word| word.parse::<f64>().ok());
            words.map(f64::to_bits).collect::<Vec<_>>()
        };
        assert_eq!(words(again), words(original));
    }
    for file in [
        "corridor-report/report.html",
        "here/run-report/report.html",
        "here/report.html",
        "here/beside.svg",
        "elsewhere/report.html",
    ] {
        assert!(folder.join(file).is_file(), "{file}");
    }
}

#[test]
fn a_wrong_log_line_is_named_with_a_way_to_go_on() {
    let folder = folder("logs-wrong");
    std::fs::write(folder.join("a.log"), format!("{}ODOM 1 2 x\nNEFF 3\n", corridor())).unwrap();
    let imported = slate(&folder, &["bag", "import", "a.log", "--out", "a.mcap"]);
    assert_eq!(imported.status.code(), Some(2));
    let said = text(&imported.stderr);
    for words in [
        "`a.log`, line 42: `x` should be the pose, a number",
        "`slate bag import a.log --lenient --out FILE.mcap`",
    ] {
        assert!(said.contains(words), "{said}");
    }
    assert!(!folder.join("a.mcap").exists());
    let said = done(&folder, &["bag", "import", "a.log", "--lenient", "--out", "a.mcap"]);
    for words in [
        "a.mcap has 100 messages of a log of format carmen",
        "left out because it is wrong: 1 part",
        "line 42",
        "not read: 1 of NEFF",
    ] {
        assert!(said.contains(words), "{said}");
    }
    done(&folder, &["bag", "verify", "a.mcap"]);
    let told = json(&slate(
        &folder,
        &["bag", "import", "a.log", "--lenient", "--out", "a.mcap", "--force", "--json"],
    ));
    assert_eq!(
        (&told["format"], &told["wrong"], &told["unread"]["NEFF"]),
        (&"carmen".into(), &1.into(), &1.into())
    );
    let wrong = slate(&folder, &["bag", "import", "a.log", "--format", "excel", "--out", "b.mcap"]);
    assert!(
        text(&wrong.stderr).contains("known: mcap, carmen, openrdk, bblogger, rosbag1, rosbag2"),
        "{wrong:?}"
    );
    let other = slate(&folder, &["bag", "import", "a.log", "--format", "rosbag1", "--out", "b.mcap"]);
    assert!(text(&other.stderr).contains("does not begin with `#ROSBAG V2.0`"), "{other:?}");
    std::fs::write(folder.join("cut.bag"), b"#ROSBAG V2.0\n\x45\0\0").unwrap();
    let cut = slate(&folder, &["bag", "info", "cut.bag"]);
    assert!(text(&cut.stderr).contains("`slate bag import cut.bag --lenient"), "{cut:?}");
    let verified = slate(&folder, &["bag", "verify", "a.log"]);
    assert_eq!(verified.status.code(), Some(2), "{verified:?}");
    assert!(text(&verified.stderr).contains("`slate bag import` converts logs"), "{verified:?}");
}

#[test]
fn a_recording_of_slate_becomes_a_log_of_carmen() {
    let folder = folder("logs-export");
    let (run, _) = common::exp1(&folder, &["--seed", "1", "--out", "here", "--set", "record.enabled=true"]);
    let both = slate(&folder, &["bag", "export", "here/run.mcap", "--carmen", "--out", "a.log"]);
    let said = text(&both.stderr);
    assert!(
        said.contains("it has odometry at `/simulator/r1/odometry` and at `/simulator/r2/odometry`"),
        "{said}"
    );
    let said = done(
        &folder,
        &["bag", "export", "here/run.mcap", "/simulator/r2/odometry", "--carmen", "--out", "a.log"],
    );
    // A line for each cycle of the run.
    let lines = run["ticks"].as_u64().unwrap();
    assert!(lines > 0 && said.contains(&format!("0 sweeps, {lines} lines of odometry")), "{said}");
    let said = done(&folder, &["bag", "info", "a.log"]);
    let odometry = said.lines().find(|line| line.trim_start().starts_with("/odom ")).unwrap();
    let words: Vec<_> = odometry.split_whitespace().collect();
    assert!(words.windows(3).any(|words| words == [&*lines.to_string(), "50.00", "Hz"]), "{said}");
    let neither = slate(&folder, &["bag", "export", "here/run.mcap", "--out", "a.log"]);
    assert_eq!(neither.status.code(), Some(2), "{neither:?}");
}
