//! How subscriptions are served: when values are sent, how large ones travel, and how they are made smaller.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use crate::agents;

use std::sync::Arc;

use agents::{Blob, Number, add, output};
use slate_blackboard::Board;
use slate_blackboard::channel::{Policy, QueueReader, Start};
use slate_blackboard::interface::{Descriptor, Field, Interface, Kind, View, difference, schema_hash};
use slate_blackboard::wake::Wake;
use slate_share::encoding::{decode, encode};
use slate_share::peers::{Peer, WantedProperty};
use slate_share::session::{Compression, Encoding, Identity, Limits, Options};

const MILLISECOND: u64 = 1_000_000;

/// `reader` reads what `writer` writes, over a line without faults, in virtual time.
struct Line {
    boards: [Arc<Board>; 2],
    peers: [Peer; 2],
    now: u64,
    bytes: u64,
}

impl Line {
    fn new() -> Self {
        let boards = ["writer", "reader"].map(|name| Arc::new(Board::new(name)));
        let peer = |own: usize, name: &str, other: &str| {
            let identity = Identity { agent: name.into(), instance: own as u64 + 1 };
            Peer::new(&boards[own], identity, other, Limits::default(), &Arc::new(Wake::new()))
        };
        let peers = [peer(0, "writer", "reader"), peer(1, "reader", "writer")];
        Self { boards, peers, now: 0, bytes: 0 }
    }

    /// Runs for that long, in steps of a tenth of a millisecond, of which every `nth` packet is lost (0 for none).
    fn run(&mut self, time: u64, nth: u64) {
        let mut count = 0;
        for _ in 0..time / (MILLISECOND / 10) {
            self.now += MILLISECOND / 10;
            for from in [0, 1] {
                self.peers[from].tick(self.now);
                let mut packet = Vec::new();
                for _ in 0..64 {
                    if !self.peers[from].outgoing(self.now, 1200, &mut packet, None) {
                        break;
                    }
                    self.bytes += packet.len() as u64;
                    count += 1;
                    if nth == 0 || count % nth != 0 {
                        self.peers[1 - from].receive(self.now, &packet, None);
                    }
                }
            }
        }
    }

    fn reader(&self, path: &str) -> QueueReader {
        let (mirror, _) = self.boards[1].find(&format!("agents/writer/{path}")).unwrap();
        mirror.channel().unwrap().queue(Policy::Skip, Start::Oldest).unwrap()
    }
}

/// The numbers that came.
fn numbers(reader: &mut QueueReader) -> Vec<u64> {
    let mut numbers = Vec::new();
    while reader.pull().unwrap() > 0 {
        numbers.extend(reader.window().map(|loan| u64::from_ne_bytes(loan.bytes()[..8].try_into().unwrap())));
    }
    numbers
}

/// The times at which values came that are written every millisecond for 100 ms.
fn served(options: Options) -> Vec<u64> {
    served_and_lost(options).0
}

/// The same, and how many values count as lost for the reader.
fn served_and_lost(options: Options) -> (Vec<u64>, u64) {
    let mut line = Line::new();
    let mut writer = output(&line.boards[0], "out/number", 256);
    let want = WantedProperty::new("out/number", options).expect(Number::DESCRIPTOR, 0).depth(256);
    line.peers[1].subscribe(want).unwrap();
    line.run(100 * MILLISECOND, 0);
    let mut reader = line.reader("out/number");
    let mut times = Vec::new();
    for value in 1..=100 {
        writer.write(View::of(&mut Number { value }).bytes(), 0, line.now).unwrap();
        line.run(MILLISECOND, 0);
        times.extend(numbers(&mut reader).iter().map(|_| value));
    }
    (times, reader.skipped())
}

#[test]
fn values_that_a_rate_leaves_out_are_not_lost() {
    let newest = Options::default();
    for options in [newest.minimum_interval(10 * MILLISECOND), newest.periodic(10 * MILLISECOND)] {
        let (times, lost) = served_and_lost(options);
        assert!(times.len() < 12, "{times:?}");
        assert_eq!(lost, 0, "{options:?}");
    }
}

