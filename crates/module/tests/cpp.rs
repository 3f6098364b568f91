//! `slate.hpp` in both compilers: every kind of port, field and state, without warnings and under sanitizers.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::path::Path;
use std::process::Command;

/// Builds the program that uses everything, runs it, and returns what it prints.
fn run(compiler: &str, standard: &str, more: &[&str]) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("features-{compiler}"));
    let mut build = Command::new(compiler);
    build.args([standard, "-g", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]).args(more);
    build.args(["-isystem", "/usr/include/eigen3", "-I"]).arg(folder.join("include"));
    let built = build.arg(folder.join("tests/cpp/features.cpp")).arg("-o").arg(&program).output();
    let built = built.unwrap_or_else(|error| panic!("{compiler} is needed for this test: {error}"));
    assert!(built.status.success(), "{compiler} {standard}: {}", String::from_utf8_lossy(&built.stderr));
    let ran = Command::new(program).output().unwrap();
    let said = String::from_utf8_lossy(&ran.stdout).into_owned();
    assert!(ran.status.success(), "{said}{}", String::from_utf8_lossy(&ran.stderr));
    said
}

#[test]
fn cpp_modules_run_in_gcc() {
    let said = run("g++", "-std=c++17", &[]);
    let line = |key: &str| said.lines().find_map(|line| line.strip_prefix(key)).unwrap().to_owned();
    let outline: serde_json::Value = serde_json::from_str(&line("OUTLINE ")).unwrap();
    assert_eq!(outline["modules"][0]["doc"], "Uses \"every\" kind of port.");
    assert_eq!(outline["modules"][0]["ports"][7]["direction"], "Command");
    let description: serde_json::Value = serde_json::from_str(&line("DESCRIPTION ")).unwrap();
    assert_eq!(description["trigger"]["On"]["timeout"], 1_000_000_000_u64);
    assert_eq!(description["ports"][5]["capacity"], 4);
    // The agent computes the same layouts and hashes from the fields, or refuses the description.
    for port in description["ports"].as_array().unwrap() {
        let bytes = slate_module::encode(&port["interface"]).unwrap();
        let descriptor = slate_module::decode_interface(&bytes).unwrap();
        assert_eq!(Some(descriptor.hash), port["interface"]["hash"].as_u64(), "{port}");
    }
}

#[test]
fn cpp_modules_are_clean_under_clang_and_sanitizers() {
    run("clang++", "-std=c++20", &["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]);
}

#[test]
fn cpp_of_the_book_compiles() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let book = std::fs::read_to_string(folder.join("../../book/src/48-cpp.md")).unwrap();
    let block = |begin: &str| {
        let (_, rest) = book.split_once(begin).unwrap_or_else(|| panic!("{begin}"));
        rest.split_once("```\n").unwrap().0.to_owned()
    };
    let eigen = book.rsplit_once("```cpp\n").unwrap().1.split_once("```\n").unwrap().0;
    let source = block("```cpp\n") + eigen + &block("```cpp,continued\n");
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("book.cpp");
    std::fs::write(&file, source).unwrap();
    let program = file.with_extension("");
    let built = Command::new("g++")
        .args([
            "-std=c++17",
            "-Wall",
            "-Wextra",
            "-Wpedantic",
            "-Werror",
            "-isystem",
            "/usr/include/eigen3",
            "-I",
        ])
        .arg(folder.join("include"))
        .arg(&file)
        .arg("-o")
        .arg(&program)
        .output()
        .unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let ran = Command::new(program).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
}
