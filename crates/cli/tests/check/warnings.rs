//! Warnings, which fail only a strict check.

use super::common::{Running, library};
use super::{EXP1, findings};

#[test]
fn a_robot_without_modules_is_warned_of() {
    let running = Running::new("check-empty");
    std::fs::write(running.folder().join("empty.toml"), format!("{EXP1}\n[robots.r9]\n")).unwrap();
    let checked = findings(&running, 0, &["check", "empty.toml"]);
    let found = checked["findings"].as_array().unwrap();
    assert_eq!(found.len(), 1, "{checked}");
    assert_eq!(
        (&found[0]["message"], &found[0]["severity"]),
        (&"robot `r9` has no modules".into(), &"warning".into())
    );
    assert_eq!(found[0]["line"], EXP1.lines().count() + 2, "{checked}");
    findings(&running, 7, &["check", "empty.toml", "--strict"]);
}

#[test]
fn a_plugin_that_no_module_is_of_is_a_warning() {
    let running = Running::new("check-unused");
    let library = library("libslate_adaptation.so");
    let file = format!("{EXP1}\n[plugins.slate-adaptation]\nfile = {library:?}\n");
    std::fs::write(running.folder().join("unused.toml"), file).unwrap();
    let checked = findings(&running, 0, &["check", "unused.toml"]);
    assert_eq!(checked["findings"][0]["severity"], "warning", "{checked}");
    findings(&running, 7, &["check", "unused.toml", "--strict"]);
}

#[test]
fn what_is_to_be_recorded_and_is_nowhere_is_a_warning() {
    let running = Running::new("check-select");
    let select = ["check", "exp1", "--set", "record.enabled=true", "--set"];
    let with = |setting: &'static str| [&select[..], &[setting]].concat();
    let checked = findings(&running, 0, &with("record.select=\"/r2/planer/**\""));
    let finding = &checked["findings"][0];
    assert_eq!((&finding["severity"], checked["findings"].as_array().unwrap().len()), (&"warning".into(), 1));
    let (message, help) = (finding["message"].as_str().unwrap(), finding["help"].as_str().unwrap());
    assert!(message.contains("no property fits /r2/planer/** of record.select"), "{checked}");
    assert!(help.contains("/r2/planner/"), "{checked}");
    findings(&running, 7, &[&with("record.select=\"/r2/planer/**\"")[..], &["--strict"]].concat());
    for good in ["record.select=\"/r2/**\"", "record.exclude=\"/nothing/**\""] {
        let checked = findings(&running, 0, &with(good));
        assert_eq!(checked["findings"], serde_json::json!([]), "{good}");
    }
    let rule = "[[record.rules]]\nselect = [\"/r2/plans\", \"/r2/**\"]\nrate = 5.0\n";
    std::fs::write(running.folder().join("ruled.toml"), format!("{EXP1}\n{rule}")).unwrap();
    let checked = findings(&running, 0, &["check", "ruled.toml"]);
    let finding = &checked["findings"][0];
    assert!(finding["message"].as_str().unwrap().contains("/r2/plans of record.rules"), "{checked}");
    assert_eq!(finding["file"].as_str().map(|file| file.ends_with("ruled.toml")), Some(true), "{checked}");
}

#[test]
fn limits_wider_than_those_of_the_robot_model_are_warned_of() {
    let running = Running::new("check-limits");
    let checked = |limits: &str| {
        let text = EXP1.replacen("safe = { left", &format!("limits = {{ {limits} }}\nsafe = {{ left"), 1);
        std::fs::write(running.folder().join("robot.toml"), text).unwrap();
        findings(&running, 0, &["check", "robot.toml"])
    };
    let wide = checked("left = [-12.3, 20.0]");
    let message = wide["findings"][0]["message"].as_str().unwrap();
    assert!(
        message.contains("`left` at the gate `r2/wheels`, -12.3 to 20,") && message.contains("-12.3 to 12.3")
    );
    assert_eq!(wide["limits"][0]["limits"], serde_json::json!({ "right": [-12.3, 12.3] }), "{wide}");
    let narrow = checked("left = [-6.0, 6.0], right = [-12.304, 12.304]");
    assert_eq!(
        (narrow["findings"].as_array().unwrap().len(), narrow["limits"].as_array().unwrap().len()),
        (0, 0)
    );
}
