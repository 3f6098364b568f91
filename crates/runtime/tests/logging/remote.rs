use std::io::{BufRead, BufReader, Read};
use std::net::TcpStream;

use serde_json::Value;
use slate_module::Level;
use slate_runtime::log::{LogTarget, MemoryTarget, RemoteTarget};
use slate_runtime::{Options, Rate};

use crate::logging::{LONG, lines_of, logger, record};

fn target() -> RemoteTarget {
    RemoteTarget::bind("127.0.0.1:0".parse().unwrap()).unwrap()
}

fn subscribe(target: &RemoteTarget) -> BufReader<TcpStream> {
    let stream = TcpStream::connect(target.address()).unwrap();
    stream.set_read_timeout(Some(LONG)).unwrap();
    BufReader::new(stream)
}

fn next(subscriber: &mut BufReader<TcpStream>) -> Value {
    let mut line = String::new();
    subscriber.read_line(&mut line).unwrap();
    serde_json::from_str(&line).unwrap()
}

#[test]
fn subscribers_get_an_object_a_line_and_may_come_and_go() {
    let mut target = target();
    target.write(&record("to nobody"));
    let mut first = subscribe(&target);
    let mut with_fields = record("hello");
    with_fields.fields.push(("speed".into(), "1.2".into()));
    target.write(&with_fields);
    let expected = serde_json::json!({
        "time": 1_500_000_000, "level": "info", "module": "m", "text": "hello", "fields": { "speed": "1.2" },
    });
    assert_eq!(next(&mut first), expected);
    let mut second = subscribe(&target);
    target.write(&record("both"));
    assert_eq!(next(&mut first)["text"], "both");
    assert_eq!(next(&mut second)["text"], "both");
    drop(first);
    // The system finds out with the first lines after that.
    (0..10).for_each(|number| target.write(&record(&number.to_string())));
    drop(target);
    let mut rest = String::new();
    second.read_to_string(&mut rest).unwrap();
    assert_eq!(rest.lines().count(), 10, "the end keeps nothing back");
}

#[test]
fn a_slow_subscriber_loses_lines_and_learns_how_many() {
    let mut target = target();
    let mut subscriber = subscribe(&target);
    let text = "x".repeat(500);
    // More than the system's buffers take, by far. If anything waited for the subscriber, this would never end.
    let mut written = 40_000;
    (0..written).for_each(|_| target.write(&record(&text)));
    let (mut seen, mut lost) = (0, 0);
    while seen + lost < written {
        if target.idle() || lost == 0 {
            // There is always a line under way, so that reading never waits.
            target.write(&record("more"));
            written += 1;
        }
        let line = next(&mut subscriber);
        match line["dropped"].as_u64() {
            Some(count) => {
                assert_eq!(line["text"], "lines were lost, as this subscriber reads too slowly");
                lost += count;
            }
            None => seen += 1,
        }
    }
    assert!(lost > 0 && seen > 0);
    assert_eq!(seen + lost, written);
}

#[test]
fn a_crowd_is_bounded() {
    let mut target = target();
    let mut all: Vec<_> = (0..40).map(|_| subscribe(&target)).collect();
    target.write(&record("hello"));
    drop(target);
    let mut served = 0;
    for subscriber in &mut all {
        let mut text = String::new();
        // One that is turned away may see the connection reset.
        if subscriber.read_to_string(&mut text).is_ok() && !text.is_empty() {
            served += 1;
        }
    }
    assert_eq!(served, 32);
}

#[test]
fn a_subscriber_that_hangs_is_nothing_to_the_other_targets() {
    let target = target();
    let _asleep = subscribe(&target);
    let memory = MemoryTarget::default();
    let logger = logger(0, vec![Box::new(target), Box::new(memory.clone())]);
    let text = "x".repeat(500);
    // Fewer at a time than the buffer holds, so that all arrive unless a thread waits.
    for number in 0..100 {
        (0..400).for_each(|_| logger.log(number, Level::Info, &text));
        logger.flush(LONG);
    }
    assert_eq!(logger.dropped(), 0);
    assert_eq!(memory.lines().last().unwrap().time, 99);
}

#[test]
fn the_configuration_sets_the_address_and_the_log_shows_it() {
    let text = "time.source = \"talker\"\nlog.targets.remote = \"127.0.0.1:0\"\n[modules.talker]\n";
    let lines = lines_of(text, Options { rate: Rate::Max, ..Options::default() }, 1);
    assert!(lines[0].text.starts_with("the log is offered at 127.0.0.1:"), "{lines:?}");
}
