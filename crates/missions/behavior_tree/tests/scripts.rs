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
        (
            "x := 1 & 2",
            "column 8: expected an operator or `;`, found `&`; use `&&` for and, in XML `&amp;&amp;`",
        ),
        ("x := 1 | 2", "column 8: expected an operator or `;`, found `|`; use `||` for or"),
        ("x := ~1", "column 6: expected no operator of bits"),
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
