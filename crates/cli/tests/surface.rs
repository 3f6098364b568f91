//! The command's surface: what scripts rely on changes only on purpose.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::collections::BTreeSet;

use common::Running;
use serde_json::Value;

/// Verbs, options and arguments, a line each.
const SURFACE: &str = include_str!("surface.txt");

#[test]
fn the_verbs_and_options_are_those_that_are_written_down() {
    let running = Running::new("surface");
    let mut lines = Vec::new();
    collect(&running, &[], &mut lines);
    let found = lines.join("\n") + "\n";
    if found != SURFACE {
        let place = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("surface.txt");
        std::fs::write(&place, &found).unwrap();
        let (old, new): (BTreeSet<_>, BTreeSet<_>) = (SURFACE.lines().collect(), found.lines().collect());
        panic!(
            "gone: {:#?}\nnew: {:#?}\nif that is meant: cp {} crates/cli/tests/surface.txt",
            old.difference(&new).collect::<Vec<_>>(),
            new.difference(&old).collect::<Vec<_>>(),
            place.display()
        );
    }
}

/// What the help of a verb lists, and of the verbs below it.
fn collect(running: &Running, verb: &[&str], lines: &mut Vec<String>) {
    let help = running.done(&[verb, &["--help"]].concat());
    let name = [&["slate"], verb].concat().join(" ");
    let (mut section, mut below) = ("", Vec::new());
    for line in help.lines() {
        if !line.starts_with(' ') && line.ends_with(':') {
            section = line.trim_end_matches(':');
            continue;
        }
        let text = line.trim();
        let is_entry = !text.is_empty() && line.len() - line.trim_start().len() <= 6;
        match section {
            "Commands" if is_entry && line.starts_with("  ") && !line.starts_with("   ") => {
                let verb = text.split_whitespace().next().unwrap();
                if verb != "help" {
                    below.push(verb.to_owned());
                }
            }
            "Arguments" if is_entry && text.starts_with(['<', '[']) => {
                lines.push(format!("{name} {}", text.split("  ").next().unwrap()));
            }
            // Those that every verb has stand at the top.
            "Options" if !verb.is_empty() && text.starts_with("--color") => {}
            "Options" if is_entry && text.starts_with('-') && !text.contains("--help") => {
                lines.push(format!("{name} {}", text.split("  ").next().unwrap()));
            }
            _ => {}
        }
    }
    for own in below {
        lines.push(format!("{name} {own}"));
        collect(running, &[verb, &[own.as_str()]].concat(), lines);
    }
}

#[test]
fn a_shell_is_offered_what_there_is_at_that_moment() {
    let mut running = Running::new("complete");
    assert!(running.done(&["completions", "bash"]).contains("SLATE_COMPLETE=\"bash\""));
    for shell in ["zsh", "fish", "elvish", "powershell"] {
        assert!(running.done(&["completions", shell]).contains("slate"), "{shell}");
    }
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "0.3"]);
    let offered = |words: &[&str]| {
        let mut command = running.command(&["--", "slate"]);
        command.args(words).env("SLATE_COMPLETE", "bash").env("_CLAP_IFS", "\n");
        let output = command.env("_CLAP_COMPLETE_INDEX", words.len().to_string()).output().unwrap();
        common::text(&output.stdout)
    };
    // Names may come too late on a machine that is busy, which is not an error.
    let eventually = |words: &[&str], wanted: &str| {
        let offer = (0..40).map(|_| offered(words)).find(|offer| offer.lines().any(|line| line == wanted));
        assert!(offer.is_some(), "{words:?}: {}", offered(words));
    };
    eventually(&["get", "/r2/pl"], "/r2/planner/params");
    eventually(&["watch", "r2/pl"], "r2/planner/params");
    eventually(&["module", "enable", "ref"], "referee");
    eventually(&["unlink", "r2/planner/po"], "r2/planner/position");
    eventually(&["stop", "--agent", "e"], "exp1");
    eventually(&["run", "ex"], "exp3");
    eventually(&["wa"], "watch");
    assert_eq!(offered(&["get", "/nowhere"]), "");
}

