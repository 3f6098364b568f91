//! Errors of an author in C, which no compiler saw.

use std::path::{Path, PathBuf};

use crate::fixtures::{Folder, gcc};
use crate::support::*;

/// The library with an error.
fn rogue(folder: &Folder, definitions: &[(&str, &str)]) -> PathBuf {
    let definitions: Vec<String> =
        definitions.iter().map(|(name, value)| format!("-D{name}={value}")).collect();
    let file = folder.write("librogue.so", b"");
    gcc("rogue.c", &definitions, &file);
    file
}

#[track_caller]
fn refusal(file: &Path) -> String {
    let mut agent = lockstep("");
    step(&mut agent, 1);
    let refusal = agent.composer().load_library(file).unwrap_err();
    step(&mut agent, 1);
    assert_eq!(agent.modules(), ["beat"]);
    complaint(&refusal)
}

#[test]
fn without_a_mistake_it_is_loaded() {
    let folder = Folder::new();
    let mut agent = lockstep("");
    assert_eq!(agent.composer().load_library(&rogue(&folder, &[])).unwrap().modules, ["rogue"]);
    step(&mut agent, 3);
    assert_eq!(agent.counts("rogue"), Some((3, 0, 0)));
}

#[test]
fn a_call_that_was_left_out_is_named() {
    let folder = Folder::new();
    let text = refusal(&rogue(&folder, &[("MAY_UNLOAD", "NULL")]));
    assert_says(&text, &["librogue.so", "module 1", "`may_unload`"]);
}

#[test]
fn a_description_that_does_not_fit_is_refused_with_the_reason() {
    let port = |name: &str, kinds: &[&str]| {
        let fields: Vec<_> = kinds
            .iter()
            .enumerate()
            .map(|(i, kind)| format!(r#"{{"name":"f{i}","kind":"{kind}"}}"#))
            .collect();
        format!(
            r#"{{"name":"{name}","direction":"Output","interface":{{"name":"Mine","fields":[{}]}}}}"#,
            fields.join(",")
        )
    };
    let ports = |ports: &[String]| format!(r#"{{"stage":"Act","ports":[{}]}}"#, ports.join(","));
    let one = &["u64"][..];
    for (description, says) in [
        ("{".to_owned(), "as one line of JSON, can't be read"),
        (String::new(), "can't be read"),
        (r#"{"stage":"Never"}"#.to_owned(), "unknown variant `Never`"),
        (r#"{"stage":"Act","port":[]}"#.to_owned(), "unknown field `port`"),
        (ports(&[port("a", one), port("a", one)]), "two ports `a`"),
        (ports(&[port("a", one).replace("}]", r#"},{"name":"f0","kind":"u64"}]"#)]), "the same name"),
        (ports(&[port("a", one).replace("f0", "f 0")]), "field `f 0` of Mine"),
        (ports(&[port("params", one)]), "`params`"),
        (ports(&[port("", one)]), "`` can't name a port"),
        (ports(&[port("a//b", one)]), "`a//b` can't name a port"),
        (ports(&[port("A b", one)]), "`A b` can't name a port"),
    ] {
        let folder = Folder::new();
        let literal = format!("{description:?}");
        let text = refusal(&rogue(&folder, &[("DESCRIPTION", &literal)]));
        assert_says(&text, &["librogue.so", says]);
    }
}

#[test]
fn an_interface_with_padding_is_loaded() {
    let description = r#"{"stage":"Act","ports":[{"name":"a","direction":"Output","interface":{"name":"Mine","fields":[
        {"name":"small","kind":"u8"},{"name":"large","kind":"u64"},{"name":"last","kind":"u8"}]}}]}"#;
    let folder = Folder::new();
    let mut agent = lockstep("");
    let library = rogue(&folder, &[("DESCRIPTION", &format!("{:?}", description.replace('\n', "")))]);
    assert_eq!(agent.composer().load_library(&library).unwrap().modules, ["rogue"]);
    step(&mut agent, 3);
    assert_eq!(agent.counts("beat").unwrap().2, 0);
}

#[test]
fn an_instance_that_was_not_made_is_missed() {
    let folder = Folder::new();
    let text = refusal(&rogue(&folder, &[("INSTANCE", "NULL")]));
    assert_says(&text, &["`rogue` can't be set up", "made no instance"]);
    let text = refusal(&rogue(&folder, &[("REASON", r#""broken \377 text""#)]));
    assert_says(&text, &["`rogue` can't be set up", "broken", "text"]);
}

#[test]
fn an_outcome_that_does_not_exist_counts_as_a_panic() {
    let folder = Folder::new();
    let mut agent = lockstep("");
    agent.composer().load_library(&rogue(&folder, &[("OUTCOME", "99")])).unwrap();
    step(&mut agent, 10);
    assert_eq!(agent.counts("rogue"), Some((5, 0, 5)));
    assert_eq!(agent.counts("beat").unwrap().0, 10);
    agent.composer().unload("rogue").unwrap();
}

#[test]
fn more_messages_than_fit_are_cut_off() {
    let folder = Folder::new();
    let mut agent = lockstep("");
    agent.composer().load_library(&rogue(&folder, &[("COUNT", "1000000")])).unwrap();
    step(&mut agent, 10);
    assert_eq!(agent.counts("rogue"), Some((10, 0, 0)));
}
