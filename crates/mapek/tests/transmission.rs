//! Actions that send messages to other robots.
#![allow(clippy::panic, missing_docs, reason = "a test")]

use serde::{Deserialize, Serialize};
use slate_interfaces::Point2;
use slate_mapek::prelude::*;
use slate_mapek::{Ending, ExecuteBlock, ExecuteStatus, PlanStep, Planned};
use slate_module::prelude::*;
use slate_module::testing::Fixture;
use slate_module::{Delivery, Outcome};

#[ports]
pub struct Body {
    #[window(2)]
    pub go: Outbox<Point2>,
}

#[derive(Serialize, Deserialize)]
pub struct SendThere {
    place: (f64, f64),
    transmission: Transmission,
}

impl ActionKind for SendThere {
    const KIND: &'static str = "SendThere";
    type Arguments = (f64, f64);

    fn start(place: (f64, f64)) -> Self {
        Self { place, transmission: Transmission::within(0.1) }
    }
}

impl Action<Body> for SendThere {
    fn act(&mut self, acting: &Acting<'_, Body>) -> Step {
        let (x, y) = self.place;
        self.transmission.send(&acting.body.go, Point2 { x, y }, acting.now)
    }
}

/// As [`SendThere`], where others fill the outbox in every cycle.
#[derive(Serialize, Deserialize)]
pub struct SendInCrowd(Transmission);

impl ActionKind for SendInCrowd {
    const KIND: &'static str = "SendInCrowd";
    type Arguments = ();

    fn start((): ()) -> Self {
        Self(Transmission::within(0.1))
    }
}

impl Action<Body> for SendInCrowd {
    fn act(&mut self, acting: &Acting<'_, Body>) -> Step {
        while acting.body.go.send(Point2::default()) {}
        self.0.send(&acting.body.go, Point2 { x: 9.0, y: 0.0 }, acting.now)
    }
}

repertoire! {
    pub enum Actions for Body { SendThere, SendInCrowd }
}

type Execute = Fixture<ExecuteBlock<Actions>>;

fn planned(x: f64, ticket: u64) -> Planned {
    let action = SendThere::request((x, 0.0));
    Planned { epoch: 0, ticket, action, step: PlanStep::APPEND }
}

/// Ticks, and says what was sent and how the last action ended, if one did.
fn step(execute: &mut Execute) -> (Vec<f64>, Option<Ending>) {
    execute.advance(20_000_000);
    assert_eq!(execute.tick(), Outcome::Ok);
    let sent = execute.sent::<Point2>("go").iter().map(|point| point.x).collect();
    let status = execute.output::<ExecuteStatus>("status");
    (sent, status.and_then(|status| status.ended.last().map(|ended| ended.ending)))
}

#[test]
fn it_is_done_when_the_message_was_taken() {
    let mut execute = Execute::new();
    execute.push("plan", planned(1.0, 1));
    assert_eq!(step(&mut execute), (vec![1.0], None));
    assert_eq!(step(&mut execute), (vec![], None), "it is sent once");
    execute.deliver("go", 1, Delivery::Done);
    assert_eq!(step(&mut execute), (vec![], Some(Ending::COMPLETED)));
}

#[test]
fn it_fails_if_the_message_is_refused_lost_or_timed_out() {
    for (number, answer) in [(1, Some(Delivery::Refused(7))), (1, Some(Delivery::Lost)), (1, None)] {
        let mut execute = Execute::new();
        execute.push("plan", planned(1.0, 1));
        assert_eq!(step(&mut execute).0, [1.0]);
        if let Some(answer) = answer {
            execute.deliver("go", number, answer);
            assert_eq!(step(&mut execute).1, Some(Ending::FAILED), "{answer:?}");
            continue;
        }
        for _ in 0..5 {
            assert_eq!(step(&mut execute).1, None);
        }
        assert_eq!(step(&mut execute).1, Some(Ending::FAILED), "nobody answered");
    }
}

#[test]
fn it_fails_when_the_outbox_has_no_room_in_time() {
    let mut execute = Execute::new();
    execute.push("plan", Planned { action: SendInCrowd::request(()), ..planned(0.0, 1) });
    for _ in 0..6 {
        assert_eq!(step(&mut execute), (vec![0.0, 0.0], None));
    }
    assert_eq!(step(&mut execute), (vec![0.0, 0.0], Some(Ending::FAILED)));
}

#[test]
fn each_action_hears_of_its_own_message() {
    let mut execute = Execute::new();
    let mut ended = Vec::new();
    let answers = [Delivery::Done, Delivery::Done, Delivery::Done, Delivery::Refused(1)];
    for (number, answer) in (1..).zip(answers) {
        execute.push("plan", planned(number as f64, number));
        assert_eq!(step(&mut execute).0, [number as f64]);
        execute.deliver("go", number, answer);
        ended.extend(step(&mut execute).1);
    }
    assert_eq!(ended, [Ending::COMPLETED, Ending::COMPLETED, Ending::COMPLETED, Ending::FAILED]);
}

#[test]
fn codes_of_deliveries_are_read_as_they_were_written() {
    let all =
        [Delivery::Waiting, Delivery::Done, Delivery::Lost, Delivery::Refused(0), Delivery::Refused(65_535)];
    assert_eq!(all.map(|delivery| Delivery::from_code(delivery.code())), all);
}
