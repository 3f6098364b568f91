//! An agent that shares large values, and is killed while they are read.

use std::process::Command;
use std::time::Duration;

use rustix::process::Signal;
use slate_blackboard::channel::Latest;
use slate_blackboard::interface::Interface;
use slate_share::peers::{Setup, WantedProperty};
use slate_share::session::Options;

use crate::agents::process::Process;
use crate::agents::{Agent, Blob, Folder, add, wait_for};
use crate::start;

const PERIOD: Duration = Duration::from_millis(1);

/// Bytes of a large value.
const LARGE: usize = 1 << 20;

/// An agent that dials `hub`, and writes large values until the parent process ends.
pub fn be_an_agent(setup: Setup, endpoint: &str) {
    let agent = Agent::start(setup);
    let property = add(&agent.board, "out/blob", Blob::DESCRIPTOR, LARGE, 1);
    let mut writer = property.channel().unwrap().writer().unwrap();
    agent.peers.connect("hub", endpoint).unwrap();
    for number in 1.. {
        let mut bytes = vec![number as u8; 8 + LARGE];
        bytes[..8].copy_from_slice(&u64::to_ne_bytes(number));
        writer.write(&bytes, LARGE, 0).unwrap();
        agent.peers.notifier().notify();
        std::thread::sleep(PERIOD);
        if rustix::process::getppid().is_none_or(|parent| parent.as_raw_nonzero().get() == 1) {
            return;
        }
    }
}

fn launch(folder: &Folder) -> Process {
    let mut command = Command::new(std::env::current_exe().unwrap());
    Process::start(command.args(["blobs", "one", &folder.endpoint("hub")]).args(folder.files("one")))
}

pub fn killed(way: &'static str) {
    let (hub, _, folder) = start(way, &[]);
    let mut process = launch(&folder);
    wait_for("an agent", || hub.agent.peers.is_connected("one"));
    let want = WantedProperty::new("out/blob", Options::default()).expect(Blob::DESCRIPTOR, LARGE);
    hub.agent.peers.subscribe("one", want).unwrap();
    let (mirror, _) = hub.agent.board.find("agents/one/out/blob").unwrap();
    let channel = mirror.channel().unwrap();
    let check = |reader: &Latest| {
        let loan = reader.value().unwrap();
        let number = loan.bytes()[..8].try_into().map(u64::from_ne_bytes).unwrap();
        assert!(loan.bytes()[8..].iter().all(|byte| *byte == number as u8), "value {number} is torn");
        number
    };
    let mut readers = [(); 3].map(|()| channel.latest().unwrap());
    for round in 0..3 {
        // The first one holds a value for ever, others follow the newest.
        for _ in 0..100 {
            let newest = readers[1].cursor();
            wait_for("a value", || channel.published() > newest);
            readers[1].refresh();
            check(&readers[1]);
            if readers[0].value().is_none() {
                readers[0].refresh();
            }
        }
        process.signal(Signal::KILL);
        wait_for("its end", || !hub.agent.peers.is_connected("one") && !mirror.has_writer());
        readers[2].refresh();
        let _ = readers.each_ref().map(check);
        process = launch(&folder);
        let last = channel.published();
        wait_for("it to be back", || channel.published() > last);
        let numbers = readers.each_ref().map(check);
        assert!(numbers[0] <= numbers[2] || round > 0, "{numbers:?}");
    }
}
