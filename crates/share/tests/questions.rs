//! Questions and messages whose answers come late, never, or too often.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use crate::agents;

use std::sync::Arc;
use std::time::Duration;

use agents::{Agent, Folder, Number, limits, wait_for};
use slate_blackboard::Board;
use slate_blackboard::interface::Interface;
use slate_blackboard::wake::Wake;
use slate_module::encode_interface;
use slate_share::peers::{Peer, PeerEvent, WantedProperty};
use slate_share::session::{Application, DeliveryStatus, Event, Identity, Options, SendError, Session};

/// Another agent that answers as it likes.
#[derive(Default)]
struct Other {
    asked: Vec<u32>,
    messages: Vec<u64>,
}

impl Application for Other {
    fn event(&mut self, event: Event) {
        match event {
            Event::Asked { request, .. } => self.asked.push(request),
            Event::Message { ticket, .. } => self.messages.push(ticket),
            _ => {}
        }
    }
}

struct Pair {
    peer: Peer,
    session: Session,
    other: Other,
    now: u64,
}

impl Pair {
    fn new() -> Self {
        let [own, other] =
            ["base", "arm"].map(|agent| Identity { agent: agent.into(), instance: agent.len() as u64 });
        let peer = Peer::new(&Arc::new(Board::new("base")), own, "arm", limits(), &Arc::new(Wake::new()));
        let session = Session::new(other, Some("base"), limits());
        let mut pair = Self { peer, session, other: Other::default(), now: 0 };
        pair.steps(200);
        assert!(pair.peer.session().other().is_some());
        pair
    }

    fn steps(&mut self, count: usize) {
        for _ in 0..count {
            self.now += 1_000_000;
            self.peer.tick(self.now);
            self.session.tick(self.now, &mut self.other);
            let mut packet = Vec::new();
            for _ in 0..64 {
                let sent = self.peer.outgoing(self.now, 60_000, &mut packet, None);
                if sent {
                    self.session.receive(self.now, &packet, &mut self.other);
                }
                let came = self.session.outgoing(self.now, 60_000, &mut packet, &mut self.other);
                if came {
                    self.peer.receive(self.now, &packet, None);
                }
                if !sent && !came {
                    break;
                }
            }
        }
    }

    fn listed(&mut self) -> Vec<(u32, bool)> {
        let listed = self.peer.unread_events().filter_map(|happening| match happening {
            PeerEvent::Listed { request, answer } => Some((request, answer.is_ok())),
            _ => None,
        });
        listed.collect()
    }
}

#[test]
fn an_abandoned_query_keeps_its_place_until_it_is_answered() {
    let mut pair = Pair::new();
    let open: Vec<u32> = (0..16).map(|_| pair.peer.query("**", true).unwrap()).collect();
    assert_eq!(pair.peer.query("**", true), Err(SendError::Unanswered));
    pair.peer.cancel_query(open[3]);
    // The other agent still has it, and no place for another one.
    assert_eq!(pair.peer.query("**", true), Err(SendError::Unanswered));
    pair.steps(5);
    // The answer has no receiver, and frees its entry.
    pair.session.send_part(open[3], &[], true);
    pair.session.send_part(open[4], &[], true);
    pair.steps(5);
    assert_eq!(pair.listed(), [(open[4], true)]);
    let last = pair.peer.query("**", true).unwrap();
    pair.steps(5);
    pair.session.send_part(last, &[], true);
    pair.steps(5);
    assert_eq!(pair.listed(), [(last, true)]);
}

#[test]
fn a_query_that_is_not_taken_has_no_answer() {
    let mut pair = Pair::new();
    let request = pair.peer.query("**", true).unwrap();
    pair.steps(5);
    pair.session.decline_query(request, "it is busy");
    pair.steps(5);
    let last = pair.peer.unread_events().last();
    assert!(
        matches!(&last, Some(PeerEvent::Listed { answer: Err(reason), .. }) if reason == "it is busy"),
        "{last:?}"
    );
}

#[test]
fn incomplete_answers_are_bounded_in_total() {
    let mut pair = Pair::new();
    let open: Vec<u32> = (0..16).map(|_| pair.peer.query("**", true).unwrap()).collect();
    pair.steps(5);
    assert_eq!(pair.other.asked, open);
    let interface = encode_interface(Number::DESCRIPTOR).unwrap();
    let mebibytes = 6;
    let entry = |doc: &str| {
        let entry = ("a/b", doc, 0_u8, interface.as_slice(), 0_u64, 1_u32, false, None::<u8>);
        postcard::to_allocvec(&entry).unwrap()
    };
    let part = entry(&"x".repeat(1 << 20));
    for request in &open {
        for _ in 0..mebibytes {
            pair.session.send_part(*request, &part, false);
            pair.steps(4);
        }
    }
    pair.steps(50);
    // Ten have room beside each other; what comes for the rest is dropped, and they have their answer.
    let refused = pair.listed();
    assert!(refused.iter().all(|(_, is_whole)| !is_whole), "{refused:?}");
    assert_eq!(refused.len(), 6, "{refused:?}");
    // One that is whole makes room.
    pair.session.send_part(open[0], &[], true);
    pair.steps(5);
    assert_eq!(pair.listed(), [(open[0], true)]);
}

