//! Large values of agents on one machine: they are read where their origin has put them.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

mod agents;

use std::sync::Arc;
use std::time::Duration;

use agents::{Agent, Blob, Folder, add, wait_for};
use slate_blackboard::Property;
use slate_blackboard::channel::{Latest, Policy, Start, Writer};
use slate_blackboard::interface::{Descriptor, Interface, Text};
use slate_module::interface;
use slate_share::carrier::local::Local;
use slate_share::carrier::{Carrier, Link};
use slate_share::peers::WantedProperty;
use slate_share::session::{Compression, Options};

const SIZE: usize = 100_000;

/// As many bytes behind a text.
#[interface]
pub struct Labeled {
    /// What was written.
    pub number: u64,
    /// What they are.
    pub label: Text<12>,
    /// The bytes.
    pub data: [u8],
}

/// An agent that writes large values, and one that reads them.
struct Two {
    /// Nothing when it is gone.
    base: Option<Agent>,
    reader: Agent,
    _folder: Folder,
}

impl Two {
    fn new() -> Self {
        let folder = Folder::new();
        let base = Agent::listening("base", &folder);
        let reader = Agent::start(folder.setup("reader"));
        reader.peers.connect("base", &folder.endpoint("base")).unwrap();
        Self { base: Some(base), reader, _folder: folder }
    }

    /// A property's writer, and its mirror.
    fn property(
        &self,
        path: &str,
        descriptor: &'static Descriptor,
        want: impl FnOnce(WantedProperty) -> WantedProperty,
        options: Options,
    ) -> (Writer, Arc<Property>) {
        let base = self.base.as_ref().unwrap();
        let property = add(&base.board, path, descriptor, SIZE, 64);
        let want = want(WantedProperty::new(path, options).expect(descriptor, SIZE));
        self.reader.peers.subscribe("base", want).unwrap();
        wait_for("a subscription", || property.readers() == 1);
        let mirror = self.reader.board.find(&format!("agents/base/{path}")).unwrap().0;
        (property.channel().unwrap().writer().unwrap(), mirror)
    }

    fn write(&self, writer: &mut Writer, head: usize, number: u64, items: usize) {
        let mut bytes = vec![number as u8; head + items];
        bytes[..8].copy_from_slice(&number.to_ne_bytes());
        writer.write(&bytes, items, 0).unwrap();
        self.base.as_ref().unwrap().peers.notifier().notify();
    }
}

/// Waits until a value is there, and looks whether all of it is right and nothing is behind it.
fn check(reader: &mut Latest, head: usize, number: u64, items: usize) {
    wait_for("a value", || {
        reader.refresh();
        reader.value().is_some_and(|loan| loan.bytes()[..8] == number.to_ne_bytes())
    });
    let loan = reader.value().unwrap();
    assert_eq!(loan.items(), items);
    let (value, rest) = loan.bytes().split_at(head + items);
    assert!(value[8..].iter().all(|byte| *byte == number as u8));
    assert_eq!((rest.len() < 8, rest.iter().all(|byte| *byte == 0)), (true, true));
}

/// Whether it is in memory that agents share.
fn is_shared(pointer: *const u8) -> bool {
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
    maps.lines().filter(|line| line.contains("memfd:slate-share")).any(|line| {
        let (first, end) = line.split_once(' ').unwrap().0.split_once('-').unwrap();
        let address = |text: &str| usize::from_str_radix(text, 16).unwrap();
        (address(first)..address(end)).contains(&pointer.addr())
    })
}

#[test]
fn a_large_value_is_read_where_it_is() {
    let two = Two::new();
    for (i, compression) in [Compression::None, Compression::Lossless].into_iter().enumerate() {
        let options = Options::default().compression(compression);
        let (mut writer, mirror) =
            two.property(&format!("out/blob{i}"), Blob::DESCRIPTOR, |want| want, options);
        let mut reader = mirror.channel().unwrap().latest().unwrap();
        // Also such as are not as long as the one that was there before.
        for (number, items) in (1..).zip([SIZE, SIZE - 1, 99_993, 70_003, 99_999].repeat(10)) {
            two.write(&mut writer, 8, number, items);
            check(&mut reader, 8, number, items);
            assert!(is_shared(reader.value().unwrap().as_ptr()), "{number}");
        }
        two.write(&mut writer, 8, 99, 100);
        check(&mut reader, 8, 99, 100);
        assert!(!is_shared(reader.value().unwrap().as_ptr()), "a small one");
    }
}

