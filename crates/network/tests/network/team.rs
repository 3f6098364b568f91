//! Facts of a team.

use std::net::UdpSocket;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

use slate_blackboard::interface::Value;
use slate_network::{NetworkSettings, router_access_control, team_key, team_token_key};
use zenoh::Wait;

use crate::network::agent::{Running, ask, eventually, ports, session, session_with};
use crate::network::cable::Cable;
use crate::network::certificates::Authority;
use crate::network::quic::{program, table, tls, udp_port};

/// A folder for the sockets of a test's robots, which have no peers.
struct Camp(PathBuf);

impl Camp {
    fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("slate-team-{}-{number}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    /// A robot that is not connected yet.
    fn load(&self, name: &str, network: &str) -> Running {
        let robot = format!(
            "[modules.scout]\n[share]\nlisten = \"local:{}\"\n\
             [share.knowledge]\nperiod = \"50ms\"\nfacts.speeds = \"scout/found\"",
            self.0.join(name).display()
        );
        Running::load_with(name, &robot, network)
    }

    fn robot(&self, name: &str, network: &str) -> Running {
        let mut robot = self.load(name, network);
        robot.connect().unwrap();
        robot
    }
}

impl Drop for Camp {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Lets a robot see something, which it states; it takes back what is negative.
fn see(robot: &Running, number: f64) {
    let seen = Value::Table(vec![("value".into(), Value::Float(number))]);
    robot.surface.board().write("scout/seen", &seen, 0).unwrap();
    let fact = format!("{} {}", robot.surface.board().agent(), number.abs());
    eventually("its own facts", || facts(robot).contains(&fact) == (number > 0.0));
}

/// A fact: its origin and its key.
fn facts(robot: &Running) -> Vec<String> {
    let Ok(Some((Value::List(facts), _))) = robot.surface.board().read("team/speeds/facts") else {
        return Vec::new();
    };
    let text = |fact: &Value, name: &str| {
        let Value::Table(fields) = fact else { panic!("{fact}") };
        let (_, value) = fields.iter().find(|(own, _)| own == name).unwrap();
        value.to_string().trim_matches('"').to_owned()
    };
    let mut facts: Vec<_> =
        facts.iter().map(|fact| format!("{} {}", text(fact, "robot"), text(fact, "key"))).collect();
    facts.sort();
    facts
}

/// Waits until all robots know these facts and no others.
fn all_know(robots: &[&Running], wanted: &[&str]) {
    for robot in robots {
        let name = robot.surface.board().agent();
        eventually(&format!("{wanted:?} at {name}, which knows {:?}", facts(robot)), || {
            facts(robot) == wanted
        });
    }
}

#[test]
fn facts_reach_a_robot_that_comes_late_or_back() {
    let (camp, [port]) = (Camp::new(), ports());
    let connect = format!("connect = [\"tcp/127.0.0.1:{port}\"]\nteam = true");
    // In any order: the one that the others connect to comes second, and they have no link to each other.
    let two = camp.robot("r2", &connect);
    see(&two, 2.0);
    let one = camp.robot("r1", &format!("listen = [\"tcp/127.0.0.1:{port}\"]\nteam = true"));
    see(&one, 1.0);
    all_know(&[&one, &two], &["r1 1", "r2 2"]);
    let three = camp.robot("r3", &connect);
    see(&three, 3.0);
    all_know(&[&one, &two, &three], &["r1 1", "r2 2", "r3 3"]);
    drop(two);
    see(&three, 4.0);
    see(&one, -1.0);
    all_know(&[&one, &three], &["r2 2", "r3 3", "r3 4"]);
    // It has lost its memory, and takes back what it said before.
    let two = camp.robot("r2", &connect);
    all_know(&[&two], &["r2 2", "r3 3", "r3 4"]);
    see(&two, -2.0);
    all_know(&[&one, &two, &three], &["r3 3", "r3 4"]);
    // Any program reads them as a property.
    let other = session("peer", &[], &[port]);
    eventually("an answer", || ask(&other, "slate/r1/team/speeds", None).iter().any(Result::is_ok));
}

#[test]
fn a_team_that_was_cut_agrees_again() {
    let (camp, [port]) = (Camp::new(), ports());
    let one = camp.robot("r1", &format!("listen = [\"tcp/127.0.0.1:{port}\"]\nteam = true"));
    let cable = Cable::to(port);
    let two = camp.robot("r2", &format!("connect = [\"tcp/127.0.0.1:{}\"]\nteam = true", cable.port));
    see(&one, 1.0);
    see(&two, 2.0);
    all_know(&[&one, &two], &["r1 1", "r2 2"]);
    for is_told in [true, false] {
        match is_told {
            true => cable.cut(),
            false => cable.swallow(),
        }
        eventually("the absence", || one.network().agents() == ["r1"] && two.network().agents() == ["r2"]);
        let number = if is_told { 3.0 } else { 5.0 };
        see(&one, number);
        see(&two, number + 1.0);
        // Both restate what they have stated already, and one takes something back.
        see(&two, 2.0);
        assert!(!facts(&one).contains(&format!("r2 {}", number + 1.0)));
        cable.mend();
        eventually("the facts of both", || {
            facts(&one) == facts(&two) && facts(&one).len() == number as usize + 1
        });
    }
    assert_eq!(facts(&one), ["r1 1", "r1 3", "r1 5", "r2 2", "r2 4", "r2 6"]);
}

#[test]
fn only_agents_of_the_team_read_and_state_facts() {
    let (camp, port, authority) = (Camp::new(), udp_port(), Authority::new());
    let rights =
        "[network.security.allow.r2]\nteam = true\n[network.security.allow.r3]\nread = [\"sensor/**\"]";
    let listen = format!("listen = [\"quic/127.0.0.1:{port}\"]\nteam = true");
    let one = camp.robot("r1", &table(&listen, &authority.sign("r1"), rights));
    let connect = format!("connect = [\"quic/127.0.0.1:{port}\"]\nteam = true");
    let robot = |name: &str| {
        let rights = "[network.security.allow.r1]\nteam = true";
        camp.robot(name, &table(&connect, &authority.sign(name), rights))
    };
    // It would take part itself.
    let three = robot("r3");
    let two = robot("r2");
    see(&one, 1.0);
    see(&two, 2.0);
    see(&three, 3.0);
    all_know(&[&one, &two], &["r1 1", "r2 2"]);
    eventually("the other agent", || three.network().agents() == ["r1", "r3"]);
    assert_eq!(facts(&three), ["r3 3"]);
    // Nor does it in another way: it listens to all, and speaks in the names of both.
    let [lab, watcher] = [(); 2].map(|()| {
        let session = program(port, &authority.sign("r3"));
        eventually("the agent", || ask(&session, "slate/r1/@tree/r3", None).iter().any(Result::is_ok));
        session
    });
    let messages = watcher.declare_subscriber("slate/*/@team/*").wait().unwrap();
    let tokens = watcher.liveliness().declare_subscriber(team_token_key("*")).history(true).wait().unwrap();
    let received = one.number("share/knowledge/received");
    for (number, name) in [(4.0, "r2"), (5.0, "r3"), (6.0, "r4")] {
        lab.put(team_key(name, "r1"), "nonsense").wait().unwrap();
        see(&one, number);
    }
    all_know(&[&one, &two], &["r1 1", "r1 4", "r1 5", "r1 6", "r2 2"]);
    eventually("more messages", || one.number("share/knowledge/received") > received);
    assert_eq!(one.number("share/knowledge/refused"), 0.0);
    assert!(messages.try_recv().unwrap().is_none() && tokens.try_recv().unwrap().is_none());
    assert_eq!((facts(&three), three.number("share/knowledge/received")), (vec!["r3 3".to_owned()], 0.0));
}

#[test]
fn facts_pass_a_router_that_checks_rights_and_comes_back() {
    let (camp, port, authority) = (Camp::new(), udp_port(), Authority::new());
    let endpoint = [format!("quic/127.0.0.1:{port}")];
    let connect = format!("mode = \"client\"\nconnect = [\"{}\"]\nteam = true", endpoint[0]);
    let names = ["r1", "r2", "r3"];
    let hub = "[network.security.allow.hub]\nrouter = true\nteam = true\n";
    let robots = names.map(|name| {
        // The third one matches neither, and could match both.
        let mates = names.iter().filter(|other| **other != name && (name == "r3" || **other != "r3"));
        let rights: String =
            mates.map(|other| format!("[network.security.allow.{other}]\nteam = true\n")).collect();
        camp.load(name, &table(&connect, &authority.sign(name), &(hub.to_owned() + &rights)))
    });
    let settings = robots.each_ref().map(|robot| NetworkSettings::of(&robot.configuration).unwrap().unwrap());
    let named: Vec<_> = names.into_iter().zip(&settings).collect();
    let mut router = tls(&authority.sign("hub"), true);
    router.push(("access_control", router_access_control(&named)));
    let hub = session_with("router", &endpoint, &[], &router);
    let [one, two, three] = robots.map(|mut robot| {
        robot.connect().unwrap();
        robot
    });
    see(&one, 1.0);
    see(&two, 2.0);
    see(&three, 3.0);
    all_know(&[&one, &two], &["r1 1", "r2 2"]);
    hub.close().wait().unwrap();
    eventually("the absence", || one.network().agents() == ["r1"]);
    see(&one, 4.0);
    eventually("its port", || UdpSocket::bind(("127.0.0.1", port)).is_ok());
    let _hub = session_with("router", &endpoint, &[], &router);
    all_know(&[&one, &two], &["r1 1", "r1 4", "r2 2"]);
    assert_eq!(facts(&three), ["r3 3"]);
}
