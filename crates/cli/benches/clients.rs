//! Benchmark of clients that watch live values.
//! EXP3 runs as by `slate run`, without a client and with many in turn, each with the values that a page shows ten
//! times a second. Prints the share of a core that the agent spends on each client, and the client's own.
//!
//! `cargo bench -p slate-robotics-cli --bench clients [-- CLIENTS]`; 20 unless given. `SLATE=FILE` is another command that is measured.
#![allow(clippy::disallowed_methods, reason = "a bench measures real time")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a bench that can't go on ends")]

use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::{Message, client};

const PHASE: Duration = Duration::from_secs(8);
const ROUNDS: usize = 3;
/// Hz.
const RATE: u32 = 10;
/// Properties that a page shows.
const URLS: [&str; 12] = [
    "/simulator/r2/truth",
    "/simulator/r3/truth",
    "/simulator/r2/sonar",
    "/simulator/r3/sonar",
    "/r2/execute/status",
    "/r3/execute/status",
    "/r2/planner/state",
    "/r3/planner/state",
    "/r2/wheels/gate",
    "/r3/wheels/gate",
    "/loop/state",
    "/loop/histogram",
];

fn main() {
    let clients = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(20);
    let run = Run::start();
    let mut cost = [(0.0, 0.0); 2];
    let (mut values, mut own) = (0, 0.0);
    for _ in 0..ROUNDS {
        add(&mut cost[0], run.measure());
        let stop = Arc::new(AtomicBool::new(false));
        let open = (0..clients).map(|_| run.client(Arc::clone(&stop)));
        let open: Vec<_> = open.collect();
        std::thread::sleep(Duration::from_secs(1));
        let before = processor(&format!("/proc/{}/stat", std::process::id()));
        add(&mut cost[1], run.measure());
        own += processor(&format!("/proc/{}/stat", std::process::id())) - before;
        stop.store(true, Ordering::Relaxed);
        values += open.into_iter().map(|client| client.join().unwrap()).sum::<u64>();
    }
    let seconds = PHASE.as_secs_f64() * ROUNDS as f64;
    let part = |time: f64| 100.0 * time / seconds;
    let [without, with] = cost;
    println!("EXP3 at real time, {clients} clients with {} properties at {RATE} Hz each", URLS.len());
    println!("values            {:.0}/s", values as f64 / (seconds + ROUNDS as f64));
    println!(
        "agent without     {:.1} % of a core, {:.1} % of it the console's",
        part(without.0),
        part(without.1)
    );
    println!("agent with        {:.1} % of a core, {:.1} % of it the console's", part(with.0), part(with.1));
    println!("for each client   {:.2} % of a core", part(with.0 - without.0) / f64::from(clients));
    println!("and the client    {:.2} % of a core", part(own) / f64::from(clients));
}

fn add(sum: &mut (f64, f64), more: (f64, f64)) {
    sum.0 += more.0;
    sum.1 += more.1;
}

/// Seconds of processor time that a process or thread has used.
fn processor(stat: &str) -> f64 {
    let Ok(stat) = std::fs::read_to_string(stat) else { return 0.0 };
    let fields: Vec<_> = stat.rsplit_once(')').unwrap().1.split_whitespace().collect();
    let ticks: u64 = fields[11..13].iter().map(|field| field.parse::<u64>().unwrap()).sum();
    ticks as f64 / rustix::param::clock_ticks_per_second() as f64
}

struct Run {
    process: Child,
    folder: std::path::PathBuf,
    host: String,
    token: String,
}

impl Run {
    fn start() -> Self {
        let folder = std::env::temp_dir().join(format!("slate-clients-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let mut command =
            Command::new(std::env::var_os("SLATE").unwrap_or(env!("CARGO_BIN_EXE_slate").into()));
        command.args(["run", "exp3", "--headless", "--rate", "realtime", "--seed", "2"]);
        command.args(["--set", "console.port=0", "--out", "out"]);
        command.current_dir(&folder).env("XDG_RUNTIME_DIR", &folder);
        let process = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let begin = Instant::now();
        let content = loop {
            if let Some(content) = endpoint(&folder.join("slate")) {
                break content;
            }
            assert!(begin.elapsed() < Duration::from_secs(20), "the agent has no console");
            std::thread::sleep(Duration::from_millis(50));
        };
        let host = content["address"].as_str().unwrap().strip_prefix("http://").unwrap().to_owned();
        let token = content["tokens"]["viewer"].as_str().unwrap().to_owned();
        std::thread::sleep(Duration::from_secs(2));
        Self { process, folder, host, token }
    }

    /// Measures the processor time of the agent and its console during a phase.
    fn measure(&self) -> (f64, f64) {
        let process = format!("/proc/{}", self.process.id());
        let look = || (processor(&format!("{process}/stat")), console(&process));
        let before = look();
        std::thread::sleep(PHASE);
        let after = look();
        assert!(Path::new(&process).exists() && after.0 > before.0, "the run has ended");
        (after.0 - before.0, after.1 - before.1)
    }

    /// Starts a client that watches, and returns the number of values it received.
    fn client(&self, stop: Arc<AtomicBool>) -> std::thread::JoinHandle<u64> {
        let request =
            format!("ws://{}/api/v1/live?token={}", self.host, self.token).into_client_request().unwrap();
        let stream = TcpStream::connect(&self.host).unwrap();
        let (mut socket, _) = client(request, stream).unwrap();
        socket.get_ref().set_read_timeout(Some(Duration::from_millis(500))).unwrap();
        let wishes = URLS.iter().zip(1..).map(|(url, id)| json!({ "id": id, "url": url, "rate": RATE }));
        let wish = json!({ "subscribe": wishes.collect::<Vec<_>>() });
        socket.send(Message::Text(wish.to_string().into())).unwrap();
        std::thread::spawn(move || {
            let mut values = 0;
            while !stop.load(Ordering::Relaxed) {
                let Ok(Message::Text(text)) = socket.read() else { continue };
                assert!(!text.contains("\"problem\""), "{text}");
                values += u64::from(text.contains("\"value\""));
            }
            values
        })
    }
}

/// Returns the processor time of all threads of the console.
fn console(process: &str) -> f64 {
    let tasks = std::fs::read_dir(format!("{process}/task")).into_iter().flatten().flatten();
    let of_console = |task: &std::fs::DirEntry| {
        std::fs::read_to_string(task.path().join("comm")).is_ok_and(|name| name.starts_with("console"))
    };
    tasks.filter(of_console).map(|task| processor(&task.path().join("stat").to_string_lossy())).sum()
}

fn endpoint(folder: &Path) -> Option<Value> {
    let files = std::fs::read_dir(folder).ok()?.flatten();
    let mut files = files.filter(|file| file.file_name().to_string_lossy().ends_with(".console"));
    serde_json::from_str(&std::fs::read_to_string(files.next()?.path()).ok()?).ok()
}

impl Drop for Run {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}
