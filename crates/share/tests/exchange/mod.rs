//! Exchange of two agents over any carrier: the test selects it by the name of this module.

use std::time::Duration;

use slate_blackboard::channel::{Budget, Policy, Start};
use slate_blackboard::interface::{Descriptor, Interface, Kind, Value, View, schema_hash};
use slate_blackboard::message::{Answer as Reply, Mailbox};
use slate_blackboard::{Access, Store};
use slate_module::interface;
use slate_share::peers::{PeerError, Status, WantedProperty};
use slate_share::session::{Compression, DeliveryStatus, Options};

use crate::agents::{Agent, Blob, Folder, Number, add, clock, output, wait_for, write};

fn folder() -> Folder {
    super::folder(module_path!())
}

/// Two agents, of which `arm` dials `base`.
fn pair(folder: &Folder) -> (Agent, Agent) {
    let base = Agent::listening("base", folder);
    let arm = Agent::start(folder.setup("arm"));
    arm.peers.connect("base", &folder.endpoint("base")).unwrap();
    wait_for("a connection", || arm.peers.is_connected("base") && base.peers.is_connected("arm"));
    (base, arm)
}

#[test]
fn a_value_is_mirrored_and_stays_the_newest() {
    let folder = folder();
    let (base, arm) = pair(&folder);
    let mut writer = output(&base.board, "drive/speed", 1);
    arm.peers.subscribe("base", WantedProperty::new("drive/speed", Options::default())).unwrap();
    for value in 1..=100 {
        write(&mut writer, value);
    }
    wait_for("the value", || arm.number("agents/base/drive/speed") == Some(100));
    let (mirror, _) = arm.board.find("agents/base/drive/speed").unwrap();
    assert!(mirror.has_writer());
    assert_eq!(mirror.descriptor().hash, Number::DESCRIPTOR.hash);
    drop(writer);
    wait_for("the writer to leave", || !mirror.has_writer());
    // The other way round, over the same connection.
    let mut writer = output(&arm.board, "joint/angle", 1);
    base.peers.subscribe("arm", WantedProperty::new("joint/angle", Options::default())).unwrap();
    write(&mut writer, 7);
    wait_for("the value of the agent that dialed", || base.number("agents/arm/joint/angle") == Some(7));
}

#[test]
fn a_queue_comes_whole_and_in_order() {
    let folder = folder();
    let (base, arm) = pair(&folder);
    let mut writer = output(&base.board, "scan/points", 1024);
    let want = WantedProperty::new("scan/points", Options::queue()).expect(Number::DESCRIPTOR, 0).depth(4096);
    arm.peers.subscribe("base", want).unwrap();
    let (mirror, _) = arm.board.find("agents/base/scan/points").unwrap();
    let mut reader = mirror.channel().unwrap().queue(Policy::Skip, Start::Oldest).unwrap();
    let mut next = 1;
    for value in 1..=3000 {
        write(&mut writer, value);
        if value % 100 == 0 {
            // As a queue that is not read fast enough would lose values, which is its right.
            wait_for("the values so far", || {
                reader.pull().unwrap();
                for loan in reader.window() {
                    assert_eq!(u64::from_ne_bytes(loan.bytes()[..8].try_into().unwrap()), next);
                    next += 1;
                }
                next > value
            });
        }
    }
    assert_eq!(reader.skipped(), 0);
    wait_for("the count on the board", || {
        let state = arm.board.read("peers/base/reads/scan/points/received").ok().flatten();
        state.is_some_and(|(value, _)| value == Value::Integer(3000))
    });
    let lost = arm.board.read("peers/base/reads/scan/points/lost").unwrap().unwrap().0;
    assert_eq!(lost, Value::Integer(0));
}

#[test]
fn queue_reports_losses_to_its_readers() {
    let folder = super::folder(module_path!());
    let (base, arm) = pair(&folder);
    let mut writer = output(&base.board, "scan/points", 16);
    let want = WantedProperty::new("scan/points", Options::queue()).expect(Number::DESCRIPTOR, 0).depth(4096);
    arm.peers.subscribe("base", want).unwrap();
    wait_for("who reads it", || base.board.find("scan/points").unwrap().0.readers() == 1);
    let (mirror, _) = arm.board.find("agents/base/scan/points").unwrap();
    let mut reader = mirror.channel().unwrap().queue(Policy::Skip, Start::Oldest).unwrap();
    let (mut seen, mut last) = (0, 0);
    for value in 1..=100_000 {
        // Faster than they can be sent, by far.
        write(&mut writer, value);
    }
    wait_for("the last value", || {
        while reader.pull().unwrap() > 0 {
            for loan in reader.window() {
                last = u64::from_ne_bytes(loan.bytes()[..8].try_into().unwrap());
                seen += 1;
            }
        }
        last == 100_000
    });
    assert!(seen < last, "the test is about values that are lost");
    assert_eq!(seen + reader.skipped(), last);
}

