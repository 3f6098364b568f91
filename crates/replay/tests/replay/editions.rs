//! Recordings of the edition before this one: its modules had a `plugin` instead of a kind, and its interfaces named their padding.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use slate_bag as bag;
use slate_bag::{Attachment, Compression, Metadata, Reader, Schema, Selection, Writer};
use slate_replay::{Comparison, Plan, PlayError, Player, Run, Verdict};
use slate_report::{page, page::Known};
use slate_runtime::{Agent, Options};

use crate::replay::support::{Written, file, load, plugins, recorded, values};

/// What that edition would have written of the robot.
fn of_first_edition(name: &str) -> PathBuf {
    let new = recorded(&format!("new-{name}"));
    let old = file(name);
    let mut reader = Reader::open(&new).unwrap();
    let mut writer = Writer::new(Vec::new(), &old, reader.header(), Compression::None).unwrap();
    for own in reader.metadata().unwrap() {
        writer.metadata(&own).unwrap();
    }
    for number in 0..reader.attachments() {
        let own = reader.attachment(number).unwrap().unwrap();
        let text = String::from_utf8(own.data).unwrap();
        let data = text.replace(".kind = ", ".plugin = ").into_bytes();
        assert!(own.name != "configuration.toml" || data != text.as_bytes(), "{text}");
        writer.attachment(&Attachment { data, ..own }).unwrap();
    }
    let mut known = BTreeSet::new();
    while let Some(message) = reader.next_message().unwrap() {
        let is_number = message.schema.unwrap().name == "slate_msgs/msg/Number";
        if known.insert(message.channel.id) {
            let mut schema = Schema::clone(message.schema.unwrap());
            let mut channel = bag::Channel::clone(message.channel);
            if is_number {
                // Each channel has a schema of its own here.
                schema.data.extend(b"uint32 reserved\n");
                channel.metadata.insert("hash".into(), "0123456789abcdef".into());
            }
            schema.id = 1000 + channel.id;
            channel.schema_id = schema.id;
            writer.schema(&schema).unwrap();
            writer.channel(&channel).unwrap();
        }
        let padding: &[u8] = if is_number { &[0; 4] } else { &[] };
        let data = [message.data, padding].concat();
        let (id, sequence) = (message.channel.id, message.sequence);
        writer.message(id, sequence, message.log_time, message.publish_time, &data).unwrap();
    }
    std::fs::write(&old, writer.finish().unwrap()).unwrap();
    old
}

/// The numbers of a topic, without what is behind them.
fn numbers(path: &Path, topic: &str) -> Vec<Written> {
    let cut = |(sequence, time, data): Written| (sequence, time, data[..12].to_vec());
    values(path, topic).into_iter().map(cut).collect()
}

#[test]
fn values_of_older_edition_are_played_and_reported() {
    let old = of_first_edition("edition-play.mcap");
    assert_eq!(numbers(&old, "/back/sum"), values(&file("new-edition-play.mcap"), "/back/sum"));
    let mut player = Player::open(&old, &plugins(), Plan::default()).unwrap();
    let remarks = player.remarks();
    let remark = |name: &str| &remarks.iter().find(|(topic, _)| topic == name).unwrap().1;
    assert!(remark("configuration.toml").contains("`plugin`, which is called `kind`"), "{remarks:?}");
    assert!(remark("/back/sum").contains("recorded by another version"), "{remarks:?}");
    let mut agent = load(&player, None);
    player.run(&mut agent, &AtomicBool::new(false)).unwrap();
    assert_eq!(agent.board().agent(), "robot");
    let (value, stamp) = agent.board().read("back/sum").unwrap().unwrap();
    let (sequence, _, data) = numbers(&old, "/back/sum").pop().unwrap();
    assert_eq!(value.get("value").unwrap().as_f64(), Some(f64::from_le_bytes(data[4..].try_into().unwrap())));
    assert_eq!(stamp.sequence, u64::from(sequence));
}

#[test]
fn modules_of_older_edition_are_refused_with_reason() {
    let old = of_first_edition("edition-run.mcap");
    let plan = Plan { modules: ["back".into()].into(), ..Plan::default() };
    let error = Player::open(&old, &plugins(), plan).unwrap_err();
    assert!(matches!(error, PlayError::Unfit { .. }));
    let text = error.to_string();
    for words in ["another version of Slate", "called `kind`", "`slate replay FILE`"] {
        assert!(text.contains(words), "{text}");
    }
    let obstacle = Run::read(&old).unwrap().obstacle().unwrap();
    assert!(obstacle.contains("another version of Slate"), "{obstacle}");
    let comparison = Comparison::open(&old).unwrap();
    let options = Options { recording: Some(comparison.recording()), ..Options::default() };
    let new = Run::read(&file("new-edition-run.mcap")).unwrap().configuration(Vec::new()).unwrap();
    let verdict = comparison.compare(Agent::load_with(&new, &plugins(), options).unwrap()).unwrap();
    assert_eq!(verdict, Verdict::NotCovered(obstacle));
}

#[test]
fn tools_read_recordings_of_older_edition() {
    let old = of_first_edition("edition-tools.mcap");
    let info = bag::verify(&mut Reader::open(&old).unwrap()).unwrap();
    assert!(info.messages > 0 && info.unchecked.is_empty(), "{info:?}");
    let out = file("edition-tools.csv");
    let (tables, unread) = slate_logs::export_csv(&old, &Selection::new(["/back/sum"]), &out).unwrap();
    assert_eq!((tables[0].rows, unread.len()), (values(&old, "/back/sum").len() as u64, 0));
    assert_eq!(
        slate_logs::copy(&old, &file("edition-copy.mcap"), &Selection::default()).unwrap(),
        info.messages
    );
    let page = page::write(&old, &Known::default(), &file("edition-page")).unwrap();
    assert!(page.unread.is_empty(), "{:?}", page.unread);
    assert!(std::fs::read_to_string(&page.files[0]).unwrap().contains("/back/sum"));
    assert!(Reader::open(&old).unwrap().metadata().unwrap().iter().any(|own: &Metadata| own.name == "run"));
}
