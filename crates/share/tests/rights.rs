//! Rights of agents, where they are configured.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use crate::agents;

use std::sync::{Arc, Mutex};
use std::time::Duration;

use agents::{Agent, Blob, Folder, Number, add, clock, limits, output, setup, wait_for, write};
use slate_blackboard::Pattern;
use slate_blackboard::interface::{Interface, Value, View};
use slate_blackboard::message::Mailbox;
use slate_runtime::sharing::Unread;
use slate_share::carrier::Carrier;
use slate_share::carrier::local::Local;
use slate_share::peers::{Allowance, Notice, PeerEvent, Rights, Setup, Status, WantedProperty};
use slate_share::session::{Application, DeliveryStatus, Event, Identity, Limits, Options, Session};
use slate_sorted::SortedMap;

fn rights(agents: &[(&str, &[&str], &[&str])]) -> Rights {
    let patterns = |texts: &[&str]| texts.iter().map(|text| Pattern::parse(text).unwrap()).collect();
    let each = agents.iter().map(|(agent, read, send)| {
        ((*agent).to_owned(), Allowance { read: patterns(read), send: patterns(send), team: false })
    });
    Rights::restricted(each.collect::<SortedMap<_, _>>())
}

#[test]
fn agent_has_exactly_its_listed_rights() {
    let folder = Folder::new();
    let rights = rights(&[("arm", &["drive/*"], &["drive/commands"])]);
    let base = Agent::start(Setup { rights, ..setup("base") }.listen(&folder.endpoint("base")));
    let mut speed = output(&base.board, "drive/speed", 1);
    let mut secret = output(&base.board, "vault/secret", 1);
    for path in ["drive/commands", "vault/commands"] {
        let mailbox = Mailbox::new(Number::DESCRIPTOR.shape(0), 4, 2);
        base.board.add_mailbox(path, "Commands.", Number::DESCRIPTOR, mailbox).unwrap();
    }
    write(&mut speed, 3);
    write(&mut secret, 4);
    let arm = Agent::start(setup("arm"));
    arm.peers.connect("base", &folder.endpoint("base")).unwrap();
    let want = |path| WantedProperty::new(path, Options::default());
    arm.peers.subscribe("base", want("drive/speed")).unwrap();
    let refused = arm.peers.subscribe("base", want("vault/secret")).unwrap();
    let missing = arm.peers.subscribe("base", want("drive/sped")).unwrap();
    wait_for("what it may read", || arm.number("agents/base/drive/speed") == Some(3));
    let reason = "agent `base` does not allow agent `arm` to read /vault/secret";
    wait_for("the refusal", || arm.peers.status("base", refused) == Some(Status::Refused(reason.into())));
    wait_for("the nearest of what it may read, and of nothing else", || {
        matches!(arm.peers.status("base", missing), Some(Status::Waiting(reason))
            if reason.starts_with("no property at /drive/sped; nearest: drive/speed") && !reason.contains("vault"))
    });
    assert_eq!(arm.number("agents/base/vault/secret"), None);

    let limit = Duration::from_secs(20);
    let send = |path: &str| {
        let mut message = Number { value: 1 };
        let hash = Number::DESCRIPTOR.hash;
        arm.peers.send("base", path, hash, 0, View::of(&mut message).bytes()).unwrap().recv_timeout(limit)
    };
    assert_eq!(send("drive/commands"), Ok(DeliveryStatus::Accepted));
    assert_eq!(send("vault/commands"), Ok(DeliveryStatus::Denied));
    // It is not said that it is of the team.
    assert!(!base.peers.send_knowledge("arm", b"something"));
    let listed = arm.peers.list("base", "**", true, limit).unwrap();
    let paths: Vec<_> = listed.iter().map(|property| property.path.as_str()).collect();
    assert_eq!(paths, ["drive/commands", "drive/speed"]);
}

#[test]
fn an_execute_with_a_plan_takes_none_of_another_agent() {
    let folder = Folder::new();
    let base = Agent::start(setup("base").listen(&folder.endpoint("base")));
    let inbox = |path: &str, part: &str| {
        let mailbox = Mailbox::new(Number::DESCRIPTOR.shape(0), 4, 2);
        let property = base.board.add_mailbox(path, "Actions.", Number::DESCRIPTOR, mailbox.clone()).unwrap();
        property.set_part(part);
        mailbox
    };
    let (plan, reflexes) = (inbox("r2/execute/plan", "plan"), inbox("r2/execute/reflexes", "reactive"));
    let [arm, leg] = ["arm", "leg"].map(|name| {
        let agent = Agent::start(setup(name));
        agent.peers.connect("base", &folder.endpoint("base")).unwrap();
        let listed = || agent.peers.list("base", "**", false, Duration::from_secs(20)).unwrap_or_default();
        wait_for("the agent", || !listed().is_empty());
        agent
    });
    let send = |from: &Agent, path: &str| {
        let mut message = Number { value: 1 };
        let bytes = View::of(&mut message).bytes().to_vec();
        let answers = from.peers.send("base", path, Number::DESCRIPTOR.hash, 0, &bytes).unwrap();
        answers.recv_timeout(Duration::from_secs(20)).unwrap()
    };
    // A robot whose Plan and reflexes are elsewhere: one Plan, several reflexes.
    assert_eq!(send(&arm, "r2/execute/plan"), DeliveryStatus::Accepted);
    assert_eq!(send(&leg, "r2/execute/plan"), DeliveryStatus::Denied);
    assert_eq!(send(&arm, "r2/execute/reflexes"), DeliveryStatus::Accepted);
    assert_eq!(send(&leg, "r2/execute/reflexes"), DeliveryStatus::Accepted);
    // Its own blocks come.
    let _own = [plan.sender_of("r2/planner/plan"), reflexes.sender_of("r2/avoid/reflex")].map(Result::unwrap);
    assert_eq!(send(&arm, "r2/execute/plan"), DeliveryStatus::Denied);
    assert_eq!(send(&arm, "r2/execute/reflexes"), DeliveryStatus::Denied);
}

