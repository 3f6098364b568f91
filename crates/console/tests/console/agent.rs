//! An agent that runs, with its console.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;

use serde_json::{Value as Json, json};
use slate_blackboard::Board;
use slate_console::{Console, Document, Settings};
use slate_control::ControlSurface;
use slate_record::Recorder;
use slate_runtime::configuration::{Database, Options as Sources};
use slate_runtime::{Agent, Control, Options, Stopper};

use crate::client::{Client, Reply};
use crate::modules::{CONFIGURATION, plugins};

/// An agent that runs until this is dropped.
pub struct Running {
    pub console: Console,
    /// What the console serves.
    pub surface: Arc<ControlSurface>,
    pub board: Arc<Board>,
    /// Where its recordings are.
    pub folder: PathBuf,
    tokens: Json,
    stopper: Stopper,
    thread: Option<JoinHandle<()>>,
}

impl Running {
    /// One for each test, as tests run beside each other.
    pub fn start(name: &str) -> Self {
        Self::start_with(name, &format!("{CONFIGURATION}\n[console]\nport = 0"))
    }

    pub fn start_with(name: &str, text: &str) -> Self {
        let text = text.replace("\"tester\"", &format!("\"tester-{name}\""));
        let sources = Sources { extra_tables: vec![slate_console::TABLE.into()], ..Sources::default() };
        let database = Database::from_text("test.toml", &text, sources).unwrap();
        let recorder = Recorder::on_demand(database.current().record());
        let options = Options {
            armed: true,
            recording: Some(Arc::new(recorder.clone())),
            log: vec![recorder.log_target()],
            ..Options::default()
        };
        let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("recordings").join(name);
        let _ = std::fs::remove_dir_all(&folder);
        recorder.attach(&agent, &folder);
        let world = Document { name: "world".into(), read: Arc::new(|| json!({ "walls": [] })) };
        let settings = Settings::of(&database.current()).unwrap();
        let surface = Arc::new(ControlSurface::new(&agent).unwrap());
        surface.add_documents([world]);
        let console = Console::start_on(Arc::clone(&surface), &settings, Vec::new()).unwrap();
        let tokens = serde_json::from_str(&std::fs::read_to_string(console.token_file()).unwrap()).unwrap();
        let (board, stopper) = (Arc::clone(agent.board()), agent.stopper());
        let thread = std::thread::spawn(move || {
            agent.run(Box::new(|_| Control::Continue)).unwrap();
            recorder.finish(&mut agent);
        });
        let running = Self { console, surface, board, folder, tokens, stopper, thread: Some(thread) };
        running.wait_for("the first cycle", || running.number("sensor/count/value") > 2.0);
        running
    }

    pub fn address(&self) -> SocketAddr {
        self.console.addresses()[0]
    }

    pub fn token(&self, role: &str) -> String {
        self.tokens["tokens"][role].as_str().unwrap().into()
    }

    /// Somebody of a role.
    pub fn client(&self, role: &str) -> Client {
        Client::new(self.address(), &self.token(role))
    }

    /// What a developer gets.
    pub fn get(&self, path: &str) -> Reply {
        self.client("developer").send("GET", path, None)
    }

    pub fn name(&self) -> &str {
        self.board.agent()
    }

    /// The path of a property in the API.
    pub fn at(&self, path: &str) -> String {
        format!("/slate/{}/{path}", self.name())
    }

    pub fn number(&self, path: &str) -> f64 {
        self.board.read(path).unwrap().and_then(|(value, _)| value.as_f64()).unwrap_or(f64::NAN)
    }

    /// Waits until something is so.
    pub fn wait_for(&self, what: &str, mut is_so: impl FnMut() -> bool) {
        for _ in 0..2000 {
            if is_so() {
                return;
            }
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        panic!("{what}: not within 10 s");
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stopper.stop();
        let _ = self.thread.take().unwrap().join();
    }
}
