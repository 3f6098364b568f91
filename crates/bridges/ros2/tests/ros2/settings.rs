//! The table `[ros2]`.

use slate_ros_messages::WireFormat;
use slate_ros2::{NodeAccess, RosSettings, ServiceType, TABLE, TopicQuality, WaitPer};
use slate_runtime::configuration::{Configuration, Options, Report};

fn read(table: &str) -> Result<Option<RosSettings>, Report> {
    let options = Options { extra_tables: vec![TABLE.into()], ..Options::default() };
    let text = format!("agent.name = \"r2-d2\"\n[ros2]\n{table}\n");
    RosSettings::of(&Configuration::from_text("r2.toml", &text, &options).unwrap())
}

#[test]
fn entries_are_a_text_or_a_table() {
    let table = "domain = 7\nnamespace = \"/robots\"\nread.\"driver/scan\" = { topic = \"scan\", reliable = false, depth = 1 }\n\
                 read.\"/driver/goal\" = \"/goal\"\nwrite.\"/cmd_vel\" = \"wheels/command\"\n\
                 write.\"~/scan\" = { from = \"laser/scan\", frame = \"laser\", transient_local = true }";
    let settings = read(table).unwrap().unwrap();
    assert_eq!((settings.domain, settings.trusted), (7, false));
    assert_eq!((settings.node.namespace.as_str(), settings.node.name.as_str()), ("/robots", "r2_d2"));
    let read: Vec<_> = settings
        .topics
        .read
        .iter()
        .map(|own| (own.input.as_str(), own.topic.as_str(), own.quality))
        .collect();
    let usual = TopicQuality { reliable: true, transient_local: false, depth: 10 };
    let lossy = TopicQuality { reliable: false, transient_local: false, depth: 1 };
    assert_eq!(read, [("driver/goal", "/goal", usual), ("driver/scan", "/robots/scan", lossy)]);
    let written: Vec<_> = settings
        .topics
        .write
        .iter()
        .map(|own| (own.topic.as_str(), own.property.as_str(), own.frame.as_str()))
        .collect();
    assert_eq!(
        written,
        [("/cmd_vel", "wheels/command", "base_link"), ("/robots/r2_d2/scan", "laser/scan", "laser")]
    );
    let kept = settings.topics.write.iter().find(|own| own.frame == "laser").unwrap().quality;
    assert_eq!(kept, TopicQuality { transient_local: true, ..usual });
}

#[test]
fn an_input_may_have_cycles_wait_for_its_messages() {
    let table = "clock = true\nread.\"driver/scan\" = { topic = \"/scan\", wait_per = \"20ms\", late = \"continue\" }\n\
                 read.\"driver/goal\" = { topic = \"/goal\", wait_per = \"/clock\", timeout = \"2s\" }\n\
                 read.\"driver/odometry\" = \"/odom\"";
    let read = read(table).unwrap().unwrap().topics.read;
    let wait = |input: &str| read.iter().find(|own| own.input == input).unwrap().wait.clone();
    assert_eq!(wait("driver/odometry"), None);
    let (scan, goal) = (wait("driver/scan").unwrap(), wait("driver/goal").unwrap());
    assert_eq!(
        (scan.per, scan.timeout.as_secs(), scan.continue_when_late),
        (WaitPer::Period(20_000_000), 10, true)
    );
    assert_eq!(
        (goal.per, goal.timeout.as_secs(), goal.continue_when_late),
        (WaitPer::Topic("/clock".into()), 2, false)
    );
}

