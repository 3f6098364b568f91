//! Agents whose links lead to each other.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that fails panics")]

mod scene;

use crate::agents;

use agents::{Folder, wait_for};
use slate_control::{Client, ClientError, Server};
use slate_module::Plugin;
use slate_runtime::configuration::{Configuration, Options as Reading};
use slate_runtime::{Agent, Mode, NewLink, Options, StartError};

use scene::*;

fn base(folder: &Folder) -> String {
    format!(
        "[agent]\nname = \"base\"\n[loop]\nperiod = \"5ms\"\n[share]\nlisten = \"{}\"\n[modules.counter]\n",
        folder.endpoint("base")
    )
}

fn arm(folder: &Folder, module: &str) -> String {
    format!(
        r#"
[agent]
name = "arm"
[loop]
period = "5ms"
[share]
listen = "{}"
agents.base.at = "{}"
[modules.reader]
{module}
[links]
"reader/number" = {{ from = "slate://base/counter/number", stale = "5s" }}
"reader/all" = "slate://base/counter/number"
"slate://base/counter/notes" = "reader/note"
"#,
        folder.endpoint("arm"),
        folder.endpoint("base")
    )
}

#[test]
fn values_queues_and_messages_cross_and_absence_shows() {
    for mode in [Mode::Staged, Mode::Threaded] {
        let folder = Folder::new();
        let reader = Running::start("arm", &arm(&folder, ""), mode);
        wait_for("the trouble", || {
            reader.trouble("reader/number").is_some_and(|trouble| trouble.contains("`base` is not reachable"))
        });
        assert_eq!(reader.number("reader/fresh"), 0.0);
        let counter = Running::start("base", &base(&folder), mode);
        wait_for("fresh values", || reader.number("reader/fresh") > 3.0);
        reader.hears_all();
        wait_for("all messages", || counter.number("counter/sum") == 55.0);
        assert_eq!(reader.trouble("slate://base/counter/notes"), None);
        drop(counter);
        wait_for("what is gone to be stale", || reader.number("reader/fresh") == 0.0);
        let counter = Running::start("base", &base(&folder), mode);
        wait_for("fresh values of the next one", || reader.number("reader/fresh") > 3.0);
        drop((reader, counter));
    }
}

#[test]
fn ground_truth_of_another_agent_is_for_referees() {
    let folder = Folder::new();
    let text = arm(&folder, "[modules.judge]")
        .replace("base/counter/number\", stale", "base/witness/truth\", stale")
        + "\"judge/truth\" = \"slate://base/witness/truth\"\n";
    let reader = Running::start("arm", &text, Mode::Staged);
    let _base = Running::start("base", &(base(&folder) + "[modules.witness]\n"), Mode::Staged);
    wait_for("the truth", || reader.number("judge/heard") == 7.0);
    wait_for("the rule", || {
        reader.trouble("reader/number").is_some_and(|trouble| {
            trouble.contains("only ports of referees read ground truth")
                && trouble.contains("slate://base/witness/truth")
        })
    });
    assert_eq!(reader.number("reader/fresh"), 0.0);
    assert_eq!(reader.trouble("judge/truth"), None);
}

#[test]
fn an_actuator_obeys_another_agent_through_its_gate_alone() {
    let folder = Folder::new();
    let modules =
        "[modules.helm]\n[actuators.rudder]\ncommand = \"helm/course\"\nlimits = { value = [-2.0, 2.0] }\n";
    let base = load("base", &(base(&folder) + modules), Mode::Staged);
    assert!(base.arm());
    let _base = Running::run(base);
    let text = |source: &str| {
        let links = format!("\"steer/command\" = \"slate://base/{source}\"\n");
        reading(&folder, &links).replace("[links]", "[modules.steer]\nkind = \"rudder\"\n[links]")
    };
    let arm = Running::start("arm", &text("rudder/command"), Mode::Staged);
    wait_for("the command within its limits", || arm.number("steer/moved") == 2.0);
    assert_eq!(arm.trouble("steer/command"), None);
    drop(arm);
    // The value of a module that is not a gate.
    let arm = Running::start("arm", &text("counter/number"), Mode::Staged);
    wait_for("the rule", || {
        arm.trouble("steer/command").is_some_and(|trouble| {
            trouble.contains("an Actuator reads the command that passed the gate")
                && trouble.contains("slate://base/counter/number")
        })
    });
    assert_eq!(arm.number("steer/moved"), -1.0, "it is safe");
}

