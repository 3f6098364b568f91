//! The table `[network]`.

use slate_network::{InputSource, NetworkMode, NetworkSettings, ReadMode, ReadRate};
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
fn each_error_has_file_line_and_remedy() {
    let cases = [
        ("listen = [\"127.0.0.1:7447\"]", "`127.0.0.1:7447` is not an endpoint"),
        ("listen = [\"tcp/127.0.0.1\"]", "has no host and port"),
        ("listen = [\"tcp/127.0.0.1:http\"]", "`http` is not a port"),
        ("listen = [\"tcp/::1:7447\"]", "`::1` is not a host"),
        ("listen = [\"tcp/127.0.0.1:7447?rel=0\"]", "has options"),
        ("listen = [\"tls/127.0.0.1:7447\"]", "Zenoh's TLS lets two threads into one connection at once"),
        (
            "listen = [\"quic/10.0.0.7:7447\"]",
            "needs `certificate`, `key` and `authority` in [network.security]",
        ),
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
        ("set = [\"a//b\"]", "is not a pattern of paths"),
        ("read = [\"a/in\"]", "`read` is a table of inputs, found a list"),
        ("read.\"a/in\" = \"zenoh:a/*\"", "is not a key of Zenoh"),
        ("read.\"a/in\" = 3", "an input reads a URL, found a whole number"),
        ("read.\"slate://base/in\" = \"zenoh:a\"", "belongs to agent `base`"),
        ("listen = [\"tcp/[::1]:1\"]\nteam = true", "the agent takes no part in a team"),
        ("endpoints = []", "endpoints"),
    ];
    for (table, message) in cases {
        let text = wrong(table);
        assert!(text.starts_with("arm.toml:"), "{table}: {text}");
        assert!(text.contains(message), "{table}: {text}");
        assert!(!text.contains("()"), "no help: {text}");
    }
}

/// The certificates of a configuration that is beside them.
const FILES: &str =
    "certificate = \"keys/arm.pem\"\nkey = \"keys/arm.key\"\nauthority = \"keys/authority.pem\"";

#[test]
fn certificates_and_rights_are_read() {
    let settings = read(&format!(
        "listen = [\"quic/0.0.0.0:7447\", \"tcp/[::1]:7447\"]\n[network.security]\n{FILES}\n\
         unauthenticated = {{ read = [\"**\"] }}\n[network.security.allow.base]\nread = [\"localizer/**\"]\n\
         send = [\"mission/goal\"]\n[network.security.allow]\nhub = {{ router = true }}"
    ))
    .unwrap();
    assert!(settings.listen[0].is_encrypted() && !settings.listen[1].is_encrypted());
    let security = settings.security.unwrap();
    assert!(security.key.path.ends_with("keys/arm.key"), "{:?}", security.key);
    let base = &security.allow["base"];
    assert!(
        base.may_read("localizer/pose") && !base.may_read("mission/goal") && base.may_send("mission/goal")
    );
    assert!(!base.router && security.allow["hub"].router);
    let unauthenticated = security.unauthenticated.as_ref().unwrap();
    assert!(unauthenticated.may_read("mission/goal") && !unauthenticated.may_send("mission/goal"));
    // Through a router that checks names, the others have at most its rights.
    assert_eq!((security.rights("base"), security.rights("leg")), (Some(base), security.allow.get("hub")));
}

