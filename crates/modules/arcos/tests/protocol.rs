//! Bytes and what they mean: the examples of the manual, and any bytes at all.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use proptest::prelude::*;
use slate_arcos::command::{Argument, Command, TEXT};
use slate_arcos::model::Model;
use slate_arcos::odometry::Odometer;
use slate_arcos::packet::{Decoder, LARGEST, encode};
use slate_arcos::report::{Identity, Range, Report};
use slate_arcos::ring::Ring;
use slate_interfaces::Pose2;

fn encoded(command: Command<'_>) -> Vec<u8> {
    let mut bytes = Vec::new();
    command.encode(&mut bytes);
    bytes
}

/// The packets that a decoder finds.
fn decoded(decoder: &mut Decoder, bytes: &[u8]) -> Vec<Vec<u8>> {
    let mut packets = Vec::new();
    decoder.receive(bytes, |data| packets.push(data.to_vec()));
    packets
}

fn p3dx() -> &'static Model {
    Model::named("p3dx-sh").unwrap()
}

#[test]
fn commands_are_the_bytes_of_the_manual() {
    assert_eq!(encoded(Command::Sync(0)), [250, 251, 3, 0, 0, 0]);
    assert_eq!(encoded(Command::Sync(1)), [250, 251, 3, 1, 0, 1]);
    assert_eq!(encoded(Command::Sync(2)), [250, 251, 3, 2, 0, 2]);
    assert_eq!(encoded(Command::Open), [0xFA, 0xFB, 0x03, 0x01, 0x00, 0x01]);
    assert_eq!(encoded(Command::Enable(true)), [0xFA, 0xFB, 0x06, 0x04, 0x3B, 0x01, 0x00, 0x05, 0x3B]);
}

#[test]
fn numbers_have_sign_and_magnitude_and_texts_a_length() {
    // 0x0B3B + 0x2C01, and 0x0B1B + 0x2C01.
    assert_eq!(encoded(Command::Velocity(300)), [0xFA, 0xFB, 6, 11, 0x3B, 0x2C, 0x01, 0x37, 0x3C]);
    assert_eq!(encoded(Command::Velocity(-300)), [0xFA, 0xFB, 6, 11, 0x1B, 0x2C, 0x01, 0x37, 0x1C]);
    // 0x032B + 0x0201, and 2 alone.
    let polling = Command::Other(3, Argument::Text(&[1, 2]));
    assert_eq!(encoded(polling), [0xFA, 0xFB, 7, 3, 0x2B, 2, 1, 2, 0x05, 0x2E]);
    // The right wheel is in the low byte.
    assert_eq!(encoded(Command::Wheels(-1, 2))[3..7], [32, 0x3B, 0x02, 0xFF]);
}

/// A report as the manual lays it out, byte by byte.
const REPORT: [u8; 37] = [
    0x33, // moving
    0xE8, 0x03, // x: 1000
    0x18, 0xFC, // y: -1000
    0x00, 0x04, // a quarter of a turn
    0x2C, 0x01, // left wheel: 300
    0xF4, 0xFF, // right wheel: -12
    0x7D, // 12.5 V
    0x05, // left stall, second button of the back bumper
    0x02, // first button of the front bumper
    0x00, 0x00, // control
    0x23, 0x00, // motors, first array of sonars, stop button
    0x00, // compass
    0x02, // two sonars
    0x03, 0xF4, 0x01, // number 3: 500
    0x0B, 0x88, 0x13, // number 11: 5000
    0x00, 0x05, 0x00, 0x00, 0x00, // gripper, analog port and value, inputs, outputs
    0x7D, 0x00, // battery once more
    0x00, // charger
    0x9C, 0xFF, // turns at -10 degrees per second
    0x00, // something of newer controllers
];

#[test]
fn a_report_is_read_field_by_field() {
    let report = Report::decode(&REPORT).unwrap();
    assert!(report.moving && report.motors() && report.sonars() && report.stop_button());
    assert_eq!((report.x, report.y, report.heading), (1000, 64_536, 1024));
    assert_eq!((report.left, report.right, report.battery), (300, -12, 125));
    assert_eq!(report.stalls(), (true, false));
    assert_eq!(report.bumpers(), (true, true));
    assert_eq!(report.ranges, [Range { sonar: 3, range: 500 }, Range { sonar: 11, range: 5000 }]);
    assert_eq!(report.rotation, Some(-100));
    // Older controllers say less.
    assert_eq!(Report::decode(&REPORT[..26]).unwrap().rotation, None);
    // Cut within the sonars, or something else.
    assert_eq!(Report::decode(&REPORT[..25]), None);
    assert_eq!(Report::decode(&[0x20; 60]), None);
    assert_eq!(Report::decode(&[]), None);
}