#[test]
fn values_arrive_at_requested_rate() {
    let newest = Options::default();
    assert_eq!(served(newest).len(), 100);
    let spaced = served(newest.minimum_interval(10 * MILLISECOND));
    assert!((9..=11).contains(&spaced.len()), "{spaced:?}");
    assert!(spaced.windows(2).all(|pair| pair[1] - pair[0] >= 10), "{spaced:?}");
    let periodic = served(newest.periodic(10 * MILLISECOND));
    assert!((9..=11).contains(&periodic.len()), "{periodic:?}");
    assert!(periodic.windows(2).all(|pair| pair[1] - pair[0] == 10), "without drift: {periodic:?}");
    // Of a queue nothing is left out, it only comes in heaps.
    let heaps = served(Options::queue().periodic(20 * MILLISECOND));
    assert!(heaps.len() >= 80, "{heaps:?}");
    let mut moments = heaps.clone();
    moments.dedup();
    assert!(moments.len() <= 6, "{moments:?}");
}

/// Blobs of 100 000 bytes, which take about 90 packets each.
fn blobs(options: Options, nth: u64) -> (Vec<u64>, u64) {
    let mut line = Line::new();
    let size = 100_000;
    let property = add(&line.boards[0], "out/blob", Blob::DESCRIPTOR, size, 32);
    let mut writer = property.channel().unwrap().writer().unwrap();
    let want = WantedProperty::new("out/blob", options).expect(Blob::DESCRIPTOR, size).depth(32);
    let id = line.peers[1].subscribe(want).unwrap();
    line.run(300 * MILLISECOND, 0);
    let mut reader = line.reader("out/blob");
    let mut came = Vec::new();
    for number in 1..=10_u64 {
        let mut bytes = number.to_ne_bytes().to_vec();
        // What can't be made smaller.
        let mut noise = number;
        bytes.extend((0..size).map(|_| {
            noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (noise >> 56) as u8
        }));
        writer.write(&bytes, size, line.now).unwrap();
        line.run(100 * MILLISECOND, nth);
        while reader.pull().unwrap() > 0 {
            for loan in reader.window() {
                let number = u64::from_ne_bytes(loan.bytes()[..8].try_into().unwrap());
                assert_eq!(loan.items(), size);
                came.push(number);
            }
        }
    }
    line.run(500 * MILLISECOND, 0);
    came.extend(numbers(&mut reader));
    (came, line.peers[1].session().progress(id).unwrap().lost)
}

#[test]
fn large_values_are_cut_and_put_together() {
    let all: Vec<u64> = (1..=10).collect();
    for options in [Options::default(), Options::queue(), Options::queue().best_effort()] {
        assert_eq!(blobs(options, 0), (all.clone(), 0), "{options:?}");
    }
    // One packet in 30 is lost: of each blob several.
    assert_eq!(blobs(Options::queue(), 30), (all.clone(), 0));
    let (newest, _) = blobs(Options::default(), 30);
    assert_eq!(newest.last(), Some(&10));
    let (came, lost) = blobs(Options::queue().best_effort(), 30);
    assert_eq!((came.len() as u64 + lost, came.len() < 10), (10, true));
}

#[test]
fn repetitive_data_is_compressed() {
    let mut sent = Vec::new();
    for compression in [Compression::None, Compression::Lossless] {
        let mut line = Line::new();
        let property = add(&line.boards[0], "out/blob", Blob::DESCRIPTOR, 50_000, 1);
        let mut writer = property.channel().unwrap().writer().unwrap();
        line.peers[1]
            .subscribe(WantedProperty::new("out/blob", Options::default().compression(compression)))
            .unwrap();
        line.run(100 * MILLISECOND, 0);
        let before = line.bytes;
        writer.write(&[5; 50_008], 50_000, line.now).unwrap();
        line.run(100 * MILLISECOND, 0);
        let (mirror, _) = line.boards[1].find("agents/writer/out/blob").unwrap();
        let (bytes, items, stamp) = mirror.newest().unwrap().unwrap();
        assert_eq!((items, bytes == [5; 50_008]), (50_000, true));
        assert!(stamp.time < line.now, "the time is the origin's");
        sent.push(line.bytes - before);
    }
    assert!(sent[1] * 10 < sent[0], "{sent:?}");
}

