//! Lines of a tool at an agent's socket: each has an answer, and what is refused changes nothing.

use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::{Mutex, OnceLock};

use slate_runtime::Agent;
use slate_runtime::remote::{Answer, Call, Server};

struct Reached {
    _agent: Agent,
    server: Server,
}

fn reached() -> &'static Mutex<Reached> {
    static REACHED: OnceLock<Mutex<Reached>> = OnceLock::new();
    REACHED.get_or_init(|| {
        // SAFETY: nobody else reads the environment yet.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", crate::folder()) };
        let agent = crate::robot::robot();
        let server = Server::open(&agent).expect("the folder is this process's");
        Mutex::new(Reached { _agent: agent, server })
    })
}

/// A tool at the socket.
struct Tool {
    stream: UnixStream,
    answers: BufReader<UnixStream>,
}

impl Tool {
    /// The answer to a line.
    fn ask(&mut self, line: &[u8]) -> String {
        self.stream.write_all(line).and_then(|()| self.stream.write_all(b"\n")).expect("it listens");
        self.answer()
    }

    fn answer(&mut self) -> String {
        let mut line = String::new();
        self.answers.read_line(&mut line).expect("it answers");
        line
    }

    /// What the agent is configured to be, and how it is linked.
    fn state(&mut self) -> [String; 2] {
        let calls = [Call::ConfigDiff {}, Call::LinkList {}];
        calls.map(|call| self.ask(&serde_json::to_vec(&call).expect("it can be written")))
    }
}

/// Sends those lines.
pub fn run(bytes: &[u8]) {
    let reached = reached().lock().expect("nobody panics");
    let stream = UnixStream::connect(reached.server.socket()).expect("it listens");
    let answers = BufReader::new(stream.try_clone().expect("there are handles"));
    let mut tool = Tool { stream, answers };
    tool.answer();
    let mut state = tool.state();
    for text in bytes.split(|byte| *byte == b'\n') {
        let text = tamed(text);
        let answer: Answer = serde_json::from_str(&tool.ask(&text)).expect("it answers in JSON");
        let is_refused = match answer {
            Answer::Error(refusal) => {
                assert!(!refusal.message.is_empty(), "refused without a word");
                true
            }
            Answer::Result(_) => false,
        };
        // What is no call may be a few bytes long, and there may be thousands of them.
        if serde_json::from_slice::<Call>(&text).is_ok() {
            let before = std::mem::replace(&mut state, tool.state());
            assert!(!is_refused || state == before, "refused, and something has changed");
        }
    }
}

/// A call that would touch files touches one of the target's, as the fuzzer may name any.
fn tamed(line: &[u8]) -> Vec<u8> {
    let Ok(mut call) = serde_json::from_slice::<Call>(line) else { return line.to_vec() };
    let tame = |file: &mut PathBuf| *file = crate::folder().join("tool.snapshot");
    match &mut call {
        Call::PluginLoad { file: Some(file), .. } | Call::PluginReload { file: Some(file), .. } => tame(file),
        Call::PluginShadow { file, .. }
        | Call::TraceRecord { file }
        | Call::RecordStart { file, .. }
        | Call::RecordStop { file: Some(file) }
        | Call::RecordSnapshot { file }
        | Call::SnapshotSave { file }
        | Call::SnapshotRemote { file, .. }
        | Call::SnapshotLoad { file } => tame(file),
        _ => return line.to_vec(),
    }
    serde_json::to_vec(&call).expect("it was one")
}
