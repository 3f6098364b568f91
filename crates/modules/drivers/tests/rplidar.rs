//! Laser scanners of Slamtec.

use std::f64::consts::PI;
use std::time::Duration;

use proptest::prelude::*;
use slate_device_line::simulated::Faults;
use slate_drivers::rplidar::packet::{
    PacketDecoder, ResponseKind, RplidarNode, RplidarPacket, RplidarRequest,
};
use slate_drivers::rplidar::session::{RplidarOptions, RplidarSession};
use slate_drivers::simulated::SimulatedRplidar;
use slate_drivers::{DeviceFault, DeviceProtocol};

use crate::common::{Running, Talk, at_terminal, refusal, survives_a_pulled_cable};

/// A distance of its own for each degree, quarters of a millimeter; none at every 50th.
fn distance(degree: u16) -> u16 {
    if degree % 50 == 3 { 0 } else { 1000 + degree * 110 }
}

fn scanner() -> SimulatedRplidar {
    let mut scanner = SimulatedRplidar::default();
    scanner.set_distances(distance);
    scanner
}

const OPTIONS: RplidarOptions = RplidarOptions { beams: 360, range_min: 0.15, range_max: 12.0, motor: 660 };

/// Range of a beam, of which the first looks back and the others follow counter-clockwise.
fn meters(beam: usize) -> f64 {
    let degree = (540 - beam) % 360;
    let distance = distance(degree as u16);
    if distance == 0 { f64::INFINITY } else { f64::from(distance) / 4000.0 }
}

#[test]
fn rplidar_scan_arrives_as_sent() {
    let device = at_terminal(scanner());
    let running = Running::well("rplidar", device.name(), "");
    let ranges = running.numbers("scan/ranges");
    assert_eq!(ranges.len(), 360);
    for (beam, range) in ranges.into_iter().enumerate() {
        let sent = meters(beam);
        assert!(
            (range - sent).abs() < 5e-4 || sent.is_infinite() && !range.is_finite(),
            "{beam}: {range} of {sent}"
        );
    }
    assert!((running.number("scan/angle_min") + PI).abs() < 1e-12);
    assert!(running.text().starts_with("RPLIDAR A2 (model 40, firmware 1.29"), "{}", running.text());
    assert_eq!(device.with(|scanner| scanner.motor()), 660);
    survives_a_pulled_cable(&running, &device);
    drop(running);
    while device.with(|scanner| scanner.motor()) > 0 {
        std::thread::sleep(Duration::from_millis(2));
    }
}

pub fn rplidar_survives_damage_and_says_what_is_wrong() {
    let device = at_terminal(scanner());
    let running = Running::well("rplidar", device.name(), "");
    device.set_faults(Faults { drop: 1e-3, corrupt: 1e-3, ..Faults::default() });
    running.until("damage", || running.number("status/damaged") > 3.0);
    device.set_faults(Faults::default());
    device.set_faults(Faults { silent: true, ..Faults::default() });
    running.until_text("stopped responding");
    // A defect is reported, and the scanner restarted.
    device.with(|scanner| scanner.set_health(2, 0x17));
    device.set_faults(Faults::default());
    running.until("measurements", || running.is_well());
    assert_eq!(running.logged("defect (code 0x0017)"), 1);
}

#[test]
fn rplidar_that_warns_of_itself_measures_on() {
    let mut device = scanner();
    device.set_health(1, 9);
    let mut talk = Talk::new(RplidarSession::new(OPTIONS), device);
    assert!(talk.pass(Duration::from_millis(500), 3).unwrap().len() > 2);
    assert!(talk.protocol.device_error().is_some_and(|device_error| device_error.contains("0x0009")));
    talk.device.set_health(2, 9);
    let mut again = Talk::new(RplidarSession::new(OPTIONS), talk.device);
    assert!(matches!(again.pass(Duration::from_secs(1), 3), Err(DeviceFault::Refused(_))));
}

#[test]
fn rplidar_parameters_that_make_no_sense_are_refused() {
    assert!(refusal("rplidar", "params.baud = 9600").contains("115200"));
    assert!(refusal("rplidar", "params.beams = 5").contains("90"));
    assert!(refusal("rplidar", "params.device = \"\"").contains("/dev/ttyUSB0"));
}

/// Nodes that a decoder finds in pieces of bytes.
fn nodes(decoder: &mut PacketDecoder, bytes: &[u8], cut: usize) -> Vec<RplidarNode> {
    let mut nodes = Vec::new();
    for piece in bytes.chunks(cut) {
        decoder.receive(piece, |packet| {
            if let RplidarPacket::Node(node) = packet {
                nodes.push(node);
            }
        });
    }
    nodes
}

fn turn() -> Vec<RplidarNode> {
    let node = |degree: u16| RplidarNode {
        begins: degree == 0,
        quality: 15,
        angle: degree * 64,
        distance: distance(degree),
    };
    (0..360).map(node).collect()
}

fn scan_bytes(nodes: &[RplidarNode]) -> Vec<u8> {
    ResponseKind::Scan.descriptor().into_iter().chain(nodes.iter().flat_map(RplidarNode::bytes)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn rplidar_nodes_survive_a_round_trip(
        begins in any::<bool>(),
        quality in 0_u8..64,
        angle in 0_u16..361 * 64,
        distance in any::<u16>(),
    ) {
        let node = RplidarNode { begins, quality, angle, distance };
        prop_assert_eq!(RplidarNode::parse(node.bytes()), Some(node));
    }

    #[test]
    fn rplidar_finds_all_nodes_in_any_cuts(cut in 1_usize..64, garbage in proptest::collection::vec(0_u8..0xA5, 0..20)) {
        let turn = turn();
        let mut bytes = garbage;
        bytes.extend(scan_bytes(&turn));
        prop_assert!(nodes(&mut PacketDecoder::default(), &bytes, cut) == turn);
    }

    #[test]
    fn rplidar_loses_few_nodes_by_lost_bytes(place in 7_usize..1700, count in 1_usize..5, cut in 1_usize..64) {
        let turn = turn();
        let mut bytes = scan_bytes(&turn);
        bytes.drain(place..place + count);
        let found = nodes(&mut PacketDecoder::default(), &bytes, cut);
        let right = found.iter().filter(|node| turn.contains(node)).count();
        // One wrong node has right check bits by chance; some are lost until three in a row are right.
        prop_assert!(right >= 350 && found.len() - right <= 3, "{} right of {}", right, found.len());
    }

    #[test]
    fn rplidar_takes_any_bytes_in_any_cuts(
        bytes in proptest::collection::vec(prop_oneof![any::<u8>(), Just(0xA5), Just(0x5A)], 0..2000),
        cut in 1_usize..100,
    ) {
        let mut session = RplidarSession::new(OPTIONS);
        let mut outgoing = Vec::new();
        session.begin(Duration::ZERO, &mut outgoing);
        prop_assert!(session.poll(Duration::from_millis(60), &mut outgoing).is_ok());
        for piece in bytes.chunks(cut) {
            session.receive(piece, Duration::from_millis(60), &mut outgoing, &mut |_| ());
        }
        while let Some((_, used)) = RplidarRequest::parse(&outgoing) {
            outgoing.drain(..used);
        }
        prop_assert!(outgoing.is_empty(), "it sends bytes that are no request");
    }
}
