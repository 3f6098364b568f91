//! The header of the client is what the sources say.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

/// Set it to write the header instead of comparing.
const UPDATE: &str = "SLATE_UPDATE_HEADER";

fn generated(folder: &Path) -> String {
    let configuration = cbindgen::Config::from_file(folder.join("cbindgen.toml")).unwrap();
    let mut builder = cbindgen::Builder::new().with_config(configuration);
    for source in ["agent", "boundary", "error", "text", "watch"] {
        builder = builder.with_src(folder.join(format!("src/{source}.rs")));
    }
    let mut text = Vec::new();
    builder.generate().unwrap().write(&mut text);
    let text = String::from_utf8(text).unwrap();
    // What Rust asks of its callers is said at the top of the header.
    let mut lines: Vec<&str> = Vec::new();
    let mut is_skipped = false;
    for line in text.lines().map(str::trim_end) {
        is_skipped = (is_skipped || line == "// # Safety") && line.starts_with("//");
        if !is_skipped {
            lines.push(line);
        } else if lines.last() == Some(&"//") {
            lines.pop();
        }
    }
    lines.join("\n").trim_end().replace("\n\n\n", "\n\n") + "\n"
}

#[test]
fn client_header_is_what_the_sources_say() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let file = folder.join("include/slate_client.h");
    let text = generated(folder);
    assert!(!text.contains("[`"), "a link of rustdoc is left:\n{text}");
    #[allow(clippy::disallowed_methods, reason = "how a developer asks for the update")]
    if std::env::var_os(UPDATE).is_some() {
        std::fs::write(&file, &text).unwrap();
    }
    let written = std::fs::read_to_string(&file).unwrap_or_default();
    let differs = text.lines().zip(written.lines()).find(|(new, old)| new != old);
    assert!(
        text == written,
        "include/slate_client.h is not what the sources say (first: {differs:?}); renew it with\n    \
         {UPDATE}=1 cargo test -p slate-client --test header"
    );
}

/// Compiles a source that includes the header, with all warnings on.
fn compile(compiler: &str, language: &str, standard: &str, source: &str) {
    let mut child = Command::new(compiler)
        .args(["-fsyntax-only", "-Wall", "-Wextra", "-Werror", "-pedantic", "-x", language, standard, "-I"])
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("include"))
        .arg("-")
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap_or_else(|error| panic!("{compiler} is needed for this test: {error}"));
    child.stdin.take().unwrap().write_all(source.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{compiler} {standard}:\n{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn client_header_and_the_book_compile_in_c_and_cpp() {
    let book = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../book/src/48-cpp.md");
    let book = std::fs::read_to_string(book).unwrap();
    let (_, rest) = book.split_once("```c\n").unwrap();
    let program = rest.split_once("```\n").unwrap().0;
    for standard in ["-std=c11", "-std=c17"] {
        compile("cc", "c", standard, program);
    }
    // Rust brings a linker for C; not everybody has the other compilers.
    for (compiler, standard) in [("c++", "-std=c++17"), ("clang++", "-std=c++20")] {
        if Command::new(compiler).arg("--version").output().is_ok() {
            compile(compiler, "c++", standard, program);
        }
    }
}
