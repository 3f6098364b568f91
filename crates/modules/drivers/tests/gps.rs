//! Satellite receivers.

use std::time::Duration;

use proptest::prelude::*;
use slate_device_line::simulated::Faults;
use slate_drivers::DeviceProtocol;
use slate_drivers::gps::message::{GeographicPoint, GpsMessage};
use slate_drivers::gps::session::{GpsOptions, GpsSession};
use slate_drivers::sentence::{LONGEST, SentenceDecoder, append};
use slate_drivers::simulated::SimulatedGps;
use slate_interfaces::FixStatus;

use crate::common::{Running, Talk, at_terminal, refusal, survives_a_pulled_cable};

const OPTIONS: GpsOptions = GpsOptions { rate: 10.0, range_error_stddev: 4.0 };

fn receiver() -> SimulatedGps {
    let mut receiver = SimulatedGps::default();
    receiver.set_rate(10.0);
    receiver
}

const HOME: GeographicPoint = GeographicPoint { latitude: -33.856_784_4, longitude: -151.215_296_7 };

#[test]
fn gps_fix_arrives_as_sent_and_loss_is_reported() {
    let mut receiver = receiver();
    receiver.set_point(Some(HOME));
    receiver.set_quality(4);
    receiver.set_stddev(Some([0.5, 0.25, 1.0]));
    let device = at_terminal(receiver);
    let running = Running::well("gps", device.name(), "params.rate = 10.0");
    // A ten-millionth of a minute is 0.2 mm.
    assert!((running.number("fix/latitude") - HOME.latitude).abs() < 2e-9);
    assert!((running.number("fix/longitude") - HOME.longitude).abs() < 2e-9);
    assert!((running.number("fix/altitude") - 592.3).abs() < 1e-9);
    assert_eq!(running.numbers("fix/position_covariance"), [0.0625, 0.0, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 1.0]);
    device.with(|receiver| receiver.set_point(None));
    running.until_text("no satellite fix (2 satellites in use)");
    assert!(!running.is_well() && running.number("fix/latitude").is_nan());
    device.with(|receiver| receiver.set_point(Some(HOME)));
    running.until("a fix", || running.is_well() && !running.number("fix/latitude").is_nan());
    survives_a_pulled_cable(&running, &device);
}

pub fn gps_survives_damage_and_noise() {
    let device = at_terminal(receiver());
    let running = Running::well("gps", device.name(), "params.rate = 10.0");
    device.babble(b"$GPGGA,half\xFF\x00$$GPGGA,1*00\r\n");
    running.until("damage", || running.number("status/damaged") >= 3.0);
    device.set_faults(Faults { noise: true, ..Faults::default() });
    running.until_text("only noise is on the line");
    device.set_faults(Faults::default());
    running.until("a fix", || running.is_well());
}

#[test]
fn gps_parameters_that_make_no_sense_are_refused() {
    assert!(refusal("gps", "params.baud = 1200").contains("4800"));
    assert!(refusal("gps", "params.device = \"COM3\"").contains("/dev/ttyUSB0"));
}

#[test]
fn gps_messages_of_any_talker_are_read() {
    let parse = GpsMessage::parse;
    let Some(GpsMessage::Gga { time, point, status, satellites, horizontal_dilution, altitude }) =
        parse("GNGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,")
    else {
        panic!("it is a fix");
    };
    let point = point.unwrap();
    assert_eq!((time, status, satellites), (Some(45_319.0), FixStatus::FIX, 8));
    assert!((point.latitude - 48.1173).abs() < 1e-9 && (point.longitude - 11.516_666_667).abs() < 1e-9);
    assert_eq!((horizontal_dilution, altitude.map(f64::round)), (Some(0.9), Some(592.0)));
    assert_eq!(parse("GLRMC,,V,,,,,,,,,,N"), Some(GpsMessage::Rmc { time: None, point: None }));
    assert_eq!(
        parse("GPGSA,A,3,04,05,,09,12,,,24,,,,,2.5,1.3,2.1"),
        Some(GpsMessage::Gsa { horizontal_dilution: Some(1.3), vertical_dilution: Some(2.1) })
    );
    assert_eq!(
        parse("GPGST,172814.0,0.006,0.023,0.020,273.6,0.023,0.020,0.031"),
        Some(GpsMessage::Gst { time: Some(62_894.0), stddev: [0.023, 0.020, 0.031] })
    );
    for wrong in [
        "",
        "GPGGA",
        "PGRME,15.0,M",
        "GPGGA,123519,9907.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,",
        "GPGGA,123519,4867.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,",
        "GPGGA,123519,4807.038,X,01131.000,E,1,08,0.9,545.4,M,46.9,M,,",
        "GPGGA,123519,inf,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,",
        "GPGGA,999999,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,",
        "GPGST,172814.0,0.006,0.023,0.020,273.6,-1,0.020,0.031",
    ] {
        assert_eq!(parse(wrong), None, "{wrong}");
    }
}