#[test]
fn undelivered_messages_trouble_a_link_no_longer_than_needed() {
    let folder = Folder::new();
    let text = arm(&folder, "")
        .replace("{ from = \"slate://base/counter/number\", stale = \"5s\" }", "\"counter/number\"")
        .replace("\"reader/all\" = \"slate://base/counter/number\"\n", "")
        .replace("[links]", "[modules.counter]\n[links]");
    let sender = Running::start("arm", &text, Mode::Staged);
    wait_for("all messages to be sent", || sender.number("reader/fresh") > 20.0);
    wait_for("the trouble", || {
        sender
            .trouble("slate://base/counter/notes")
            .is_some_and(|trouble| trouble.contains("agent `base` is not reachable"))
    });
    let counter = Running::start("base", &base(&folder), Mode::Staged);
    wait_for("its end", || sender.trouble("slate://base/counter/notes").is_none());
    assert_eq!(counter.number("counter/sum"), 0.0, "nobody sends them again");
}

#[test]
fn a_schema_that_does_not_fit_is_named_and_mends_itself() {
    let folder = Folder::new();
    let text = arm(&folder, "").replace("base/counter/number\", stale", "base/counter/state\", stale");
    let reader = Running::start("arm", &text, Mode::Staged);
    let counter = Running::start("base", &base(&folder), Mode::Staged);
    wait_for("both interfaces", || {
        reader.trouble("reader/number").is_some_and(|trouble| {
            trouble.contains("`reader/number` is Number") && trouble.contains("ModuleState")
        })
    });
    // The rest of the agent continues.
    reader.hears_all();
    drop(counter);
    wait_for("its absence", || reader.trouble("reader/all").is_some());
}

#[test]
fn an_agent_that_can_not_share_refuses_links_to_others() {
    let folder = Folder::new();
    let configuration = Configuration::from_text("arm.toml", &arm(&folder, ""), &Reading::default()).unwrap();
    let plugins = [Plugin::linked::<Counter>(), Plugin::linked::<Reader>()];
    let error = Agent::load(&configuration, &plugins, Options::default()).unwrap_err();
    assert!(error.to_string().contains("`slate://base/counter/number` belongs to agent `base`"), "{error}");
}

#[test]
fn tools_see_another_agent_through_one_that_knows_it() {
    let folder = Folder::new();
    let _base = Running::start("base", &base(&folder), Mode::Staged);
    let (name, file) = (format!("arm-{}", std::process::id()), folder.path("base.json"));
    let text = format!(
        "[agent]\nname = \"{name}\"\n[share]\nlisten = \"{}\"\nagents.base.at = \"{}\"\nagents.nobody.at = \"{}\"\n",
        folder.endpoint("arm"),
        folder.endpoint("base"),
        folder.endpoint("nobody")
    );
    let arm = load("arm", &text, Mode::Staged);
    // Nothing is linked there, so only requests pass.
    let server = Server::open(&arm).unwrap();
    let _arm = Running::run(arm);
    let mut client = Client::connect(server.name()).unwrap();

    let tree = client.properties(Some("slate://base/counter/*")).unwrap();
    assert!(tree.iter().any(|property| property.path == "counter/number" && property.interface == "Number"));
    let first = client.read("slate://base/counter/number").unwrap().unwrap();
    let field = client.read("slate://base/counter/number/value").unwrap().unwrap();
    assert!(field.value.as_f64() >= first.value["value"].as_f64() && field.sequence >= first.sequence);

    let saved = client.save_remote("slate://base/**", &file).unwrap();
    let text = std::fs::read_to_string(&file).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let properties = json["properties"].as_array().unwrap();
    assert_eq!((json["agent"].as_str(), properties.len()), (Some("base"), saved.properties));
    assert!(saved.values > 0 && saved.values <= saved.properties);
    let number = properties.iter().find(|property| property["path"] == "counter/number").unwrap();
    assert!(number["newest"]["value"]["value"].as_f64() >= first.value["value"].as_f64(), "{number}");

    let mut refused = |url: &str, says: &[&str]| {
        let ClientError::Refused(refusal) = client.read(url).unwrap_err() else {
            panic!("{url} is not refused")
        };
        assert!(says.iter().all(|says| refusal.message.contains(says)), "{url}: {refusal:?}");
    };
    refused("slate://bse/counter/number", &["no agent `bse`", "nearest: base"]);
    refused("slate://base/countr/number", &["slate://base/countr/number", "nearest: counter/number"]);
    refused("slate://base/counter/number/valeu", &["no field `valeu`", "value"]);
    refused("slate://nobody/counter/number", &["`nobody`", "not connected"]);
    let there = std::fs::metadata(&file).unwrap().len();
    assert!(client.save_remote("slate://nobody/**", &file).is_err());
    assert!(client.properties(Some("slate://base/countr/**")).unwrap_err().to_string().contains("counter/"));
    assert_eq!(std::fs::metadata(&file).unwrap().len(), there, "what is refused leaves an older file");
}