#[test]
fn non_numeric_or_long_lived_values_are_copied() {
    let two = Two::new();
    let (mut writer, mirror) =
        two.property("out/labelled", Labeled::DESCRIPTOR, |want| want, Options::default());
    let mut reader = mirror.channel().unwrap().latest().unwrap();
    for number in 1..=50 {
        two.write(&mut writer, Labeled::DESCRIPTOR.size, number, SIZE);
        check(&mut reader, Labeled::DESCRIPTOR.size, number, SIZE);
        assert!(!is_shared(reader.value().unwrap().as_ptr()));
    }
    let (mut writer, mirror) =
        two.property("out/kept", Blob::DESCRIPTOR, |want| want.depth(100), Options::default());
    let mut reader = mirror.channel().unwrap().latest().unwrap();
    for number in 1..=50 {
        two.write(&mut writer, 8, number, SIZE);
        check(&mut reader, 8, number, SIZE);
        assert!(!is_shared(reader.value().unwrap().as_ptr()));
    }
}

#[test]
fn readers_that_never_let_go_do_not_stop_later_values() {
    let two = Two::new();
    let (mut writer, mirror) =
        two.property("out/blob", Blob::DESCRIPTOR, |want| want.depth(4), Options::default());
    let channel = mirror.channel().unwrap();
    let mut reader = channel.latest().unwrap();
    let mut held = Vec::new();
    let mut windows = Vec::new();
    let mut number = 0;
    let mut next = |reader: &mut Latest| {
        number += 1;
        two.write(&mut writer, 8, number, SIZE);
        check(reader, 8, number, SIZE);
        number
    };
    // Each holds values that no other one has.
    for _ in 0..8 {
        let mut queue = channel.queue(Policy::Skip, Start::Next).unwrap();
        let numbers = [(); 4].map(|()| next(&mut reader));
        assert_eq!(queue.pull(), Ok(4));
        windows.push((queue, numbers));
    }
    for _ in 0..15 {
        let number = next(&mut reader);
        let mut latest = channel.latest().unwrap();
        check(&mut latest, 8, number, SIZE);
        held.push((latest, number));
    }
    for _ in 0..40 {
        next(&mut reader);
    }
    let pinned = windows.iter().flat_map(|(queue, _)| queue.window());
    let shared = pinned.chain(held.iter().filter_map(|(latest, _)| latest.value()));
    let shared = shared.filter(|loan| is_shared(loan.as_ptr())).count();
    assert!((16..=24).contains(&shared), "{shared} are where they were put, and the rest are copies");
    assert!(!is_shared(reader.value().unwrap().as_ptr()), "no more are lent");
    for (queue, numbers) in &windows {
        assert!(queue.window().zip(numbers).all(|(loan, number)| {
            let bytes = loan.bytes();
            bytes[..8] == number.to_ne_bytes() && bytes[8..8 + SIZE].iter().all(|byte| *byte == *number as u8)
        }));
    }
    for (latest, number) in &mut held {
        let loan = latest.value().unwrap();
        assert!(loan.bytes()[8..8 + SIZE].iter().all(|byte| *byte == *number as u8));
    }
    drop((held, windows));
    for _ in 0..10 {
        next(&mut reader);
    }
    assert!(is_shared(reader.value().unwrap().as_ptr()), "they are lent again");
}