#[test]
fn big_values_come_through_shared_memory_and_without_it() {
    let folder = folder();
    let (base, arm) = pair(&folder);
    let size = 1 << 20;
    let property = add(&base.board, "camera/blob", Blob::DESCRIPTOR, size, 4);
    let mut writer = property.channel().unwrap().writer().unwrap();
    arm.peers.subscribe("base", WantedProperty::new("camera/blob", Options::queue())).unwrap();
    let small = Options::default().compression(Compression::Lossless).periodic(1_000_000);
    // Few bytes of it are used, so they are sent as they are.
    for number in 1..=20_u64 {
        let length = if number % 2 == 0 { size } else { 100 };
        let mut bytes = number.to_ne_bytes().to_vec();
        bytes.extend((0..length).map(|i| (i as u64 * number) as u8));
        writer.write(&bytes, length, 0).unwrap();
        wait_for("the blob", || {
            let came = arm.newest("agents/base/camera/blob");
            came.is_some_and(|(came, items)| items == length && came[..bytes.len()] == bytes[..])
        });
    }
    arm.peers.subscribe("base", WantedProperty::new("camera/nothing", small)).unwrap();
}

#[test]
fn a_property_that_comes_late_or_again_is_found() {
    let folder = folder();
    let (base, arm) = pair(&folder);
    let _other = output(&base.board, "drive/speeds", 1);
    let id = arm.peers.subscribe("base", WantedProperty::new("drive/speed", Options::default())).unwrap();
    let waiting = Status::Waiting("no property at /drive/speed; nearest: drive/speeds".into());
    wait_for("the reason", || arm.peers.status("base", id) == Some(waiting.clone()));
    let mut writer = output(&base.board, "drive/speed", 1);
    (1..=5).for_each(|value| write(&mut writer, value));
    wait_for("the value", || arm.number("agents/base/drive/speed") == Some(5));
    base.board.remove("drive/speed").unwrap();
    wait_for("its end", || matches!(arm.peers.status("base", id), Some(Status::Waiting(_))));
    drop(writer);
    let mut writer = output(&base.board, "drive/speed", 1);
    write(&mut writer, 1);
    wait_for("the value of the next one, whose number is lower", || {
        arm.number("agents/base/drive/speed") == Some(1)
    });
    arm.peers.unsubscribe("base", id);
    assert!(arm.board.get("agents/base/drive/speed").is_none(), "the mirror goes with the subscription");
    wait_for("nobody to read it", || base.board.find("drive/speed").unwrap().0.readers() == 0);
}

/// As [`Number`], in another unit.
static OTHER: Descriptor = Descriptor {
    name: "Number",
    doc: "",
    ros: "",
    fields: OTHER_FIELDS,
    size: 8,
    align: 8,
    hash: schema_hash("Number", OTHER_FIELDS),
};

const OTHER_FIELDS: &[slate_blackboard::interface::Field] =
    &[slate_blackboard::interface::Field { name: "value", doc: "", unit: "m", offset: 0, kind: Kind::U64 }];

#[test]
fn another_schema_is_refused_with_the_field_that_differs() {
    let folder = folder();
    let (base, arm) = pair(&folder);
    let mut writer = output(&base.board, "drive/speed", 1);
    write(&mut writer, 3);
    let want = WantedProperty::new("drive/speed", Options::default()).expect(&OTHER, 0);
    let id = arm.peers.subscribe("base", want).unwrap();
    let reason = "/drive/speed differs from the expected interface: `value` is u64 in m here and u64 without unit there";
    wait_for("the reason", || arm.peers.status("base", id) == Some(Status::Refused(reason.into())));
    assert_eq!(arm.number("agents/base/drive/speed"), None);
    let id =
        arm.peers.subscribe("base", WantedProperty::new("drive/speed/value", Options::default())).unwrap();
    wait_for("the hint", || {
        let hint =
            "/drive/speed/value is `value` of /drive/speed: subscribe to that, and read the field here";
        arm.peers.status("base", id) == Some(Status::Refused(hint.into()))
    });
}

