use std::sync::Arc;

use proptest::prelude::*;
use slate_module::prelude::{Module, Outcome, Tick, module};
use slate_module::{Level, Plugin};
use slate_runtime::log::{MemoryTarget, Record};
use slate_runtime::{Options, Rate};

use crate::logging::common::load;

/// Logs with fields of all kinds.
pub struct Surveyor;

#[module(stage = Think)]
impl Module for Surveyor {
    type Io = ();
    type Params = ();
    type State = ();

    fn tick(_: &mut (), _: &(), _: &(), now: &Tick) -> Outcome {
        let fields = [
            ("speed", 1.2.into()),
            ("range", 0.1_f32.into()),
            ("count", 3.into()),
            ("seen", true.into()),
            ("goal", "door = open".into()),
        ];
        now.log_with(Level::Info, format_args!("arrived in {} s", 7), &fields);
        now.log_with(Level::Info, format_args!("a\u{1f}b=c"), &[("k=e\u{1f}y", "v\u{1f}w=x".into())]);
        let long = "v".repeat(300);
        now.log_with(
            Level::Info,
            format_args!("{:>600}", "end"),
            &[("long", long.as_str().into()), ("kept", 7_u64.into())],
        );
        Outcome::Ok
    }
}

fn surveyed() -> Vec<Record> {
    let target = MemoryTarget::default();
    let options = Options { log: vec![Box::new(target.clone())], rate: Rate::Max, ..Options::default() };
    let text = "time.source = \"surveyor\"\n[modules.surveyor]\n";
    let mut agent = load(text, &[Plugin::linked::<Surveyor>()], options).unwrap();
    assert!(agent.step());
    drop(agent);
    target.lines()
}

fn fields(record: &Record) -> Vec<(&str, &str)> {
    record.fields.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect()
}

#[test]
fn values_arrive_apart_from_the_text() {
    let line = &surveyed()[0];
    assert_eq!(line.text, "arrived in 7 s");
    let expected =
        [("speed", "1.2"), ("range", "0.1"), ("count", "3"), ("seen", "true"), ("goal", "door = open")];
    assert_eq!(fields(line), expected);
    assert_eq!(
        line.to_string(),
        "     0.000 info  surveyor: arrived in 7 s speed=1.2 range=0.1 count=3 seen=true goal=door = open"
    );
    let json = serde_json::to_value(line).unwrap();
    let expected = serde_json::json!({
        "time": 0, "level": "info", "module": "surveyor", "text": "arrived in 7 s",
        "fields": { "speed": "1.2", "range": "0.1", "count": "3", "seen": "true", "goal": "door = open" },
    });
    assert_eq!(json, expected);
}

#[test]
fn a_separator_in_a_message_makes_no_field() {
    let line = &surveyed()[1];
    assert_eq!(line.text, "a_b=c");
    assert_eq!(fields(line), [("k_e_y", "v_w=x")]);
}

#[test]
fn an_oversized_field_is_dropped_and_a_long_text_leaves_room() {
    let line = &surveyed()[2];
    assert_eq!(fields(line), [("kept", "7")]);
    assert_eq!(line.text.len(), 512 - "\u{1f}kept=7".len());
}

#[test]
fn a_record_is_one_line_whatever_it_says() {
    let mut record = crate::logging::record("one\ntwo\x1b[2J");
    record.fields.push(("k".into(), "\r".into()));
    assert_eq!(record.message(), "one\\ntwo\\u{1b}[2J k=\\r");
}

proptest! {
    #[test]
    fn fields_are_split_as_they_were_joined(
        text in "[^\u{1f}]{0,40}",
        fields in prop::collection::vec(("[^\u{1f}=]{1,10}", "[^\u{1f}]{0,20}"), 0..6),
    ) {
        let mut message = text.clone();
        for (key, value) in &fields {
            message.push_str(&format!("\u{1f}{key}={value}"));
        }
        let record = Record::from_message(1, Level::Info, &Arc::from("m"), &message);
        prop_assert_eq!(record.text, text);
        prop_assert_eq!(record.fields, fields);
    }

    #[test]
    fn any_message_has_a_record_of_one_line_and_a_json_form(message in "[\u{0}-\u{20}=a-cé\u{1f}]{0,60}") {
        let record = Record::from_message(1, Level::Info, &Arc::from("m"), &message);
        prop_assert!(!record.to_string().contains(char::is_control));
        let json: serde_json::Value = serde_json::from_str(&serde_json::to_string(&record).unwrap()).unwrap();
        prop_assert_eq!(json["text"].as_str(), message.split('\u{1f}').next());
        let kept: usize = record.fields.iter().map(|(key, value)| key.len() + value.len()).sum();
        prop_assert!(record.text.len() + kept <= message.len());
    }
}
