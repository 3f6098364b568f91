//! Properties, writers and readers that come and go while a board is in use.
#![cfg(not(any(loom, feature = "shuttle")))]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use crate::sample;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use proptest::prelude::*;
use sample::SAMPLE;
use slate_blackboard::channel::{Budget, Latest, Policy, QueueReader, Start, Writer};
use slate_blackboard::interface::{Interface, Value};
use slate_blackboard::message::Mailbox;
use slate_blackboard::wake::Wake;
use slate_blackboard::{Access, Board, BoardError, Channel, Event, Observer, Pattern, Property, Store};

const STORE: Store = Store { capacity: 4, depth: 2, budget: Budget { latest: 4, queues: 2, window: 1 } };

fn add(board: &Board, path: &str) -> Arc<Property> {
    board.add_channel(path, "A sample.", &SAMPLE, STORE, Access::Output).unwrap()
}

fn add_setting(board: &Board, path: &str) -> Arc<Property> {
    board.add_channel(path, "A sample.", &SAMPLE, STORE, Access::Setting).unwrap()
}

fn channel(board: &Board, path: &str) -> Arc<Channel> {
    Arc::clone(board.find(path).unwrap().0.channel().unwrap())
}

fn pattern(text: &str) -> Pattern {
    Pattern::parse(text).unwrap()
}

fn observe(board: &Board, text: &str, limit: usize) -> Observer {
    board.observe(&pattern(text), limit, None)
}

fn paths(properties: &[Arc<Property>]) -> Vec<&str> {
    properties.iter().map(|property| property.path()).collect()
}

#[test]
fn removed_property_still_works_for_its_holders() {
    let board = Board::new("base");
    let old = add(&board, "drive/state");
    let mut writer = channel(&board, "drive/state").writer().unwrap();
    let mut reader = channel(&board, "drive/state").latest().unwrap();
    board.remove("drive/state").unwrap();
    assert!(matches!(board.find("drive/state"), Err(BoardError::Unknown { .. })));
    assert!(board.properties().is_empty());
    writer.write(&[1; 8], 0, 5).unwrap();
    assert!(reader.refresh());
    assert_eq!(old.newest().unwrap().unwrap().2.time, 5);
    // The path is free, and what is there now is another property.
    let new = add(&board, "drive/state");
    assert!(!Arc::ptr_eq(&old, &new));
    assert_eq!((new.newest(), new.has_writer(), old.has_writer()), (Ok(None), false, true));
}

#[test]
fn a_link_is_removed_without_what_it_leads_to() {
    let board = Board::new("base");
    add(&board, "drive/state");
    board.add_alias("gate/state", "drive/state").unwrap();
    board.remove("gate/state").unwrap();
    assert!(board.find("gate/state").is_err() && board.aliases().is_empty());
    assert!(board.find("drive/state").is_ok());
    // The other way round it leads nowhere, until something is there again.
    board.add_alias("gate/state", "drive/state").unwrap();
    board.remove("drive/state").unwrap();
    let error = board.find("gate/state").unwrap_err().to_string();
    assert!(error.starts_with("no property at /drive/state;"), "{error}");
    add(&board, "drive/state");
    assert!(board.find("gate/state").is_ok());
}

#[test]
fn only_what_is_there_is_removed() {
    let board = Board::new("base");
    add(&board, "drive/state");
    for path in ["drive/stat", "drive/state/count", "drive", ""] {
        assert!(matches!(board.remove(path), Err(BoardError::Unknown { .. })), "{path}");
    }
    let error = board.remove("drive/stats").unwrap_err();
    assert_eq!(error.to_string(), "no property at /drive/stats; nearest: drive/state");
    assert_eq!(paths(&board.properties()), ["drive/state"]);
}

#[test]
fn a_link_is_led_elsewhere() {
    let board = Board::new("base");
    add(&board, "drive/state");
    add(&board, "arm/state");
    board.add_alias("gate/state", "drive/state").unwrap();
    assert_eq!(board.replace_alias("gate/state", "arm/state"), Ok("drive/state".into()));
    assert_eq!(board.find("gate/state").unwrap().0.path(), "arm/state");
    let exists = BoardError::Exists { url: "/arm/state".into() };
    assert_eq!(board.replace_alias("arm/state", "drive/state"), Err(exists));
    assert!(matches!(board.replace_alias("gate/stat", "x"), Err(BoardError::Unknown { .. })));
    assert_eq!(board.aliases(), [("gate/state".into(), "arm/state".into())]);
}