#[test]
fn each_error_in_certificates_and_rights_is_reported() {
    let quic = "listen = [\"quic/[::1]:7447\"]";
    let secure = |rest: &str| format!("{quic}\n[network.security]\n{FILES}\n{rest}");
    let arm = "[network.security.allow.arm]";
    let cases = [
        (format!("{quic}\nsecurity = 1"), "`security` is a table, found a whole number"),
        (format!("{quic}\n[network.security]\nkey = \"a\"\n{arm}"), "[network.security] lacks `certificate`"),
        (secure("[network.security.allow.arm]").replace("\"keys/arm.key\"", "1"), "`key` takes text"),
        (secure(arm).replace("keys/arm.key", "keys;1/arm.key"), "contains `;`"),
        (secure(""), "has this agent's identity, but no rights of others"),
        (secure("allow = []"), "`allow` is a table, found a list"),
        (secure("[network.security.allow.\"robot.local\"]"), "`robot.local` can't be an agent's name"),
        (secure("[network.security.allow]\narm = 1"), "`network.security.allow.arm` is a table"),
        (
            secure("[network.security.allow.arm]\nwrite = []"),
            "unknown key `write` in [network.security.allow.arm]",
        ),
        (secure("[network.security.allow.arm]\nread = [\"a b\"]"), "`a b` is not a pattern of paths"),
        (secure("[network.security.allow.arm]\nteam = 1"), "`team` takes true or false"),
        (
            secure("[network.security.allow.arm]\nteam = true"),
            "belong to the team, and [network] has no `team`",
        ),
        (secure("[network.security.allow.arm]\nrouter = 1"), "`router` takes true or false"),
        (secure("verify = 1\n[network.security.allow.arm]"), "unknown key `verify` in [network.security]"),
        (format!("mode = \"router\"\n{}", secure(arm)), "passes on nothing of others"),
        (secure(arm).replace("quic", "tcp"), "no endpoint is `quic/`"),
        (
            format!("connect = [\"tcp/[::1]:7448\"]\n{}", secure(arm)),
            "others at `tcp/[::1]:7448` have no name",
        ),
        (format!("multicast = {{ trusted = true }}\n{}", secure(arm)), "others at `multicast` have no name"),
    ];
    for (table, message) in cases {
        let text = wrong(&table);
        assert!(text.starts_with("arm.toml:") && text.contains(message), "{table}: {text}");
        assert!(!text.contains("()"), "no help: {text}");
    }
}

#[test]
fn links_name_keys_beside_the_table() {
    let of = |links: &str, table: &str| {
        let options = Options { extra_tables: vec!["network".into()], ..Options::default() };
        let text = format!("agent.name = \"arm\"\n[links]\n{links}\n{table}");
        let configuration = Configuration::from_text("arm.toml", &text, &options).unwrap();
        NetworkSettings::of(&configuration).map(Option::unwrap)
    };
    let table = "[network]\nlisten = [\"tcp/127.0.0.1:7447\"]";
    let links = "\"a/in\" = { from = \"zenoh:demo/temperature\", rate = \"10Hz\", mode = \"reliable\" }\n\
                 \"zenoh:demo/speed\" = \"a/speed\"";
    let settings = of(links, table).unwrap();
    let input = &settings.read["a/in"];
    assert_eq!(input.source, InputSource::Key("demo/temperature".into()));
    assert_eq!((input.options.rate, input.options.mode), (ReadRate::Every(100_000_000), ReadMode::Reliable));
    let output = &settings.write[0];
    assert_eq!((output.key.as_str(), output.property.as_str()), ("demo/speed", "a/speed"));
    let both = format!("{table}\nread.\"a/in\" = \"zenoh:b\"");
    for (links, table, words) in [
        ("\"a/in\" = \"zenoh:b\"", "", "`zenoh:b` needs a network, and the configuration has no [network]"),
        ("\"a/in\" = \"zenoh:b/*\"", table, "is not a key of Zenoh"),
        ("\"zenoh:b//c\" = \"a/out\"", table, "is not a key of Zenoh"),
        ("\"zenoh:slate/base/goal\" = \"a/out\"", table, "is a key of an agent"),
        ("\"zenoh:b\" = { from = \"a/out\", rate = \"10Hz\" }", table, "rate"),
        ("\"a/in\" = { from = \"zenoh:b\", mode = \"best-effort\" }", table, "its writer is not an agent"),
        ("\"a/in\" = { from = \"zenoh:b\", every = 2 }", table, "every"),
        ("\"a/in\" = \"zenoh:c\"", &both, "/a/in reads two sources, and the other is `zenoh:b`"),
    ] {
        let report = of(links, table).unwrap_err();
        let found = report.diagnostics().iter().find(|own| own.message().contains(words));
        let found = found.unwrap_or_else(|| panic!("{links}: {report}"));
        assert!(
            found.placed().starts_with("arm.toml:3:") && found.help_text().is_some(),
            "{}",
            found.placed()
        );
    }
}
