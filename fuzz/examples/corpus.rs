//! Corpus from real agents, robots and tools.
//! `cargo run -p slate-fuzz --example corpus` writes it.

use std::fs;
use std::path::Path;
use std::time::Duration;

use serde_json::json;
use slate_bag::Compression as Chunks;
use slate_blackboard::interface::{Descriptor, Interface, View};
use slate_dds::{IdlFile, IdlMessage, Representation};
use slate_drivers::DeviceProtocol;
use slate_drivers::joystick::session::JoystickSession;
use slate_drivers::simulated::{
    DeviceFirmware, SimulatedGps, SimulatedHokuyo, SimulatedImu, SimulatedJoystick, SimulatedRplidar,
};
use slate_fuzz::agents::{Agent, Blob, MILLISECOND, Number};
use slate_fuzz::input::append_counted;
use slate_fuzz::{
    bag, configuration, definition, drivers, knowledge, logs as others, network, peer, robot, shared_memory,
    state,
};
use slate_interfaces::{Chassis, Image, ImageFormat, LaserScan, Odometry, Pose2, Sightings, Transform};
use slate_module::encode_interface;
use slate_network::SampleAttachment;
use slate_ros_messages as ros;
use slate_share::encoding::encode;
use slate_share::knowledge::{Replica, Statement};
use slate_share::session::{Compression, Encoding};

/// Bytes of an input that a fuzzer reads: see `fuzz/run`.
const LONGEST: usize = 16 << 10;

fn main() {
    packets();
    conversations();
    knowledge_of_a_team();
    values();
    states();
    interfaces();
    memory();
    calls();
    libraries();
    snapshots();
    configurations();
    recordings();
    logs();
    definitions();
    idl();
    samples();
    devices();
}

fn keep(target: &str, name: &str, bytes: &[u8]) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target);
    fs::create_dir_all(&folder).expect("the folder can be written to");
    fs::write(folder.join(name), bytes).expect("the folder can be written to");
}

/// Writes the packets of one of two agents.
/// All until both have read from each other, then a part.
fn packets() {
    let mut agents = [Agent::new("base", "arm", 1), Agent::new("arm", "base", 7)];
    let (mut whole, mut frames) = (vec![0], vec![1]);
    let told = b"what the team knows";
    for round in 1..40 {
        let know_each_other = agents.iter().all(|agent| agent.shown("out/blob").is_some());
        let now = 10 * round * MILLISECOND;
        for from in [0, 1] {
            agents[from].peer.tick(now);
            agents[from].write(round, now);
            if round == 20 {
                let mut number = Number { value: round };
                let hash = Number::DESCRIPTOR.hash;
                agents[from]
                    .peer
                    .send("in/mail", hash, 0, View::of(&mut number).bytes())
                    .expect("there is room");
                agents[from].peer.query("**", true).expect("there is room");
                assert!(agents[from].peer.send_knowledge(told), "there is room");
            }
            while let Some(packet) = agents[from].outgoing(now) {
                let is_kept = !know_each_other || round % 3 == 2;
                if from == 1 && is_kept && whole.len() + packet.len() < LONGEST {
                    peer::append_part(peer::PACKET, &packet, &mut whole);
                    peer::append_part(peer::FRAMES, &packet[18..], &mut frames);
                }
                if from == 1 && round < 3 {
                    let mut alone = vec![1];
                    peer::append_part(peer::FRAMES, &packet[18..], &mut alone);
                    alone.extend([peer::PASS, 20, peer::WRITE]);
                    keep("peer", &format!("frames-{round}-{}", packet.len()), &alone);
                }
                agents[1 - from].peer.receive(now, &packet, None);
            }
        }
        for script in [&mut whole, &mut frames] {
            script.extend([peer::PASS, 10, peer::WRITE]);
        }
    }
    assert!(agents.iter().all(|agent| agent.shown("out/blob").is_some()), "the agents talk");
    for script in [&whole, &frames] {
        // Without these, a fuzzer has to find out by itself how to subscribe.
        for part in [&b"out/value"[..], b"out/blob", b"in/mail", told] {
            assert!(script.windows(part.len()).any(|bytes| bytes == part), "the corpus lacks {part:?}");
        }
    }
    keep("peer", "packets", &whole);
    keep("peer", "frames", &frames);
    keep("peer", "version", b"\0\0\x02\0S\x09");
    items();
}