#[test]
fn properties_are_found_by_pattern_and_interface() {
    let board = Board::new("base");
    for path in ["arm/state", "drive/left/state", "drive/limits", "drive/state"] {
        add(&board, path);
    }
    board.add_channel("bumper/state", "", <()>::DESCRIPTOR, STORE, Access::Output).unwrap();
    board.add_alias("gate/state", "drive/state").unwrap();
    assert_eq!(paths(&board.matching(&pattern("*/state"))), ["arm/state", "bumper/state", "drive/state"]);
    assert_eq!(
        paths(&board.matching(&pattern("/drive/**"))),
        ["drive/left/state", "drive/limits", "drive/state"]
    );
    assert_eq!(paths(&board.matching_type("Sample", &pattern("*/state"))), ["arm/state", "drive/state"]);
    assert_eq!(board.matching_type("Sampl", &pattern("**")).len(), 0);
    assert_eq!(board.matching(&pattern("**")).len(), board.properties().len());
}

#[test]
fn observer_receives_events_in_order() {
    let board = Board::new("base");
    let mut observer = observe(&board, "drive/*", 16);
    let path: Arc<str> = "drive/state".into();
    add(&board, "arm/state");
    add(&board, "drive/state");
    let channel = channel(&board, "drive/state");
    let writer = channel.writer().unwrap();
    let latest = channel.latest().unwrap();
    let queue = channel.queue(Policy::Skip, Start::Next).unwrap();
    drop((latest, queue, writer));
    let writer = channel.writer().unwrap();
    board.remove("drive/state").unwrap();
    // It is not the board's any more.
    drop(writer);
    channel.latest().unwrap();
    add(&board, "drive/state");
    let told: Vec<_> = observer.by_ref().collect();
    assert_eq!(
        told,
        [
            Event::Appeared(path.clone()),
            Event::WriterCame(path.clone(), 1),
            Event::ReaderCame(path.clone()),
            Event::ReaderCame(path.clone()),
            Event::ReaderLeft(path.clone()),
            Event::ReaderLeft(path.clone()),
            Event::WriterLeft(path.clone(), 1),
            Event::WriterCame(path.clone(), 2),
            Event::Vanished(path.clone()),
            Event::Appeared(path.clone()),
        ]
    );
    assert!(told.iter().all(|event| **event.path() == *path));
    assert_eq!((observer.next(), observer.missed()), (None, 0));
    board.remove("drive/state").unwrap();
    assert_eq!(observer.next(), Some(Event::Vanished(path)));
}

#[test]
fn refusal_causes_no_event() {
    let board = Board::new("base");
    let mut observer = observe(&board, "**", 8);
    let property = add(&board, "drive/state");
    let channel = property.channel().unwrap();
    assert!(board.add_channel("drive/state", "", &SAMPLE, STORE, Access::Setting).is_err());
    assert!(board.remove("drive/stat").is_err());
    let _writer = channel.writer().unwrap();
    assert!(channel.writer().is_err());
    let appeared = observer.next().unwrap();
    let came = observer.next().unwrap();
    assert_eq!(appeared, Event::Appeared("drive/state".into()));
    assert_eq!((came, observer.next()), (Event::WriterCame("drive/state".into(), 1), None));
}

#[test]
fn mailboxes_and_settings_appear_and_links_do_not() {
    let board = Board::new("base");
    let mut observer = observe(&board, "**", 8);
    board.add_mailbox("drive/commands", "", &SAMPLE, Mailbox::new(SAMPLE.shape(0), 1, 1)).unwrap();
    board.add_alias("gate/commands", "drive/commands").unwrap();
    let setting = add_setting(&board, "drive/limits");
    board.remove("gate/commands").unwrap();
    board.remove("drive/commands").unwrap();
    let told: Vec<_> = observer.by_ref().collect();
    let [commands, limits] = ["drive/commands", "drive/limits"].map(Arc::<str>::from);
    assert_eq!(told, [Event::Appeared(commands.clone()), Event::Appeared(limits), Event::Vanished(commands)]);
    assert!(setting.has_writer(), "the host");
}

