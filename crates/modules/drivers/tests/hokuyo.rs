//! Laser scanners of Hokuyo.

use std::time::Duration;

use proptest::prelude::*;
use slate_device_line::simulated::{Faults, SimulatedDevice, SimulatedLine};
use slate_drivers::DeviceFault;
use slate_drivers::hokuyo::encoding::{append_line, checksum, decode, encode};
use slate_drivers::hokuyo::response::{LARGEST, ScipDecoder};
use slate_drivers::hokuyo::scan::{ScanCommand, ScipScan};
use slate_drivers::hokuyo::session::{HokuyoOptions, HokuyoSession};
use slate_drivers::simulated::SimulatedHokuyo;

use crate::common::{Running, Talk, at_terminal, refusal, survives_a_pulled_cable};

/// A distance of its own for each step, up to 60 m; some steps have none.
fn distance(step: u16) -> u32 {
    if step % 100 == 7 { 5 } else { 100 + u32::from(step) * 37 % 59_000 }
}

fn scanner() -> SimulatedHokuyo {
    let mut scanner = SimulatedHokuyo::default();
    scanner.set_distances(distance);
    scanner
}

const OPTIONS: HokuyoOptions = HokuyoOptions { angle_min: -3.2, angle_max: 3.2, cluster: 1, skip: 0 };

fn meters(step: u16) -> f32 {
    let distance = distance(step);
    if distance < 23 { f32::INFINITY } else { distance as f32 / 1000.0 }
}

/// Every range as it was sent, to the millimeter.
fn assert_scan(running: &Running) {
    let ranges = running.numbers("scan/ranges");
    assert_eq!(ranges.len(), 1081);
    for (step, range) in (0..).zip(ranges) {
        let sent = f64::from(meters(step));
        // The board's text of an infinite number is not a number.
        assert!(
            (range - sent).abs() < 5e-4 || sent.is_infinite() && !range.is_finite(),
            "{step}: {range} of {sent}"
        );
    }
    assert!((running.number("scan/angle_min") + 135_f64.to_radians()).abs() < 1e-12);
    assert!((running.number("scan/angle_increment") - 0.25_f64.to_radians()).abs() < 1e-12);
    assert_eq!(running.number("scan/range_max"), 60.0);
}

