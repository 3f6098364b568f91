//! Links over a network.

use std::io::Write;
use std::net::TcpStream;

use slate_blackboard::channel::{Policy, Start};
use slate_blackboard::interface::Interface;
use slate_share::peers::WantedProperty;
use slate_share::session::Options;

use crate::agents::cable::{CARRIES, CUT, Cable};
use crate::agents::{Agent, Folder, Number, output, rejected, wait_for, write};

/// Connections of one machine before their greeting.
const PENDING: usize = 8;

/// Runs the tests with that in their names.
pub fn run(filter: Option<&str>) {
    let tests: [(&str, fn()); 2] = [
        ("tls::who_knocks_again_and_again_fills_nothing_and_keeps_nobody_out", knocked),
        ("tls::a_cut_cable_costs_nothing_once_it_is_mended", cut),
    ];
    for (name, test) in tests {
        if filter.is_none_or(|filter| name.contains(filter)) {
            test();
            println!("test {name} ... ok");
        }
    }
}

fn count(folder: &str) -> usize {
    std::fs::read_dir(folder).unwrap().count()
}

/// Files and threads of this process.
fn taken() -> (usize, usize) {
    (count("/proc/self/fd"), count("/proc/self/task"))
}

fn knocked() {
    let folder = Folder::over_tls();
    let base = Agent::listening("base", &folder);
    let port: u16 = folder.endpoint("base").rsplit(':').next().unwrap().parse().unwrap();
    let connect = || TcpStream::connect(("127.0.0.1", port)).unwrap();
    let (files, threads) = taken();
    // Some say nothing and stay, and some talk nonsense and go.
    let silent: Vec<_> = (0..200).map(|_| connect()).collect();
    let others = || rejected(&base, "too many others connected before its greeting");
    let late = || rejected(&base, "no greeting within 2 s");
    wait_for("room to be made", || others() + late() >= 200 - PENDING as i128);
    wait_for("no more than those that may be about to greet", || {
        taken().0 <= files + silent.len() + PENDING && taken().1 <= threads + PENDING
    });
    // Not because their time was over.
    assert!(others() > 100, "{}", others());
    for _ in 0..500 {
        // It may have been rejected already.
        let _ = connect().write_all(b"GET / HTTP/1.1\r\n\r\n");
    }
    let arm = Agent::start(folder.setup("arm"));
    arm.peers.connect("base", &folder.endpoint("base")).unwrap();
    wait_for("the one that may", || base.peers.is_connected("arm"));
    wait_for("those that say nothing", || others() + late() >= 200);
    assert!(base.board.get("share/rejected/9").is_none());
    drop((silent, arm));
    wait_for("as many files and threads as before", || {
        let now = taken();
        now.0 <= files && now.1 <= threads
    });
}

fn cut() {
    let folder = Folder::over_tls();
    let base = Agent::listening("base", &folder);
    let cable = Cable::to(&folder.endpoint("base"));
    let arm = Agent::start(folder.setup("arm"));
    arm.peers.connect("base", cable.endpoint()).unwrap();
    let mut writer = output(&base.board, "scan/points", 8192);
    let want = WantedProperty::new("scan/points", Options::queue()).expect(Number::DESCRIPTOR, 0).depth(8192);
    arm.peers.subscribe("base", want).unwrap();
    let (mirror, _) = arm.board.find("agents/base/scan/points").unwrap();
    let mut reader = mirror.channel().unwrap().queue(Policy::Skip, Start::Oldest).unwrap();
    let (mut written, mut next) = (0, 1);
    let mut write_some = |count: u64| {
        (1..=count).for_each(|i| write(&mut writer, written + i));
        written += count;
        written
    };
    let mut read_to = |last: u64| {
        wait_for("what was written", || {
            reader.pull().unwrap();
            for loan in reader.window() {
                assert_eq!(u64::from_ne_bytes(loan.bytes()[..8].try_into().unwrap()), next);
                next += 1;
            }
            next > last
        });
    };
    read_to(write_some(100));
    let (files, threads) = taken();
    for _ in 0..8 {
        cable.set(CUT);
        wait_for("the cut", || !arm.peers.is_connected("base") && !base.peers.is_connected("arm"));
        let last = write_some(100);
        cable.set(CARRIES);
        read_to(last);
    }
    wait_for("as many files and threads as before", || {
        let now = taken();
        now.0 <= files && now.1 <= threads
    });
}
