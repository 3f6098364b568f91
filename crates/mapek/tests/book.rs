//! The book's first chapter shows the code of the crate's documented example and of EXP1, which are compiled and run.

use std::path::Path;

#[test]
fn the_chapters_code_is_that_of_the_example() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let chapter = std::fs::read_to_string(root.join("../../book/src/01-a-robot-in-mape-k.md")).unwrap();
    let source = std::fs::read_to_string(root.join("src/lib.rs")).unwrap();
    let example: Vec<&str> = source
        .lines()
        .map_while(|line| line.strip_prefix("//!"))
        .map(|line| line.strip_prefix(' ').unwrap_or(line))
        .collect();
    let example = example.join("\n");
    let program = ["examples/exp1.rs", "src/r2.rs"]
        .map(|file| std::fs::read_to_string(root.join("../../examples/exp1").join(file)).unwrap())
        .concat();
    let pieces: Vec<&str> = chapter
        .split("```rust\n")
        .skip(1)
        .map(|rest| rest.split("\n```").next().unwrap_or_default())
        .collect();
    assert!(pieces.len() > 10);
    for piece in pieces {
        assert!(example.contains(piece) || program.contains(piece), "not in the example:\n{piece}");
    }
}
