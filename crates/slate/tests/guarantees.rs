//! The ledger of promises: `book/guarantees.txt` names the tests that verify each promise of the book, each of these tests
//! must exist, and `book/src/guarantees.md` is the generated page.
//!
//! `SLATE_WRITE=1 cargo test -p slate-robotics --test guarantees` writes the page anew.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

const HEAD: &str = "# Guarantees

Each promise of this book with the tests that verify it. `cargo test` fails when one of these tests is
missing, or when this page differs from `book/guarantees.txt`. A new promise needs a line there and a test;
`SLATE_WRITE=1 cargo test -p slate-robotics --test guarantees` writes the page. `grep -rn TEST crates
examples` finds a test.
";

struct Promise {
    text: String,
    tests: Vec<String>,
}

struct Chapter {
    file: String,
    promises: Vec<Promise>,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A chapter begins with `[FILE]`; a promise is a line, and the indented lines below it are the names of its tests.
fn ledger() -> Vec<Chapter> {
    let mut chapters: Vec<Chapter> = Vec::new();
    let text = read(&root().join("book/guarantees.txt"));
    for line in text.lines().filter(|line| !line.trim().is_empty() && !line.starts_with('#')) {
        if let Some(file) = line.strip_prefix('[') {
            let file = file.trim_end_matches(']').to_owned();
            chapters.push(Chapter { file, promises: Vec::new() });
            continue;
        }
        let chapter = chapters.last_mut().unwrap_or_else(|| panic!("before the first chapter: {line}"));
        if line.starts_with(' ') {
            let promise = chapter.promises.last_mut().unwrap_or_else(|| panic!("no promise above {line}"));
            promise.tests.extend(line.split_whitespace().map(str::to_owned));
        } else {
            chapter.promises.push(Promise { text: line.to_owned(), tests: Vec::new() });
        }
    }
    chapters
}

/// The names of all functions that are tests, in the sources of the workspace and of the Python package.
fn tests() -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for folder in ["crates", "examples", "python/tests"] {
        look(&root().join(folder), &mut found);
    }
    found
}

fn look(folder: &Path, found: &mut BTreeSet<String>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() && name != "target" {
            look(&path, found);
        } else if name.ends_with(".py") {
            let text = read(&path);
            let functions = text.lines().filter_map(|line| line.trim().strip_prefix("def "));
            let names = functions.filter_map(|rest| rest.split('(').next());
            found.extend(names.filter(|name| name.starts_with("test_")).map(str::to_owned));
        } else if name.ends_with(".rs") {
            let text = read(&path);
            let mut is_test = false;
            for line in text.lines().map(str::trim) {
                // Tests with a harness of their own stand in a list, by their names in words.
                if let Some((name, _)) = line.strip_prefix("(\"").and_then(|rest| rest.split_once('"')) {
                    found.insert(name.replace(' ', "_"));
                }
                let function = line.strip_prefix("pub ").unwrap_or(line).strip_prefix("fn ");
                match function.and_then(|rest| rest.split(['(', '<']).next()) {
                    Some(name) if is_test => {
                        found.insert(name.to_owned());
                        is_test = false;
                    }
                    // Property tests stand in a macro, where the attribute is the same.
                    _ => is_test = line == "#[test]" || is_test && line.starts_with("#["),
                }
            }
        }
    }
}

/// The test that has the most words of a name.
fn nearest<'a>(name: &str, tests: &'a BTreeSet<String>) -> &'a str {
    let words: BTreeSet<&str> = name.split('_').collect();
    let shared = |test: &&String| {
        let own: BTreeSet<&str> = test.split('_').collect();
        words.intersection(&own).count() * 100 / words.union(&own).count()
    };
    tests.iter().max_by_key(shared).map_or("", String::as_str)
}

/// The title of a chapter.
fn title(file: &str) -> String {
    let text = read(&root().join("book/src").join(file));
    text.lines().next().unwrap_or_default().trim_start_matches("# ").to_owned()
}

fn page(chapters: &[Chapter]) -> String {
    let mut page = HEAD.to_owned();
    for Chapter { file, promises } in chapters {
        let _ = write!(page, "\n## [{}]({file})\n\n| promise | tests |\n|---|---|\n", title(file));
        for Promise { text, tests } in promises {
            let tests: Vec<_> = tests.iter().map(|test| format!("`{test}`")).collect();
            let _ = writeln!(page, "| {text} | {} |", tests.join("<br>"));
        }
    }
    page
}

#[test]
fn every_promise_has_a_test_that_is_there() {
    let (chapters, tests) = (ledger(), tests());
    assert!(tests.len() > 1000, "tests were not found in the sources: {}", tests.len());
    let mut wrong = Vec::new();
    for promise in chapters.iter().flat_map(|chapter| &chapter.promises) {
        if promise.tests.is_empty() {
            wrong.push(format!("no test holds: {}", promise.text));
        }
        for (at, test) in
            promise.tests.iter().enumerate().filter(|(at, test)| promise.tests[..*at].contains(test))
        {
            wrong.push(format!(
                "the test `{test}` is named twice (the second time as number {}): {}",
                at + 1,
                promise.text
            ));
        }
        for test in promise.tests.iter().filter(|test| !tests.contains(*test)) {
            let near = nearest(test, &tests);
            wrong.push(format!(
                "the test `{test}` is gone that holds: {}; if it was renamed, to `{near}`?",
                promise.text
            ));
        }
    }
    assert!(wrong.is_empty(), "book/guarantees.txt:\n{}", wrong.join("\n"));
}

#[test]
fn page_of_guarantees_is_what_the_ledger_says() {
    let (path, page) = (root().join("book/src/guarantees.md"), page(&ledger()));
    if std::env::var_os("SLATE_WRITE").is_some() {
        std::fs::write(&path, &page).unwrap();
    }
    let help = "write it anew: SLATE_WRITE=1 cargo test -p slate-robotics --test guarantees";
    assert!(read(&path) == page, "{} is stale; {help}", path.display());
}

#[test]
fn every_chapter_of_the_book_has_a_promise() {
    let chapters: BTreeSet<_> = ledger().into_iter().map(|chapter| chapter.file).collect();
    let summary = read(&root().join("book/src/SUMMARY.md"));
    let files = summary.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    // The glossary and this page promise nothing.
    let missing: Vec<_> = files
        .filter(|file| file.starts_with(|c: char| c.is_ascii_digit()) && !chapters.contains(*file))
        .collect();
    assert!(missing.is_empty(), "chapters without a promise in book/guarantees.txt: {missing:?}");
}
