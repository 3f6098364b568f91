//! Answers to monitors.

use crate::agent::RunningAgent;
use crate::client::Client;

const ONE: &str = "[modules.planner]\nkind = \"shown\"\n[groot]\nport = 0";

#[test]
fn monitors_see_tree_statuses_and_blackboards() {
    let agent = RunningAgent::start(ONE);
    let mut client = Client::connect(agent.ports()[0]);
    let tree = client.ask(b'T', &[]);
    assert_eq!(
        (&tree[0][..6], tree[0].len()),
        (&[2, b'T', 77, 0, 0, 0][..], 22),
        "the header, and a number of the tree"
    );
    assert_eq!(tree[1], b"<root/>");
    let statuses = client.ask(b'S', &[]);
    assert_eq!(statuses[1], [1, 0, 1, 2, 0, 12, 3, 0, 3]);
    assert_eq!(statuses[0][6..], tree[0][6..], "it is that of the same tree");
    let go = b"\xde\x00\x01\xd9\x09main/1 go\xde\x00\x01\xd9\x02to\xd9\x07kitchen";
    assert_eq!(client.ask(b'B', &[b"main/1 go;none"])[1], go);
    let all = &client.ask(b'B', &[b""])[1];
    let main = b"\xd9\x04main\xde\x00\x03\xd9\x01x\x01\xd9\x01y\xcb\xbf\xe0\0\0\0\0\0\0\xd9\x01z\xd3\0\0\0\0\0\0\x01\x2c";
    assert!(all.windows(main.len()).any(|part| part == main), "{all:?}");
    assert_eq!(client.ask(b'D', &[])[1], b"[]", "no hooks");
}

#[test]
fn no_monitor_stops_a_tree() {
    let agent = RunningAgent::start(ONE);
    let mut client = Client::connect(agent.ports()[0]);
    for (kind, words) in [
        (b'I', "no breakpoints"),
        (b'U', "no breakpoints"),
        (b'r', "slate record"),
        (b'Z', "unknown request"),
    ] {
        let answer = client.ask(kind, &[b"{}"]);
        assert_eq!(answer[0], b"error");
        assert!(String::from_utf8_lossy(&answer[1]).contains(words), "{answer:?}");
    }
    assert_eq!(client.ask(b'B', &[])[0], b"error", "no names");
    assert_eq!(client.ask(b'A', &[]).len(), 1, "there is nothing to remove");
}

#[test]
fn each_tree_has_a_port_of_its_own() {
    let modules =
        "[modules.planner]\nkind = \"shown\"\n[modules.other]\nkind = \"shown\"\nparams.xml = \"<other/>\"";
    let agent = RunningAgent::start(&format!("{modules}\n[groot]\nports = {{ other = 0, planner = 0 }}"));
    let trees = agent.ports().into_iter().map(|port| Client::connect(port).ask(b'T', &[]).remove(1));
    assert_eq!(trees.collect::<Vec<_>>(), [b"<other/>".to_vec(), b"<root/>".to_vec()]);
}

#[test]
fn a_tree_that_is_too_large_is_refused_in_words() {
    let xml = "x".repeat(100);
    let agent = RunningAgent::start(&format!(
        "[modules.planner]\nkind = \"shown\"\nparams.xml = \"{xml}\"\n[groot]\nport = 0"
    ));
    let answer = Client::connect(agent.ports()[0]).ask(b'T', &[]);
    assert_eq!(answer[0], b"error");
    assert!(String::from_utf8_lossy(&answer[1]).contains("100 bytes, or more"), "{answer:?}");
}
