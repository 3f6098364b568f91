//! Instruction counts of hot paths under Valgrind.
//! Fails when a path takes more than a tenth more than `expected.txt` has. Unlike times, counts do not depend on the
//! load of the machine.
//!
//! `cargo run --release --bin slate-instructions [-- --write]`
#![allow(clippy::disallowed_methods, reason = "nothing here is deterministic")]

mod controller;
mod folder;
mod monitors;
mod paths;

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use std::process::{Command, ExitCode};

use folder::ProcessFolder;

/// Allowed ratio of a path's instructions to the expected ones.
const TOLERANCE: f64 = 1.1;

const EXPECTED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/expected.txt");

const USAGE: &str = "usage: slate-instructions [--write]\n  --write  writes what was counted to bench/instructions/expected.txt";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let result = match words[..] {
        // What runs under Valgrind.
        ["@path", name, count] => paths::run(name, count.parse().unwrap_or(0)),
        [] => compare(),
        ["--write"] => write(),
        _ => Err(USAGE.into()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Counts all paths, and compares them with what is written down.
fn compare() -> Result<(), String> {
    let text = std::fs::read_to_string(EXPECTED).map_err(|error| format!("{EXPECTED}: {error}"))?;
    println!("{:<32}{:>12}{:>12}{:>9}", "instructions", "now", "expected", "");
    let (mut more, mut ticks) = (Vec::new(), BTreeMap::new());
    for (name, few, many) in paths::ALL {
        let expected = expected(&text, name)?;
        let counted = count(name, few, many)?;
        let ratio = counted / expected;
        println!("{name:<32}{counted:>12.1}{expected:>12.1}{:>+8.1}%", (ratio - 1.0) * 100.0);
        if ratio > TOLERANCE {
            more.push(name);
        }
        ticks.insert(name, counted);
    }
    let (rust, cpp) = (ticks[paths::TICK_IN_RUST], ticks[paths::TICK_IN_CPP]);
    if cpp > TOLERANCE * rust {
        return Err(format!(
            "a tick in C++ takes {cpp:.1} instructions, more than a tenth above Rust's {rust:.1}"
        ));
    }
    if more.is_empty() {
        return Ok(());
    }
    Err(format!(
        "{} takes more than a tenth more instructions than in bench/instructions/expected.txt; find out why, and if it is \
         worth it, write the new counts with `--write`",
        more.join(", ")
    ))
}

/// The count of a path, from lines of a number and a name.
fn expected(text: &str, name: &str) -> Result<f64, String> {
    let mut lines = text.lines().filter_map(|line| line.trim().split_once(' '));
    let found = lines.find_map(|(number, known)| (known.trim() == name).then(|| number.parse()));
    match found {
        Some(Ok(number)) => Ok(number),
        Some(Err(_)) => Err(format!("{EXPECTED}: what stands before `{name}` is not a number")),
        None => Err(format!("{EXPECTED}: there is no line `COUNT {name}`; `--write` adds it")),
    }
}

/// Writes down what is counted now.
fn write() -> Result<(), String> {
    let mut text = String::from(
        "# Instructions of one operation, counted by Valgrind; written by `slate-instructions --write`.\n",
    );
    for (name, few, many) in paths::ALL {
        let _ = writeln!(text, "{:.1} {name}", count(name, few, many)?);
    }
    print!("{text}");
    std::fs::write(EXPECTED, text).map_err(|error| format!("{EXPECTED}: {error}"))
}

/// Returns the instructions of one operation.
/// The difference of two runs leaves out beginning and end.
fn count(name: &str, few: u32, many: u32) -> Result<f64, String> {
    let difference = total(name, many)?.saturating_sub(total(name, few)?);
    Ok(difference as f64 / f64::from(many - few))
}

/// Instructions of the main thread of a run.
fn total(name: &str, operations: u32) -> Result<u64, String> {
    let folder = ProcessFolder::new().map_err(|error| format!("a folder for what is counted: {error}"))?;
    let program = std::env::current_exe().map_err(|error| error.to_string())?;
    let file = folder.path().join("count");
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--separate-threads=yes"])
        .arg(format!("--callgrind-out-file={}", file.display()))
        .arg(program)
        .args(["@path", name, &operations.to_string()])
        .output()
        .map_err(|error| {
            format!("`valgrind` does not start ({error}): install it, as with `apt-get install valgrind`")
        })?;
    if !output.status.success() {
        return Err(format!("`{name}` under Valgrind: {}", String::from_utf8_lossy(&output.stderr)));
    }
    // The first thread's.
    summed(&folder.path().join("count-01"))
}

/// Reads the total at the end of callgrind's file.
fn summed(file: &Path) -> Result<u64, String> {
    let text = std::fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
    let total =
        text.lines().find_map(|line| line.strip_prefix("totals: ").or(line.strip_prefix("summary: ")));
    let total = total.and_then(|total| total.trim().parse().ok());
    total.ok_or_else(|| format!("{}: callgrind wrote no total", file.display()))
}

#[cfg(test)]
mod tests {
    use super::expected;

    #[test]
    fn the_count_of_a_path_stands_before_its_name() {
        let text = "# a comment\n81.5 write a value\n";
        assert_eq!(expected(text, "write a value"), Ok(81.5));
        assert!(expected(text, "read a value").is_err_and(|error| error.contains("read a value")));
    }

    #[test]
    fn nan_is_refused() {
        assert!(expected("many write a value", "write a value").is_err());
    }
}
