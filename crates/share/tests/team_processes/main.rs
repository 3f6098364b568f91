//! A team of eight robots, each a process of its own that knows the one before it. They state facts while one is killed and
//! comes again without its disk, and while one in the middle is stopped, so that the team is two.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]
#![allow(clippy::disallowed_methods, reason = "what real processes do takes real time")]

#[path = "../agents/mod.rs"]
mod agents;

use std::io::{BufRead, BufReader, Write};
use std::process::{ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use agents::process::Process;
use agents::scout::{Scout, say};
use agents::{Folder, wait_for};
use rustix::process::Signal;
use slate_blackboard::Board;
use slate_blackboard::interface::Value;
use slate_module::Plugin;
use slate_runtime::configuration::{Configuration, Options as Reading};
use slate_runtime::{Agent, Control, Options, Rate};
use slate_share::agent::AgentSharing;
use slate_share::session::Limits;
use slate_sorted::SortedSet;

/// How many robots there are.
const TEAM: usize = 8;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    if let [_, robot, text] = &arguments[..]
        && robot == "robot"
    {
        return robot_main(text);
    }
    let ways = if cfg!(feature = "tls") { &["local", "tls"][..] } else { &["local"] };
    let filter = arguments.get(1).filter(|argument| !argument.starts_with('-'));
    for way in ways {
        let name = format!("{way}::eight_robots");
        if filter.is_none_or(|filter| name.contains(filter.as_str())) {
            eight_robots(way);
            println!("test {name} ... ok");
        }
    }
}

/// The configuration of a robot, which knows the one before it.
fn text(folder: &Folder, robot: usize) -> String {
    let endpoint = |robot: usize| folder.endpoint(&format!("r{robot}"));
    let before =
        robot.checked_sub(1).map(|before| format!("agents.r{before}.at = \"{}\"\n", endpoint(before)));
    let text = format!(
        "[agent]\nname = \"r{robot}\"\n[loop]\nperiod = \"10ms\"\n[modules.scout]\n\
         [share]\nlisten = \"{}\"\n{}[share.knowledge]\nperiod = \"50ms\"\nsave = \"{}\"\n\
         facts.victims = \"scout/found\"\n",
        endpoint(robot),
        before.unwrap_or_default(),
        folder.path("saved").display(),
    );
    text + &security(folder, robot)
}

/// Where robots have certificates, each admits its neighbors only.
fn security(folder: &Folder, robot: usize) -> String {
    let files = folder.files(&format!("r{robot}"));
    let [certificate, key, authority] = &files[..] else { return String::new() };
    let neighbors = [robot.checked_sub(1), Some(robot + 1).filter(|next| *next < TEAM)];
    let allow = neighbors.into_iter().flatten().map(|other| format!("allow.r{other}.team = true\n"));
    format!(
        "[share.security]\ncertificate = \"{}\"\nkey = \"{}\"\nauthority = \"{}\"\n{}",
        certificate.display(),
        key.display(),
        authority.display(),
        allow.collect::<String>(),
    )
}

/// A robot: states facts from its standard input, and prints its knowledge.
fn robot_main(text: &str) {
    let configuration = Configuration::from_text("robot.toml", text, &Reading::default()).unwrap();
    let mut sharing = AgentSharing::default();
    // Processes that share two processors may be silent for a while.
    sharing.limits = Limits { silence: 1_000_000_000, ..Limits::default() };
    let options = Options { rate: Rate::REALTIME, sharing: Some(Box::new(sharing)), ..Options::default() };
    let mut agent = Agent::load(&configuration, &[Plugin::linked::<Scout>()], options).unwrap();
    let (board, stopper) = (std::sync::Arc::clone(agent.board()), agent.stopper());
    let run = std::thread::spawn(move || {
        agent.run(Box::new(|_| Control::Continue)).unwrap();
    });
    for line in std::io::stdin().lines() {
        let line = line.unwrap();
        match line.split(' ').collect::<Vec<_>>()[..] {
            ["say", victim, x] => say(&board, victim.parse().unwrap(), x.parse().unwrap(), 1.0, false),
            ["retract", victim] => say(&board, victim.parse().unwrap(), 0.0, 0.0, true),
            ["known"] => println!("{}", known(&board)),
            ["read", field] => {
                println!("{}", board.read(&format!("share/knowledge/{field}")).unwrap().unwrap().0);
            }
            _ => unreachable!("{line}"),
        }
    }
    // The parent process has ended, or requests the end.
    stopper.stop();
    run.join().unwrap();
}

/// The facts as this robot's board shows them: key, robot, value and version.
fn known(board: &Board) -> String {
    let Ok(Some((table, _))) = board.read("team/victims/facts") else { return String::new() };
    let Value::List(facts) = table else { return String::new() };
    let fact = |fact: &Value| {
        let Value::Table(fields) = fact else { return String::new() };
        let field = |name: &str| {
            fields.iter().find(|(own, _)| own == name).map(|(_, value)| value.to_string()).unwrap_or_default()
        };
        let names = ["key", "robot", "value", "epoch", "sequence", "time", "order"];
        names.map(field).join(" ")
    };
    facts.iter().map(fact).collect::<Vec<_>>().join("; ")
}

