//! The table `[network]`.

use slate_network::{InputSource, NetworkMode, NetworkSettings};
use slate_runtime::configuration::{Configuration, Options, Report};

fn read(table: &str) -> Result<NetworkSettings, Report> {
    let options = Options { extra_tables: vec!["network".into()], ..Options::default() };
    let text = format!("[agent]\nname = \"arm\"\n[network]\n{table}\n");
    let configuration = Configuration::from_text("arm.toml", &text, &options)?;
    NetworkSettings::of(&configuration).map(Option::unwrap)
}

/// The lines of the report, each with its file and line, and what to do.
fn wrong(table: &str) -> String {
    let report = read(table).unwrap_err();
    let line = |diagnostic: &slate_runtime::configuration::Diagnostic| {
        format!("{} ({})\n", diagnostic.placed(), diagnostic.help_text().unwrap())
    };
    report.diagnostics().iter().map(line).collect()
}

#[test]
fn a_table_is_read_with_its_defaults() {
    let settings = read("listen = [\"tcp/127.0.0.1:7447\", \"udp/[::1]:7448\"]").unwrap();
    assert_eq!((settings.mode, settings.multicast), (NetworkMode::Peer, false));
    assert_eq!(settings.listen[1].text, "udp/[::1]:7448");
    assert!(settings.is_published("any/property") && !settings.is_settable("any/property"));
    let settings = read(
        "mode = \"client\"\nconnect = [{ endpoint = \"tcp/10.0.0.7:7447\", trusted = true }]\npublish = [\"a/*\"]\n\
         set = [\"a/goal\"]\nread.\"a/in\" = \"zenoh:demo/temperature\"",
    )
    .unwrap();
    assert_eq!((settings.mode, settings.connect[0].address()), (NetworkMode::Client, "10.0.0.7:7447"));
    assert!(
        settings.is_published("a/goal") && !settings.is_published("b/goal") && settings.is_settable("a/goal")
    );
    assert_eq!(settings.read["a/in"].source, InputSource::Key("demo/temperature".into()));
}

#[test]
fn clear_text_leaves_the_machine_only_where_it_is_trusted() {
    for endpoint in ["tcp/0.0.0.0:7447", "tcp/[::]:7447", "udp/192.168.0.7:7447", "tcp/robot.local:7447"] {
        let text = wrong(&format!("listen = [\"{endpoint}\"]"));
        assert!(
            text.starts_with("arm.toml:4:") && text.contains("clear text") && text.contains("trusted = true"),
            "{text}"
        );
        assert!(read(&format!("connect = [\"{endpoint}\"]")).is_err());
        let trusted = read(&format!("listen = [{{ endpoint = \"{endpoint}\", trusted = true }}]")).unwrap();
        assert_eq!(trusted.listen[0].text, endpoint);
        assert!(read(&format!("listen = [{{ endpoint = \"{endpoint}\", trusted = false }}]")).is_err());
    }
    for endpoint in ["tcp/127.0.0.1:7447", "tcp/localhost:7447", "udp/[::1]:7447", "tcp/127.8.0.1:1"] {
        assert!(read(&format!("listen = [\"{endpoint}\"]")).is_ok(), "{endpoint}");
    }
    assert!(wrong("multicast = true").contains("trusted = true"));
    assert!(read("multicast = { trusted = true }").unwrap().multicast);
}

#[test]
fn each_mistake_is_told_with_file_line_and_what_to_do() {
    let cases = [
        ("listen = [\"127.0.0.1:7447\"]", "`127.0.0.1:7447` is not an endpoint"),
        ("listen = [\"tcp/127.0.0.1\"]", "has no host and port"),
        ("listen = [\"tcp/127.0.0.1:http\"]", "`http` is not a port"),
        ("listen = [\"tcp/::1:7447\"]", "`::1` is not a host"),
        ("listen = [\"tcp/127.0.0.1:7447?rel=0\"]", "has options"),
        ("listen = [\"quic/127.0.0.1:7447\"]", "needs an encrypted carrier"),
        ("listen = [\"ws/127.0.0.1:7447\"]", "`ws` is not a carrier"),
        ("listen = [7447]", "`listen` takes endpoints, found a whole number"),
        ("listen = \"tcp/127.0.0.1:7447\"", "`listen` takes a list, found text"),
        ("listen = [{ trusted = true }]", "an endpoint lacks `endpoint`"),
        ("listen = [{ endpoint = \"tcp/10.0.0.7:1\", trusted = \"yes\" }]", "`trusted` takes true or false"),
        ("mode = \"broker\"", "`mode` is `peer`, `client` or `router`, found \"broker\""),
        ("mode = \"client\"", "a client connects to a router"),
        (
            "mode = \"client\"\nlisten = [\"tcp/[::1]:1\"]\nconnect = [\"tcp/[::1]:2\"]",
            "a client does not listen",
        ),
        ("mode = \"router\"\nconnect = [\"tcp/[::1]:2\"]", "a router listens"),
        ("publish = []", "[network] reaches no other program"),
        ("multicast = 1", "`multicast` takes true or false, found a whole number"),
        ("set = [\"a//b\"]", "is no pattern of paths"),
        ("read = [\"a/in\"]", "`read` is a table of inputs, found a list"),
        ("read.\"a/in\" = \"zenoh:a/*\"", "is not a key of Zenoh"),
        ("read.\"a/in\" = 3", "an input reads a URL, found a whole number"),
        ("read.\"slate://base/in\" = \"zenoh:a\"", "belongs to agent `base`"),
        ("endpoints = []", "endpoints"),
    ];
    for (table, message) in cases {
        let text = wrong(table);
        assert!(text.starts_with("arm.toml:"), "{table}: {text}");
        assert!(text.contains(message), "{table}: {text}");
        assert!(!text.contains("()"), "no help: {text}");
    }
}