#[test]
fn a_damaged_content_is_nothing() {
    let bytes = vec![3_u8; 5000];
    let mut content = Vec::new();
    assert_eq!(encode(Blob::DESCRIPTOR, &bytes, Compression::Lossless, &mut content), Encoding::Lz4);
    assert_eq!(decode(Blob::DESCRIPTOR, Encoding::Lz4, &content, 5000).unwrap().into_owned(), bytes);
    assert!(decode(Blob::DESCRIPTOR, Encoding::Lz4, &content, 5001).is_none());
    assert!(decode(Blob::DESCRIPTOR, Encoding::Lz4, &content, usize::MAX).is_none());
    assert!(decode(Blob::DESCRIPTOR, Encoding::Lz4, &content[..5], 5000).is_none());
    assert!(decode(Blob::DESCRIPTOR, Encoding::Plain, &content, 5000).is_none());
    assert!(decode(Blob::DESCRIPTOR, Encoding::Jpeg, &content, 5000).is_none());
}

const fn field(name: &'static str, unit: &'static str, offset: usize, kind: Kind) -> Field {
    Field { name, doc: "", unit, offset, kind }
}

fn pose(fields: Vec<Field>) -> Descriptor {
    let fields: &'static [Field] = fields.leak();
    Descriptor {
        name: "Pose",
        doc: "",
        ros: "",
        fields,
        size: 16,
        align: 8,
        hash: schema_hash("Pose", fields),
    }
}

/// Words for this agent and the other one.
const PLACES: (&str, &str) = ("here", "there");

#[test]
fn the_first_difference_of_two_schemas_is_named() {
    const X: Field = field("x", "m", 0, Kind::F64);
    let own = pose(vec![X, field("y", "m", 8, Kind::F64)]);
    let differs = |fields: Vec<Field>| difference(&own, &pose(fields), PLACES).unwrap();
    assert_eq!(difference(&own, &pose(vec![X, field("y", "m", 8, Kind::F64)]), PLACES), None);
    assert_eq!(differs(vec![X, field("y", "mm", 8, Kind::F64)]), "`y` is f64 in m here and f64 in mm there");
    assert_eq!(differs(vec![X, field("y", "m", 8, Kind::I64)]), "`y` is f64 in m here and i64 in m there");
    assert_eq!(differs(vec![X, field("z", "m", 8, Kind::F64)]), "a field is `y` here and `z` there");
    assert_eq!(differs(vec![X]), "Pose has `y` (f64 in m) only here");
    let other = Descriptor { name: "Place", ..pose(vec![X]) };
    let other = Descriptor { hash: schema_hash("Place", other.fields), ..other };
    assert_eq!(difference(&own, &other, PLACES).unwrap(), "here it is Pose, there Place");
}

/// Pixels of a picture that a camera could see.
#[cfg(feature = "jpeg")]
#[test]
fn an_image_as_jpeg_is_small_and_nearly_the_same() {
    use slate_interfaces::Image;

    let (width, height) = (160_u32, 120_u32);
    let mut bytes = Vec::new();
    [width, height, width * 3].iter().for_each(|number| bytes.extend(number.to_ne_bytes()));
    // RGB8, and three bytes that are not used.
    bytes.extend([1, 0, 0, 0]);
    for y in 0..height {
        bytes.extend((0..width).flat_map(|x| [x as u8, (y * 2) as u8, ((x + y) / 2) as u8]));
    }
    let mut content = Vec::new();
    let encoding = encode(Image::DESCRIPTOR, &bytes, Compression::Jpeg(90), &mut content);
    assert_eq!(encoding, Encoding::Jpeg);
    assert!(content.len() * 8 < bytes.len(), "{} of {}", content.len(), bytes.len());
    let image = decode(Image::DESCRIPTOR, encoding, &content, bytes.len()).unwrap();
    assert_eq!(image[..16], bytes[..16]);
    assert!(image.iter().zip(&bytes).all(|(came, sent)| came.abs_diff(*sent) < 24));
    for cut in [10, 20, 100, content.len() / 2] {
        // Whatever comes of it, it is an image of that size or nothing.
        let part = decode(Image::DESCRIPTOR, encoding, &content[..cut], bytes.len());
        assert!(part.is_none_or(|part| part.len() == bytes.len()));
    }
    assert!(decode(Image::DESCRIPTOR, encoding, &content, bytes.len() + 1).is_none());
    // What is not an image is sent without loss.
    let blob = vec![1; 4096];
    let encoding = encode(Blob::DESCRIPTOR, &blob, Compression::Jpeg(50), &mut Vec::new());
    assert_eq!(encoding, Encoding::Lz4);
}