/// The control stream and the streams of values, item by item.
fn items() {
    #[derive(serde::Serialize)]
    struct Options(u32, u64, u32, bool, u32);
    let newest = Options(0, 0, 0, true, 1);
    let every = Options(1, MILLISECOND, 1, true, 0);
    let interface = |descriptor: &Descriptor| encode_interface(descriptor).expect("it can be written");
    let mut script = vec![1];
    let mut control = |message: Vec<u8>| {
        script.extend([peer::ITEM, 0]);
        append_counted(&message, &mut script);
    };
    let write = |message: &dyn erased::Message| message.bytes();
    control(write(&(0_u32, 1_u32, "out/value", newest, None::<()>)));
    control(write(&(0_u32, 2_u32, "out/blob", every, Some((7_u64, 1_u64, 3_u64)))));
    control(write(&(0_u32, 3_u32, "out/vale", Options(0, 0, 0, false, 0), None::<()>)));
    for (id, path, descriptor, capacity) in [
        (1_u32, "out/value", Number::DESCRIPTOR, 0_u64),
        (2, "out/blob", Blob::DESCRIPTOR, 8192),
        (3, "out/other", Pose2::DESCRIPTOR, 0),
    ] {
        control(write(&(2_u32, id, 1_u32, (path, interface(descriptor), "A test.", capacity, 8_u32, 0_u64))));
        control(write(&(3_u32, id, 1_u32)));
    }
    control(write(&(7_u32, 1_u64, "in/mail", Number::DESCRIPTOR.hash, 0_u64, [7_u8; 8].to_vec())));
    control(write(&(9_u32, 1_u32, "**", true)));
    control(write(&(6_u32, 1_u32, 1_u64)));
    control(write(&(4_u32, 2_u32, "not yet")));
    control(write(&(1_u32, 1_u32)));
    for (stream, content) in [(1, 5_u64.to_le_bytes().to_vec()), (2, [9; 40].to_vec()), (3, [0; 24].to_vec())]
    {
        for sequence in 1..4_u64 {
            let mut item = Vec::new();
            for number in [1, sequence, sequence * MILLISECOND] {
                item.extend(number.to_le_bytes());
            }
            let items = if stream == 2 { 32_u32 } else { 0 };
            item.extend(items.to_le_bytes());
            item.extend((content.len() as u32).to_le_bytes());
            item.push(0);
            item.extend(1_u32.to_le_bytes());
            item.extend(&content);
            script.extend([peer::ITEM, stream]);
            append_counted(&item, &mut script);
            script.extend([peer::PASS, 10, peer::WRITE]);
        }
    }
    keep("peer", "items", &script);
}

mod erased {
    /// Value that postcard writes.
    pub trait Message {
        fn bytes(&self) -> Vec<u8>;
    }

    impl<T: serde::Serialize> Message for T {
        fn bytes(&self) -> Vec<u8> {
            postcard::to_allocvec(self).expect("it has a length")
        }
    }
}

/// Writes scripts of packet damage: none, and each kind now and then.
fn conversations() {
    keep("conversation", "untouched", &[0; 400]);
    keep("conversation", "lossy", &[0, 0, 1, 0, 1].repeat(60));
    keep("conversation", "doubled", &[0, 2].repeat(100));
    keep("conversation", "reordered", &[0, 3, 3, 0, 3, 4].repeat(50));
    keep("conversation", "cut", &[0, 0, 0, 5, 9, 0].repeat(50));
    keep("conversation", "flipped", &[0, 0, 7, 3, 0, 0x80, 0, 7, 40, 0, 1].repeat(30));
    keep("conversation", "spliced", &[0, 3, 0, 9, 30, 0, 0, 0].repeat(40));
    keep("conversation", "overwritten", &[0, 0, 8, 5, 0, 2, 0, 255, 255, 0].repeat(30));
}

