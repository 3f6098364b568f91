//! The page on what is reused says what the sources say.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

#[path = "../examples/reuse.rs"]
#[allow(dead_code, reason = "it is a program, too")]
mod reuse;

#[test]
fn the_page_on_reuse_is_up_to_date() {
    let written = include_str!("../../REUSE.md");
    let counted = reuse::table().unwrap();
    assert_eq!(written, counted, "cargo run -p slate-exp3 --example reuse > examples/REUSE.md");
}
