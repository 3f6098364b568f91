//! Attachments, payloads and keys.

use proptest::prelude::*;
use slate_blackboard::Stamp;
use slate_blackboard::interface::{Descriptor, Interface, Value};
use slate_interfaces::{LaserScan, Path, Pose2, Twist2};
use slate_network::{
    AttachmentError, Decoded, InputSource, Payload, PayloadError, ReadOptions, SampleAttachment, alive_agent,
    alive_key, encoding, property_key,
};
use slate_ros_messages as ros;

fn interfaces() -> [&'static Descriptor; 4] {
    [Pose2::DESCRIPTOR, Twist2::DESCRIPTOR, LaserScan::DESCRIPTOR, Path::DESCRIPTOR]
}

fn attachment() -> impl Strategy<Value = SampleAttachment> {
    any::<[u64; 5]>().prop_map(|[sequence, time, generation, hash, number]| SampleAttachment {
        stamp: Stamp { sequence, time, generation },
        hash,
        number,
    })
}

#[test]
fn an_attachment_has_the_documented_bytes() {
    let stamp = Stamp { sequence: 1, time: 0x0203, generation: 4 };
    let bytes = SampleAttachment { stamp, hash: 0xf0f1_f2f3_f4f5_f6f7, number: 5 }.encode();
    let expected = [
        &[1, 1, 0, 0, 0, 0, 0, 0, 0, 3, 2, 0, 0, 0, 0, 0, 0, 4, 0, 0, 0, 0, 0, 0, 0][..],
        &[0xf7, 0xf6, 0xf5, 0xf4, 0xf3, 0xf2, 0xf1, 0xf0],
        &[5, 0, 0, 0, 0, 0, 0, 0],
    ];
    assert_eq!(bytes[..], expected.concat());
    assert_eq!(SampleAttachment::decode(&bytes[..40]), Err(AttachmentError::Length(40)));
    let other = [[2].as_slice(), &bytes[1..]].concat();
    assert_eq!(SampleAttachment::decode(&other), Err(AttachmentError::Layout(2)));
}

#[test]
fn keys_are_urls_without_their_scheme() {
    assert_eq!(property_key("arm", "localizer/pose"), "slate/arm/localizer/pose");
    let source = InputSource::parse("slate://arm/localizer/pose").unwrap();
    let plain = ReadOptions::default();
    assert_eq!(source.key(&plain), "slate/arm/localizer/pose");
    assert_eq!(source.to_string(), "slate://arm/localizer/pose");
    assert_eq!(InputSource::parse("zenoh:demo/temperature").unwrap().key(&plain), "demo/temperature");
    assert_eq!(alive_agent(&alive_key("arm")), Some("arm"));
    for wrong in
        ["zenoh:", "zenoh:a//b", "zenoh:a/*", "zenoh:a?b", "/own/property", "ros2:/scan", "slate://arm"]
    {
        assert!(InputSource::parse(wrong).is_err(), "{wrong}");
    }
}

#[test]
fn a_value_of_another_interface_or_schema_is_named() {
    let mut message = Vec::new();
    ros::encode(Pose2::DESCRIPTOR, &[0; 24], &mut message).unwrap();
    let encoding = encoding(Pose2::DESCRIPTOR);
    assert_eq!(encoding, "application/cdr;slate_msgs/msg/Pose2");
    let payload = Payload { encoding: &encoding, bytes: &message, attachment: &[] };
    assert_eq!(payload.decode(Pose2::DESCRIPTOR, ""), Ok(Decoded::Bytes(vec![0; 24])));
    let other = payload.decode(Twist2::DESCRIPTOR, "").unwrap_err().to_string();
    assert!(other.contains("slate_msgs/msg/Pose2") && other.contains("slate_msgs/msg/Twist2"), "{other}");
    let attachment = SampleAttachment { stamp: Stamp::default(), hash: 7, number: 0 }.encode();
    let old = Payload { attachment: &attachment, ..payload }.decode(Pose2::DESCRIPTOR, "").unwrap_err();
    assert_eq!(old, PayloadError::Schema { interface: "Pose2", expected: Pose2::DESCRIPTOR.hash, found: 7 });
}

