//! The conversation, without a device and without a clock.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::time::Duration;

use proptest::prelude::*;
use slate_arcos::command::Command;
use slate_arcos::model::Model;
use slate_arcos::packet::{Decoder, encode};
use slate_arcos::report::{Identity, MOTORS, Report};
use slate_arcos::session::{Event, Loss, SILENCE, Session};

const STEP: Duration = Duration::from_millis(10);
const TIME_TO_LIVE: Duration = Duration::from_millis(200);

/// A session, and the other end of its line.
struct Line {
    session: Session,
    now: Duration,
    decoder: Decoder,
    /// Received packets, with their times.
    received: Vec<(Duration, Vec<u8>)>,
    events: Vec<Event>,
}

impl Line {
    fn new() -> Self {
        Self::with(None)
    }

    fn with(model: Option<&'static Model>) -> Self {
        Self {
            session: Session::new(model, TIME_TO_LIVE),
            now: Duration::ZERO,
            decoder: Decoder::default(),
            received: Vec::new(),
            events: Vec::new(),
        }
    }

    fn step(&mut self) {
        self.now += STEP;
        self.events.extend(self.session.poll(self.now));
        let bytes = std::mem::take(self.session.outgoing());
        let (received, now) = (&mut self.received, self.now);
        self.decoder.receive(&bytes, |data| received.push((now, data.to_vec())));
    }

    fn pass(&mut self, time: Duration) {
        let end = self.now + time;
        while self.now < end {
            self.step();
        }
    }

    fn say(&mut self, data: &[u8]) {
        let mut bytes = Vec::new();
        encode(data, &mut bytes);
        let events = &mut self.events;
        self.session.receive(&bytes, self.now, |event| events.push(event));
    }

    /// Says a report ten times a second.
    fn report(&mut self, report: &Report, time: Duration) {
        let end = self.now + time;
        while self.now < end {
            self.say(&report.encode());
            self.pass(Duration::from_millis(100));
        }
    }

    /// Packets received since the last call.
    fn take_received(&mut self) -> Vec<Vec<u8>> {
        self.received.drain(..).map(|(_, data)| data).collect()
    }

    /// The motions that were commanded since the last call.
    fn motions(&mut self) -> Vec<(i16, i16)> {
        let said = self.take_received();
        let commands: Vec<_> = said.iter().filter_map(|data| Command::decode(data)).collect();
        commands
            .windows(2)
            .filter_map(|pair| match *pair {
                [Command::Velocity(velocity), Command::Rotation(rotation)] => Some((velocity, rotation)),
                _ => None,
            })
            .collect()
    }

    fn losses(&self) -> Vec<Loss> {
        self.events
            .iter()
            .filter_map(|event| match event {
                Event::Lost(loss) => Some(loss.clone()),
                _ => None,
            })
            .collect()
    }

    /// Answers until the session is open.
    fn open(&mut self) {
        self.pass(Duration::from_millis(200));
        self.say(&[0]);
        self.step();
        self.say(&[1]);
        self.step();
        self.say(b"\x02Rosie\0Pioneer\0p3dx-sh\0");
        self.step();
        self.say(&Report::default().encode());
        self.step();
        assert!(matches!(self.events[..], [Event::Connected { .. }]), "{:?}", self.events);
    }
}

/// A report of a robot that stands, with motors and sonars on.
fn on() -> Report {
    Report { flags: MOTORS | 0b110, ..Report::default() }
}

#[test]
fn a_session_stops_the_robot_synchronizes_and_opens() {
    let mut line = Line::new();
    line.pass(Duration::from_millis(50));
    // A robot that its watchdog has stopped would drive on at any other packet.
    assert_eq!(line.take_received(), [[29], [2]]);
    line.pass(Duration::from_millis(100));
    assert_eq!(line.take_received(), [[0]]);
    line.say(&[0]);
    line.step();
    assert_eq!(line.take_received(), [[1]]);
    line.say(&[1]);
    line.step();
    assert_eq!(line.take_received(), [[2]]);
    line.say(b"\x02Rosie\0Pioneer\0p3dx-sh\0");
    line.step();
    assert_eq!(line.take_received(), [[1], [0]]);
    line.say(&Report::default().encode());
    let identity = Identity { name: "Rosie".into(), class: "Pioneer".into(), model: "p3dx-sh".into() };
    let model = Model::named("p3dx-sh").unwrap();
    assert_eq!(line.events, [Event::Connected { identity, model }]);
    line.report(&Report::default(), Duration::from_millis(500));
    let said = line.take_received();
    assert!(said.contains(&vec![4, 0x3B, 1, 0]), "the motors are switched on: {said:?}");
    assert!(said.contains(&vec![28, 0x3B, 1, 0]), "and the sonars: {said:?}");
}