/// An agent that reads others with those links alone.
fn reading(folder: &Folder, links: &str) -> String {
    let text = arm(folder, "");
    format!("{}{links}", &text[..text.find("\"reader/number\"").unwrap()])
}

#[test]
fn a_carrier_concerns_the_link_that_names_it() {
    let folder = Folder::new();
    let links = r#"
"reader/number" = { from = "slate://base/counter/number", carrier = "other" }
"slate://base/counter/notes" = { from = "reader/note", carrier = "other" }
"reader/all" = "slate://base/counter/number"
"reader/other/value" = "slate://base/counter/number/value"
"#;
    let _base = Running::start("base", &base(&folder), Mode::Staged);
    let reader = Running::start("arm", &reading(&folder, links), Mode::Staged);
    wait_for("values of the others", || reader.number("reader/changes") > 10.0);
    reader.hears_all();
    for to in ["reader/number", "slate://base/counter/notes"] {
        let trouble = reader.trouble(to).unwrap();
        assert!(trouble.contains("`base` is at local:") && trouble.contains("not by `other`"), "{trouble}");
    }
    assert_eq!(reader.number("reader/fresh"), 0.0);
    assert_eq!(reader.trouble("reader/all"), None);

    let unknown = reading(&folder, "\"reader/number\" = { from = \"slate://b/c/d\", carrier = \"udp\" }\n");
    let error = try_load("arm", &unknown, Mode::Staged).unwrap_err().to_string();
    assert!(error.contains("no carrier `udp`"), "{error}");
}

#[test]
fn a_slow_link_to_a_field_holds_back_no_other_field() {
    let folder = Folder::new();
    let links = r#"
"reader/number/value" = { from = "slate://base/counter/both/first", rate = "60min" }
"reader/other/value" = "slate://base/counter/both/second"
"#;
    let _base = Running::start("base", &base(&folder), Mode::Staged);
    let reader = Running::start("arm", &reading(&folder, links), Mode::Staged);
    wait_for("many values", || reader.number("reader/changes") > 50.0);
    assert_eq!(reader.trouble("reader/number/value"), None);
    assert_eq!(reader.trouble("reader/other/value"), None);
}

#[test]
fn values_follow_each_other_by_the_interval_of_their_link() {
    let folder = Folder::new();
    let links = r#"
"reader/other/value" = { from = "slate://base/counter/both/second", interval = "60min", compression = "none" }
"reader/all" = "slate://base/counter/number"
"#;
    let _base = Running::start("base", &base(&folder), Mode::Staged);
    let reader = Running::start("arm", &reading(&folder, links), Mode::Staged);
    wait_for("a first value", || reader.number("reader/changes") > 0.0);
    reader.hears_all();
    let count = |reader: &Running| reader.number("agents/base/counter/number");
    let before = count(&reader);
    wait_for("many more", || count(&reader) > before + 50.0);
    assert_eq!(reader.number("reader/changes"), 1.0);
}