#[test]
fn text_and_json_are_values_of_fields() {
    let decode = |encoding, text: &str, field| {
        Payload { encoding, bytes: text.as_bytes(), attachment: &[] }.decode(Pose2::DESCRIPTOR, field)
    };
    assert_eq!(decode("text/plain", "0.5", "x"), Ok(Decoded::Value(Value::Float(0.5))));
    assert_eq!(decode("zenoh/string", "2", "x"), Ok(Decoded::Value(Value::Integer(2))));
    let table = Value::Table(vec![("x".into(), Value::Integer(1))]);
    assert_eq!(decode("application/json", "{\"x\": 1}", ""), Ok(Decoded::Value(table)));
    assert_eq!(decode("text/plain", "0.5", ""), Err(PayloadError::Several("Pose2")));
    assert!(matches!(decode("application/json", "{", ""), Err(PayloadError::Json(_))));
    let long = " ".repeat((1 << 20) + 1);
    assert_eq!(decode("text/plain", &long, "x"), Err(PayloadError::Long(long.len())));
    assert!(matches!(decode("image/png", "0.5", "x"), Err(PayloadError::Encoding(_))));
}

proptest! {
    #[test]
    fn an_attachment_comes_back(attachment in attachment(), later in proptest::collection::vec(any::<u8>(), 0..20)) {
        let bytes = [&attachment.encode()[..], &later].concat();
        prop_assert_eq!(SampleAttachment::decode(&bytes), Ok(attachment));
    }

    #[test]
    fn any_bytes_are_an_attachment_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..80)) {
        match SampleAttachment::decode(&bytes) {
            Ok(attachment) => prop_assert_eq!(&attachment.encode()[..], &bytes[..SampleAttachment::LENGTH]),
            Err(AttachmentError::Length(length)) => prop_assert!(length == bytes.len() && length < SampleAttachment::LENGTH),
            Err(AttachmentError::Layout(layout)) => prop_assert!(layout == bytes[0] && layout != SampleAttachment::LAYOUT),
        }
    }

    #[test]
    fn any_payload_is_a_value_or_refused(
        kind in 0..9_usize,
        header in any::<bool>(),
        bytes in proptest::collection::vec(any::<u8>(), 0..300),
        attachment in proptest::collection::vec(any::<u8>(), 0..50),
        which in 0..4_usize,
        field in "[a-z/]{0,6}",
    ) {
        let descriptor = interfaces()[which];
        let own = encoding(descriptor);
        let encodings =
            ["", "zenoh/bytes", "application/cdr", &own, "application/json", "text/plain", "zenoh/string", "image/png", ";"];
        let bytes = if header { [&[0, 1, 0, 0][..], &bytes].concat() } else { bytes };
        let payload = Payload { encoding: encodings[kind], bytes: &bytes, attachment: &attachment };
        if let Ok(Decoded::Bytes(value)) = payload.decode(descriptor, &field) {
            let mut again = Vec::new();
            prop_assert!(ros::encode(descriptor, &value, &mut again).is_ok());
        }
    }

    #[test]
    fn any_text_is_a_source_or_refused(text in "(zenoh:|slate://|)[ -~]{0,30}") {
        if let Ok(source) = InputSource::parse(&text) {
            prop_assert_eq!(InputSource::parse(&source.to_string()), Ok(source));
        }
    }
}

#[test]
fn options_have_one_text_and_mistakes_in_them_are_named() {
    let source = InputSource::parse("slate://arm/localizer/pose").unwrap();
    for text in ["rate=100ms", "interval=1500us", "all", "all,reliable", "best-effort,rate=1s", "reliable"] {
        let options = ReadOptions::parse(text).unwrap();
        assert_eq!(options.to_string(), text);
        assert_eq!(source.key(&options), format!("slate/arm/@read/{text}/localizer/pose"));
    }
    for (text, reason) in [
        ("fast", "unknown option `fast`"),
        ("", "unknown option ``"),
        ("rate=0ms", "`0ms` is not a duration"),
        ("rate=often", "`often` is not a duration"),
        ("rate=99h", "`99h` is not a duration"),
        ("rate=0.1s", "write `rate=100ms`"),
        ("reliable,all", "write `all,reliable`"),
        ("all,rate=1s", "neither a rate nor an interval"),
    ] {
        let error = ReadOptions::parse(text).unwrap_err();
        assert!(error.contains(reason), "{text}: {error}");
    }
}