#[test]
fn an_identity_is_three_texts_possibly_missing_or_hostile() {
    let identity = Identity::decode(b"Rosie\0Pioneer\0p3dx-sh\0");
    assert_eq!((&*identity.name, &*identity.class, &*identity.model), ("Rosie", "Pioneer", "p3dx-sh"));
    assert_eq!(Identity::decode(b""), Identity::default());
    assert_eq!(Identity::decode(b"\x1b[2J\xFF x\0").name, "_[2J_ x");
}

#[test]
fn a_damaged_packet_is_counted_and_hides_no_other() {
    let mut decoder = Decoder::default();
    let mut bytes = encoded(Command::Velocity(300));
    bytes[5] ^= 1;
    bytes.extend(encoded(Command::Pulse));
    assert_eq!(decoded(&mut decoder, &bytes), [[0]]);
    assert_eq!((decoder.bad_checksums(), decoder.skipped()), (1, 9));
    // A header that garbage imitates swallows what follows, until there is enough to tell.
    let mut bytes = vec![0xFA, 0xFB, 40];
    let pulses: Vec<u8> = (0..10).flat_map(|_| encoded(Command::Pulse)).collect();
    bytes.extend(&pulses);
    assert_eq!(decoded(&mut decoder, &bytes).len(), 10);
}

#[test]
fn counts_that_no_packet_has_are_garbage() {
    for count in [0, 1, 2, 250, 255] {
        let mut decoder = Decoder::default();
        let mut bytes = vec![0xFA, 0xFB, count];
        bytes.extend(encoded(Command::Open));
        assert_eq!(decoded(&mut decoder, &bytes), [[1]], "{count}");
    }
    let mut bytes = Vec::new();
    encode(&[0; LARGEST - 1], &mut bytes);
    encode(&[], &mut bytes);
    assert!(bytes.is_empty(), "what fits in no packet is not begun");
}

#[test]
fn texts_are_decoded_and_those_that_fit_in_no_packet_left_out() {
    for length in [0, 1, TEXT] {
        let bytes = encoded(Command::Other(15, Argument::Text(&[7; TEXT][..length])));
        let packets = decoded(&mut Decoder::default(), &bytes);
        let text = &[7; TEXT][..length];
        assert_eq!(Command::decode(&packets[0]), Some(Command::Other(15, Argument::Text(text))));
    }
    assert!(encoded(Command::Other(15, Argument::Text(&[7; TEXT + 1]))).is_empty());
    assert_eq!(Command::decode(&[15, 0x2B, 3, 1, 2]), None, "its length is another one");
}

#[test]
fn wheels_become_forward_speed_and_turn() {
    // 1 m/s is 10.26 rad/s.
    assert_eq!(p3dx().motion(0.1 / 0.0975, 0.1 / 0.0975), (100, 0));
    assert_eq!(p3dx().motion(-2.0, 2.0), (0, 68));
    assert_eq!(p3dx().motion(1e9, 1e9), (2200, 0));
    assert_eq!(p3dx().motion(-1e9, 1e9), (0, 500));
    assert_eq!(p3dx().motion(f64::NAN, 1.0), (0, 0));
    assert_eq!(p3dx().motion(f64::INFINITY, f64::NEG_INFINITY), (0, 0));
}

#[test]
fn the_robot_is_the_one_of_the_simulator() {
    let description = slate_sim::robot::RobotDescription::load("pioneer_p3dx").unwrap();
    let sonar = &description.sonar["real"];
    let model = p3dx();
    assert_eq!(sonar.placements, model.sonars);
    assert_eq!((sonar.range_min, sonar.range_max), (model.range_min, model.range_max));
    assert!((sonar.field_of_view - model.field_of_view).abs() < 1e-4);
    assert_eq!((description.drive.wheel_radius, description.drive.track), (model.wheel_radius, model.track));
}

#[test]
fn a_robot_with_a_scanner_is_the_same_robot() {
    assert_eq!(Model::reported("p3dx-sh-lms500"), Some(p3dx()));
    assert_eq!(Model::reported("P3DX-SH"), Some(p3dx()));
    assert_eq!(Model::reported("p3dx").map(|model| model.distance), Some(0.000_485));
    assert_eq!(Model::reported("p3dx-shl"), None);
    assert_eq!(Model::reported("p3at-sh"), None);
}

fn report_at(x: u16, y: u16, heading: i16) -> Report {
    Report { x, y, heading, ..Report::default() }
}