#[test]
fn a_message_to_another_agent_is_answered() {
    let folder = folder();
    let (base, arm) = pair(&folder);
    let mailbox = Mailbox::new(Number::DESCRIPTOR.shape(0), 4, 2);
    base.board.add_mailbox("drive/commands", "Commands.", Number::DESCRIPTOR, mailbox.clone()).unwrap();
    let mut receiver = mailbox.receiver().unwrap();
    let limit = Duration::from_secs(20);
    let send = |path: &str, schema: u64, value: u64| {
        let mut number = Number { value };
        arm.peers.send("base", path, schema, 0, View::of(&mut number).bytes()).unwrap()
    };
    let hash = Number::DESCRIPTOR.hash;
    let (first, second) = (send("drive/commands", hash, 1), send("drive/commands", hash, 2));
    assert_eq!(first.recv_timeout(limit), Ok(DeliveryStatus::Accepted));
    assert_eq!(second.recv_timeout(limit), Ok(DeliveryStatus::Accepted));
    let third = send("drive/commands", hash, 3);
    assert_eq!(third.recv_timeout(limit), Ok(DeliveryStatus::Full));
    assert_eq!(receiver.collect(), 2);
    let values: Vec<_> = receiver.messages().map(|message| message.bytes()[0]).collect();
    assert_eq!(values, [1, 2]);
    receiver.answer(0, Reply::Done);
    receiver.answer(1, Reply::Refused(5));
    receiver.release();
    assert_eq!(first.recv_timeout(limit), Ok(DeliveryStatus::Done));
    assert_eq!(second.recv_timeout(limit), Ok(DeliveryStatus::Refused(5)));
    assert_eq!(send("drive/commands", hash + 1, 1).recv_timeout(limit), Ok(DeliveryStatus::NoMailbox));
    assert_eq!(send("drive/nothing", hash, 1).recv_timeout(limit), Ok(DeliveryStatus::NoMailbox));
    let fourth = send("drive/commands", hash, 4);
    assert_eq!(fourth.recv_timeout(limit), Ok(DeliveryStatus::Accepted));
    drop(base);
    assert_eq!(fourth.recv_timeout(limit), Ok(DeliveryStatus::Vanished));
}

#[test]
fn the_properties_of_another_agent_can_be_listed() {
    let folder = folder();
    let (base, arm) = pair(&folder);
    let mut writers: Vec<_> = (0..500).map(|i| output(&base.board, &format!("many/p{i:03}"), 1)).collect();
    writers.iter_mut().zip(0..).for_each(|(writer, value)| write(writer, value));
    let limit = Duration::from_secs(20);
    let all = arm.peers.list("base", "many/*", true, limit).unwrap();
    assert_eq!(all.len(), 500);
    for (property, value) in all.iter().zip(0..) {
        assert_eq!(property.path, format!("many/p{value:03}"));
        let (newest, stamp) = property.value("value").unwrap().unwrap();
        assert_eq!(newest, Value::Integer(value));
        assert_eq!((stamp.sequence, property.descriptor.hash), (1, Number::DESCRIPTOR.hash));
    }
    let tree = arm.peers.list("base", "many/p00*", false, limit);
    assert_eq!(tree.unwrap_err().to_string(), "agent `base`: that is not a pattern of paths");
    let error = arm.peers.list("bose", "**", false, limit).unwrap_err();
    assert_eq!(error.to_string(), "unknown agent `bose`; known: base");
}

#[test]
fn a_second_agent_of_a_name_is_refused_until_the_first_is_gone() {
    let folder = folder();
    let (base, arm) = pair(&folder);
    let other = Agent::start(folder.setup("arm"));
    other.peers.connect("base", &folder.endpoint("base")).unwrap();
    let reason = "agent `base` is connected to an agent `arm` already: give each agent a name of its own";
    wait_for("the refusal", || {
        let shown = other.board.read("peers/base/link/reason").ok().flatten();
        shown.is_some_and(|(value, _)| value == Value::Text(reason.into()))
    });
    let error = other.peers.list("base", "**", false, Duration::from_secs(1)).unwrap_err();
    assert!(matches!(error, PeerError::Send { .. }));
    assert_eq!(error.to_string(), format!("agent `base`: the other agent is not connected: {reason}"));
    assert!(arm.peers.is_connected("base"), "the first one notices nothing");
    drop(arm);
    wait_for("its turn", || other.peers.is_connected("base"));
    let own = Agent::start(folder.setup("base"));
    own.peers.connect("base", &folder.endpoint("base")).unwrap();
    wait_for("the refusal of itself", || {
        let shown = own.board.read("peers/base/link/reason").ok().flatten();
        let reason = "an agent `base` already exists: give each agent a name of its own";
        shown.is_some_and(|(value, _)| value == Value::Text(reason.into()))
    });
    drop(base);
}

