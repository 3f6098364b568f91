//! Which paths a pattern means.
#![cfg(not(any(loom, feature = "shuttle")))]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use proptest::prelude::*;
use slate_blackboard::Pattern;

fn matches(pattern: &str, path: &str) -> bool {
    Pattern::parse(pattern).unwrap().matches(path)
}

#[test]
fn a_pattern_without_stars_means_one_path() {
    assert!(matches("drive/state", "drive/state") && matches("/drive/state", "drive/state"));
    for path in ["drive", "drive/stat", "drive/states", "drive/state/x", "a/drive/state", ""] {
        assert!(!matches("drive/state", path), "{path}");
    }
}

#[test]
fn one_star_is_one_name() {
    assert!(matches("*", "drive") && matches("*/state", "arm/state") && matches("a/*/c/*", "a/b/c/d"));
    for (pattern, path) in [("*", "drive/state"), ("*/state", "state"), ("a/*", "a"), ("*/*", "a")] {
        assert!(!matches(pattern, path), "{pattern} {path}");
    }
}

#[test]
fn two_stars_are_any_number_of_names() {
    for (pattern, path) in [
        ("**", "a"),
        ("**", "a/b/c"),
        ("a/**", "a"),
        ("a/**", "a/b/c"),
        ("**/c", "c"),
        ("**/c", "a/b/c"),
        ("**/c", "c/b/c"),
        ("a/**/c", "a/c"),
        ("a/**/c", "a/b/c/c"),
        ("**/b/**/d", "a/b/b/c/d"),
        ("**/**", "a"),
        ("**/*/c", "a/b/c"),
    ] {
        assert!(matches(pattern, path), "{pattern} {path}");
    }
    for (pattern, path) in [
        ("a/**", "b"),
        ("**/c", "c/b"),
        ("a/**/c", "a"),
        ("a/**/c", "a/b"),
        ("**/*/c", "c"),
        ("**/b/**/d", "a/b/c"),
    ] {
        assert!(!matches(pattern, path), "{pattern} {path}");
    }
}

#[test]
fn invalid_pattern_is_refused_with_reason() {
    for text in ["", "/", "a//b", "a/", "//a", "a*", "*b/c", "***", "a b", "ä", "slate://base/a"] {
        let error = Pattern::parse(text).unwrap_err();
        assert_eq!(error.text, text);
        assert!(error.to_string().starts_with(&format!("`{text}` is not a pattern")), "{error}");
    }
}

#[test]
fn many_stars_take_no_time() {
    let path = ["a"; 300].join("/");
    assert!(matches(&format!("{}a", "**/a/".repeat(30)), &path));
    assert!(!matches(&format!("{}b", "**/a/".repeat(30)), &path));
}

/// The definition, with all the time that it takes.
fn means(pattern: &[&str], path: &[&str]) -> bool {
    match (pattern.split_first(), path.split_first()) {
        (None, None) => true,
        (Some((&"**", rest)), Some((_, after))) => means(rest, path) || means(pattern, after),
        (Some((&"**", rest)), None) => means(rest, path),
        (Some((part, rest)), Some((name, after))) => (*part == "*" || part == name) && means(rest, after),
        _ => false,
    }
}

proptest! {
    #[test]
    fn a_pattern_means_what_it_is_defined_to(
        pattern in prop::collection::vec(prop::sample::select(vec!["a", "b", "*", "**"]), 1..7),
        path in prop::collection::vec(prop::sample::select(vec!["a", "b", "c"]), 1..8),
    ) {
        let text = pattern.join("/");
        prop_assert_eq!(matches(&text, &path.join("/")), means(&pattern, &path));
        prop_assert_eq!(Pattern::parse(&text).unwrap().to_string(), text);
    }

    #[test]
    fn no_text_breaks_a_pattern(text in "[a*/ ä]{0,12}", path in "\\PC{0,12}") {
        if let Ok(pattern) = Pattern::parse(&text) {
            pattern.matches(&path);
        }
    }
}