#[test]
fn services_have_a_type_and_a_port() {
    let table = "serve.\"~/on\" = { to = \"lamp/switches\", type = \"std_srvs/srv/Empty\", value = { on = true } }\n\
                 call.\"/sum\" = { from = \"driver/ask\", type = \"a_package/srv/Sum\", timeout = \"200ms\", \
                 response = \"driver/sum\", definition = \"int64 a\\nint64 b\\n---\\nint64 sum\" }";
    let settings = read(table).unwrap().unwrap();
    let [offer] = &settings.serve[..] else { panic!("{settings:?}") };
    assert_eq!((offer.service.as_str(), offer.inbox.as_str()), ("/r2_d2/on", "lamp/switches"));
    assert_eq!(
        (offer.service_type.name(), &offer.value),
        ("std_srvs/srv/Empty", &serde_json::json!({ "on": true }))
    );
    let [call] = &settings.call[..] else { panic!("{settings:?}") };
    assert_eq!((call.outbox.as_str(), call.response.as_deref()), ("driver/ask", Some("driver/sum")));
    assert_eq!(
        (call.service_type.request().name(), call.timeout.as_millis()),
        ("a_package/srv/Sum_Request", 200)
    );
    assert_eq!(call.service_type.response().schema().field_names().collect::<Vec<_>>(), ["sum"]);
    assert_eq!(
        call.service_type,
        ServiceType::parse(WireFormat::Cdr, "a_package/srv/Sum", "int64 a\nint64 b\n---\nint64 sum").unwrap()
    );
}

#[test]
fn a_node_has_options_beside_its_topics() {
    let usual = read("read.\"driver/goal\" = \"/goal\"").unwrap().unwrap().options;
    assert_eq!((usual.parameters, usual.log), (NodeAccess::Read, true));
    assert!(!usual.clock && !usual.transforms && usual.frames.is_empty());
    let table = "parameters = \"set\"\nclock = true\nrosout = false\ntf = true\nframes.\"laser/transform\" = \"laser\"";
    let own = read(table).unwrap().unwrap().options;
    assert_eq!((own.parameters, own.clock, own.log, own.transforms), (NodeAccess::Set, true, false, true));
    let [frame] = &own.frames[..] else { panic!("{own:?}") };
    assert_eq!((frame.input.as_str(), frame.frame.as_str()), ("laser/transform", "laser"));
}

#[test]
#[cfg(any(feature = "zenoh", not(feature = "dds")))]
fn a_node_is_on_dds_or_a_client_of_a_router_of_zenoh() {
    use slate_ros2::RosWireSettings;

    let wire =
        |table: &str| read(&format!("{table}\nread.\"driver/goal\" = \"/goal\"")).unwrap().unwrap().wire;
    assert_eq!(wire(""), RosWireSettings::Dds);
    assert_eq!(wire("wire = \"dds\""), RosWireSettings::Dds);
    assert_eq!(wire("wire = \"zenoh\""), RosWireSettings::local_zenoh());
    let router = |wire| match wire {
        RosWireSettings::Zenoh { router } => router.text,
        RosWireSettings::Dds => String::new(),
    };
    assert_eq!(router(wire("wire = \"zenoh\"\nrouter = \"tcp/[::1]:7000\"")), "tcp/[::1]:7000");
    let far = "wire = \"zenoh\"\nrouter = \"tcp/10.0.0.7:7447\"\ntrusted = true";
    assert_eq!(router(wire(far)), "tcp/10.0.0.7:7447");
}

#[test]
#[cfg(all(feature = "dds", not(feature = "zenoh")))]
fn a_program_without_zenoh_says_how_to_get_it() {
    let report = read("wire = \"zenoh\"\nread.\"driver/goal\" = \"/goal\"").unwrap_err();
    assert!(
        report.to_string().contains("this program is built without the features `ros2,zenoh`"),
        "{report}"
    );
    assert!(report.diagnostics()[0].help_text().unwrap().contains("--features ros2,zenoh"));
}

#[test]
#[cfg(any(feature = "zenoh", not(feature = "dds")))]
fn a_router_is_on_this_machine_unless_the_network_is_trusted() {
    for (router, words) in [
        ("7447", "`7447` is not an endpoint"),
        ("tcp/localhost", "has no host and port"),
        ("quic/localhost:7447", "`quic/localhost:7447` is not an endpoint of `tcp/`"),
        ("tls/10.0.0.7:7447", "`tls/10.0.0.7:7447` can't be used"),
        ("tcp/10.0.0.7:7447", "`tcp/10.0.0.7:7447` is on another machine, and what goes there is clear text"),
    ] {
        let table = format!("wire = \"zenoh\"\nrouter = {router:?}\nread.\"driver/goal\" = \"/goal\"");
        let report = read(&table).unwrap_err();
        let found = report.diagnostics().iter().find(|own| own.message().contains(words));
        let found = found.unwrap_or_else(|| panic!("{router}: {report}"));
        assert!(found.help_text().is_some() && report.to_string().contains(":4:"), "{report}");
    }
}

