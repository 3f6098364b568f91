//! Topics of other robots, without a local demand.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use crate::agents;

use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use agents::scout::Victim;
use agents::{Folder, wait_for};
use slate_blackboard::Board;
use slate_blackboard::interface::Value;
use slate_mapek::FactTable;
use slate_module::Interface;
use slate_runtime::configuration::{Configuration, Options as Reading};
use slate_runtime::{Agent, Control, Options, Rate, Stopper};
use slate_share::agent::AgentSharing;
use slate_share::knowledge::{Replica, Statement};
use slate_share::peers::{Notice, PeerEvent, Setup};
use slate_share::team::{Layout, Member, robot_number};

/// A robot without modules, which logs to a file.
struct Robot {
    board: Arc<Board>,
    log: PathBuf,
    stopper: Stopper,
    thread: JoinHandle<()>,
}

impl Robot {
    fn start(folder: &Folder) -> Self {
        let log = folder.path("one.log");
        let text = format!(
            "[agent]\nname = \"one\"\n[loop]\nperiod = \"10ms\"\n[share]\nlisten = \"{}\"\n\
             [share.knowledge]\nperiod = \"20ms\"\n[log.targets]\nfile = \"{}\"\n",
            folder.endpoint("one"),
            log.display(),
        );
        let configuration = Configuration::from_text("one.toml", &text, &Reading::default()).unwrap();
        let mut sharing = AgentSharing::default();
        sharing.limits = agents::limits();
        let options =
            Options { rate: Rate::REALTIME, sharing: Some(Box::new(sharing)), ..Options::default() };
        let mut agent = Agent::load(&configuration, &[], options).unwrap();
        let (board, stopper) = (Arc::clone(agent.board()), agent.stopper());
        let thread = std::thread::spawn(move || {
            agent.run(Box::new(|_| Control::Continue)).unwrap();
        });
        Self { board, log, stopper, thread }
    }

    fn number(&self, name: &str) -> i128 {
        match self.board.read(&format!("share/knowledge/{name}")) {
            Ok(Some((Value::Integer(number), _))) => number,
            _ => -1,
        }
    }

    /// The topics on its board.
    fn topics(&self) -> Vec<String> {
        let properties = self.board.properties();
        let topics = properties.iter().filter_map(|property| property.path().strip_prefix("team/"));
        topics.map(str::to_owned).collect()
    }

    /// Ends it, and gives what it has logged.
    fn end(self) -> String {
        self.stopper.stop();
        self.thread.join().unwrap();
        std::fs::read_to_string(self.log).unwrap()
    }
}

/// An agent that tells the robot what a robot would not.
struct Odd {
    agent: agents::Agent,
    received: Arc<Mutex<Vec<Vec<u8>>>>,
}

impl Odd {
    fn start(folder: &Folder) -> Self {
        let received = Arc::new(Mutex::new(Vec::new()));
        let notice: Notice = {
            let received = Arc::clone(&received);
            Arc::new(move |_, happening| {
                if let PeerEvent::Knowledge { bytes } = happening {
                    received.lock().unwrap().push(bytes.clone());
                }
            })
        };
        let agent = agents::Agent::start(Setup { notice: Some(notice), ..folder.setup("odd") });
        agent.peers.connect("one", &folder.endpoint("one")).unwrap();
        Self { agent, received }
    }

    fn take_received(&self) -> Vec<Vec<u8>> {
        std::mem::take(&mut *self.received.lock().unwrap())
    }

    fn send(&self, message: &[u8]) {
        self.agent.peers.send_knowledge("one", message);
    }

    fn speak(&self, member: &mut Member) {
        member.tick();
        self.take_received().iter().for_each(|bytes| member.receive("one", bytes).unwrap());
        while let Some((_, message)) = member.outgoing() {
            self.send(&message);
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn topics_of_others_are_shown_as_far_as_there_is_room() {
    let folder = Folder::new();
    let (robot, odd) = (Robot::start(&folder), Odd::start(&folder));
    let mut member = Member::new("odd", 1, None).unwrap();
    member.add_neighbor("one").unwrap();
    let layout = Layout::of(FactTable::<Victim>::DESCRIPTOR).unwrap();
    for i in 0..100 {
        // A configuration would not let it state the former.
        for topic in [format!("No topic {i}!"), format!("topic_{i:02}")] {
            member.state(1, (&topic, "here"), &layout, 1.0, &[0; 8]).unwrap();
        }
    }
    wait_for("all facts", || {
        odd.speak(&mut member);
        robot.number("facts") == 200 && robot.number("unshown") == 136
    });
    let expected: Vec<String> = (0..64).map(|i| format!("topic_{i:02}")).collect();
    assert_eq!(robot.topics(), expected);
    // One that is empty makes room.
    member.retract(2, "topic_00", "here").unwrap();
    wait_for("another one", || {
        odd.speak(&mut member);
        robot.topics() == (1..65).map(|i| format!("topic_{i:02}")).collect::<Vec<_>>()
    });
    robot.end();
}

#[test]
fn undisplayable_value_is_logged_once() {
    let folder = Folder::new();
    let (robot, odd) = (Robot::start(&folder), Odd::start(&folder));
    let one = robot_number("one");
    // It says nothing of the interface.
    let mut replica = Replica::new(robot_number("odd"), 1, Member::limits());
    replica.add_neighbor(one);
    let state = |replica: &mut Replica, topic: usize, value: u64| {
        let statement = Statement { schema: 7, certainty: 1.0, value: &value.to_le_bytes() };
        replica.state(value, format!("topic_{topic:02}:here").as_bytes(), statement).unwrap();
    };
    (0..100).for_each(|topic| state(&mut replica, topic, 0));
    for round in 1.. {
        state(&mut replica, 0, round);
        replica.tick();
        odd.take_received().iter().for_each(|bytes| replica.receive(one, bytes).unwrap());
        while let Some(message) = replica.outgoing() {
            odd.send(&message.bytes);
        }
        std::thread::sleep(Duration::from_millis(5));
        if round > 200 && robot.number("facts") == 100 {
            break;
        }
    }
    let log = robot.end();
    let lines = log.lines().filter(|line| line.contains("it is not known yet what facts about it look like"));
    assert_eq!(lines.count(), 64, "{log}");
}
