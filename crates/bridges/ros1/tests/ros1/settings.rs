//! The table and links of a configuration.

use slate_ros1::{Ros1Settings, check_name, node_of_agent};
use slate_runtime::configuration::{Configuration, Options};

fn read(text: &str) -> Result<Option<Ros1Settings>, String> {
    let options = Options { extra_tables: vec!["ros1".into()], ..Options::default() };
    let text = format!("[agent]\nname = \"r2-d2\"\n{text}");
    let configuration = Configuration::from_text("r2.toml", &text, &options).unwrap();
    Ros1Settings::of(&configuration).map_err(|report| report.to_string())
}

#[track_caller]
fn refused(text: &str, words: &[&str]) {
    let error = read(text).unwrap_err();
    for word in words {
        assert!(error.contains(word), "no {word:?} in {error}");
    }
}

#[test]
fn links_and_table_say_all() {
    let text = "[ros1]\nmaster = \"http://robot:11311\"\ntrusted = true\n[links]\n\"driver/scan\" = \"ros1:/scan\"\n\
                \"ros1:odom\" = { from = \"sensor/odometry\", frame = \"odom\", latched = true, depth = 3 }";
    let settings = read(text).unwrap().unwrap();
    assert_eq!((settings.master.as_str(), settings.node.as_str()), ("http://robot:11311", "/r2_d2"));
    let input = &settings.read[0];
    assert_eq!((input.input.as_str(), input.topic.as_str(), input.depth), ("driver/scan", "/scan", 10));
    let output = &settings.write[0];
    assert_eq!((output.topic.as_str(), output.property.as_str()), ("/odom", "sensor/odometry"));
    assert_eq!((output.frame.as_str(), output.latched, output.depth), ("odom", true, 3));
    assert_eq!(read("[links]\n\"driver/scan\" = \"laser/scan\""), Ok(None));
}

#[test]
fn who_does_not_trust_the_network_has_no_ros_1() {
    let link = "[links]\n\"driver/scan\" = \"ros1:/scan\"";
    refused(link, &["open to everybody", "trusted = true", "r2.toml:4"]);
    refused(&format!("[ros1]\ntrusted = false\n{link}"), &["open to everybody", "r2.toml:4"]);
    refused(&format!("[ros1]\ntrusted = 1\n{link}"), &["takes true or false"]);
}

#[test]
fn mistakes_are_named_with_their_place() {
    let with = |links: &str| format!("[ros1]\ntrusted = true\n[links]\n{links}");
    refused(
        &with("\"driver/scan\" = \"ros1:/scan-2\""),
        &["`/scan-2` can't be the name", "'-'", "r2.toml:6"],
    );
    refused(&with("\"a/b\" = \"ros1:/1scan\""), &["does not begin with a letter"]);
    refused(
        &with("\"ros1:/x\" = \"a/b\"\n\"ros1:x\" = \"a/c\""),
        &["/x is written by two links, of /a/b and /a/c"],
    );
    refused(
        &with("\"ros1:/x\" = \"a/b\"\n\"c/d\" = \"ros1:/x\""),
        &["/x is read by /c/d and written by /a/b"],
    );
    refused(&with("\"a/b\" = { from = \"ros1:/x\", depth = 0 }"), &["`depth` is a number from 1 to 10000"]);
    refused(&with("\"a/b\" = { from = \"ros1:/x\", latched = true }"), &["latched"]);
    refused("[ros1]\ntrusted = true", &["no link names a topic"]);
    refused("ros1 = 3", &["`ros1` is a table"]);
    let table = "[ros1]\ntrusted = true\nmaster = \"robot:11311\"\n[links]\n\"a/b\" = \"ros1:/x\"";
    refused(table, &["begins with http://", "r2.toml:5"]);
    let table = "[ros1]\ntrusted = true\nnode = \"r2 d2\"\n[links]\n\"a/b\" = \"ros1:/x\"";
    refused(table, &["`/r2 d2` can't be the name of a node"]);
}

#[test]
fn names_are_those_of_ros() {
    assert_eq!(node_of_agent("r2-d2"), "r2_d2");
    assert_eq!(node_of_agent("2nd"), "agent_2nd");
    for good in ["/scan", "/r2/front_scan", "/R2"] {
        assert_eq!(check_name(good), Ok(()), "{good}");
    }
    for wrong in ["scan", "/", "/a//b", "/a/", "/a b", "/_a", "/ä"] {
        assert!(check_name(wrong).is_err(), "{wrong}");
    }
}