#[test]
fn errors_have_their_line() {
    let cases = [
        ("wire = \"tcp\"", 3, "expected `wire` to be dds or zenoh, found \"tcp\""),
        ("router = \"tcp/localhost:7447\"", 3, "DDS has no router, and `router` names one"),
        ("", 2, "[ros2] names no topic"),
        ("domain = 233", 3, "a domain is a number from 0 to 232, found 233"),
        ("domain = \"a\"", 3, "a domain is a number"),
        ("node = \"r2-d2\"", 3, "`r2-d2` can't be the name of a node: it has '-'"),
        ("namespace = \"robots\"", 3, "`robots` can't be a namespace: it does not begin with a slash"),
        ("trusted = 1", 3, "`trusted` takes true or false"),
        ("multicast = true", 3, "multicast"),
        ("read = 1", 3, "`read` is a table"),
        ("read.\"driver/scan\" = 1", 3, "a text or a table"),
        ("read.\"driver/scan\" = \"/my-scan\"", 3, "`/my-scan` can't be the name of a topic: it has '-'"),
        ("read.\"driver/scan\" = { reliable = true }", 3, "an entry lacks `topic`"),
        (
            "read.\"driver/scan\" = { topic = \"/scan\", depth = 0 }",
            3,
            "`depth` is a number from 1 to 10000, found 0",
        ),
        ("read.\"driver/scan\" = { topic = \"/scan\", best_effort = true }", 3, "best_effort"),
        ("read.\"driver/scan\" = { topic = \"/scan\", reliable = 1 }", 3, "`reliable` takes true or false"),
        (
            "read.\"driver/scan\" = { topic = \"/scan\", wait_per = \"/odom\" }",
            3,
            "messages for each value of /odom are waited for, and no entry writes it",
        ),
        (
            "read.\"driver/scan\" = { topic = \"/scan\", wait_per = \"/clock\" }",
            3,
            "messages are waited for by the time of the agent, and /clock is not published",
        ),
        (
            "read.\"driver/scan\" = { topic = \"/scan\", wait_per = \"20ms\" }",
            3,
            "messages are waited for by the time of the agent, and /clock is not published",
        ),
        (
            "read.\"driver/scan\" = { topic = \"/scan\", timeout = \"1s\" }",
            3,
            "`timeout` is that of `wait_per`, which is missing",
        ),
        (
            "read.\"driver/scan\" = { topic = \"/scan\", wait_per = \"1s\", late = \"drop\" }",
            3,
            "expected `late` to be stop or continue, found \"drop\"",
        ),
        (
            "read.\"driver/scan\" = { topic = \"/scan\", wait_per = \"a b\" }",
            3,
            "`a b` can't be the name of a topic",
        ),
        ("parameters = true", 3, "`parameters` takes a text"),
        ("parameters = \"all\"", 3, "expected `parameters` to be none, read or set, found \"all\""),
        ("clock = \"yes\"", 3, "`clock` takes true or false"),
        ("frames.\"laser/transform\" = 1", 3, "a frame is a text, found 1"),
        ("serve.\"/on\" = \"lamp/switches\"", 3, "an entry of a service is a table, found text"),
        ("serve.\"/on\" = { to = \"lamp/switches\" }", 3, "an entry lacks `type`"),
        ("serve.\"/on\" = { type = \"std_srvs/srv/Empty\" }", 3, "an entry lacks `to`"),
        (
            "serve.\"/on\" = { to = \"lamp/switches\", type = \"a/srv/B\" }",
            3,
            "the definition of a/srv/B is unknown; known ones: std_srvs/srv/Empty",
        ),
        (
            "serve.\"/on\" = { to = \"lamp/switches\", type = \"a/msg/B\", definition = \"---\" }",
            3,
            "`a/msg/B` is not a type of a service",
        ),
        (
            "serve.\"/on\" = { to = \"lamp/switches\", type = \"a/srv/B\", definition = \"bool on\" }",
            3,
            "no line `---` separates the response of a/srv/B",
        ),
        (
            "call.\"/on\" = { from = \"a/b\", type = \"std_srvs/srv/Empty\", timeout = \"soon\" }",
            3,
            "expected a duration such as \"2s\", found \"soon\"",
        ),
        (
            "call.\"/on\" = { from = \"a/b\", type = \"std_srvs/srv/Empty\" }\ncall.\"/off\" = { from = \"/a/b\", type = \"std_srvs/srv/Empty\" }",
            4,
            "/a/b calls two services",
        ),
        ("write.\"/a b\" = \"wheels/command\"", 3, "`/a b` can't be the name of a topic"),
        ("write.\"/cmd_vel\" = { topic = \"wheels/command\" }", 3, "topic"),
        ("write.\"/cmd_vel\" = \"slate://other/wheels/command\"", 3, "belongs to agent `other`"),
        (
            "read.\"driver/scan\" = \"/scan\"\nread.\"/driver/scan\" = \"/scan2\"",
            4,
            "/driver/scan reads two topics",
        ),
        (
            "write.\"cmd_vel\" = \"a/b\"\nwrite.\"/cmd_vel\" = \"c/d\"",
            4,
            "/cmd_vel is written by two entries, of /c/d and /a/b",
        ),
        (
            "write.\"/scan\" = \"a/b\"\nread.\"driver/scan\" = \"scan\"",
            4,
            "/scan is read by /driver/scan and written by /a/b here",
        ),
    ];
    for (table, line, words) in cases {
        let report = read(table).unwrap_err();
        let found = report.diagnostics().iter().find(|own| own.message().contains(words));
        let found = found.unwrap_or_else(|| panic!("{table}: {report}"));
        assert!(found.help_text().is_some(), "{table}");
        // The order of the entries is that of their names.
        let placed = found.placed();
        assert!(line == 4 || placed.starts_with(&format!("r2.toml:{line}:")), "{table}: {placed}");
    }
    let options = Options { extra_tables: vec![TABLE.into()], ..Options::default() };
    let without = Configuration::from_text("r2.toml", "agent.name = \"r2\"\n", &options).unwrap();
    assert_eq!(RosSettings::of(&without).unwrap(), None);
}