#[test]
fn unreadable_value_has_a_reason() {
    let folder = Folder::new();
    let rights = rights(&[("arm", &["camera/*"], &["drive/*"])]);
    let base = Agent::start(Setup { rights, ..setup("base") }.listen(&folder.endpoint("base")));
    write(&mut output(&base.board, "drive/speed", 1), 3);
    write(&mut output(&base.board, "camera/gain", 1), 7);
    let _ = output(&base.board, "camera/focus", 1);
    let mailbox = Mailbox::new(Number::DESCRIPTOR.shape(0), 4, 2);
    base.board.add_mailbox("drive/commands", "Commands.", Number::DESCRIPTOR, mailbox).unwrap();
    let large = limits().value / 2;
    let image = add(&base.board, "camera/image", Blob::DESCRIPTOR, large, 1);
    let mut image = image.channel().unwrap().writer().unwrap();
    image.write(&1_u64.to_ne_bytes(), large, clock()()).unwrap();

    let arm = Agent::start(setup("arm"));
    arm.peers.connect("base", &folder.endpoint("base")).unwrap();
    let listed = || arm.peers.list("base", "**", true, Duration::from_secs(20)).unwrap_or_default();
    wait_for("the agent", || !listed().is_empty());
    let listed = listed();
    let told = |path: &str| {
        let property = listed.iter().find(|property| property.path == path).unwrap();
        property.value("").map(|value| value.is_some())
    };
    assert_eq!(told("camera/gain"), Ok(true));
    assert_eq!(told("camera/focus"), Ok(false), "it was never written");
    assert_eq!(told("camera/image"), Err(Unread::TooLarge(large as u64 + 8)));
    assert_eq!(told("drive/speed"), Err(Unread::NotAllowed));
    assert_eq!(told("drive/commands"), Err(Unread::Messages));
}

#[test]
fn unnamed_agent_may_not_connect() {
    let folder = Folder::new();
    let setup_base = Setup { rights: rights(&[("arm", &[], &[])]), ..setup("base") };
    let base = Agent::start(setup_base.listen(&folder.endpoint("base")));
    let leg = Agent::listening("leg", &folder);
    leg.peers.connect("base", &folder.endpoint("base")).unwrap();
    let reason = "agent `leg` is not in [share.security.allow] of agent `base`, so they may not connect";
    wait_for("the refusal", || {
        let shown = leg.board.read("peers/base/link/reason").ok().flatten();
        shown.is_some_and(|(value, _)| value == Value::Text(reason.into()))
    });
    let error = base.peers.connect("leg", &folder.endpoint("leg")).unwrap_err();
    assert_eq!(error.to_string(), format!("endpoint `{}`: {reason}", folder.endpoint("leg")));
    assert!(base.peers.agents().is_empty());
}

/// Serves nothing and takes nothing.
struct Nothing;

impl Application for Nothing {
    fn event(&mut self, _: Event) {}
}

#[test]
fn rejected_attempts_fill_neither_log_nor_blackboard() {
    let folder = Folder::new();
    let told: Arc<Mutex<Vec<String>>> = Arc::default();
    let notice: Notice = {
        let told = Arc::clone(&told);
        Arc::new(move |_, happening| {
            if let PeerEvent::Rejected { reason } = happening {
                told.lock().unwrap().push(reason.clone());
            }
        })
    };
    let base = Setup { rights: rights(&[("arm", &[], &[])]), notice: Some(notice), ..setup("base") };
    let base = Agent::start(base.listen(&folder.endpoint("base")));
    let (mut greeting, mut answer) = (Vec::new(), vec![0; 1 << 16]);
    for number in 0..20 {
        let link = Local.dial(&folder.endpoint("base")).unwrap();
        let identity = Identity { agent: format!("stranger-{number}"), instance: number + 1 };
        let mut session = Session::new(identity, None, Limits::default());
        assert!(session.outgoing(1, link.largest(), &mut greeting, &mut Nothing));
        assert!(link.send(&greeting).unwrap());
        let length = link.receive(&mut answer, Duration::from_secs(20)).unwrap().unwrap();
        session.receive(2, &answer[..length], &mut Nothing);
        assert!(session.refused().unwrap().contains(&format!("agent `stranger-{number}` is not in")));
    }
    let told = told.lock().unwrap();
    assert_eq!(told.len(), 16, "{told:?}");
    assert!(told.iter().enumerate().all(|(at, line)| line.contains(&format!("`stranger-{at}`"))), "{told:?}");
    assert!(base.board.get("share/rejected/8").is_some() && base.board.get("share/rejected/9").is_none());
}