fn knowledge_of_a_team() {
    let mut team: Vec<Replica> = [(1, 77), (2, 5), (3, 901)]
        .map(|(robot, random)| Replica::new(robot, random, knowledge::LIMITS))
        .into();
    for (one, other) in [(1, 2), (2, 3), (1, 3)] {
        team[one - 1].add_neighbor(other as u32);
        team[other - 1].add_neighbor(one as u32);
    }
    let (mut script, mut all) = (Vec::new(), 0);
    for round in 0..12_u64 {
        for place in 0..3 {
            let robot = &mut team[place];
            let key = [(round % 4) as u8];
            let statement = Statement { schema: 1, certainty: 0.5, value: b"value of it" };
            robot.state(round * 1000, &key, statement).expect("there is room");
            if round % 3 == 2 {
                robot.retract(round * 1000 + 1, &key).expect("there is room");
            }
            robot.tick();
            while let Some(message) = team[place].outgoing() {
                if message.to == 1 {
                    script.extend([knowledge::MESSAGE, place as u8 + 1]);
                    append_counted(&message.bytes, &mut script);
                    script.push(1);
                    if all % 4 == 0 {
                        let mut alone = vec![knowledge::STATE, 1, b'v', 0, 0, 0, 0, 0, 0, 0, 9, 0, 0, 0, 1];
                        alone.extend([knowledge::MESSAGE, place as u8 + 1]);
                        append_counted(&message.bytes, &mut alone);
                        alone.extend([1, knowledge::TICK, 2, knowledge::RESTART, 3, 0, 0, 0, 1]);
                        keep("knowledge", &format!("message-{all}"), &alone);
                    }
                    all += 1;
                }
                team[message.to as usize - 1]
                    .receive(place as u32 + 1, &message.bytes)
                    .expect("it is a message");
            }
        }
    }
    keep("knowledge", "team", &script[..script.len().min(8 << 10)]);
    let saved = team[0].save();
    keep("knowledge_file", "robot", &saved[..saved.len() - 8]);
    let fresh = Replica::new(1, 77, knowledge::LIMITS).save();
    keep("knowledge_file", "empty", &fresh[..fresh.len() - 8]);
}

fn image(format: ImageFormat, pixel: usize) -> Vec<u8> {
    let (width, height, pixel) = (24, 16, pixel as u32);
    let mut bytes: Vec<u8> = [width, height, width * pixel].into_iter().flat_map(u32::to_ne_bytes).collect();
    bytes.extend([format.0, 0, 0, 0]);
    bytes.extend((0..width * height * pixel).map(|i| (i / 3) as u8));
    bytes
}

fn values() {
    let blob: Vec<u8> = (0..600_u32).map(|i| (i / 50) as u8).collect();
    for (index, name, descriptor, bytes) in [
        (0, "grey", Image::DESCRIPTOR, image(ImageFormat::MONO8, 1)),
        (0, "colour", Image::DESCRIPTOR, image(ImageFormat::RGB8, 3)),
        (1, "blob", Blob::DESCRIPTOR, blob),
        (2, "number", Number::DESCRIPTOR, vec![7; 8]),
    ] {
        for compression in [Compression::None, Compression::Lossless, Compression::Jpeg(70)] {
            let mut content = Vec::new();
            let encoding = encode(descriptor, &bytes, compression, &mut content);
            let number =
                [Encoding::Plain, Encoding::Lz4, Encoding::Jpeg].iter().position(|one| *one == encoding);
            let mut script = vec![index, number.expect("one of those") as u8];
            script.extend((bytes.len() as u32).to_le_bytes());
            script.extend(content);
            keep("encoding", &format!("{name}-{encoding:?}"), &script);
        }
    }
}

fn states() {
    keep("state", "whole", &state::example());
}

fn interfaces() {
    for (name, descriptor) in [
        ("number", Number::DESCRIPTOR),
        ("blob", Blob::DESCRIPTOR),
        ("pose", Pose2::DESCRIPTOR),
        ("scan", LaserScan::DESCRIPTOR),
        ("image", Image::DESCRIPTOR),
        ("peer", slate_share::peers::PeerState::DESCRIPTOR),
    ] {
        let mut script = Vec::new();
        append_counted(&encode_interface(descriptor).expect("it can be written"), &mut script);
        script.extend(8_u16.to_le_bytes());
        script.extend(vec![1; descriptor.shape(8).bytes(8)]);
        keep("interface", name, &script);
    }
    // What no agent says: without a hash, and with large numbers where a fuzzer finds them.
    for (name, kind) in [
        ("array", json!({"array": ["u64", 1_u64 << 40]})),
        ("sequence", json!({"sequence": [{"text": 0x1_0000_0004_u64}, 3]})),
        ("deep", json!({"optional": {"array": [{"nested": {"name": "Inner", "fields": []}}, 0x1_0000]}})),
    ] {
        let interface = json!({"name": "Huge", "fields": [{"name": "many", "kind": kind}]});
        let (mut bytes, mut script) = (Vec::new(), Vec::new());
        ciborium::into_writer(&interface, &mut bytes).expect("it can be written");
        append_counted(&bytes, &mut script);
        script.extend([0; 12]);
        keep("interface", name, &script);
    }
}