struct Robot {
    process: Process,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Robot {
    fn start(text: &str) -> Self {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["robot", text]).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let (orders, answers) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        Self { process: Process(child), orders, answers: BufReader::new(answers) }
    }

    fn order(&mut self, order: &str) {
        writeln!(self.orders, "{order}").unwrap();
    }

    fn ask(&mut self, question: &str) -> String {
        self.order(question);
        let mut line = String::new();
        self.answers.read_line(&mut line).unwrap();
        line.trim_end().to_owned()
    }

    /// The facts that it knows: key and robot.
    fn facts(&mut self) -> SortedSet<(String, String)> {
        let known = self.ask("known");
        let facts = known.split("; ").filter(|fact| !fact.is_empty());
        let names = |fact: &str| {
            let mut words = fact.split(' ').map(|word| word.trim_matches('"').to_owned());
            (words.next().unwrap(), words.next().unwrap())
        };
        facts.map(names).collect()
    }
}

fn facts(all: &[(u32, usize)]) -> SortedSet<(String, String)> {
    all.iter().map(|(key, robot)| (key.to_string(), format!("r{robot}"))).collect()
}

/// Waits until these robots show exactly these facts, to the byte the same.
fn wait_for_facts(what: &str, team: &mut [Robot], wanted: &[(u32, usize)]) {
    let (wanted, start) = (facts(wanted), Instant::now());
    wait_for(what, || {
        let found: Vec<_> = team.iter_mut().map(Robot::facts).collect();
        let agree = found.iter().all(|found| *found == wanted);
        if !agree && start.elapsed() > Duration::from_secs(18) {
            println!("{what}: wanted {wanted:?}, found {found:#?}");
        }
        agree && {
            let known: SortedSet<String> = team.iter_mut().map(|robot| robot.ask("known")).collect();
            known.len() == 1
        }
    });
    println!("{what}: after {:.1?}", start.elapsed());
}

fn eight_robots(way: &'static str) {
    let folder = match way {
        #[cfg(feature = "tls")]
        "tls" => Folder::over_tls(),
        _ => Folder::new(),
    };
    let texts: Vec<String> = (0..TEAM).map(|robot| text(&folder, robot)).collect();
    let mut team: Vec<Robot> = texts.iter().map(|text| Robot::start(text)).collect();
    let again = |team: &mut Vec<Robot>, robot: usize| {
        team[robot].process.signal(Signal::KILL);
        team[robot].process.0.wait().unwrap();
        // Its disk is lost.
        let _ = std::fs::remove_file(folder.path(&format!("saved/r{robot}.knowledge")));
        team[robot] = Robot::start(&texts[robot]);
    };

    // Each finds a victim of its own, and all find victim 100.
    let mut wanted: Vec<(u32, usize)> = Vec::new();
    for (i, robot) in team.iter_mut().enumerate() {
        robot.order(&format!("say 1{i} {i}.5"));
        wanted.push((10 + i as u32, i));
    }
    wait_for_facts("all know all", &mut team, &wanted);
    for (i, robot) in team.iter_mut().enumerate() {
        robot.order(&format!("say 100 {i}.25"));
        wanted.push((100, i));
    }
    wait_for_facts("all differ about one", &mut team, &wanted);

    // One is killed and comes without its disk: what it said stands, and what it takes back is gone, although it does not
    // know that it ever said so when it starts.
    again(&mut team, 3);
    wait_for_facts("one has lost its disk", &mut team, &wanted);
    team[3].order("retract 13");
    wanted.retain(|fact| *fact != (13, 3));
    wait_for_facts("it takes back a former word", &mut team, &wanted);
    team[3].order("say 103 1");
    wanted.push((103, 3));
    wait_for_facts("it says something new", &mut team, &wanted);

    // The chain is cut in the middle: both sides continue.
    team[4].process.signal(Signal::STOP);
    team[0].order("retract 10");
    team[7].order("say 107 7");
    let mut left = wanted.clone();
    left.retain(|fact| *fact != (10, 0));
    let mut right = wanted.clone();
    right.push((107, 7));
    wait_for_facts("the left side goes on", &mut team[..4], &left);
    wait_for_facts("the right side continues", &mut team[5..], &right);
    // One of the right side, which has not heard of the retraction, begins anew meanwhile.
    again(&mut team, 6);
    wait_for_facts("the right side tells the new one", &mut team[5..], &right);
    // Long enough that its neighbors hold it to be gone.
    wait_for("its absence", || {
        team[3].ask("read neighbours") == "1" && team[5].ask("read neighbours") == "1"
    });
    team[4].process.signal(Signal::CONT);
    wanted = left;
    wanted.push((107, 7));
    wait_for_facts("the chain is mended", &mut team, &wanted);

    // Nothing comes back later.
    again(&mut team, 0);
    team[0].order("say 200 1");
    wanted.push((200, 0));
    wait_for_facts("nothing is lost and nothing is resurrected", &mut team, &wanted);
    for robot in &mut team {
        assert_eq!(robot.ask("read contested"), "false");
        assert_eq!(robot.ask("read refused"), "0");
    }
}