#[test]
fn a_full_queue_counts_what_it_misses_and_goes_on() {
    let board = Board::new("base");
    let (mut slow, mut fast) = (observe(&board, "**", 2), observe(&board, "**", 100));
    for name in ["a", "b", "c", "d"] {
        add(&board, name);
    }
    assert_eq!((slow.missed(), fast.missed()), (2, 0));
    assert_eq!(fast.by_ref().count(), 4, "nobody loses what another one does not take");
    assert_eq!(slow.next(), Some(Event::Appeared("a".into())));
    add(&board, "e");
    let rest: Vec<_> = slow.by_ref().collect();
    assert_eq!(rest, [Event::Appeared("b".into()), Event::Appeared("e".into())]);
    assert_eq!(slow.missed(), 2);
    let mut least = observe(&board, "**", 0);
    add(&board, "f");
    assert!(least.next().is_some(), "there is room for one at least");
}

#[test]
fn an_observer_is_woken() {
    let board = Board::new("base");
    let wake = Arc::new(Wake::new());
    let mut observer = board.observe(&pattern("drive/*"), 1, Some(Arc::clone(&wake)));
    add(&board, "arm/state");
    assert_eq!(wake.wait_timeout(Duration::ZERO), 0, "that is none of its business");
    for expected in [1, 0] {
        let name = format!("drive/{expected}");
        add(&board, &name);
        assert_eq!(wake.wait_timeout(Duration::ZERO), 1, "also of what it misses");
    }
    assert_eq!((observer.by_ref().count(), observer.missed()), (1, 1));
    drop(observer);
    add(&board, "drive/more");
    assert_eq!(wake.wait_timeout(Duration::ZERO), 0);
    assert_eq!(Arc::strong_count(&wake), 1, "nothing is left of an observer that is gone");
}

#[test]
fn a_property_counts_its_readers_and_writers() {
    let board = Board::new("base");
    let property = add(&board, "drive/state");
    let channel = property.channel().unwrap();
    assert_eq!((property.readers(), property.has_writer(), property.generation()), (0, false, 0));
    let latest = channel.latest().unwrap();
    let queue = channel.queue(Policy::Skip, Start::Next).unwrap();
    let writer = channel.writer().unwrap();
    assert_eq!((property.readers(), property.has_writer(), property.generation()), (2, true, 1));
    drop((latest, writer));
    assert_eq!((property.readers(), property.has_writer(), property.generation()), (1, false, 1));
    drop(queue);
    assert_eq!(property.readers(), 0);
    let mailbox = Mailbox::new(SAMPLE.shape(0), 1, 1);
    let messages = board.add_mailbox("drive/commands", "", &SAMPLE, mailbox).unwrap();
    assert_eq!((messages.readers(), messages.has_writer(), messages.generation()), (0, false, 0));
}

#[test]
fn a_tool_that_looks_is_no_reader() {
    let board = Board::new("base");
    let property = add(&board, "drive/state");
    let mut observer = observe(&board, "**", 8);
    assert_eq!(board.read("drive/state"), Ok(None));
    assert_eq!((property.readers(), observer.next()), (0, None));
    let latest = property.channel().unwrap().latest().unwrap();
    assert_eq!(property.readers(), 1);
    drop((latest, board, property));
    let told: Vec<_> = observer.by_ref().collect();
    let path: Arc<str> = "drive/state".into();
    assert_eq!(told, [Event::ReaderCame(path.clone()), Event::ReaderLeft(path)]);
}

#[test]
fn listener_wakes_when_its_setting_is_set() {
    let board = Board::new("base");
    let limits = add_setting(&board, "drive/limits");
    let wakes = [(); 2].map(|()| Arc::new(Wake::new()));
    let woken = || wakes.each_ref().map(|wake| wake.wait_timeout(Duration::ZERO));
    wakes.iter().for_each(|wake| limits.add_listener(Arc::clone(wake)));
    board.write("drive/limits/small", &Value::Integer(1), 0).unwrap();
    assert_eq!(woken(), [1, 1]);
    assert!(board.write("drive/limits/small", &Value::Integer(300), 0).is_err());
    assert_eq!(woken(), [0, 0], "nothing was set");
    limits.remove_listener(&wakes[0]);
    limits.set_bytes(&[0; sample::SIZE], 0).unwrap();
    assert_eq!(woken(), [0, 1]);
}

