//! Fleet measurement: agents in processes of ten, through two routers.
//! Each agent has 50 properties at 1 Hz; one router is killed and starts again. Needs `ss` of iproute2. Fails when a
//! limit is exceeded.
//!
//! `cargo run --release -p slate-network --features zenoh --example fleet`
#![allow(missing_docs, reason = "the interfaces of a measurement need no documentation")]
#![allow(clippy::disallowed_methods, reason = "a measurement goes by the machine's clock")]

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::io::Read;
use std::net::TcpListener;
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use slate_control::ControlSurface;
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_network::{AgentNetwork, NetworkSettings, TABLE};
use slate_runtime::configuration::{Database, Options as Layers};
use slate_runtime::{Agent, Control, Options};
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

type Failure = Box<dyn Error + Send + Sync>;

/// Agents of a process, modules of an agent, and properties of a module.
const AGENTS: usize = 10;
const MODULES: usize = 5;
const PROPERTIES: usize = 10;

/// Processes of the small fleet and of the whole one.
const FLEETS: [usize; 2] = [2, 20];

/// Duration of the traffic measurement.
const WINDOW: Duration = Duration::from_secs(10);

/// Timeout for the start of a fleet.
const START: Duration = Duration::from_secs(120);

/// Limits: time until the state is complete again, memory and traffic.
/// Memory of a session in MB, and traffic of an agent in the whole fleet as a multiple of that in the small one.
const COMPLETE: Duration = Duration::from_secs(10);
const MEMORY: f64 = 30.0;
const GROWTH: f64 = 1.25;

/// Value of a property of the fleet.
#[interface]
pub struct Reading {
    pub value: f64,
}

#[ports]
pub struct PartIo {
    a: Output<Reading>,
    b: Output<Reading>,
    c: Output<Reading>,
    d: Output<Reading>,
    e: Output<Reading>,
    f: Output<Reading>,
    g: Output<Reading>,
    h: Output<Reading>,
    i: Output<Reading>,
    j: Output<Reading>,
}

/// Writes all its properties in each cycle.
pub struct Part;