#[test]
fn a_message_is_accepted_once() {
    let mut pair = Pair::new();
    let ticket = pair.peer.send("a/inbox", 1, 0, &[0; 8]).unwrap();
    pair.steps(5);
    assert_eq!(pair.other.messages, [ticket]);
    (0..100).for_each(|_| pair.session.answer(ticket, DeliveryStatus::Accepted));
    (0..2).for_each(|_| pair.session.answer(ticket, DeliveryStatus::Done));
    pair.steps(20);
    let answers: Vec<DeliveryStatus> = pair
        .peer
        .unread_events()
        .filter_map(|happening| match happening {
            PeerEvent::Answered { answer, .. } => Some(answer),
            _ => None,
        })
        .collect();
    assert_eq!(answers, [DeliveryStatus::Accepted, DeliveryStatus::Done]);
}

#[test]
fn query_can_be_repeated_after_timeout() {
    let folder = Folder::new();
    let base = Agent::listening("base", &folder);
    let arm = Agent::start(folder.setup("arm"));
    arm.peers.connect("base", &folder.endpoint("base")).unwrap();
    wait_for("the connection", || arm.peers.is_connected("base"));
    for _ in 0..100 {
        let answer = arm.peers.list("base", "**", false, Duration::ZERO);
        if let Err(error) = answer {
            assert!(error.to_string().contains("has not answered"), "{error}");
        }
    }
    wait_for("an answer", || match arm.peers.list("base", "**", false, Duration::from_secs(5)) {
        Ok(all) => all.iter().any(|property| property.path.starts_with("peers/arm")),
        // Some of the first are still being answered.
        Err(error) => {
            assert!(error.to_string().contains("has not answered the last 16 questions"), "{error}");
            false
        }
    });
    drop((base, arm));
}

#[test]
fn single_query_does_not_dial_forever() {
    let folder = Folder::new();
    let base = Agent::listening("base", &folder);
    let arm = Agent::start(folder.setup("arm"));
    arm.peers.dial_for_query("base", &folder.endpoint("base")).unwrap();
    wait_for("the connection", || arm.peers.is_connected("base"));
    arm.peers.list("base", "**", false, Duration::from_secs(5)).unwrap();
    wait_for("it to be gone", || arm.peers.agents().is_empty() && base.peers.agents().is_empty());
    // One that is not there is not looked for for long, either.
    arm.peers.dial_for_query("leg", &folder.endpoint("leg")).unwrap();
    assert_eq!(arm.peers.agents(), ["leg"]);
    wait_for("it to be forgotten", || arm.peers.agents().is_empty());
}

#[test]
fn a_forgotten_agent_is_dialed_no_more_and_may_come_itself() {
    let folder = Folder::new();
    let base = Agent::listening("base", &folder);
    // It is not reachable: it is removed at once, with its properties.
    base.peers.connect("arm", &folder.endpoint("arm")).unwrap();
    wait_for("what shows of it", || base.board.get("peers/arm/link").is_some());
    base.peers.forget("arm");
    assert!(base.peers.agents().is_empty() && base.board.get("peers/arm/link").is_none());
    // Again, and it comes.
    base.peers.connect("arm", &folder.endpoint("arm")).unwrap();
    let arm = Agent::listening("arm", &folder);
    wait_for("the connection", || base.peers.is_connected("arm"));
    base.peers.forget("arm");
    // A connection without a reader ends.
    let id = arm.peers.subscribe("base", WantedProperty::new("peers/arm/link", Options::default())).unwrap();
    wait_for("the link's state", || arm.board.get("agents/base/peers/arm/link").is_some());
    assert!(base.peers.is_connected("arm") && !base.peers.is_dialed("arm"));
    std::thread::sleep(Duration::from_secs(6));
    assert!(base.peers.is_connected("arm"));
    arm.peers.unsubscribe("base", id);
    wait_for("the end", || !base.peers.is_connected("arm") && base.peers.agents().is_empty());
    wait_for("what shows of it", || base.board.get("peers/arm/link").is_none());
    drop(arm);
    let arm = Agent::start(folder.setup("arm"));
    arm.peers.connect("base", &folder.endpoint("base")).unwrap();
    wait_for("the other to come", || base.peers.is_connected("arm"));
}