#[test]
fn odometry_goes_on_where_the_numbers_wrap_around() {
    // With 16 bits, and with 15.
    for (from, to) in [(65_500, 464_u16), (32_700, 432), (464, 65_500), (432, 32_700)] {
        let mut odometer = Odometer::new(Pose2::default());
        odometer.advance(&report_at(from, from, 0), p3dx());
        let pose = odometer.advance(&report_at(to, to, 0), p3dx()).pose;
        let expected = if to < from { 0.5 } else { -0.5 };
        assert!((pose.x - expected).abs() < 1e-9 && (pose.y - expected).abs() < 1e-9, "{pose:?}");
        assert_eq!(odometer.jumps(), 0);
    }
    // Headings too, on either side of half a turn.
    let mut odometer = Odometer::new(Pose2::default());
    odometer.advance(&report_at(0, 0, 2040), p3dx());
    let pose = odometer.advance(&report_at(0, 0, -2040), p3dx()).pose;
    assert!((pose.theta - 16.0 * p3dx().angle).abs() < 1e-9, "{pose:?}");
}

#[test]
fn odometry_keeps_its_frame_when_the_controller_restarts() {
    let start = Pose2 { x: 1.0, y: 2.0, theta: std::f64::consts::FRAC_PI_2 };
    let mut odometer = Odometer::new(start);
    assert_eq!(odometer.advance(&report_at(7, 8, 0), p3dx()).pose, start);
    // Ahead for the controller, which is along y in the frame.
    let pose = odometer.advance(&report_at(107, 8, 0), p3dx()).pose;
    assert!((pose.x - 1.0).abs() < 1e-9 && (pose.y - 2.1).abs() < 1e-9, "{pose:?}");
    odometer.interrupt();
    assert_eq!(odometer.advance(&report_at(9000, 1, 1024), p3dx()).pose, pose);
    // Without a word of warning it is no motion, either.
    assert_eq!(odometer.advance(&report_at(0, 0, 0), p3dx()).pose, pose);
    assert_eq!(odometer.jumps(), 1);
}

#[test]
fn odometry_says_how_the_robot_moves() {
    let mut odometer = Odometer::new(Pose2::default());
    let mut report = Report { left: 100, right: 300, ..Report::default() };
    let twist = odometer.advance(&report, p3dx()).twist;
    assert!((twist.linear - 0.2).abs() < 1e-9 && (twist.angular - 0.2 / 0.331).abs() < 1e-9);
    // The controller knows better.
    report.rotation = Some(300);
    let twist = odometer.advance(&report, p3dx()).twist;
    assert!((twist.angular - 30_f64.to_radians()).abs() < 1e-9);
}

#[test]
fn a_scan_needs_an_echo_of_every_sonar() {
    let mut ring = Ring::new(p3dx(), 16);
    let range = |sonar, range| Range { sonar, range };
    for sonar in 0..15 {
        assert_eq!(ring.advance(&[range(sonar, 1000)], 0.0), None);
    }
    let scan = ring.advance(&[range(15, 5000), range(31, 7), range(0, 20)], 0.1).unwrap();
    assert_eq!((scan.echoes.len(), scan.placements.len()), (16, 16));
    assert!((scan.echoes[1].range - 1.0).abs() < 1e-12 && scan.echoes[1].heard.get());
    assert!(scan.echoes[15].range == 5.0 && !scan.echoes[15].heard.get(), "nothing was heard");
    assert!(scan.echoes[0].range == 0.1, "what is nearer can't be measured");
    assert_eq!(ring.advance(&[], 0.2), None, "nothing is new");
    assert!(ring.advance(&[range(0, 900)], 0.9).is_some());
    assert_eq!(ring.advance(&[range(0, 900)], 1.2), None, "number 1 is silent");
    assert_eq!(ring.silent(1.2), Some(1));
    // Front array alone.
    let mut ring = Ring::new(p3dx(), 8);
    let front: Vec<_> = (0..8).map(|sonar| range(sonar, 700)).collect();
    assert_eq!(ring.advance(&front, 0.0).unwrap().echoes.len(), 8);
}

fn command() -> impl Strategy<Value = Command<'static>> {
    prop_oneof![
        Just(Command::Pulse),
        Just(Command::Open),
        Just(Command::Close),
        Just(Command::Stop),
        any::<bool>().prop_map(Command::Enable),
        any::<i16>().prop_map(Command::Velocity),
        any::<i16>().prop_map(Command::Rotation),
        any::<(i8, i8)>().prop_map(|(left, right)| Command::Wheels(left, right)),
    ]
}

