//! Reports on variants that are not chosen.

use super::common::{Running, text as text_of};
use super::{EXP1, findings};

/// EXP1 with more in it, before its first variant.
fn with_variants(settings: &str) -> String {
    let first = "[choices.controller.slate]\n";
    assert_eq!(EXP1.matches(first).count(), 1);
    EXP1.replacen(first, &format!("{settings}\n{first}"), 1)
}

#[test]
fn a_variant_that_is_not_chosen_is_checked_as_if_it_were() {
    let running = Running::new("check-variants");
    let file = running.folder().join("variants.toml");
    for (settings, words) in [
        ("robots.r2.modules.second = { kind = \"go_to_origin_planner\" }", "a robot has one plan"),
        ("robots.r2.modules.planner.kind = \"no_such_kind\"", "no_such_kind"),
        ("robots.r2.links.\"planner/position\" = \"sonar/value\"", "`/r2/sonar/value`"),
        ("modules.referee.params.time_limit = -1.0", "outside 0 to"),
        ("robots.r2.modules.avoid_obstcle.enabled = false", "avoid_obstcle"),
    ] {
        let text = with_variants(&format!("[choices.controller.x]\n{settings}"));
        std::fs::write(&file, &text).unwrap();
        let checked = findings(&running, 7, &["check", "variants.toml"]);
        let found = checked["findings"].as_array().unwrap();
        assert!(!found.is_empty(), "{checked}");
        for one in found {
            let message = one["message"].as_str().unwrap();
            assert!(message.starts_with("with `controller = \"x\"`: "), "{checked}");
            assert_eq!(one["variants"], serde_json::json!(["controller = \"x\""]), "{checked}");
        }
        let named = found.iter().find(|one| one["message"].as_str().unwrap().contains(words));
        let place = named.unwrap_or_else(|| panic!("{words}: {checked}"))["line"].as_u64().unwrap() as usize;
        assert_eq!(text.lines().nth(place - 1), Some(settings), "{checked}");
        let output = running.call(&["check", "variants.toml"]);
        assert!(text_of(&output.stderr).contains("with `controller = \"x\"`: "), "{output:?}");
    }
}

#[test]
fn what_is_wrong_in_all_variants_is_told_once_and_names_none() {
    let running = Running::new("check-anyhow");
    let text =
        with_variants("[choices.controller.x]\n").replacen("time_limit = 120.0", "time_limit = -1.0", 1);
    std::fs::write(running.folder().join("wrong.toml"), text).unwrap();
    let checked = findings(&running, 7, &["check", "wrong.toml"]);
    let found = checked["findings"].as_array().unwrap();
    assert_eq!(found.len(), 1, "{checked}");
    assert_eq!(found[0].get("variants"), None, "{checked}");
    let output = running.call(&["check", "wrong.toml"]);
    assert_eq!(text_of(&output.stderr).matches("outside 0 to").count(), 1, "{output:?}");
    // What is wrong with one of two names that.
    let wrong = "modules.referee.params.time_limit = -1.0";
    let both = with_variants(&format!("[choices.controller.x]\n[choices.controller.y]\n{wrong}"));
    std::fs::write(running.folder().join("one.toml"), both).unwrap();
    let checked = findings(&running, 7, &["check", "one.toml", "--set", "controller=x"]);
    assert_eq!(checked["findings"].as_array().unwrap().len(), 1, "{checked}");
    assert_eq!(checked["findings"][0]["variants"], serde_json::json!(["controller = \"y\""]));
    // The chosen one is the configuration as it is.
    let checked = findings(&running, 7, &["check", "one.toml", "--set", "controller=y"]);
    assert_eq!(checked["findings"][0].get("variants"), None, "{checked}");
}
