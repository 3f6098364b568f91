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

/// Sends those lines.
pub fn run(bytes: &[u8]) {
    let reached = reached().lock().expect("nobody panics");
    let mut stream = UnixStream::connect(reached.server.socket()).expect("it listens");
    let mut answers = BufReader::new(stream.try_clone().expect("there are handles"));
    let mut line = String::new();
    answers.read_line(&mut line).expect("it greets");
    for text in bytes.split(|byte| *byte == b'\n') {
        let text = tamed(text);
        stream.write_all(&text).and_then(|()| stream.write_all(b"\n")).expect("it listens");
        line.clear();
        answers.read_line(&mut line).expect("it answers");
        let answer: Answer = serde_json::from_str(&line).expect("it answers in JSON");
        if let Answer::Error(refusal) = answer {
            assert!(!refusal.message.is_empty(), "refused without a word");
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
        | Call::SnapshotSave { file }
        | Call::SnapshotRemote { file, .. }
        | Call::SnapshotLoad { file } => tame(file),
        _ => return line.to_vec(),
    }
    serde_json::to_vec(&call).expect("it was one")
}