fn report() -> impl Strategy<Value = Report> {
    let ranges = prop::collection::vec(any::<(u8, u16)>(), 0..=71);
    let words = any::<(u16, u16, i16, i16, i16, i16, u16)>();
    let bytes = any::<(bool, u8, u8, u8, u8, Option<i16>)>();
    (words, bytes, ranges).prop_map(|(words, bytes, ranges)| Report {
        moving: bytes.0,
        x: words.0,
        y: words.1,
        heading: words.2,
        left: words.3,
        right: words.4,
        battery: bytes.1,
        left_stall_and_back_bumper: bytes.2,
        right_stall_and_front_bumper: bytes.3,
        control: words.5,
        flags: words.6,
        compass: bytes.4,
        ranges: ranges.into_iter().map(|(sonar, range)| Range { sonar, range }).collect(),
        rotation: bytes.5,
    })
}

/// Cuts bytes into pieces of these lengths, again and again.
fn pieces<'a>(mut bytes: &'a [u8], lengths: &[usize]) -> Vec<&'a [u8]> {
    let mut pieces = Vec::new();
    for length in lengths.iter().cycle() {
        if bytes.is_empty() {
            break;
        }
        let (piece, rest) = bytes.split_at((*length).min(bytes.len()));
        pieces.push(piece);
        bytes = rest;
    }
    pieces
}

proptest! {
    #[test]
    fn encoding_round_trips(commands in prop::collection::vec(command(), 1..20)) {
        let bytes: Vec<u8> = commands.iter().flat_map(|command| encoded(*command)).collect();
        let mut decoder = Decoder::default();
        let packets = decoded(&mut decoder, &bytes);
        let found: Vec<_> = packets.iter().map(|data| Command::decode(data).unwrap()).collect();
        prop_assert_eq!(found, commands);
        prop_assert_eq!((decoder.bad_checksums(), decoder.skipped()), (0, 0));
    }

    #[test]
    fn reports_come_through_any_cuts(
        reports in prop::collection::vec(report(), 1..6),
        lengths in prop::collection::vec(1..60_usize, 1..20),
    ) {
        let mut bytes = Vec::new();
        reports.iter().for_each(|report| encode(&report.encode(), &mut bytes));
        let mut decoder = Decoder::default();
        let mut found = Vec::new();
        for piece in pieces(&bytes, &lengths) {
            found.extend(decoded(&mut decoder, piece).iter().filter_map(|data| Report::decode(data)));
        }
        prop_assert_eq!(found, reports);
    }

    #[test]
    fn any_bytes_mean_the_same_in_any_cuts_and_never_panic(
        bytes in prop::collection::vec(prop_oneof![Just(0xFA_u8), Just(0xFB), Just(3), any::<u8>()], 0..600),
        lengths in prop::collection::vec(1..300_usize, 1..20),
    ) {
        let (mut whole, mut cut) = (Decoder::default(), Decoder::default());
        let found = decoded(&mut whole, &bytes);
        let in_pieces: Vec<_> =
            pieces(&bytes, &lengths).iter().flat_map(|piece| decoded(&mut cut, piece)).collect();
        prop_assert_eq!(&found, &in_pieces);
        prop_assert_eq!(whole.bad_checksums(), cut.bad_checksums());
        for data in found {
            let _ = (Command::decode(&data), Report::decode(&data), Identity::decode(&data));
        }
    }

    #[test]
    fn garbage_hides_packets_no_longer_than_one_packet_can_be(
        garbage in prop::collection::vec(prop_oneof![Just(0xFA_u8), Just(0xFB), any::<u8>()], 0..100),
    ) {
        let mut decoder = Decoder::default();
        decoded(&mut decoder, &garbage);
        // Each packet has 6 bytes.
        let packets = LARGEST / 6 + 2;
        let pulses: Vec<u8> = (0..packets).flat_map(|_| encoded(Command::Pulse)).collect();
        let found = decoded(&mut decoder, &pulses);
        // Garbage may have a right checksum, once in 65,536 headers: that is a packet, and hides those that it overlaps.
        let imitated: usize = found.iter().filter(|data| **data != [0]).map(|data| data.len() + 5).sum();
        let hidden = if imitated == 0 { 0 } else { imitated / 6 + 2 };
        prop_assert!(found.iter().filter(|data| **data == [0]).count() + hidden >= packets - 1);
    }

    #[test]
    fn odometry_follows_any_small_steps(steps in prop::collection::vec((-500..500_i32, -500..500_i32), 0..200)) {
        let mut odometer = Odometer::new(Pose2::default());
        let (mut x, mut y) = (0_i32, 0_i32);
        odometer.advance(&Report::default(), p3dx());
        for (dx, dy) in steps {
            (x, y) = (x + dx, y + dy);
            let pose = odometer.advance(&report_at(x as u16, y as u16, 0), p3dx()).pose;
            prop_assert!((pose.x - f64::from(x) / 1000.0).abs() < 1e-6);
            prop_assert!((pose.y - f64::from(y) / 1000.0).abs() < 1e-6);
        }
    }
}
