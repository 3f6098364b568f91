//! The list of all interfaces.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::collections::BTreeSet;
use std::path::Path;

use slate_interfaces::ALL;

#[test]
fn the_list_has_each_interface_that_is_written_here() {
    let mut written = BTreeSet::new();
    for file in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("src")).unwrap() {
        let text = std::fs::read_to_string(file.unwrap().path()).unwrap();
        for part in text.split("#[interface").skip(1) {
            let item = part.lines().find(|line| line.starts_with("pub ")).unwrap();
            if let Some(name) = item.strip_prefix("pub struct ") {
                written.insert(name.split(|end: char| !end.is_alphanumeric()).next().unwrap().to_owned());
            }
        }
    }
    let listed: Vec<_> = ALL.iter().map(|interface| interface.name.to_owned()).collect();
    assert!(!written.is_empty() && listed.is_sorted(), "{listed:?}");
    assert_eq!(listed, Vec::from_iter(written));
}
