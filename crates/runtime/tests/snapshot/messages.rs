//! Senders' knowledge of their messages after an agent continued from a snapshot.

use slate_module::prelude::*;
use slate_module::{Delivery, Plugin};
use slate_runtime::configuration::{Database, Options as Reading};
use slate_runtime::sharing::{RemoteDemand, RemotePath, Sharing, SharingError, Site};
use slate_runtime::{Agent, Options};
use slate_sorted::SortedMap;

use crate::snapshot::common::{Number, Pair, number, plugins};
use crate::snapshot::support::{options, seen, steps};

/// Ports of [`Mailer`].
#[ports]
pub struct MailerIo {
    #[window(4)]
    notes: Outbox<Number>,
    fares: Output<Pair>,
}

/// Posts a message a tick, and shows how the last three and the third one fare.
pub struct Mailer;

#[module(stage = Think)]
impl Module for Mailer {
    type Io = MailerIo;
    type Params = ();
    type State = u64;

    fn tick(last: &mut u64, io: &MailerIo, _: &(), _: &Tick) -> Outcome {
        let fares = |number: u64| f64::from(io.notes.delivery(number).code());
        let (earlier, third) = ((1..=3).map(|back| last.saturating_sub(back)), fares(3));
        let earlier = earlier.fold(0.0, |sum, number| sum * 8.0 + fares(number));
        io.fares.set(Pair { first: earlier, second: third });
        *last = io.notes.send_tracked(Number { value: *last as f64 }).unwrap_or(0);
        Outcome::Ok
    }
}

/// Sharing without peers.
struct Alone;

impl Sharing for Alone {
    fn start(&mut self, _: Site) -> Result<(), SharingError> {
        Ok(())
    }

    fn set_demands(&mut self, _: SortedMap<RemotePath, RemoteDemand>) {}
}

fn agent(rest: &str) -> Agent {
    let text = format!("agent.name = \"robot\"\ntime.source = \"mailer\"\n[modules.mailer]\n{rest}");
    let database = Database::from_text("robot.toml", &text, Reading::default()).unwrap();
    let options = Options { sharing: Some(Box::new(Alone)), ..options() };
    Agent::load_with(&database, &[plugins(), vec![Plugin::linked::<Mailer>()]].concat(), options).unwrap()
}

#[test]
fn messages_of_an_earlier_life_do_not_mix_with_the_snapshot() {
    let text = "[modules.receiver]\nevery = \"100ms\"\n[links]\n\"receiver/notes\" = \"mailer/notes\"\n";
    for moment in 0..12 {
        let mut agent = agent(text);
        steps(&mut agent, moment);
        let snapshot = agent.composer().snapshot().unwrap();
        let trace = |agent: &mut Agent| -> Vec<_> {
            let mut step = || {
                steps(agent, 1);
                seen(agent)
            };
            (0..15).map(|_| step()).collect()
        };
        let expected = trace(&mut agent);
        for wander in 0..7 {
            steps(&mut agent, wander);
            agent.restore(&snapshot).unwrap();
            assert_eq!(trace(&mut agent), expected, "of cycle {moment}, after {wander} cycles more");
        }
    }
}

#[test]
fn a_message_that_waits_for_another_agent_is_lost() {
    let mut agent = agent("[links]\n\"slate://other/inbox/notes\" = \"mailer/notes\"\n");
    steps(&mut agent, 3);
    let snapshot = agent.composer().snapshot().unwrap();
    steps(&mut agent, 1);
    let third = |agent: &Agent| number(agent, "mailer/fares/second");
    assert_eq!(third(&agent), f64::from(Delivery::Waiting.code()));
    agent.restore(&snapshot).unwrap();
    steps(&mut agent, 1);
    assert_eq!(third(&agent), f64::from(Delivery::Lost.code()));
}