/// Writes scripts of the filling end of a link.
/// It hands over memory, and says where values are.
fn memory() {
    let mut script = vec![shared_memory::MEMORY, 14, 1, 0];
    let mut head = vec![0; 64 * 8];
    head[0] = 1;
    head[64] = 2;
    append_counted(&head, &mut script);
    for (slot, number, race) in [(0_u8, 1_u32, 0_u8), (1, 2, 1)] {
        script.push(shared_memory::READ);
        script.extend(100_u32.to_le_bytes());
        script.push(race);
        let mut reference = vec![14, slot];
        reference.extend(number.to_le_bytes());
        append_counted(&reference, &mut script);
    }
    script.extend([shared_memory::CHANGE, 0, 0, 0, 0, 1]);
    script.push(shared_memory::PACKET);
    append_counted(b"Sxyz", &mut script);
    keep("shared_memory", "values", &script);
    let mut short = vec![shared_memory::MEMORY, 14, 0, 0, 0, 16, 0, 0];
    append_counted(&[], &mut short);
    keep("shared_memory", "short", &short);
    let mut open = vec![shared_memory::MEMORY, 26, 5, 0];
    append_counted(&[], &mut open);
    keep("shared_memory", "unsealed", &open);
    let mut several = vec![shared_memory::MEMORY, 15, 9, 0];
    append_counted(&[], &mut several);
    keep("shared_memory", "several", &several);
}

fn calls() {
    let lines = [
        "GET /plugins",
        "DELETE /plugins/relay",
        "PUT /plugins/relay",
        "POST /plugins/relay/reload",
        "GET /modules",
        r#"PUT /modules/relay {"enabled":false}"#,
        r#"PUT /modules/relay {"enabled":true}"#,
        r#"PUT /links/relay%2Finput {"from":"counter/number","options":[["stale","\"1s\""]]}"#,
        r#"PUT /links/relay%2Finput%2Fvalue?dry_run=true {"from":"relay/output/value"}"#,
        "DELETE /links/relay%2Fall",
        "GET /links",
        "GET /peers",
        "GET /settings?path=modules",
        r#"PATCH /settings?dry_run=true [["modules.counter.params.step","2"]]"#,
        "GET /settings/differences",
        "DELETE /settings?path=",
        "GET /settings/refused",
        r#"POST /settings/save {"to":"origin"}"#,
        "GET /properties?pattern=%2F**%2Ftiming",
        "GET /slate/other/counter/number",
        "GET /slate/robot/counter/number/value",
        "GET /queues/robot/counter/number",
        r#"PUT /value {"url":"/counter/params/step","value":2}"#,
        "POST /stop?reason=a%20test",
        "POST /reset",
        r#"POST /arm {"actuator":"wheel"}"#,
    ];
    keep("tool", "all", lines.join("\n").as_bytes());
    for (number, part) in lines.chunks(6).enumerate() {
        keep("tool", &format!("some-{number}"), part.join("\n").as_bytes());
    }
}

/// A library with an outline and nothing else, as a C compiler makes it.
fn libraries() {
    let folder = slate_fuzz::folder();
    let (source, library) = (folder.join("plugin.c"), folder.join("plugin.so"));
    let outline = r#"{\"abi\":ABI,\"symbol\":\"slate_plugin_x\",\"name\":\"x\",\"modules\":[{\"name\":\"x\",\"ports\":[{\"name\":\"in\",\"direction\":\"input\",\"interface\":\"Number\"}]}]}"#;
    let outline = outline.replace("ABI", &slate_module::table::ABI.to_string());
    let text = format!(
        "int slate_plugin_x = 1;\n__attribute__((section(\".slate\"), used)) static const char outline[] = \"{outline}\";\n"
    );
    fs::write(&source, text).expect("there is room");
    let made = std::process::Command::new("cc")
        .args(["-shared", "-nostdlib", "-s", "-Wl,-z,noseparate-code", "-Wl,--build-id=none", "-o"])
        .args([&library, &source])
        .status();
    assert!(made.is_ok_and(|status| status.success()), "a C compiler is needed");
    let bytes = fs::read(&library).expect("it was made");
    slate_runtime::plugin::LibraryOutline::read(&library).expect("it is a plugin");
    keep("outline", "plugin", &bytes);
    keep("outline", "half", &bytes[..bytes.len() / 2]);
}