#[test]
fn requests_are_repeated_and_then_session_restarts() {
    let mut line = Line::new();
    line.pass(Duration::from_millis(1100));
    let said = line.take_received();
    assert_eq!(said[..2], [[29], [2]]);
    assert_eq!(said[2..5], [[0], [0], [0]]);
    assert_eq!(said[5..7], [[29], [2]]);
    assert_eq!(line.losses(), [Loss::NoAnswer]);
    // Answers that are late, double or out of order do no harm.
    let mut line = Line::new();
    line.pass(Duration::from_millis(500));
    for data in [&[2][..], &[1], &[0], &[0], &[0], &[1], &[1], b"\x02a\0b\0p3dx-sh\0", b"\x02a\0b\0p3dx-sh\0"]
    {
        line.say(data);
        line.step();
    }
    line.say(&on().encode());
    assert!(matches!(line.events[..], [Event::Connected { .. }]), "{:?}", line.events);
}

#[test]
fn errors_are_distinguished() {
    let noise = |line: &mut Line| {
        for _ in 0..40 {
            let events = &mut line.events;
            line.session.receive(&[0xA5; 20], line.now, |event| events.push(event));
            line.pass(Duration::from_millis(30));
        }
    };
    let mut line = Line::new();
    noise(&mut line);
    assert_eq!(line.losses(), [Loss::Noise]);

    let mut line = Line::new();
    for _ in 0..12 {
        line.say(&on().encode());
        line.pass(Duration::from_millis(100));
    }
    assert_eq!(line.losses(), [Loss::Confused], "it never synchronizes");

    let mut line = Line::new();
    line.open();
    line.pass(SILENCE);
    assert_eq!(line.losses(), [Loss::Silent]);
    assert!(line.take_received().ends_with(&[vec![29], vec![2]]), "it is stopped before all else");

    let mut line = Line::new();
    line.open();
    noise(&mut line);
    assert_eq!(line.losses(), [Loss::Drowned]);
}

#[test]
fn a_model_that_is_not_known_must_be_named() {
    let answer = |line: &mut Line| {
        line.pass(Duration::from_millis(200));
        line.say(&[0]);
        line.say(&[1]);
        line.say(b"\x02Rosie\0Pioneer\0p4dx\0");
        line.step();
        line.say(&on().encode());
    };
    let mut line = Line::new();
    answer(&mut line);
    assert_eq!(line.losses(), [Loss::Unknown("p4dx".into())]);
    assert!(line.losses()[0].to_string().contains("p3dx-sh"), "{}", line.losses()[0]);
    let mut line = Line::with(Model::named("p3dx"));
    answer(&mut line);
    assert!(matches!(&line.events[..], [Event::Connected { model, .. }] if model.name == "p3dx"));
}

#[test]
fn a_command_is_sent_at_once_and_renewed_within_its_lifetime() {
    let mut line = Line::new();
    line.open();
    line.report(&on(), Duration::from_secs(2));
    line.take_received();
    line.session.drive(1.0, 1.0, line.now);
    line.step();
    assert_eq!(line.motions(), [(98, 0)]);
    let end = line.now + Duration::from_secs(1);
    while line.now < end {
        line.session.drive(1.0, 1.0, line.now);
        line.say(&Report { moving: true, ..on() }.encode());
        line.step();
    }
    let renewals = line.motions();
    assert!(
        (3..=5).contains(&renewals.len()) && renewals.iter().all(|motion| *motion == (98, 0)),
        "{renewals:?}"
    );
    let last = line.now;
    line.pass(TIME_TO_LIVE + STEP);
    let stop = line.received.iter().find(|(_, data)| *data == [11, 0x3B, 0, 0]).unwrap().0;
    assert!(stop > last && stop <= last + TIME_TO_LIVE, "{:?} after the last command", stop - last);
    // While it still moves, the stop is repeated.
    line.take_received();
    line.report(&Report { moving: true, ..on() }, Duration::from_secs(2));
    assert!(line.motions().len() >= 6);
}

