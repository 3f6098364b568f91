use std::sync::atomic::{AtomicBool, Ordering};

use slate_bag::Compression;
use slate_blackboard::channel::StampedValue;
use slate_blackboard::interface::Descriptor;
use slate_replay::{Plan, Player};
use slate_runtime::playback::{LoopSection, Order, PlaybackStatus};
use slate_runtime::recording::{HistoryRequest, Left};

use crate::replay::support::{Foreign, foreign_in, load, plugins, recorded};

const MS: u64 = 1_000_000;

/// Ends a playback, also after a failed assertion.
struct End<'a>(&'a AtomicBool);

impl Drop for End<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[test]
fn a_playback_steps_seeks_and_goes_in_circles() {
    let path = recorded("orders.mcap");
    let plan = Plan { is_paused: true, ..Plan::default() };
    let mut player = Player::open(&path, &plugins(), plan).unwrap();
    let (mut agent, control, stop) = (load(&player, None), player.control(), AtomicBool::new(false));
    let board = std::sync::Arc::clone(agent.board());
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let _end = End(&stop);
            let order = |order| -> PlaybackStatus { control.order(order).unwrap() };
            let read =
                |path: &str| board.read(path).unwrap().map(|(value, stamp)| (value.as_f64().unwrap(), stamp));
            assert!(order(Order::Status).is_paused);
            assert_eq!(read("source/number/value"), None);
            // Also before the first cycle, a step continues from where it was sent.
            assert_eq!(order(Order::Seek(100 * MS)).time, 100 * MS);
            assert_eq!(order(Order::Step(1)).time, 110 * MS);
            assert_eq!(read("source/number/value").unwrap().0, 12.0);
            order(Order::Seek(290 * MS));
            assert_eq!(order(Order::Step(1)).time, 290 * MS, "it is at its end");
            order(Order::Seek(0));
            assert_eq!(order(Order::Step(2)).time, 20 * MS);
            assert_eq!(read("source/number/value").unwrap().0, 3.0);
            // Each property has the last value that it had then.
            assert_eq!(order(Order::Seek(255 * MS)).time, 255 * MS);
            let (value, stamp) = read("late/number/value").unwrap();
            assert_eq!((value, stamp.sequence, stamp.time), (26.0, 7, 250 * MS));
            assert_eq!(order(Order::Step(1)).time, 260 * MS);
            assert_eq!(read("late/number/value").unwrap().1.sequence, 8);
            // One that had none yet has none.
            order(Order::Seek(100 * MS));
            assert_eq!(read("late/number/value"), None);
            assert_eq!(read("source/number/value").unwrap().0, 11.0);
            assert!(control.order(Order::Seek(291 * MS)).unwrap_err().0.contains("0.290 s"));
            assert!(control.order(Order::Rate(Some(-1.0))).is_err());
            assert!(control.order(Order::Loop(Some(LoopSection { from: 5, to: 5 }))).is_err());
            let section = LoopSection { from: 100 * MS, to: 120 * MS };
            assert_eq!(order(Order::Loop(Some(section))).section, Some(section));
            let before = order(Order::Resume).values;
            while order(Order::Status).values < before + 1000 {
                assert!((100 * MS..=120 * MS).contains(&order(Order::Status).time));
            }
            assert_eq!(order(Order::Pause).rate, None);
            assert_eq!(order(Order::Rate(Some(2.0))).rate, Some(2.0));
            assert_eq!(order(Order::Loop(None)).section, None);
            // Steps end with the recording.
            assert_eq!(order(Order::Step(1000)).time, 290 * MS);
        });
        player.run(&mut agent, &stop).unwrap();
    });
    drop(player);
    assert!(control.order(Order::Status).unwrap_err().0.contains("ended"));
}

#[test]
fn to_modules_time_never_goes_back() {
    let path = recorded("forward.mcap");
    let plan = Plan { is_paused: true, modules: ["back".into()].into(), ..Plan::default() };
    let mut player = Player::open(&path, &plugins(), plan).unwrap();
    let (mut agent, control, stop) = (load(&player, None), player.control(), AtomicBool::new(false));
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let _end = End(&stop);
            assert!(control.order(Order::Seek(0)).unwrap_err().0.contains("never goes back"));
            assert_eq!(control.order(Order::Step(2)).unwrap().modules, ["back"]);
        });
        player.run(&mut agent, &stop).unwrap();
    });
    assert_eq!(player.outcome().unwrap().unwrap().first, None);
    assert!(!agent.jump(0));
}