#[test]
fn mismatched_loan_is_returned() {
    let two = Two::new();
    let want = |want: WantedProperty| want.expect(Blob::DESCRIPTOR, 80_000);
    let (mut writer, mirror) = two.property("out/blob", Blob::DESCRIPTOR, want, Options::queue());
    let mut reader = mirror.channel().unwrap().latest().unwrap();
    // More than there are places, each of which is sent.
    (1..=40).for_each(|number| two.write(&mut writer, 8, number, SIZE));
    for number in 41..=43 {
        two.write(&mut writer, 8, number, 80_000);
        check(&mut reader, 8, number, 80_000);
    }
    assert!(is_shared(reader.value().unwrap().as_ptr()));
}

#[test]
fn the_value_of_an_agent_that_is_gone_stays_right() {
    let mut two = Two::new();
    let (mut writer, mirror) = two.property("out/blob", Blob::DESCRIPTOR, |want| want, Options::default());
    let mut readers = [(); 2].map(|()| mirror.channel().unwrap().latest().unwrap());
    two.write(&mut writer, 8, 1, SIZE);
    check(&mut readers[0], 8, 1, SIZE);
    two.write(&mut writer, 8, 2, SIZE);
    check(&mut readers[1], 8, 2, SIZE);
    drop((writer, two.base.take()));
    wait_for("its end", || !two.reader.peers.is_connected("base"));
    wait_for("its writer's end", || !mirror.has_writer());
    check(&mut readers[0], 8, 2, SIZE);
    check(&mut readers[1], 8, 2, SIZE);
    assert!(readers.iter().all(|reader| is_shared(reader.value().unwrap().as_ptr())));
    drop((two, mirror));
    assert!(readers.iter().all(|reader| reader.value().unwrap().bytes()[8..8 + SIZE] == [2; SIZE]));
}

/// Two ends of a link.
fn linked(folder: &Folder) -> [Arc<dyn Link>; 2] {
    let listener = Local.listen(&folder.endpoint("base")).unwrap();
    let first = Local.dial(&folder.endpoint("base")).unwrap();
    let second = listener.accept(Duration::from_secs(20)).unwrap().unwrap();
    [first, second]
}

#[test]
fn a_place_is_lent_once_and_some_are_kept_back() {
    let folder = Folder::new();
    let [first, second] = linked(&folder);
    let (own, others) = (first.memory().unwrap(), second.memory().unwrap());
    let place = |byte: u8| {
        let mut reference = Vec::new();
        own.place(&vec![byte; 20_001], &mut reference).then_some(reference)
    };
    let mut references = vec![place(0).unwrap()];
    // The memory arrives with a packet of no session.
    assert_eq!(second.receive(&mut [0; 100], Duration::from_secs(20)).unwrap(), None);
    references.extend((1..).map_while(place));
    assert_eq!(references.len(), 32);
    assert!(others.lend(&references[0], 40_000).is_none(), "more than there is room for");
    assert!(others.lend(&references[0][..3], 20_001).is_none());
    let mut lent: Vec<_> = references.iter().map_while(|reference| others.lend(reference, 20_001)).collect();
    assert_eq!(lent.len(), 24);
    assert!(lent.iter().all(|lent| lent.bytes().len() == 20_032 && lent.bytes().addr().get() % 64 == 0));
    // One comes free, and is not lent twice.
    drop(lent.pop());
    assert!(others.lend(&references[23], 20_001).is_none(), "it is given back");
    assert!(others.lend(&references[0], 20_001).is_none(), "it is lent");
    assert!(!others.read(&references[0], 20_001, &mut |_| panic!("it is lent")));
    // The rest can be read.
    for (byte, reference) in references.iter().enumerate().skip(24) {
        let mut right = false;
        let mut take = |bytes: &[u8]| right = bytes == vec![byte as u8; 20_001];
        assert!(others.read(reference, 20_001, &mut take) && right);
    }
    let more: Vec<_> = (100..).map_while(place).collect();
    assert_eq!(more.len(), 9);
    // No number that a slot's word may have means a value of its own.
    for number in [0, u32::MAX] {
        let mut forged = references[0].clone();
        forged[2..].copy_from_slice(&number.to_le_bytes());
        assert!(others.lend(&forged, 20_001).is_none());
        assert!(!others.read(&forged, 20_001, &mut |_| panic!("it is lent")));
    }
    drop((first, second));
    drop(lent);
}
