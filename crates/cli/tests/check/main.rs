//! Reports on a configuration that does not run.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

mod agents;
#[path = "../common/mod.rs"]
mod common;
mod errors;
mod graph;
mod links;
mod variants;
mod warnings;

use common::Running;
use serde_json::Value;

const EXP1: &str = include_str!("../../../../examples/exp1/exp1.toml");
/// The head of the links of EXP1's robot.
const LINKS: &str = "[robots.r2.links]\n";

/// EXP1 with further links of its robot.
fn with_links(lines: &str) -> String {
    assert_eq!(EXP1.matches(LINKS).count(), 1);
    EXP1.replacen(LINKS, &format!("{LINKS}{lines}\n"), 1)
}

fn findings(running: &Running, code: i32, arguments: &[&str]) -> Value {
    let output = running.call(&[arguments, &["--json"]].concat());
    assert_eq!(output.status.code(), Some(code), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap()
}