fn snapshots() {
    let agent = robot::robot();
    let file = slate_fuzz::folder().join("corpus.snapshot");
    agent.composer().save_snapshot(&file).expect("there is room");
    keep("snapshot", "robot", &fs::read(&file).expect("it was written"));
}

fn configurations() {
    let mut plain = vec![0];
    plain.extend(configuration::TEXT.bytes());
    keep("configuration", "text", &plain);
    let mut robot = vec![0];
    robot.extend(robot::TEXT.bytes());
    keep("configuration", "robot", &robot);
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    for folder in fs::read_dir(examples).expect("it is there").flatten() {
        for file in fs::read_dir(folder.path()).into_iter().flatten().flatten() {
            let path = file.path();
            if path.extension().is_some_and(|ending| ending == "toml") && !path.ends_with("Cargo.toml") {
                let mut text = vec![0];
                text.extend(fs::read(&path).expect("it is there"));
                let name = folder.file_name().into_string().expect("it is text");
                keep("configuration", &format!("{name}-{}", file.file_name().display()), &text);
            }
        }
    }
    let mut changes = Vec::new();
    for (path, value) in [
        ("modules.counter.params.step", "4"),
        ("modules.relay", "{ enabled = true }"),
        ("links.'relay/input'.stale", "\"2s\""),
        ("actuators.wheel.limits.value", "[-2.0, 2.0]"),
        ("modules.counter.every", "\"x\""),
    ] {
        changes.push(configuration::CHANGE);
        append_counted(path.as_bytes(), &mut changes);
        append_counted(value.as_bytes(), &mut changes);
    }
    changes.push(configuration::REVERT);
    append_counted(b"modules", &mut changes);
    keep("configuration", "changes", &changes);
}

/// Logs of other systems, whole and cut off.
fn logs() {
    for (name, format, bytes) in others::samples() {
        let whole = [&[format], &bytes[..]].concat();
        keep("logs", name, &whole);
        keep("logs", &format!("{name}-cut"), &whole[..whole.len() * 2 / 3]);
    }
}

