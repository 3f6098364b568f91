//! Modules in processes of their own, and what a fault there leaves untouched. With `--long`, what takes minutes too; with
//! `--figures`, what it costs; a name runs the tests whose names contain it.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    unsafe_code,
    reason = "a test that fails panics, wall-clock time is what some are about, and others break the rules on purpose"
)]

#[path = "../common/mod.rs"]
mod common;
mod faults;
mod figures;
mod host;
mod library;
mod modules;
mod same;
mod snapshot;
mod supervision;

use std::panic::catch_unwind;
use std::process::ExitCode;

/// A test: its name, and what it does.
type Test = (&'static str, fn());

fn main() -> ExitCode {
    // Looking up the names of a backtrace takes longer than a step may.
    // SAFETY: there is no other thread yet.
    unsafe { std::env::set_var("RUST_BACKTRACE", "0") };
    slate_runtime::isolation::enter(&modules::plugins());
    host::enter();
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.iter().any(|argument| argument == "--figures") {
        figures::print();
        return ExitCode::SUCCESS;
    }
    let long = arguments.iter().any(|argument| argument == "--long");
    let filter = arguments.iter().find(|argument| !argument.starts_with('-'));
    let groups: [&[Test]; 6] =
        [&same::TESTS, &snapshot::TESTS, &faults::TESTS, &supervision::TESTS, &library::TESTS, &host::TESTS];
    let long_ones = supervision::LONG_TESTS.iter().filter(|_| long);
    let tests = groups.into_iter().flatten().chain(long_ones);
    let mut failed = Vec::new();
    for (name, test) in tests.filter(|(name, _)| filter.is_none_or(|filter| name.contains(filter.as_str()))) {
        let passed = catch_unwind(test).is_ok();
        println!("test {name} ... {}", if passed { "ok" } else { "FAILED" });
        if !passed {
            failed.push(name);
        }
    }
    if failed.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
