//! The table and links of a configuration.

use slate_ros1::{Ros1Settings, check_name, node_of_agent};
use slate_runtime::configuration::{Configuration, Options};
use slate_topics::NodeAccess;

fn read(text: &str) -> Result<Option<Ros1Settings>, String> {
    let options = Options { extra_tables: vec!["ros1".into()], ..Options::default() };
    let text = format!("agent.name = \"r2-d2\"\n\n{text}");
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
    let input = &settings.topics.read[0];
    assert_eq!(
        (input.input.as_str(), input.topic.as_str(), input.quality.depth),
        ("driver/scan", "/scan", 10)
    );
    let output = &settings.topics.write[0];
    assert_eq!((output.topic.as_str(), output.property.as_str()), ("/odom", "sensor/odometry"));
    assert_eq!((output.frame.as_str(), output.quality.latched, output.quality.depth), ("odom", true, 3));
    assert_eq!(read("[links]\n\"driver/scan\" = \"laser/scan\""), Ok(None));
}

#[test]
fn untrusted_network_needs_local_master() {
    let table = |rest: &str| format!("[ros1]\n{rest}\n[links]\n\"driver/scan\" = \"ros1:/scan\"");
    for local in ["http://localhost:11311", "http://127.0.0.1:11311/", "http://[::1]:11311"] {
        assert!(!read(&table(&format!("master = \"{local}\""))).unwrap().unwrap().trusted);
    }
    let words = ["is not named by localhost", "trusted = true", "r2.toml:4"];
    refused(&table("master = \"http://robot:11311\""), &words);
    refused(&table("master = \"http://robot:11311\"\ntrusted = false"), &words);
    refused(&table("trusted = 1"), &["takes true or false"]);
    assert!(read(&table("master = \"http://robot:11311\"\ntrusted = true")).unwrap().unwrap().trusted);
}

#[test]
fn the_table_says_what_links_say_and_more() {
    let text = "[ros1]\nnode = \"/house/r2\"\nparameters = \"set\"\nrosout = false\ntf = true\nread.\"driver/scan\" = \"scan\"\n\
                write.\"~/odom\" = { from = \"sensor/odometry\", latched = true }\n\
                serve.\"~/off\" = { to = \"lamp/switches\", type = \"std_srvs/Trigger\", value = { on = false } }\n\
                call.\"/enable\" = { from = \"driver/ask\", type = \"std_srvs/SetBool\", timeout = \"2s\" }\n\
                frames.\"laser_frame/transform\" = \"laser\"";
    let settings = read(text).unwrap().unwrap();
    assert_eq!(
        (settings.node.as_str(), settings.topics.read[0].topic.as_str()),
        ("/house/r2", "/house/scan")
    );
    let output = &settings.topics.write[0];
    assert_eq!((output.topic.as_str(), output.property.as_str()), ("/house/r2/odom", "sensor/odometry"));
    assert_eq!(
        (settings.serve[0].service.as_str(), settings.serve[0].service_type.name()),
        ("/house/r2/off", "std_srvs/Trigger")
    );
    assert_eq!(settings.call[0].timeout, std::time::Duration::from_secs(2));
    assert_eq!(settings.options.parameters, NodeAccess::Set);
    assert!(settings.options.transforms && !settings.options.log && !settings.options.clock);
    assert_eq!(settings.options.frames[0].frame, "laser");
}

#[test]
fn errors_have_their_place() {
    let with = |links: &str| format!("[ros1]\ntrusted = true\n[links]\n{links}");
    refused(
        &with("\"driver/scan\" = \"ros1:/scan-2\""),
        &["`/scan-2` can't be the name", "'-'", "r2.toml:6"],
    );
    refused(&with("\"a/b\" = \"ros1:/1scan\""), &["does not begin with a letter"]);
    refused(
        &with("\"ros1:/x\" = \"a/b\"\n\"ros1:x\" = \"a/c\""),
        &["/x is written by two entries, of /a/b and /a/c"],
    );
    refused(
        &with("\"ros1:/x\" = \"a/b\"\n\"c/d\" = \"ros1:/x\""),
        &["/x is read by /c/d and written by /a/b"],
    );
    refused(&with("\"ros1:/rosout\" = \"a/b\""), &["/rosout is written by /a/b and by the node itself"]);
    refused(&with("\"a/b\" = { from = \"ros1:/x\", depth = 0 }"), &["`depth` is a number from 1 to 10000"]);
    refused(&with("\"a/b\" = { from = \"ros1:/x\", latched = true }"), &["latched"]);
    refused("[ros1]\ntrusted = true", &["[ros1] names no topic, and no link does"]);
    let own = "serve.\"/on\" = { to = \"lamp/switches\", type = \"std_srvs/srv/SetBool\" }";
    refused(&format!("[ros1]\n{own}"), &["std_srvs/srv/SetBool is unknown", "std_srvs/SetBool"]);
    refused("[ros1]\nparameters = \"write\"", &["expected `parameters` to be none, read or set"]);
    refused("[ros1]\nread.\"a/b\" = { depth = 1 }", &["an entry lacks `topic`"]);
    refused("ros1 = 3", &["`ros1` is a table"]);
    let table = "[ros1]\ntrusted = true\nmaster = \"robot:11311\"\n[links]\n\"a/b\" = \"ros1:/x\"";
    refused(table, &["a master is http://HOST:PORT, found `robot:11311`", "r2.toml:5"]);
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