#[test]
fn links_name_topics_without_a_table_and_with_one() {
    let of = |text: &str| {
        let options = Options { extra_tables: vec![TABLE.into()], ..Options::default() };
        let configuration = Configuration::from_text("r2.toml", text, &options).unwrap();
        RosSettings::of(&configuration).map(|settings| settings.unwrap())
    };
    let links = "agent.name = \"r2\"\n[links]\n\"driver/scan\" = { from = \"ros2:scan\", reliable = false, depth = 2 }\n\
                 \"ros2:/cmd_vel\" = { from = \"wheels/command\", frame = \"base\" }\n";
    let settings = of(links).unwrap();
    let (read, written) = (&settings.topics.read[0], &settings.topics.write[0]);
    let lossy = TopicQuality { reliable: false, transient_local: false, depth: 2 };
    assert_eq!((read.input.as_str(), read.topic.as_str(), read.quality), ("driver/scan", "/scan", lossy));
    assert_eq!(
        (written.topic.as_str(), written.property.as_str(), written.frame.as_str()),
        ("/cmd_vel", "wheels/command", "base")
    );
    let settings =
        of(&format!("{links}[ros2]\nnamespace = \"/robots\"\nread.\"driver/goal\" = \"/goal\"\n")).unwrap();
    let topics: Vec<_> = settings.topics.read.iter().map(|own| own.topic.as_str()).collect();
    assert_eq!((topics, settings.topics.write.len()), (vec!["/goal", "/robots/scan"], 1));
    let cases = [
        ("\"driver/scan\" = \"ros2:/my-scan\"", 3, "`/my-scan` can't be the name of a topic"),
        ("\"driver/scan\" = { from = \"ros2:/scan\", stale = \"1s\" }", 3, "stale"),
        ("\"driver/scan\" = { from = \"ros2:/scan\", frame = \"a\" }", 3, "frame"),
        (
            "\"driver/scan\" = \"ros2:/scan\"\n\"ros2:/scan\" = \"a/b\"",
            3,
            "/scan is read by /driver/scan and written by /a/b",
        ),
        (
            "\"driver/scan\" = \"ros2:/scan\"\n[ros2]\nread.\"driver/scan\" = \"/b\"",
            3,
            "/driver/scan reads two topics",
        ),
    ];
    for (links, line, words) in cases {
        let report = of(&format!("agent.name = \"r2\"\n[links]\n{links}\n")).unwrap_err();
        let found = report.diagnostics().iter().find(|own| own.message().contains(words));
        let found = found.unwrap_or_else(|| panic!("{links}: {report}"));
        assert!(found.placed().starts_with(&format!("r2.toml:{line}:")), "{}", found.placed());
        assert!(found.help_text().is_some(), "{links}");
    }
}