#[test]
fn a_robot_that_stands_hears_a_pulse_at_least_every_second() {
    let mut line = Line::new();
    line.open();
    line.report(&on(), Duration::from_secs(10));
    let times: Vec<_> = line.received.iter().map(|(time, _)| *time).collect();
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] <= Duration::from_secs(1)));
    let pulses = line.take_received().iter().filter(|data| **data == [0]).count();
    assert!((10..25).contains(&pulses), "{pulses}");
}

#[test]
fn changing_commands_do_not_flood_the_line_or_delay_a_stop() {
    let mut line = Line::new();
    line.open();
    line.take_received();
    for step in 0..100 {
        line.session.drive(f64::from(step) / 10.0, 0.0, line.now);
        if step % 10 == 0 {
            line.say(&on().encode());
        }
        line.step();
    }
    let motions = line.motions();
    assert!((15..=21).contains(&motions.len()), "{}", motions.len());
    line.session.drive(0.0, 0.0, line.now);
    line.step();
    assert_eq!(line.motions().last(), Some(&(0, 0)));
}

#[test]
fn untaken_values_of_port_do_not_accumulate() {
    let mut session = Session::new(None, TIME_TO_LIVE);
    let mut now = Duration::ZERO;
    for _ in 0..100_000 {
        now += STEP;
        session.drive(1.0, 1.0, now);
        session.poll(now);
    }
    assert!(session.outgoing().len() < 300, "{}", session.outgoing().len());
}

#[test]
fn motors_that_a_person_switches_off_stay_off() {
    let mut line = Line::new();
    line.open();
    line.report(&on(), Duration::from_secs(1));
    line.take_received();
    let off = Report { flags: 0b110, ..Report::default() };
    line.report(&off, Duration::from_secs(5));
    // Not even with another connection.
    line.pass(SILENCE);
    line.events.clear();
    line.open();
    line.report(&off, Duration::from_secs(5));
    line.session.begin();
    line.events.clear();
    line.open();
    line.report(&off, Duration::from_secs(5));
    assert!(line.take_received().iter().all(|data| data[0] != 4), "nobody switches them on again");
    // Until the person does.
    line.report(&on(), Duration::from_secs(1));
    line.pass(SILENCE);
    line.events.clear();
    line.open();
    line.report(&off, Duration::from_secs(1));
    assert!(line.take_received().iter().any(|data| data[0] == 4));
}

#[test]
fn a_closed_session_stops_the_robot() {
    let mut line = Line::new();
    line.open();
    line.take_received();
    line.session.drive(1.0, 1.0, line.now);
    line.session.close();
    let bytes = std::mem::take(line.session.outgoing());
    let mut said = Vec::new();
    Decoder::default().receive(&bytes, |data| said.push(data.to_vec()));
    assert_eq!(said, [[29], [2]]);
}

proptest! {
    #[test]
    fn no_bytes_at_no_time_do_harm(
        steps in prop::collection::vec(
            (prop::collection::vec(prop_oneof![Just(0xFA_u8), Just(0xFB), 0..4_u8, any::<u8>()], 0..40), 0..400_u64),
            0..100,
        ),
    ) {
        let mut line = Line::new();
        for (bytes, milliseconds) in steps {
            let events = &mut line.events;
            line.session.receive(&bytes, line.now, |event| events.push(event));
            line.session.drive(1.0, 1.0, line.now);
            line.now += Duration::from_millis(milliseconds);
            line.step();
            prop_assert!(line.session.outgoing().len() < 300);
        }
        // Whatever was said, a robot that behaves is connected in the end.
        line.events.clear();
        for _ in 0..400 {
            let said = line.take_received();
            for data in said {
                match data[..] {
                    [step @ (0 | 1)] => line.say(&[step]),
                    [2] => line.say(b"\x02Rosie\0Pioneer\0p3dx-sh\0"),
                    _ => {}
                }
            }
            line.say(&on().encode());
            line.step();
        }
        prop_assert!(matches!(line.events.last(), Some(Event::Report(_))), "{:?}", line.events.last());
    }
}
