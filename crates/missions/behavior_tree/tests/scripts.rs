//! Scripts.

use proptest::prelude::*;
use slate_behavior_tree::{BehaviorTree, BoardValue, TreeExecutor};

use crate::common::{Answers, document, models, tree};

/// The value of `x` after a script.
fn value(code: &str) -> Result<BoardValue, String> {
    let code = code.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
    let text = document(&format!("<Script code=\"{code}\"/>"), "");
    let tree = BehaviorTree::parse(text.as_bytes(), &models()).map_err(|error| error.to_string())?;
    let mut executor = TreeExecutor::new(tree.into());
    executor.tick(0, &mut Answers::default()).map_err(|error| error.to_string())?;
    Ok(executor.entry("x").unwrap().clone())
}

#[test]
fn scripts_compute() {
    for (code, expected) in [
        ("x := 1 + 2 * 3 - 8 / 4", 5.0),
        ("x := -(2 - 5) * 2", 6.0),
        ("x := 7 / 2", 3.5),
        ("x := 1.5e2", 150.0),
        ("x := 3 > 2 && !(1 == 2) || false", 1.0),
        ("x := 1 < 2 < 3 != 0", 1.0),
        ("x := 3 > 2 > 2", 0.0),
        ("x := 0.1 + 0.2 == 0.3", 1.0),
        ("x := 'a' < 'b' && 'a' != 'b'", 1.0),
        ("x := '12' == 12 && 'true' == true", 1.0),
        ("x := false ? 1 : true ? 2 : 3", 2.0),
        ("x := 1; x += 2; x *= 3; x -= 1; x /= 4;", 2.0),
        ("y := x := 4; x = x + y", 8.0),
        ("x := 1; x = '5'", 5.0),
        ("x := 6 & 3 | 8", 10.0),
        ("x := 1 + 2 & 6 ^ 4", 6.0),
        ("x := 5 & 1 == 1", 1.0),
        ("x := ~0x0F", -16.0),
    ] {
        assert_eq!(value(code), Ok(BoardValue::Number(expected)), "{code}");
    }
    for (code, expected) in [
        ("x := 'a' .. 1 .. 'b'", "a1b"),
        ("x := 'a' + 'b'; x += 'c'", "abc"),
        ("x := 'a'; x = 1.5", "1.5"),
        ("x := 'gru\u{308}n'", "gru\u{308}n"),
    ] {
        assert_eq!(value(code), Ok(BoardValue::Text(expected.into())), "{code}");
    }
}

#[test]
fn a_bad_script_is_refused_with_its_column() {
    for (code, expected) in [
        ("x := ", "column 6: expected a value, found the end"),
        ("x := 1 2", "column 8: expected an operator or `;`, found `2`"),
        ("x := (1", "column 8: expected `)`, found the end"),
        ("x := true ? 1", "column 14: expected `:` and the value otherwise, found the end"),
        ("1 := 2", "column 1: expected the name of an entry before the assignment"),
        ("x := '\u{e4}' ! 'b", "column 12: expected a closing `'`"),
        ("x := 1.5.2", "column 6: expected a number such as `1.5`, found `1.5.2`"),
        ("x := 1 &", "column 9: expected a value, found the end"),
        ("x := 0x1g", "column 6: expected a number such as `0x1f` of at most 8 digits, found `0x1g`"),
        ("x := 1 # 2", "column 8: expected an operator, found `#`"),
        (" ; ", "column 4: expected a statement such as `count := 1`"),
    ] {
        let error = value(code).unwrap_err();
        assert!(error.contains(&format!("line 3: script `{code}`, {expected}")), "{error}");
    }
    let deep = format!("x := {}1{}", "(".repeat(100), ")".repeat(100));
    assert!(value(&deep).unwrap_err().contains("expected at most 64 nested operators"));
    assert!(value(&format!("x := {}1", "-".repeat(9000))).unwrap_err().contains("nested operators"));
    assert!(value(&"x := 1;".repeat(2000)).unwrap_err().contains("at most 10000 bytes"));
}

#[test]
fn a_script_that_can_t_compute_says_why() {
    for (code, expected) in [
        ("x := 'a' * 2", "expected a number for `*`, found the text 'a'"),
        ("x := 'a' > 2", "expected a number to compare with, found the text 'a'"),
        ("x = 1", "the entry `x` doesn't exist; use `:=` to make it"),
        ("x := 1; x = 'b'", "the entry `x` is a number, expected one, found the text 'b'"),
        ("x := 1e300 * 1e300", "expected a finite result"),
    ] {
        let error = value(code).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
    let doubled = format!("x := 'abcdefgh'; {}", "x = x .. x;".repeat(20));
    assert!(value(&doubled).unwrap_err().contains("expected a text of at most"));
}

#[test]
fn a_condition_is_no_text() {
    let mut executor = TreeExecutor::new(tree("<ScriptCondition code=\"'word'\"/>"));
    let error = executor.tick(0, &mut Answers::default()).unwrap_err();
    assert!(error.reason.contains("expected a condition such as `x > 1`, found the text 'word'"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn any_script_is_read_or_refused(code in "(x|y|1|2\\.5|'a'|true|:=|=|\\+|-|\\*|/|==|<|&&|\\|\\||!|\\?|:|;|\\(|\\)| |\\.\\.){0,16}|[ -~]{0,20}") {
        let _ = value(&format!("x := 0; {code}"));
    }
}

#[test]
fn operators_of_bits_need_whole_numbers() {
    for code in ["x := 1.5 & 1", "x := 1 | 'a'", "x := ~0.5", "x := 1e17 ^ 1"] {
        assert!(value(code).is_err(), "{code}");
    }
}

#[test]
fn names_of_numbers_are_known_to_scripts_and_cases() {
    let models = models().enumeration("RED", 3).enumeration("GREEN", -1);
    let node = "<Sequence><Script code=\"x := RED; y := 0; y = 'GREEN'; z := x == 'RED'\"/>\
                <Switch2 variable=\"{x}\" case_1=\"GREEN\" case_2=\"RED\"><A/><B/><C/></Switch2></Sequence>";
    let tree = BehaviorTree::parse(document(node, "").as_bytes(), &models).unwrap();
    let mut executor = TreeExecutor::new(tree.into());
    let mut host = Answers::default();
    executor.tick(0, &mut host).unwrap();
    assert_eq!(host.orders(), "start B");
    let values = ["x", "y", "z"].map(|name| executor.entry(name).and_then(BoardValue::number));
    assert_eq!(values, [Some(3.0), Some(-1.0), Some(1.0)]);
    let text = document("<Script code=\"RED := 1\"/>", "");
    let error = BehaviorTree::parse(text.as_bytes(), &models).unwrap_err().to_string();
    assert!(error.contains("expected the name of an entry before the assignment"), "{error}");
}