#[test]
fn definitions_are_read_from_files_beside_the_configuration() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros2-definitions");
    std::fs::create_dir_all(folder.join("own/msg")).unwrap();
    std::fs::create_dir_all(folder.join("own/srv")).unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    write("own/msg/Sample.msg", "float64 value\nPart[] parts\n");
    write("own/msg/Part.msg", "string name\n");
    write("own/msg/Endless.msg", "bool on\nEndless[] inner\n");
    write("own/srv/Add.srv", "Part part\n---\nfloat64 sum\n");
    write("own/srv/Part.msg", "string name\n");
    let of = |table: &str| {
        write("r2.toml", &format!("agent.name = \"r2\"\n[ros2]\n{table}\n"));
        let options = Options { extra_tables: vec![TABLE.into()], ..Options::default() };
        RosSettings::of(&Configuration::load(folder.join("r2.toml"), &options).unwrap())
    };
    let settings = of(
        "read.\"driver/sample\" = { topic = \"/sample\", definition = \"own/msg/Sample.msg\" }\n\
                       write.\"/part\" = { from = \"a/b\", definition = \"own/msg/Part.msg\", type = \"other/msg/Part\" }\n\
                       serve.\"/add\" = { to = \"a/c\", type = \"own/srv/Add\", definition = \"own/srv/Add.srv\" }",
    );
    let settings = settings.unwrap().unwrap();
    let name = |files: &Option<std::sync::Arc<slate_ros_messages::DefinitionFiles>>| {
        files.as_ref().unwrap().definition().name.clone()
    };
    assert_eq!(name(&settings.topics.read[0].definition), "own/msg/Sample");
    assert_eq!(name(&settings.topics.write[0].definition), "other/msg/Part");
    assert_eq!(settings.serve[0].service_type.request().schema().field_names().collect::<Vec<_>>(), ["part"]);
    let read = |rest: &str| format!("read.\"driver/sample\" = {{ topic = \"/sample\", {rest} }}");
    let cases = [
        (
            read("definition = \"own/msg/Endless.msg\""),
            "own/msg/Endless.msg:2: a message can't contain itself",
        ),
        (read("definition = \"own/msg/Missing.msg\""), "own/msg/Missing.msg: the file can't be read"),
        (read("definition = \"own/msg/Part.msg\", type = \"Part\""), "`Part` is not a type of a message"),
        (read("type = \"own/msg/Part\""), "`type` is the type of a `definition`, and that is missing"),
    ];
    for (table, words) in cases {
        let report = of(&table).unwrap_err();
        let found = report.diagnostics().iter().find(|own| own.message().contains(words));
        let found = found.unwrap_or_else(|| panic!("{table}: {report}"));
        assert_eq!(found.line(), Some(3), "{table}");
        assert!(found.help_text().is_some(), "{table}");
    }
}
