//! The live display where stdout is not a terminal.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common::{folder, slate, text};

#[test]
fn run_without_a_terminal_prints_plain_lines() {
    let folder = folder("display");
    let output = slate(&folder, &["run", "exp1", "--rate", "10", "--set", "console.enabled=false"]);
    assert!(output.status.success(), "{output:?}");
    let stdout = text(&output.stdout);
    assert!(stdout.starts_with("exp1, seed 0\n") && !stdout.contains('\x1b'), "{stdout}");
    let robots: Vec<_> = stdout.lines().filter(|line| line.contains(" s  r2  goal ")).collect();
    assert!(!robots.is_empty(), "{stdout}");
    assert!(robots.iter().all(|line| line.contains(" m/s  ") && line.contains("  clear ")), "{stdout}");
    for event in ["r2 reactive: ", "r2 deliberative: ", "mission succeeded: goal reached"] {
        assert!(stdout.lines().any(|line| line.contains(&format!(" s  {event}"))), "{event}: {stdout}");
    }
}