#[test]
fn hokuyo_scan_arrives_as_sent_by_serial_line() {
    let device = at_terminal(scanner());
    // The Sensor finds its driver by the type of its output.
    let sensor = "[robots.r2.modules.laser]\nkind = \"laser_device\"";
    let running = Running::well("r2/hokuyo", device.name(), sensor);
    assert_scan(&running);
    running.until("the Sensor's value", || running.numbers("../r2/laser/value/ranges").len() == 1081);
    assert_eq!(running.text(), "UTM-30LX (H1234567)");
    running.until("a rate", || running.number("status/rate") > 36.0);
    assert!(running.number("status/rate") < 44.0, "{}", running.number("status/rate"));
    assert!(running.number("status/arrival") > 0.0);
    survives_a_pulled_cable(&running, &device);
    // The end of the agent switches the laser off.
    assert!(device.with(|scanner| scanner.laser_is_on()));
    drop(running);
    while device.with(|scanner| scanner.laser_is_on()) {
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn hokuyo_scan_arrives_as_sent_by_network() {
    let device = SimulatedDevice::start(scanner(), SimulatedLine::Tcp(0)).unwrap();
    let running = Running::well("hokuyo", device.name(), "");
    assert_scan(&running);
    device.unplug();
    running.until_text("no connection");
    device.plug().unwrap();
    running.until("measurements", || running.is_well());
    assert_eq!(running.number("status/losses"), 1.0);
}

pub fn hokuyo_survives_damage_babble_noise_and_silence() {
    let device = at_terminal(scanner());
    let running = Running::well("hokuyo", device.name(), "");
    // One in 12,000 bytes: every fourth scan or so.
    device.set_faults(Faults { corrupt: 6e-5, drop: 2e-5, ..Faults::default() });
    device.babble(b"\xFF\n\nMD\n00P\n99b\n\n\x00garbage");
    running.until("damage", || running.number("status/damaged") > 2.0);
    assert_scan(&running);
    device.set_faults(Faults { noise: true, ..Faults::default() });
    running.until_text("only noise");
    device.set_faults(Faults { silent: true, ..Faults::default() });
    running.until_text("does not answer");
    device.set_faults(Faults::default());
    running.until("measurements", || running.is_well());
    assert_scan(&running);
}

pub fn hokuyo_that_lags_or_fails_is_named() {
    let device = at_terminal(scanner());
    let running = Running::well("hokuyo", device.name(), "");
    device.with(|scanner| scanner.set_speed(0.5));
    running.until_text("of 40.0 measurements a second");
    assert!(!running.is_well() && running.number("status/is_connected") == 1.0);
    device.with(|scanner| scanner.set_speed(1.0));
    running.until("a full rate", || running.is_well());
    device.with(|scanner| scanner.set_defective(true));
    // A parameter that changes acts at once.
    running.set("skip", slate_module::blackboard::interface::Value::Integer(1));
    running.until_text("can't switch its laser on");
    device.with(|scanner| scanner.set_defective(false));
    running.until("measurements", || running.is_well());
}

#[test]
fn hokuyo_parameters_that_make_no_sense_are_refused() {
    for (params, words) in [
        ("params.device = \"ttyACM0\"", "tcp://192.168.0.10:10940"),
        ("params.device = \"/no/such/folder/ttyACM0\"", "there is no folder /no/such/folder"),
        ("params.device = \"/etc/hostname\"", "is a file, and no device"),
        ("params.device = \"tcp://host:x\"", "expected an address such as"),
        ("params.baud = 300", "19200"),
        ("params.angle_min = 1.0\nparams.angle_max = -1.0", "is beyond `angle_max`"),
    ] {
        let error = refusal("hokuyo", params);
        assert!(error.contains(words), "{params}: {error}");
    }
}

#[test]
fn hokuyo_session_takes_a_part_of_the_circle_in_clusters() {
    let options = HokuyoOptions { angle_min: -0.5, angle_max: 0.5, cluster: 4, skip: 0 };
    let mut talk = Talk::new(HokuyoSession::new(options), scanner());
    let sweeps = talk.pass(Duration::from_millis(200), 7).unwrap();
    let sweep = sweeps.last().unwrap();
    // Steps 426 to 653: half a radian is 114.6 steps, and clusters are whole.
    assert_eq!(sweep.ranges.len(), 57);
    let first = talk.device.angle(426);
    let increment = 0.25_f64.to_radians();
    assert!((sweep.angle_min - (first + 1.5 * increment)).abs() < 1e-12);
    assert!((sweep.angle_increment - 4.0 * increment).abs() < 1e-12);
    let shortest =
        (426..430).map(meters).fold(f32::INFINITY, |least, range| if range < least { range } else { least });
    assert_eq!(sweep.ranges[0], shortest);
}

#[test]
fn hokuyo_session_says_what_a_scanner_refuses() {
    let mut scanner = scanner();
    scanner.set_defective(true);
    let mut talk = Talk::new(HokuyoSession::new(OPTIONS), scanner);
    let Err(DeviceFault::Refused(text)) = talk.pass(Duration::from_secs(1), 100) else {
        panic!("it is refused")
    };
    assert!(text.contains("off and on"), "{text}");
}

#[test]
fn scip_texts_and_intensities_are_read() {
    let mut bytes = b"PP\n".to_vec();
    append_line(b"00", &mut bytes);
    for line in ["MODL:URG-04LX(Hokuyo)", "DMIN:20", "DMAX:5600"] {
        bytes.extend_from_slice(line.as_bytes());
        bytes.extend([b';', checksum(line.as_bytes()), b'\n']);
    }
    bytes.push(b'\n');
    let mut found = Vec::new();
    ScipDecoder::default().receive(&bytes, |response| {
        found.push((response.value("DMAX").map(str::to_owned), response.value("SCAN").map(str::to_owned)));
    });
    assert_eq!(found, [(Some("5600".to_owned()), None)]);
    let command = ScanCommand { intensities: true, first: 10, last: 12, cluster: 1, skip: 0, count: 0 };
    assert_eq!(command.text(), "ME0010001201000");
    let scan = ScipScan { time: 77, distances: vec![1, 2, 3], intensities: vec![10, 0, 262_143] };
    assert_eq!(read(&command, &scan), Some(scan));
}

/// A scan that goes through a decoder.
fn read(command: &ScanCommand, scan: &ScipScan) -> Option<ScipScan> {
    let mut bytes = Vec::new();
    scan.append(command, &mut bytes);
    let mut found = None;
    ScipDecoder::default().receive(&bytes, |response| {
        assert_eq!(ScanCommand::parse(response.echo), Some(*command));
        let mut scan = ScipScan::default();
        found = scan.read(command, &response).map(|()| scan);
    });
    found
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn scip_numbers_survive_a_round_trip(number in 0_u32..1 << 24) {
        for (count, bits) in [(2, 12), (3, 18), (4, 24)] {
            let mut characters = Vec::new();
            encode(number, count, &mut characters);
            prop_assert_eq!(decode(&characters), Some(number & ((1 << bits) - 1)));
        }
    }

    #[test]
    fn scip_scans_survive_a_round_trip(
        distances in proptest::collection::vec(0_u32..1 << 18, 1..300),
        first in 0_u16..500,
        time in 0_u32..1 << 24,
        intensities in any::<bool>(),
        count in 0_u8..100,
    ) {
        let last = first + distances.len() as u16 - 1;
        let command = ScanCommand { intensities, first, last, cluster: 1, skip: 3, count };
        let intensities = if intensities { distances.iter().rev().copied().collect() } else { Vec::new() };
        let scan = ScipScan { time, distances, intensities };
        prop_assert!(read(&command, &scan) == Some(scan));
    }

    #[test]
    fn scip_damage_never_becomes_another_scan(
        place in 20_usize..300,
        byte in any::<u8>(),
        cut in 1_usize..50,
    ) {
        let command = ScanCommand { intensities: false, first: 0, last: 99, cluster: 1, skip: 0, count: 0 };
        let scan = ScipScan { time: 5, distances: (0..100).map(|step| step * 31).collect(), intensities: Vec::new() };
        let mut whole = Vec::new();
        scan.append(&command, &mut whole);
        let mut bytes = whole.clone();
        let place = place % bytes.len();
        prop_assume!(bytes[place] != byte);
        bytes[place] = byte;
        // A wrong one, and a right one after it.
        bytes.extend(&whole);
        let (mut decoder, mut scans) = (ScipDecoder::default(), Vec::new());
        for piece in bytes.chunks(cut) {
            decoder.receive(piece, |response| {
                let mut found = ScipScan::default();
                let echo = ScanCommand::parse(response.echo) == Some(command) && response.status == *b"99";
                if echo && found.read(&command, &response).is_some() {
                    scans.push(found);
                }
            });
        }
        // A line feed that comes or goes may join both.
        prop_assert!(scans.len() <= 2 && scans.iter().all(|found| *found == scan));
    }

    #[test]
    fn scip_takes_any_bytes_in_any_cuts(
        bytes in proptest::collection::vec(prop_oneof![any::<u8>(), Just(b'\n'), Just(b'0')], 0..2000),
        cut in 1_usize..100,
    ) {
        let mut session = HokuyoSession::new(OPTIONS);
        let mut outgoing = Vec::new();
        slate_drivers::DeviceProtocol::begin(&mut session, Duration::ZERO, &mut outgoing);
        for piece in bytes.chunks(cut) {
            slate_drivers::DeviceProtocol::receive(&mut session, piece, Duration::ZERO, &mut outgoing, &mut |_| ());
        }
    }
}

#[test]
fn scip_forgets_what_is_too_long_and_finds_the_next() {
    let mut bytes = vec![b'x'; 3 * LARGEST];
    bytes.extend_from_slice(b"\n\nQT\n00P\n\n");
    let (mut decoder, mut found) = (ScipDecoder::default(), 0);
    decoder.receive(&bytes, |response| found += usize::from(response.echo == b"QT"));
    assert_eq!((found, decoder.damaged()), (1, 1));
}