#[test]
fn departed_robots_are_forgotten() {
    let folder = folder();
    let base = Agent::listening("base", &folder);
    for i in 0..5 {
        let tool = Agent::start(folder.setup(&format!("tool-{i}")));
        tool.peers.connect("base", &folder.endpoint("base")).unwrap();
        wait_for("the tool", || base.peers.is_connected(&format!("tool-{i}")));
        drop(tool);
        wait_for("its end", || !base.peers.is_connected(&format!("tool-{i}")));
    }
    assert!(base.peers.agents().len() <= 2, "{:?}", base.peers.agents());
    let arm = Agent::start(folder.setup("arm"));
    arm.peers.connect("base", &folder.endpoint("base")).unwrap();
    for path in ["", "a//b", "a b", "/a"] {
        let refused = arm.peers.subscribe("base", WantedProperty::new(path, Options::default()));
        assert!(matches!(refused, Err(PeerError::Subscription { .. })), "{path}");
    }
}

#[test]
fn agents_that_dial_each_other_share_one_link() {
    let folder = folder();
    let (base, arm) = (Agent::listening("base", &folder), Agent::listening("arm", &folder));
    base.peers.connect("arm", &folder.endpoint("arm")).unwrap();
    arm.peers.connect("base", &folder.endpoint("base")).unwrap();
    let mut writer = output(&base.board, "drive/speed", 1);
    arm.peers.subscribe("base", WantedProperty::new("drive/speed", Options::default())).unwrap();
    write(&mut writer, 9);
    wait_for("the value", || arm.number("agents/base/drive/speed") == Some(9));
    wait_for("both", || base.peers.is_connected("arm") && arm.peers.is_connected("base"));
    wait_for("the state", || {
        let connected = base.board.read("peers/arm/link/connected").ok().flatten();
        connected.is_some_and(|(connected, _)| connected == Value::Bool(true))
    });
}

/// A setting.
#[interface]
struct Gain {
    /// How strongly.
    #[unit("1/s")]
    gain: f64,
}

#[test]
fn host_settings_are_shared_at_once() {
    let folder = folder();
    let base = Agent::start(
        slate_share::peers::Setup { poll: None, ..folder.setup("base") }.listen(&folder.endpoint("base")),
    );
    let arm = Agent::start(folder.setup("arm"));
    arm.peers.connect("base", &folder.endpoint("base")).unwrap();
    let store = Store { capacity: 0, depth: 1, budget: Budget { latest: 2, queues: 0, window: 0 } };
    base.board.add_channel("control/gain", "A gain.", Gain::DESCRIPTOR, store, Access::Setting).unwrap();
    base.board.write("control/gain/gain", &Value::Float(0.5), 0).unwrap();
    arm.peers.subscribe("base", WantedProperty::new("control/gain", Options::default())).unwrap();
    let shown = |value: f64| {
        let read = arm.board.read("agents/base/control/gain/gain").ok().flatten();
        read.is_some_and(|(read, _)| read == Value::Float(value))
    };
    wait_for("the first value", || shown(0.5));
    base.board.write("control/gain/gain", &Value::Float(1.5), 0).unwrap();
    wait_for("the next value", || shown(1.5));
    // What a module writes is seen when its host says so.
    let mut writer = output(&base.board, "drive/speed", 1);
    arm.peers.subscribe("base", WantedProperty::new("drive/speed", Options::default())).unwrap();
    wait_for("the subscription", || base.board.find("drive/speed").unwrap().0.readers() == 1);
    write(&mut writer, 4);
    base.peers.notifier().notify();
    wait_for("the output", || arm.number("agents/base/drive/speed") == Some(4));
}

#[test]
fn a_property_that_comes_back_with_more_room_is_read_anew() {
    let folder = folder();
    let base = Agent::listening("base", &folder);
    let arm = Agent::start(folder.setup("arm"));
    arm.peers.connect("base", &folder.endpoint("base")).unwrap();
    let blob = |capacity: usize| {
        let property = add(&base.board, "camera/image", Blob::DESCRIPTOR, capacity, 1);
        let mut writer = property.channel().unwrap().writer().unwrap();
        writer.write(&vec![7; 8 + capacity], capacity, clock()()).unwrap();
        writer
    };
    let read =
        || arm.peers.subscribe("base", WantedProperty::new("camera/image", Options::default())).unwrap();
    let items =
        |count: usize| arm.newest("agents/base/camera/image").is_some_and(|(_, items)| items == count);
    let writer = blob(8);
    let id = read();
    wait_for("the small one", || items(8));
    drop(writer);
    base.board.remove("camera/image").unwrap();
    let _writer = blob(64);
    let reason = || match arm.peers.status("base", id) {
        Some(Status::Refused(reason)) => reason,
        _ => String::new(),
    };
    wait_for("the reason", || reason().contains("has room for 64 items now, and not for 8"));
    arm.peers.unsubscribe("base", id);
    read();
    wait_for("the large one", || items(64));
}
