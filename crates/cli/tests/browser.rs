//! Runs as a person sees them in a browser: the console's page, in Chromium.
#![cfg(feature = "console")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::fs::Permissions;
use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

use common::{Running, wait_for};
use serde_json::Value;
use slate_test_tools::{node_packages, run};

/// A browser wants a machine that draws and answers at once; those that look at little can share it.
static TURN: RwLock<()> = RwLock::new(());

/// One browser at a time.
fn turn() -> RwLockWriteGuard<'static, ()> {
    TURN.write().unwrap_or_else(PoisonError::into_inner)
}

/// One of some.
fn shared_turn() -> RwLockReadGuard<'static, ()> {
    TURN.read().unwrap_or_else(PoisonError::into_inner)
}

/// What drives a browser, and what finds out whether everybody can use a page.
const PACKAGES: [&str; 2] = ["playwright-core@1.65.1", "axe-core@4.14.1"];

/// A folder that has the packages.
fn packages() -> PathBuf {
    node_packages(&Path::new(env!("CARGO_TARGET_TMPDIR")).join("browser-node"), &PACKAGES)
}

fn chromium() -> PathBuf {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<_> = std::env::split_paths(&path).collect();
    let mut files = ["chromium", "chromium-browser", "google-chrome"]
        .iter()
        .flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    files
        .find(|file| file.is_file())
        .unwrap_or_else(|| panic!("this test needs Chromium: apt-get install chromium"))
}

/// Run that lasts as long as the test.
const ENDLESS: [&str; 4] = [
    "--set",
    "modules.referee.params.time_limit=600.0",
    "--set",
    "modules.referee.params.goal_tolerance=1e-9",
];

/// A run, and the link that it prints.
fn open(running: &mut Running, agent: &str, example: &str, arguments: &[&str]) -> String {
    open_at("realtime", running, agent, example, arguments)
}

/// The same, at another rate of its time.
fn open_at(rate: &str, running: &mut Running, agent: &str, example: &str, arguments: &[&str]) -> String {
    // A panel that the project has beside its configuration.
    let panels = running.folder().join("console/panels");
    std::fs::create_dir_all(&panels).unwrap();
    std::fs::write(panels.join("clearance.js"), include_str!("browser/clearance.js")).unwrap();
    let first = ["run", example, "--headless", "--rate", rate, "--set", "console.port=0"];
    running.start(agent, &[&first, arguments].concat());
    link(running)
}

/// The link that was printed.
fn link(running: &Running) -> String {
    let content = printed(running);
    format!(
        "{}/#token={}",
        content["address"].as_str().unwrap(),
        content["tokens"]["developer"].as_str().unwrap()
    )
}

/// Address and tokens of the console.
fn printed(running: &Running) -> Value {
    let find = || {
        let files = std::fs::read_dir(running.sockets().join("slate")).unwrap();
        let mut files = files.map(|entry| entry.unwrap().path());
        files.find(|path| path.extension().is_some_and(|extension| extension == "console"))
    };
    // It is there a moment after the socket.
    wait_for("the link", || find().is_some());
    let file = find().unwrap();
    serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap()
}

/// Goes there with a browser.
fn visit(script: &str, link: &str, agent: &str) {
    run(&mut browser(script, link, agent), "the page does not do what it shall");
}

/// What goes there with a browser.
fn browser(script: &str, link: &str, agent: &str) -> Command {
    let pictures = Path::new(env!("CARGO_TARGET_TMPDIR")).join("browser-pictures");
    std::fs::create_dir_all(&pictures).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser").join(script);
    let mut command = Command::new("node");
    command.arg(script).arg(link).args([&pictures, &chromium()]).arg(agent);
    command.env("NODE_PATH", packages().join("node_modules"));
    command
}

#[test]
fn link_of_exp1_shows_the_robot_and_every_function() {
    let _turn = turn();
    let mut running = Running::new("browser-exp1");
    let link = open(&mut running, "exp1", "exp1", &ENDLESS);
    visit("exp1.cjs", &link, "exp1");
    assert!(running.folder().join("console/layouts/times-and-clearance.json").is_file());
    // That the browser is gone changes nothing.
    assert!(running.done(&["get", "/referee/verdict/state"]).contains("RUNNING"));
}

#[test]
fn exp3_shows_all_its_robots() {
    let _turn = shared_turn();
    let mut running = Running::new("browser-exp3");
    let link = open(&mut running, "exp3", "exp3", &[]);
    visit("exp3.cjs", &link, "exp3");
}

#[test]
fn run_stays_while_a_browser_shows_it_and_says_that_it_is_over() {
    let _turn = shared_turn();
    let mut running = Running::new("browser-over");
    let link = open(&mut running, "exp1", "exp1", &ENDLESS);
    visit("over.cjs", &link, "exp1");
    let output = running.finish();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(stderr.contains("the run is over; the agent stays"), "{stderr}");
}