/// Writes definitions of Slate and of ROS with messages, and interface sources.
fn definitions() {
    let script = |text: &str, messages: &[Vec<u8>]| {
        let mut script = vec![definition::MESSAGES];
        append_counted(text.as_bytes(), &mut script);
        messages.iter().for_each(|message| append_counted(message, &mut script));
        script
    };
    let interfaces = [
        Chassis::DESCRIPTOR,
        Image::DESCRIPTOR,
        LaserScan::DESCRIPTOR,
        Odometry::DESCRIPTOR,
        Sightings::DESCRIPTOR,
        Transform::DESCRIPTOR,
    ];
    for descriptor in interfaces {
        // Every bit pattern is a value.
        let shape = descriptor.shape(3);
        let values: Vec<Vec<u8>> = [0, 1].map(|byte| vec![byte; shape.bytes(3)]).into();
        let own = values.iter().map(|value| {
            let mut message = Vec::new();
            ros::encode(descriptor, value, &mut message).expect("it is a value");
            message
        });
        let text = ros::definition(descriptor).text;
        keep("definition", descriptor.name, &script(&text, &own.collect::<Vec<_>>()));
        let Some(standard) = ros::standard(descriptor) else { continue };
        let others = values.iter().map(|value| {
            let mut message = Vec::new();
            standard.encode(value, 1_500_000_000, "map", &mut message).expect("it is a value");
            message
        });
        let script = script(&standard.definition().text, &others.collect::<Vec<_>>());
        keep("definition", &format!("{}-standard", descriptor.name), &script);
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/interfaces/src");
    for name in ["fact", "image", "map", "range"] {
        let mut source = vec![definition::SOURCE];
        source.extend(fs::read(folder.join(name).with_extension("rs")).expect("it is there"));
        keep("definition", &format!("source-{name}"), &source);
    }
}

/// Files of IDL with messages of their structs.
fn idl() {
    let image = "module m { @final struct Image { unsigned long width, height, step; octet format; sequence<octet> data; }; };";
    let pose = "@appendable struct Pose { double x, y, theta; string name; };";
    let list = "struct One { double range; double bearing; string<28> name; }; struct Two { @key long id; sequence<One, 8> list; };";
    for (name, text, structure, descriptor) in [
        ("image", image, "m::Image", Image::DESCRIPTOR),
        ("pose", pose, "Pose", Pose2::DESCRIPTOR),
        ("list", list, "Two", Sightings::DESCRIPTOR),
    ] {
        let file = IdlFile::parse(name, text).expect("it is IDL");
        let structure = file.structure(structure).expect("it is there");
        let mut script = Vec::new();
        append_counted(text.as_bytes(), &mut script);
        for representation in [Representation::Xcdr1, Representation::Xcdr2] {
            let own = IdlMessage::of(descriptor, &structure, representation).expect("it fits");
            let mut message = Vec::new();
            own.encode(&vec![1; descriptor.shape(3).bytes(3)], &mut message).expect("it is a value");
            append_counted(&message, &mut script);
        }
        keep("idl", name, &script);
    }
}

/// Recordings, whole, cut and with a wrong bit.
fn recordings() {
    for (name, compression) in [("plain", Chunks::None), ("lz4", Chunks::Lz4)] {
        let whole = bag::recording(compression);
        keep("bag", name, &whole);
        keep("bag", &format!("{name}-cut"), &whole[..whole.len() * 2 / 3]);
        let mut flipped = whole.clone();
        flipped[whole.len() / 3] ^= 16;
        keep("bag", &format!("{name}-flipped"), &flipped);
    }
}

/// Writes samples of Zenoh programs and agents.
fn samples() {
    let stamp = slate_blackboard::Stamp { sequence: 7, time: MILLISECOND, generation: 1 };
    let sample = |name: &str, interface: usize, encoding: usize, texts: [&str; 2], content: &[u8]| {
        let mut script = vec![interface as u8, encoding as u8];
        let attachment =
            SampleAttachment { stamp, hash: network::INTERFACES[interface].hash, number: 1 }.encode();
        for part in [texts[0].as_bytes(), texts[1].as_bytes(), &attachment] {
            append_counted(part, &mut script);
        }
        script.extend(content);
        keep("network", name, &script);
    };
    let own = network::ENCODINGS.len();
    for (interface, descriptor) in network::INTERFACES.iter().enumerate() {
        let mut message = Vec::new();
        let value = vec![0; descriptor.size];
        ros::encode(descriptor, &value, &mut message).expect("it is a value of its interface");
        sample(descriptor.name, interface, own, ["", "slate/arm/@alive"], &message);
        sample(&format!("{}-unsaid", descriptor.name), interface, 0, ["", "zenoh:demo/value"], &message);
        let view = View::new(descriptor, &value, 0).expect("it is a value of its interface");
        let json = serde_json::to_vec(&view.value()).expect("it can be written");
        sample(&format!("{}-json", descriptor.name), interface, 2, ["", "slate://arm/x"], &json);
    }
    sample("field", 0, 3, ["x", ""], b"0.5");
    sample("field-json", 0, 2, ["theta", ""], b"1e3");
    sample("other-schema", 0, own + 1, ["", "application/cdr;slate_msgs/msg/Twist2"], &[0, 1, 0, 0]);
    sample("other-encoding", 0, own + 1, ["", "image/png;1"], b"\x89PNG");
    sample("nested", 1, 2, ["", ""], "[".repeat(200).as_bytes());
}

/// Writes the output of simulated devices in their first 0.5 s.
fn devices() {
    capture(0, "hokuyo", drivers::hokuyo(), SimulatedHokuyo::default());
    capture(1, "rplidar", drivers::rplidar(), SimulatedRplidar::default());
    capture(2, "gps", drivers::gps(), SimulatedGps::default());
    capture(3, "imu", drivers::imu(), SimulatedImu::default());
    capture(4, "joystick", JoystickSession::new(0.05), SimulatedJoystick::default());
}

fn capture(number: u8, name: &str, mut conversation: impl DeviceProtocol, mut device: impl DeviceFirmware) {
    let (mut outgoing, mut script) = (Vec::new(), vec![number, 99]);
    device.open();
    conversation.begin(Duration::ZERO, &mut outgoing);
    for step in 1..500 {
        let now = Duration::from_millis(step);
        device.receive(&std::mem::take(&mut outgoing));
        let mut incoming = Vec::new();
        device.advance(now, &mut incoming);
        conversation.receive(&incoming, now, &mut outgoing, &mut |_| ());
        conversation.poll(now, &mut outgoing).expect("it is well");
        script.extend(incoming);
    }
    script.truncate(LONGEST);
    keep("drivers", name, &script);
}
