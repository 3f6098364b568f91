//! Compiles a module in C++, whose tick is compared with that of Rust.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a build that fails panics"
)]

use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=src/controller.cpp");
    println!("cargo::rerun-if-changed=../../crates/module/include");
    let folder = std::env::var("OUT_DIR").expect("Cargo sets it");
    let object = Path::new(&folder).join("controller.o");
    let compiled = Command::new("c++")
        .args(["-std=c++17", "-O2", "-fPIC", "-Wall", "-Wextra", "-Wpedantic", "-Werror"])
        .args(["-I", "../../crates/module/include", "-c", "src/controller.cpp", "-o"])
        .arg(&object)
        .status();
    let compiled = compiled.unwrap_or_else(|error| panic!("`c++` does not start ({error}): install g++"));
    assert!(compiled.success(), "src/controller.cpp does not compile");
    println!("cargo::rustc-link-arg-bins={}", object.display());
    println!("cargo::rustc-link-arg-bins=-lstdc++");
}