#[test]
fn unreachable_endpoints_are_refused() {
    let folder = Folder::new();
    let text = reading(&folder, "\"reader/number\" = \"slate://base/counter/number\"\n");
    let refused = |from: &str, to: &str, says: &[&str]| {
        let text = text.replace(from, to);
        let error = try_load("arm", &text, Mode::Staged).unwrap_err();
        let StartError::Configuration(report) = error else { panic!("{error}") };
        let report = report.render(false);
        assert!(says.iter().all(|says| report.contains(says)), "{report}");
        assert!(!report.contains("in use"), "{report}");
    };
    let base = folder.endpoint("base");
    refused(&base, "tcp:1", &["tcp:1", "carrier", "agents.base.at"]);
    refused(&base, "local:a b", &["local:a b", "local:NAME"]);
    refused(&folder.endpoint("arm"), "foo:bar", &["foo:bar", "carrier"]);
    let nowhere = folder.path("no/such/folder");
    refused(&folder.endpoint("arm"), &format!("local:{}/arm", nowhere.display()), &["there is no folder"]);
    assert!(!folder.path("no").exists());
}

#[test]
fn an_agent_that_no_link_wants_any_more_is_not_dialed() {
    let folder = Folder::new();
    let arm = Running::start("arm", &arm(&folder, ""), Mode::Staged);
    wait_for("what shows of it", || arm.board.get("peers/base/link").is_some());
    for input in ["reader/number", "reader/all", "slate://base/counter/notes"] {
        arm.composer.unlink(input).unwrap();
    }
    wait_for("it to be forgotten", || arm.board.get("peers/base/link").is_none());
    // It is dialed again when a link wants it.
    let base = Running::start("base", &base(&folder), Mode::Staged);
    arm.composer.link(&NewLink::new("reader/number", "slate://base/counter/number")).unwrap();
    wait_for("fresh values", || arm.number("reader/fresh") > 3.0);
    drop(base);
}

#[test]
fn a_link_to_an_unknown_agent_names_the_nearest() {
    let folder = Folder::new();
    let links = "\"reader/number\" = \"slate://bsae/counter/number\"\n";
    let arm = Running::start("arm", &reading(&folder, links), Mode::Staged);
    wait_for("its first cycle", || arm.number("reader/gaps") == -1.0);
    wait_for("the nearest agent", || {
        let trouble = arm.trouble("reader/number").unwrap_or_default();
        trouble.contains("agent `bsae` is not reachable") && trouble.contains("nearest: base")
    });
}

#[test]
fn a_default_endpoint_in_use_is_reported_without_a_place() {
    let name = format!("twin-{:x}", agents::instance());
    let text = format!(
        "[agent]\nname = \"{name}\"\n[share.agents.other]\nat = \"local:other\"\n[modules.counter]\n"
    );
    let first = Running::start(&name, &text, Mode::Staged);
    wait_for("its first cycle", || first.number("counter/number") > 0.0);
    let error = try_load(&name, &text, Mode::Staged).unwrap_err();
    let StartError::Configuration(report) = error else { panic!("{error}") };
    let report = report.render(false);
    let in_use = format!("`local:{name}` is in use by another agent, process {}", std::process::id());
    assert!(report.contains(&in_use) && !report.contains("share.agents"), "{report}");
    drop(first);
}

#[cfg(not(feature = "jpeg"))]
#[test]
fn missing_jpeg_support_has_remedy() {
    let folder = Folder::new();
    let links = "\"reader/number\" = { from = \"slate://base/counter/number\", compression = \"jpeg:80\" }\n";
    let error = try_load("arm", &reading(&folder, links), Mode::Staged).unwrap_err();
    let StartError::Configuration(report) = error else { panic!("{error}") };
    let report = report.render(false);
    assert!(report.contains("was built without JPEG") && report.contains("the feature `jpeg`"), "{report}");
}
