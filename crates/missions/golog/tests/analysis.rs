//! Findings of checks.

use slate_golog::*;

use crate::common::theory;

#[test]
fn a_check_names_what_is_unknown_or_unused() {
    let text = "fluent idle = true\nfluent door\nfluent set = false\ndefine both = idle and set\n\
        action go performs Go(1.5)\naction rest set becomes true\nprocedure main { go; test door }\n\
        procedure help { nap }\nprocedure nap { nil }\n";
    let findings = check_theory(&theory(text), Some(&|name| name == "rest"));
    let lines: Vec<String> = findings
        .iter()
        .map(|finding| format!("{} {}: {}", finding.line, finding.kind.name(), finding.text))
        .collect();
    let expected = [
        "5 unknown action: the robot's action `Go` is unknown",
        "8 unreachable procedure: nothing calls `help`",
        "9 unreachable procedure: nothing calls `nap`",
        "6 unused action: no program performs `rest`",
        "4 unused fluent: nothing reads `both`",
        "2 unset fluent: `door` has no initial value, and no action sets it",
    ];
    assert_eq!(lines, expected);
    assert!(findings[0].kind.is_error() && !findings[1].kind.is_error());
}

#[test]
fn the_outline_has_each_part_of_a_program() {
    let text = "action go action stop procedure main { while true { go | stop }; stop }";
    let rows = outline(&theory(text));
    let texts: Vec<(usize, &str)> = rows.iter().map(|row| (row.level, row.text.as_str())).collect();
    let expected =
        [(0, "procedure main"), (1, "while true"), (2, "one of |"), (3, "go"), (3, "stop"), (1, "stop")];
    assert_eq!(texts, expected);
}