/// What is known of a property.
#[derive(Debug, Default, PartialEq)]
struct Known {
    readers: usize,
    /// The generation of the writer, if there is one.
    writer: Option<u64>,
}

fn learn(known: &mut BTreeMap<String, Known>, event: &Event) {
    let path = event.path().to_string();
    match event {
        Event::Appeared(_) => assert!(known.insert(path, Known::default()).is_none()),
        Event::Vanished(_) => assert!(known.remove(&path).is_some()),
        Event::WriterCame(_, generation) => known.get_mut(&path).unwrap().writer = Some(*generation),
        Event::WriterLeft(_, generation) => {
            assert_eq!(known.get_mut(&path).unwrap().writer.take(), Some(*generation));
        }
        Event::ReaderCame(_) => known.get_mut(&path).unwrap().readers += 1,
        Event::ReaderLeft(_) => known.get_mut(&path).unwrap().readers -= 1,
    }
}

#[derive(Clone, Debug)]
enum Operation {
    Add(usize),
    Remove(usize),
    Write(usize),
    Read(usize),
    Queue(usize),
    Look(usize),
    DropHandle(usize),
}

fn operation() -> impl Strategy<Value = Operation> {
    use Operation::*;
    prop_oneof![
        3 => (0..3_usize).prop_map(Add),
        2 => (0..3_usize).prop_map(Remove),
        2 => (0..3_usize).prop_map(Write),
        2 => (0..3_usize).prop_map(Read),
        2 => (0..3_usize).prop_map(Queue),
        1 => (0..3_usize).prop_map(Look),
        4 => (0..8_usize).prop_map(DropHandle),
    ]
}

#[allow(dead_code, reason = "a handle is only kept and dropped")]
enum Handle {
    Writer(Writer),
    Latest(Latest),
    Queue(QueueReader),
}

const NAMES: [&str; 3] = ["a/x", "a/y", "b"];

proptest! {
    #[test]
    fn events_tell_all_that_there_is(operations in prop::collection::vec(operation(), 1..80)) {
        let board = Board::new("base");
        let mut observer = observe(&board, "**", 1000);
        let mut handles = Vec::new();
        let mut known = BTreeMap::new();
        for operation in operations {
            let linked = |index: usize| board.find(NAMES[index]).map(|(property, _)| property);
            let link = |index: usize| linked(index).ok().and_then(|property| property.channel().cloned());
            match operation {
                Operation::Add(i) => {
                    let there = linked(i).is_ok();
                    let added = board.add_channel(NAMES[i], "", &SAMPLE, STORE, Access::Output);
                    prop_assert_eq!(added.is_err(), there);
                }
                Operation::Remove(i) => {
                    let there = linked(i).is_ok();
                    prop_assert_eq!(board.remove(NAMES[i]).is_ok(), there);
                }
                Operation::Write(i) => {
                    handles.extend(link(i).and_then(|channel| channel.writer().ok()).map(Handle::Writer));
                }
                Operation::Read(i) => {
                    handles.extend(link(i).and_then(|channel| channel.latest().ok()).map(Handle::Latest));
                }
                Operation::Queue(i) => {
                    let queue = link(i).and_then(|channel| channel.queue(Policy::Block, Start::Next).ok());
                    handles.extend(queue.map(Handle::Queue));
                }
                Operation::Look(i) => {
                    if let Ok(property) = linked(i) {
                        let _ = property.newest();
                    }
                }
                Operation::DropHandle(i) if i < handles.len() => drop(handles.swap_remove(i)),
                Operation::DropHandle(_) => {}
            }
            observer.by_ref().for_each(|event| learn(&mut known, &event));
            let there: BTreeMap<_, _> = board
                .properties()
                .iter()
                .map(|property| {
                    let writer = property.has_writer().then(|| property.generation());
                    (property.path().to_owned(), Known { readers: property.readers(), writer })
                })
                .collect();
            prop_assert_eq!(&known, &there);
            prop_assert_eq!(observer.missed(), 0);
        }
    }
}