#[test]
fn gps_covariance_is_of_dilutions_without_deviations() {
    let mut talk = Talk::new(GpsSession::new(OPTIONS), receiver());
    let fixes = talk.pass(Duration::from_millis(150), 5).unwrap();
    // Dilutions of 1 in the plane and 2 to the sky, at 4 m.
    assert_eq!(fixes[1].position_covariance, [8.0, 0.0, 0.0, 0.0, 8.0, 0.0, 0.0, 0.0, 64.0]);
}

#[test]
fn gps_with_rmc_alone_has_fixes_without_height() {
    let mut session = GpsSession::new(OPTIONS);
    let (mut bytes, mut fixes) = (Vec::new(), Vec::new());
    append("GPRMC,123519,A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W", &mut bytes);
    append("GPRMC,123520,V,,,,,,,230394,,", &mut bytes);
    session.receive(&bytes, Duration::ZERO, &mut Vec::new(), &mut |fix| fixes.push(*fix));
    assert_eq!([fixes[0].status, fixes[1].status], [FixStatus::FIX, FixStatus::NO_FIX]);
    assert!(fixes[0].altitude.is_nan() && fixes[1].latitude.is_nan());
    assert!(session.device_error().is_some());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn sentences_survive_a_round_trip_in_any_cuts(
        bodies in proptest::collection::vec("[ -#%-)+-~]{1,200}", 1..4),
        cut in 1_usize..50,
    ) {
        let mut bytes = Vec::new();
        for body in &bodies {
            append(body, &mut bytes);
        }
        let (mut decoder, mut found) = (SentenceDecoder::default(), Vec::new());
        for piece in bytes.chunks(cut) {
            decoder.receive(piece, |body| found.push(body.to_owned()));
        }
        prop_assert!(found == bodies);
        prop_assert_eq!(decoder.damaged(), 0);
    }

    #[test]
    fn a_changed_byte_never_becomes_another_sentence(place in 1_usize..60, byte in any::<u8>()) {
        let body = "GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,";
        let mut bytes = Vec::new();
        append(body, &mut bytes);
        prop_assume!(bytes[place] != byte);
        bytes[place] = byte;
        SentenceDecoder::default().receive(&bytes, |found| assert_eq!(found, body));
    }

    #[test]
    fn gps_takes_any_bytes_in_any_cuts(
        text in "(\\$G[PN](GGA|RMC|GSA|GST)[0-9,.NSEWA\\-]{0,80}\\*[0-9A-F]{2}\r\n|.{0,20}){0,20}",
        cut in 1_usize..50,
    ) {
        let mut session = GpsSession::new(OPTIONS);
        for piece in text.as_bytes().chunks(cut) {
            session.receive(piece, Duration::ZERO, &mut Vec::new(), &mut |_| ());
        }
        for body in text.split(['$', '*']) {
            let _ = GpsMessage::parse(body);
        }
    }
}

#[test]
fn a_sentence_that_is_too_long_is_damaged() {
    let (mut decoder, mut bytes) = (SentenceDecoder::default(), Vec::new());
    append(&"x".repeat(LONGEST), &mut bytes);
    append("next", &mut bytes);
    let mut found = Vec::new();
    decoder.receive(&bytes, |body| found.push(body.to_owned()));
    assert_eq!((found, decoder.damaged()), (vec!["next".to_owned()], 1));
}