#[module(stage = Act)]
impl Module for Part {
    type Io = PartIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &PartIo, _: &(), _: &Tick) -> Outcome {
        *state += 1.0;
        for output in [&io.a, &io.b, &io.c, &io.d, &io.e, &io.f, &io.g, &io.h, &io.i, &io.j] {
            output.set(Reading { value: *state });
        }
        Outcome::Ok
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words[..] {
        ["router", port, other] => route(port, other).map(|()| true),
        ["agents", process, port] => be_agents(process, port).map(|()| true),
        _ => measure(),
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn session(mode: &str, listen: &str, connect: &str) -> Result<Session, Failure> {
    let mut config = zenoh::Config::default();
    let endpoints = |port: &str| match port {
        "" => "[]".to_owned(),
        port => format!("[\"tcp/127.0.0.1:{port}\"]"),
    };
    for (key, value) in [
        ("mode", format!("\"{mode}\"")),
        ("listen/endpoints", endpoints(listen)),
        ("connect/endpoints", endpoints(connect)),
        ("connect/timeout_ms", "-1".into()),
        ("connect/exit_on_failure", "false".into()),
        ("scouting/multicast/enabled", "false".into()),
        ("scouting/gossip/enabled", "false".into()),
    ] {
        config.insert_json5(key, &value)?;
    }
    zenoh::open(config).wait()
}

/// Waits until the input is released.
fn wait_for_the_end() {
    let _ = std::io::stdin().read(&mut [0]);
}

fn route(port: &str, other: &str) -> Result<(), Failure> {
    let _session = session("router", port, other)?;
    wait_for_the_end();
    Ok(())
}

fn properties() -> Vec<String> {
    let outputs = ('a'..='z').take(PROPERTIES);
    let of_module = |module| outputs.clone().map(move |output| format!("part{module}/{output}"));
    (0..MODULES).flat_map(of_module).collect()
}

/// Runs the agents of a process, clients of a router.
fn be_agents(process: &str, port: &str) -> Result<(), Failure> {
    let modules: String =
        (0..MODULES).map(|module| format!("[modules.part{module}]\nkind = \"part\"\n")).collect();
    let published: Vec<_> = properties().iter().map(|path| format!("\"{path}\"")).collect();
    let mut networks = Vec::new();
    for number in 0..AGENTS {
        let text = format!(
            "agent.name = \"robot-{process}-{number}\"\nloop.period = \"1s\"\n[log.targets]\nconsole = false\n{modules}\
             [network]\nmode = \"client\"\nconnect = [\"tcp/127.0.0.1:{port}\"]\npublish = [{}]\n",
            published.join(", ")
        );
        let layers = Layers { extra_tables: vec![TABLE.into()], ..Layers::default() };
        let database = Database::from_text("fleet.toml", &text, layers)?;
        let mut agent = Agent::load_with(&database, &[Plugin::linked::<Part>()], Options::default())?;
        let surface = Arc::new(ControlSurface::new(&agent)?);
        let settings = NetworkSettings::of(&database.current())?.ok_or("no table")?;
        networks.push(AgentNetwork::start(&surface, &settings)?);
        std::thread::spawn(move || agent.run(Box::new(|_| Control::Continue)).map(drop));
    }
    wait_for_the_end();
    // All at once, as a process that ends.
    std::process::exit(0);
}

/// Observed state of the fleet.
#[derive(Default)]
struct FleetState {
    alive: BTreeSet<String>,
    /// Time of each property's last value.
    properties: BTreeMap<String, Instant>,
}

/// Processes that end with this.
#[derive(Default)]
struct Processes(Vec<Child>);

impl Processes {
    fn start(&mut self, arguments: &[&str]) -> Result<(), Failure> {
        let program = std::env::current_exe()?;
        self.0.push(Command::new(program).args(arguments).stdin(Stdio::piped()).spawn()?);
        Ok(())
    }
}

impl Drop for Processes {
    fn drop(&mut self) {
        for child in &mut self.0 {
            // One that has ended needs no signal.
            let _ = child.kill().and_then(|()| child.wait());
        }
    }
}

fn port() -> Result<String, Failure> {
    Ok(TcpListener::bind("127.0.0.1:0")?.local_addr()?.port().to_string())
}

fn measure() -> Result<bool, Failure> {
    let ports = [port()?, port()?];
    let mut routers = [Processes::default(), Processes::default()];
    routers[0].start(&["router", &ports[0], ""])?;
    routers[1].start(&["router", &ports[1], &ports[0]])?;
    std::thread::sleep(Duration::from_secs(1));
    let observer = Observer::start(&ports[1])?;
    let mut agents = Processes::default();
    let mut traffic = Vec::new();
    let mut is_good = true;
    for processes in FLEETS {
        let began = Instant::now();
        for process in agents.0.len()..processes {
            agents.start(&["agents", &process.to_string(), &ports[process % 2]])?;
        }
        let count = processes * AGENTS;
        let started = observer.complete(count, began, START)?;
        // Declarations at the start do not count as periodic traffic.
        std::thread::sleep(Duration::from_secs(5));
        let (before, busy) = (bytes(&agents)?, cpu(&routers)?);
        std::thread::sleep(WINDOW);
        let (after, busy) = (bytes(&agents)?, cpu(&routers)? - busy);
        let rate = |at: usize| (after[at] - before[at]) as f64 / WINDOW.as_secs_f64() / count as f64;
        let (memory, of_routers) = (memory([&agents])? / count as f64, memory(&routers)?);
        println!(
            "{count} agents: started in {:.1} s; an agent sends {:.0} B/s and receives {:.0} B/s; {memory:.1} MB a session",
            started.as_secs_f64(),
            rate(0),
            rate(1)
        );
        println!(
            "    both routers: {of_routers:.1} MB, {:.1} % of a core",
            100.0 * busy / WINDOW.as_secs_f64()
        );
        is_good &= memory <= MEMORY;
        traffic.push(rate(0) + rate(1));
    }
    let growth = traffic[1] / traffic[0];
    println!("traffic of an agent: {growth:.2} times that of the small fleet");
    is_good &= growth <= GROWTH;
    for router in [0, 1] {
        let count = FLEETS[1] * AGENTS;
        routers[router] = Processes::default();
        std::thread::sleep(Duration::from_secs(3));
        let other = if router == 0 { "" } else { &ports[0] };
        let began = Instant::now();
        routers[router].start(&["router", &ports[router], other])?;
        let took = observer.complete(count, began, START)?;
        println!(
            "router {} killed and started again: complete after {:.1} s",
            router + 1,
            took.as_secs_f64()
        );
        is_good &= took <= COMPLETE;
    }
    Ok(is_good)
}

/// Zenoh program that reads the whole fleet.
struct Observer {
    state: Arc<Mutex<FleetState>>,
    _session: Session,
}

impl Observer {
    fn start(port: &str) -> Result<Self, Failure> {
        let session = session("client", "", port)?;
        let state = Arc::new(Mutex::new(FleetState::default()));
        let own = Arc::clone(&state);
        let note = move |sample: zenoh::sample::Sample| {
            if let Ok(mut state) = own.lock() {
                state.properties.insert(sample.key_expr().as_str().to_owned(), Instant::now());
            }
        };
        session.declare_subscriber("slate/*/*/*").callback(note).background().wait()?;
        let own = Arc::clone(&state);
        let note = move |sample: zenoh::sample::Sample| {
            let Ok(mut state) = own.lock() else { return };
            let key = sample.key_expr().as_str().to_owned();
            match sample.kind() {
                SampleKind::Put => drop(state.alive.insert(key)),
                SampleKind::Delete => drop(state.alive.remove(&key)),
            }
        };
        let liveliness = session.liveliness();
        liveliness.declare_subscriber("slate/*/@alive").history(true).callback(note).background().wait()?;
        Ok(Self { state, _session: session })
    }

    /// Waits until all agents run and each property has a value newer than `since`.
    /// Returns the elapsed time since then.
    fn complete(&self, agents: usize, since: Instant, limit: Duration) -> Result<Duration, Failure> {
        let wanted = agents * MODULES * PROPERTIES;
        loop {
            {
                let state = self.state.lock().map_err(|error| error.to_string())?;
                let fresh = state.properties.values().filter(|time| **time > since).count();
                if state.alive.len() == agents && fresh == wanted {
                    return Ok(since.elapsed());
                }
                if since.elapsed() > limit {
                    let alive = state.alive.len();
                    return Err(format!("{alive} of {agents} agents, and {fresh} of {wanted} values").into());
                }
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

/// Bytes that processes have sent and received over TCP.
fn bytes(processes: &Processes) -> Result<[u64; 2], Failure> {
    let output = Command::new("ss").args(["-tinHpO"]).output()?;
    let text = String::from_utf8_lossy(&output.stdout);
    let pids: BTreeSet<String> = processes.0.iter().map(|child| format!("pid={},", child.id())).collect();
    let mut sums = [0, 0];
    for line in text.lines().filter(|line| pids.iter().any(|pid| line.contains(pid.as_str()))) {
        for (sum, name) in sums.iter_mut().zip(["bytes_sent:", "bytes_received:"]) {
            let word = line.split_whitespace().find_map(|word| word.strip_prefix(name));
            *sum += word.and_then(|word| word.parse::<u64>().ok()).unwrap_or(0);
        }
    }
    if sums == [0, 0] { Err("`ss` shows no connection of the agents".into()) } else { Ok(sums) }
}

/// Returns the resident memory of processes, MB.
fn memory<'p>(processes: impl IntoIterator<Item = &'p Processes>) -> Result<f64, Failure> {
    let mut sum = 0.0;
    for child in processes.into_iter().flat_map(|processes| &processes.0) {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id()))?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).ok_or("no VmRSS")?;
        sum += line.trim().trim_end_matches("kB").trim().parse::<f64>()? * 1024.0 / 1e6;
    }
    Ok(sum)
}

/// Returns the processor time of processes, s; the kernel counts it in hundredths.
fn cpu(processes: &[Processes]) -> Result<f64, Failure> {
    let mut ticks = 0;
    for child in processes.iter().flat_map(|processes| &processes.0) {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", child.id()))?;
        let (_, fields) = stat.rsplit_once(')').ok_or("no name in stat")?;
        let fields: Vec<&str> = fields.split_whitespace().collect();
        // User and system time.
        for place in [11, 12] {
            ticks += fields.get(place).ok_or("no time in stat")?.parse::<u64>()?;
        }
    }
    Ok(ticks as f64 / 100.0)
}