/// Where an example that is configuration alone lies.
fn example(file: &str) -> String {
    format!("{}/../../examples/{file}", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn the_map_shows_a_robots_belief_and_a_person_corrects_it() {
    let _turn = turn();
    let mut running = Running::new("browser-mapping");
    let link = open(&mut running, "mapping", &example("mapping/mapping.toml"), &[]);
    visit("mapping.cjs", &link, "mapping");
}

#[test]
fn a_robot_that_navigates_is_on_the_map_and_sent_from_there() {
    let _turn = turn();
    let mut running = Running::new("browser-navigation");
    let zone = "robots.r2.modules.global_costmap.params.keep_out_zones=\
                [{min_x=4.3,min_y=9.2,max_x=5.6,max_y=10.6}]";
    let link = open(&mut running, "office", &example("office/office.toml"), &["--set", zone]);
    visit("navigation.cjs", &link, "office");
}

#[test]
fn mission_is_seen_stepped_and_forced_by_a_developer() {
    let _turn = turn();
    let mut running = Running::new("browser-mission");
    let set = ["--set", "modules.referee.params.time_limit=600.0"];
    let link = open(&mut running, "patrol", &example("patrol/patrol.toml"), &set);
    let tokens = &printed(&running)["tokens"];
    let token = |role: &str| tokens[role].as_str().unwrap().to_owned();
    let mut browser = browser("mission.cjs", &link, "patrol");
    browser.env("VIEWER", token("viewer")).env("OPERATOR", token("operator"));
    run(&mut browser, "the page does not do what it shall");
}

#[test]
fn looking_back_shows_the_grid_map_of_then_or_says_current() {
    let _turn = turn();
    for (kept, largest) in [("false", "64KiB"), ("true", "128KiB")] {
        let mut running = Running::new(&format!("browser-of-now-{kept}"));
        let set = format!("record.flight.largest={largest:?}");
        let link = open(&mut running, "mapping", &example("mapping/mapping.toml"), &["--set", &set]);
        run(browser("of-now.cjs", &link, "mapping").env("KEPT", kept), "the page does not do what it shall");
    }
}

#[test]
fn a_save_is_previewed_and_keeps_the_comments_of_the_file() {
    let _turn = shared_turn();
    let mut running = Running::new("browser-save");
    let text = format!(
        "# R2 where the floor is wet.\ninclude = [{:?}]\n\n[agent]\nname = \"wet\"\n\n[robots.r2.modules.planner.params]\n\
         # Not faster.\nmax_linear_velocity = 0.3 # m/s\n",
        example("exp1/exp1.toml")
    );
    let file = running.folder().join("robot.toml");
    std::fs::write(&file, &text).unwrap();
    let link = open(&mut running, "wet", "robot.toml", &ENDLESS);
    visit("parameters.cjs", &link, "wet");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), text.replace("0.3", "0.2"));
}

#[test]
fn images_are_shown_with_what_was_found_in_them() {
    let _turn = turn();
    let mut running = Running::new("browser-camera");
    let link = open(&mut running, "camera", &example("camera/camera.toml"), &[]);
    visit("camera.cjs", &link, "camera");
}

#[test]
fn looking_back_shows_the_past_while_the_robot_continues() {
    let _turn = turn();
    let mut running = Running::new("browser-past");
    let link = open(
        &mut running,
        "exp1",
        "exp1",
        &[&ENDLESS[..], &["--set", "record.flight.keep=\"60s\""]].concat(),
    );
    visit("record.cjs", &link, "exp1");
}

#[test]
fn an_open_page_follows_the_next_run_of_its_token() {
    let _turn = shared_turn();
    let mut running = Running::new("browser-restart");
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let (port, token) = (format!("console.port={port}"), running.folder().join("token"));
    std::fs::write(&token, "0123456789abcdef0123456789abcdef").unwrap();
    std::fs::set_permissions(&token, Permissions::from_mode(0o600)).unwrap();
    let tokens = format!("console.tokens={{developer={token:?}}}");
    let kept = [&ENDLESS[..], &["--set", &port, "--set", &tokens]].concat();
    // Its time is soon one that the next run does not have for long.
    let link = open_at("5", &mut running, "exp1", "exp1", &kept);
    let mut page = browser("restart.cjs", &link, "exp1").stdout(Stdio::piped()).spawn().unwrap();
    for line in BufReader::new(page.stdout.take().unwrap()).lines() {
        match line.unwrap().as_str() {
            "freeze" => running.signal("STOP"),
            "thaw" => running.signal("CONT"),
            "kill" => running.kill(),
            "again" => drop(open(&mut running, "exp1", "exp1", &kept)),
            "other" => drop(open(&mut running, "exp1", "exp1", &[&ENDLESS[..], &["--set", &port]].concat())),
            other => panic!("the page's test says {other}"),
        }
    }
    assert!(page.wait().unwrap().success(), "the page does not do what it shall");
}

#[test]
fn a_recording_that_is_played_is_gone_through() {
    let _turn = shared_turn();
    let mut running = Running::new("browser-replay");
    running.done(&["run", "exp1", "--headless", "--set", "record.enabled=true", "--out", "here"]);
    running.start("exp1", &["replay", "here/run.mcap", "--pause"]);
    visit("replay.cjs", &link(&running), "exp1");
}

#[test]
fn exported_page_plays_a_recording_without_an_agent() {
    let _turn = shared_turn();
    let running = Running::new("browser-exported");
    running.done(&["run", "exp1", "--headless", "--set", "record.enabled=true", "--out", "here"]);
    let exported = running.done(&["console", "here", "--export", "page"]);
    assert!(exported.contains("page/index.html has "), "{exported}");
    let page = running.folder().join("page/index.html");
    assert!(std::fs::metadata(&page).unwrap().len() < 8 << 20, "the page is too large for a bug report");
    visit("exported.cjs", &format!("file://{}", page.display()), "exp1");
}

#[test]
fn exported_page_of_an_agent_has_its_modules() {
    let _turn = shared_turn();
    let mut running = Running::new("browser-exported-agent");
    open_at("5", &mut running, "exp1", "exp1", &ENDLESS);
    std::thread::sleep(std::time::Duration::from_secs(2));
    let exported = running.done(&["console", "--export", "page"]);
    assert!(exported.contains("page/index.html has "), "{exported}");
    let page = running.folder().join("page/index.html");
    visit("exported_agent.cjs", &format!("file://{}", page.display()), "exp1");
}