/// The shape of a JSON document: its keys and the types of their values.
fn shape(value: &Value) -> Value {
    match value {
        Value::Object(fields) => fields.iter().map(|(name, value)| (name.clone(), shape(value))).collect(),
        Value::Array(items) => {
            items.first().map_or_else(|| Value::Array(vec![]), |first| vec![shape(first)].into())
        }
        Value::String(text) if text.starts_with("slate.") => value.clone(),
        Value::String(_) => "text".into(),
        Value::Number(_) => "number".into(),
        Value::Bool(_) => "truth".into(),
        Value::Null => Value::Null,
    }
}

#[test]
fn the_documents_in_json_keep_their_form() {
    let mut running = Running::new("forms");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "0.3"]);
    running.done(&["wait", "/loop/histogram/count", "> 10"]);
    for (arguments, wanted) in [
        (
            &["watch", "/simulator/r2/truth", "-n", "1"][..],
            r#"{"missed":"number","schema":"slate.watch/1","sequence":"number","time":"number","url":"text",
                "value":{"theta":"number","x":"number","y":"number"}}"#,
        ),
        (
            &["stat", "/simulator/r2/truth", "--for", "200ms"],
            r#"{"properties":[{"age":"number","bandwidth":"number","count":"number","has_writer":"truth","interface":"text",
                "interval":{"deviation":"number","max":"number","mean":"number","min":"number","p50":"number","p95":"number",
                "p99":"number"},"lost":"number","rate":"number","readers":"number","size":"number","unseen":"number",
                "url":"text"}],"schema":"slate.stat/1","seconds":"number"}"#,
        ),
        (
            &["set", "/r2/planner/params/max_linear_velocity", "0.35"],
            r#"{"changed":[{"after":"text","before":null,"default":"text","path":"text"}],"schema":"slate.set/1","url":"text"}"#,
        ),
        (
            &["wait", "/simulator/r2/truth/x", "> -100"],
            r#"{"schema":"slate.wait/1","sequence":"number","time":"number","url":"text","value":"number"}"#,
        ),
        (
            &["ps"],
            r#"{"agents":[{"agent":"text","cycles":"number","disarmed":[],"modules":["number"],"over":null,"process":{"id":"number",
                "memory":"number","threads":"number","uptime":"number"},"stopped":[],"trouble":null}],
                "schema":"slate.ps/1"}"#,
        ),
        (
            &["check", "exp1"],
            r#"{"configuration":"text","counts":{"actuators":"number","agents":"number","links":"number","modules":"number"},
                "findings":[],"limits":[{"gate":"text","limits":{"left":["number"],"right":["number"]},"robot":"text"}],
                "ok":"truth","schema":"slate.check/1"}"#,
        ),
        (
            &["doctor"],
            r#"{"findings":[{"found":"text","hint":null,"state":"text","what":"text"}],"ok":"truth","schema":"slate.doctor/1"}"#,
        ),
        (
            &["get", "/simulator/r2/truth/x"],
            r#"{"schema":"slate.get/1","sequence":"number","time":"number","url":"text","value":"number"}"#,
        ),
    ] {
        let output = running.call(&[arguments, &["--json"]].concat());
        let found: Value = serde_json::from_slice(&output.stdout).unwrap();
        let wanted: Value = serde_json::from_str(wanted).unwrap();
        let mut found = shape(&found);
        // What is wrong with this machine differs.
        if let Some(hint) = found.pointer_mut("/findings/0/hint") {
            *hint = Value::Null;
        }
        assert_eq!(found, wanted, "{arguments:?}");
    }
}