#[test]
fn a_playback_stays_at_its_end_where_that_is_wanted() {
    let path = recorded("stays.mcap");
    let plan = Plan { stays: true, ..Plan::default() };
    let mut player = Player::open(&path, &plugins(), plan).unwrap();
    let (mut agent, control, stop) = (load(&player, None), player.control(), AtomicBool::new(false));
    let board = std::sync::Arc::clone(agent.board());
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let _end = End(&stop);
            while !control.order(Order::Status).unwrap().is_paused {
                std::thread::yield_now();
            }
            let number = || board.read("source/number/value").unwrap().unwrap().0.as_f64();
            assert_eq!((control.order(Order::Status).unwrap().time, number()), (290 * MS, Some(30.0)));
            control.order(Order::Seek(100 * MS)).unwrap();
            assert_eq!(number(), Some(11.0));
        });
        assert!(player.run(&mut agent, &stop).unwrap().is_whole);
    });
}

/// Texts of which each fills a page of the disk and more, as CDR has them.
fn pages() -> Foreign<'static> {
    let text = |letter: u8| [&20_001_u32.to_le_bytes()[..], &[letter; 20_000], &[0]].concat();
    let values = (b'a'..=b'z').map(|letter| (u64::from(letter) * MS, text(letter)));
    Foreign {
        topic: "/page",
        kind: "other_msgs/msg/Page",
        text: "string letters\n",
        encoding: "cdr",
        values: values.collect(),
    }
}

#[test]
fn history_query_reads_only_its_range() {
    for compression in [Compression::None, Compression::Lz4] {
        let path = foreign_in(compression, "past.mcap", &[pages()]);
        let player = Player::open(&path, &plugins(), Plan::default()).unwrap();
        let control = player.control();
        let past = |most| {
            let request = HistoryRequest { path: "page".into(), from: 0, sequence: 0, to: u64::MAX, most };
            let mut letters = Vec::new();
            // Behind the length of the text.
            let mut take = |_: &'static Descriptor, value: StampedValue| {
                letters.push(value.bytes[4]);
                true
            };
            let past = control.history(&request, &mut take).map_err(|(wrong, _)| wrong)?;
            assert_eq!((past.left, past.count), (None, 26));
            Ok::<_, String>(letters)
        };
        assert_eq!(past(100), Ok((b'a'..=b'z').collect()));
        // A limited answer says where to continue.
        let request = HistoryRequest { path: "page".into(), from: 0, sequence: 0, to: u64::MAX, most: 100 };
        let mut taken = 0;
        let past_of_some = control.history(&request, &mut |_, value| {
            taken += value.bytes.len();
            taken < 100_000
        });
        let left = Left { count: 22, time: u64::from(b'e' - b'a') * MS, sequence: 5 };
        assert_eq!(past_of_some.unwrap().left, Some(left));
        if compression == Compression::Lz4 {
            continue;
        }
        // The seventh becomes another one, while the file is open.
        let mut bytes = std::fs::read(&path).unwrap();
        let place = bytes.windows(100).position(|part| part == [b'g'; 100]).unwrap();
        bytes[place + 10_000] ^= 1;
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(past(2), Ok(b"mz".to_vec()), "what is around it is not read");
        assert!(past(100).unwrap_err().contains("the file has become another one"));
    }
}

#[test]
fn continuing_among_values_of_one_time_misses_and_repeats_none() {
    let mut pages = pages();
    // All but the first three and the last three are of one time.
    for (_, (time, _)) in
        (b'a'..=b'z').zip(&mut pages.values).filter(|(letter, _)| (b'd'..=b'w').contains(letter))
    {
        *time = u64::from(b'd') * MS;
    }
    let path = foreign_in(Compression::Lz4, "one-time.mcap", &[pages]);
    let player = Player::open(&path, &plugins(), Plan::default()).unwrap();
    let control = player.control();
    for size in 1..=9 {
        let mut request =
            HistoryRequest { path: "page".into(), from: 0, sequence: 0, to: u64::MAX, most: 100 };
        let mut letters = Vec::new();
        loop {
            let mut room = size;
            let mut take = |_: &'static Descriptor, value: StampedValue| {
                let has_room = room > 0;
                room -= usize::from(has_room);
                if has_room {
                    letters.push(value.bytes[4]);
                }
                has_room
            };
            let Some(left) = control.history(&request, &mut take).unwrap().left else { break };
            (request.from, request.sequence) = (left.time, left.sequence);
        }
        assert_eq!(letters, (b'a'..=b'z').collect::<Vec<_>>(), "{size} at once");
    }
}
