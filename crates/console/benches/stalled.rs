//! Benchmark of stalled clients: their cost to the agent.
//! An agent offers 100 MB/s of images to a reading client, to a client that has stopped reading, and to none, in turn.
//! Prints how long the writer's ticks take and how late cycles begin, in the same run.
//!
//! `cargo bench -p slate-console --bench stalled`
#![allow(clippy::disallowed_methods, reason = "a bench measures real time")]
#![allow(clippy::unwrap_used, reason = "a bench that can't go on ends")]
#![allow(missing_docs, reason = "nobody uses what is in a bench")]

use std::net::TcpStream;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde_json::json;
use slate_console::{Console, Settings};
use slate_interfaces::{Image, ImageFormat};
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{Database, Options as Sources};
use slate_runtime::{Agent, Control, Options};
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::{Message, WebSocket, client};

/// Period of the main loop; an image comes with every fifth cycle.
const PERIOD: Duration = Duration::from_millis(2);
const EVERY: u64 = 5;
/// Bytes of an image: 100 a second are 100 MB/s.
const SIZE: usize = 1_000_000;
/// Duration of a phase.
/// It is shorter than the timeout of a client that reads nothing.
const PHASE: Duration = Duration::from_secs(4);
const ROUNDS: usize = 6;

/// Durations of ticks and delays of cycle ends, ns.
static TICKS: Mutex<Vec<u64>> = Mutex::new(Vec::new());
static LATE: Mutex<Vec<u64>> = Mutex::new(Vec::new());

#[ports]
pub struct CameraIo {
    #[capacity(1_000_000)]
    image: Output<Image>,
}

/// Sees 100 images a second.
pub struct Camera;

#[module(stage = SensorAcquire)]
impl Module for Camera {
    type Io = CameraIo;
    type Params = ();
    type State = u64;

    fn tick(state: &mut u64, io: &CameraIo, _: &(), _: &Tick) -> Outcome {
        *state += 1;
        if state.is_multiple_of(EVERY) {
            let begin = Instant::now();
            io.image.write(SIZE, |image| {
                (image.width, image.height, image.step, image.format) =
                    (1000, 1000, 1000, ImageFormat::MONO8);
                image.data.fill(*state as u8);
            });
            TICKS.lock().unwrap().push(begin.elapsed().as_nanos() as u64);
        }
        Outcome::Ok
    }
}

const CONFIGURATION: &str =
    "[agent]\nname = \"bench\"\n[loop]\nperiod = \"2ms\"\n[modules.camera]\n[console]\nport = 0";

#[derive(Clone, Copy, PartialEq, Eq)]
enum Reader {
    Nobody,
    Reads,
    Stalls,
}

#[derive(Default)]
struct Seen {
    ticks: Vec<u64>,
    late: Vec<u64>,
    images: u64,
}

fn main() {
    let sources = Sources { extra_tables: vec!["console".into()], ..Sources::default() };
    let database = Database::from_text("bench.toml", CONFIGURATION, sources).unwrap();
    let mut agent = Agent::load_with(&database, &[Plugin::linked::<Camera>()], Options::default()).unwrap();
    let console = Console::start(&agent, &Settings::of(&database.current()).unwrap(), Vec::new()).unwrap();
    let stopper = agent.stopper();
    let run = std::thread::spawn(move || {
        let mut last = Instant::now();
        agent.run(Box::new(move |_| {
            let passed = last.elapsed();
            last = Instant::now();
            LATE.lock().unwrap().push(passed.saturating_sub(PERIOD).as_nanos() as u64);
            Control::Continue
        }))
    });
    std::thread::sleep(Duration::from_secs(1));
    let readers = [Reader::Nobody, Reader::Reads, Reader::Stalls];
    let mut seen = readers.map(|_| Seen::default());
    for _ in 0..ROUNDS {
        for (reader, seen) in readers.into_iter().zip(&mut seen) {
            phase(&console, reader, seen);
        }
    }
    stopper.stop();
    drop(console);
    run.join().unwrap().unwrap();
    println!(
        "{:<34}{:>8}{:>12}{:>12}{:>13}{:>13}{:>13}",
        "", "images", "tick p50", "p99.9", "max", "late p99.9", "max"
    );
    let names = ["nobody", "one that reads 100 MB/s", "one that has stopped reading"];
    for (name, mut seen) in names.into_iter().zip(seen) {
        seen.ticks.sort_unstable();
        seen.late.sort_unstable();
        let at = |sorted: &[u64], part: f64| {
            format!("{:.1} us", sorted[(part * (sorted.len() - 1) as f64) as usize] as f64 / 1e3)
        };
        println!(
            "{name:<34}{:>8}{:>12}{:>12}{:>13}{:>13}{:>13}",
            seen.images,
            at(&seen.ticks, 0.5),
            at(&seen.ticks, 0.999),
            at(&seen.ticks, 1.0),
            at(&seen.late, 0.999),
            at(&seen.late, 1.0)
        );
    }
}

fn phase(console: &Console, reader: Reader, seen: &mut Seen) {
    static GOES_ON: AtomicBool = AtomicBool::new(false);
    GOES_ON.store(true, Ordering::Relaxed);
    let socket = (reader != Reader::Nobody).then(|| open(console));
    TICKS.lock().unwrap().clear();
    LATE.lock().unwrap().clear();
    let reads = reader == Reader::Reads;
    let client = socket.map(|mut socket| {
        std::thread::spawn(move || {
            let mut images = 0;
            while GOES_ON.load(Ordering::Relaxed) {
                match reads {
                    true => images += u64::from(socket.read().is_ok_and(|message| message.is_binary())),
                    // The connection stays, and its data is not read.
                    false => std::thread::sleep(Duration::from_millis(10)),
                }
            }
            images
        })
    });
    std::thread::sleep(PHASE);
    seen.ticks.append(&mut TICKS.lock().unwrap());
    seen.late.append(&mut LATE.lock().unwrap());
    GOES_ON.store(false, Ordering::Relaxed);
    seen.images += client.map_or(0, |client| client.join().unwrap());
    // The rest is consumed.
    std::thread::sleep(Duration::from_millis(300));
}

fn open(console: &Console) -> WebSocket<TcpStream> {
    let tokens: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(console.token_file()).unwrap()).unwrap();
    let token = tokens["tokens"]["viewer"].as_str().unwrap();
    let address = console.addresses()[0];
    let request = format!("ws://{address}/api/v1/live?token={token}").into_client_request().unwrap();
    let stream = TcpStream::connect(address).unwrap();
    let (mut socket, _) = client(request, stream).unwrap();
    socket.get_ref().set_read_timeout(Some(Duration::from_millis(200))).unwrap();
    let wish = json!({ "subscribe": [{ "id": 1, "url": "/camera/image", "rate": 100, "form": "binary" }] });
    socket.send(Message::Text(wish.to_string().into())).unwrap();
    socket
}