#[test]
fn each_document_in_json_says_of_which_form_it_is() {
    let mut running = Running::new("schemas");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "0.3"]);
    running.done(&["wait", "/loop/histogram/count", "> 10"]);
    running.done(&["snapshot", "save", "now.snapshot"]);
    // A line of the log.
    running.done(&["stop"]);
    common::wait_for("the line", || !running.done(&["log"]).is_empty());
    for (arguments, schema, field) in [
        (&["module", "list"][..], "slate.module/1", "modules"),
        (&["module", "describe", "r2/planner"], "slate.module.describe/1", "ports"),
        (&["plugin", "list"], "slate.plugin/1", "plugins"),
        (&["link"], "slate.link/1", "links"),
        (&["link", "referee/truth", "simulator/r2/truth"], "slate.link.change/1", "changed"),
        (&["list"], "slate.list/1", "properties"),
        (&["config", "get"], "slate.config/1", "settings"),
        (&["config", "diff"], "slate.config.diff/1", "differences"),
        (&["peers"], "slate.peers/1", "peers"),
        (&["record", "status"], "slate.record/1", "recordings"),
        (&["snapshot", "info", "now.snapshot"], "slate.snapshot/1", "modules"),
        (&["log", "-n", "1"], "slate.log/1", "text"),
        (&["tree"], "slate.tree/1", "tree"),
        (&["top"], "slate.top/1", "modules"),
        (&["explain"], "slate.explain/1", "codes"),
        (&["graph", "exp1"], "slate.graph/1", "nodes"),
        (&["examples"], "slate.examples/1", "examples"),
        (&["stop"], "slate.stop/1", "agents"),
        (&["reset"], "slate.reset/1", "was_stopped"),
        (&["arm"], "slate.arm/1", "actuator"),
    ] {
        let said = running.done(&[arguments, &["--json"]].concat());
        let document: Value = serde_json::from_str(said.lines().last().unwrap_or("null")).unwrap();
        assert_eq!(document["schema"], schema, "{arguments:?}");
        assert!(document.get(field).is_some(), "{arguments:?}: {document}");
    }
}

#[test]
fn errors_are_a_document_with_json() {
    let mut running = Running::new("errors");
    running.start("exp1", &["run", "exp1", "--headless", "--rate", "0.3"]);
    std::fs::write(running.folder().join("bad.toml"), "[world]\n[modules.x]\ntyp = 1\n").unwrap();
    for (exit, arguments, code, message, help) in [
        (4, &["get", "/nope"][..], Some("S004"), "nope", "slate list"),
        (5, &["set", "/simulator/r2/truth", "1"], Some("S105"), "one writer", "slate link"),
        (3, &["tree", "--agent", "nobody"], Some("S101"), "no agent `nobody`", "exp1"),
        (2, &["get"], None, "not provided", "Usage"),
        (2, &["tree", "--bogus"], None, "--bogus", "Usage"),
        (2, &["param", "list"], None, "unrecognized", "slate set /MODULE/params/NAME"),
        (2, &["goal", "0", "0"], None, "without a person", "--yes"),
        (4, &["explain", "S999"], None, "S999", "lists all"),
        (2, &["interface", "check", "none.rs"], None, "none.rs", ""),
        (2, &["run", "bad.toml"], Some("S002"), "typ", ""),
    ] {
        let output = running.call(&[arguments, &["--json"]].concat());
        assert_eq!(output.status.code(), Some(exit), "{arguments:?}: {output:?}");
        let error: Value =
            serde_json::from_slice(&output.stderr).unwrap_or_else(|_| panic!("{arguments:?}: {output:?}"));
        assert_eq!(error["schema"], "slate.error/1");
        assert_eq!(error["exit"], exit, "{error}");
        assert_eq!(error["code"].as_str(), code, "{error}");
        assert!(error["message"].as_str().unwrap().contains(message), "{error}");
        assert!(error["help"].as_str().unwrap_or_default().contains(help), "{error}");
    }
    let output = running.call(&["run", "bad.toml", "--json"]);
    let error: Value = serde_json::from_slice(&output.stderr).unwrap();
    assert_eq!(
        (&error["findings"][0]["file"], &error["findings"][0]["line"]),
        (&"bad.toml".into(), &3.into())
    );
}

#[test]
fn verbs_of_other_systems_lead_to_those_that_do_it_here() {
    let running = Running::new("instead");
    for (verb, words) in [("plot", "slate bag plot"), ("param", "slate config diff"), ("topic", "slate list")]
    {
        running.fails(2, &[verb], &["unrecognized subcommand", words]);
    }
}
