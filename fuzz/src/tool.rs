//! Requests at an agent's socket: each has an answer, a refusal changes nothing.
//!
//! A line is a method, a path behind `/api/v1`, and perhaps a body of JSON.

use std::sync::{Mutex, OnceLock};

use serde_json::Value;
use slate_control::{Client, ClientError, Server};
use slate_runtime::Agent;

struct Reached {
    _agent: Agent,
    server: Server,
}

fn reached() -> &'static Mutex<Reached> {
    static REACHED: OnceLock<Mutex<Reached>> = OnceLock::new();
    REACHED.get_or_init(|| {
        // SAFETY: no other thread reads the environment yet.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", crate::folder()) };
        let agent = crate::robot::robot();
        let server = Server::open(&agent).expect("the folder is this process's");
        Mutex::new(Reached { _agent: agent, server })
    })
}

/// Returns the agent's configuration and links.
fn state(client: &mut Client) -> [Value; 2] {
    ["/settings/differences", "/links"].map(|path| client.call("GET", path, None).expect("it answers"))
}

/// Sends those lines.
pub fn run(bytes: &[u8]) {
    let reached = reached().lock().expect("nobody panics");
    let mut client = Client::connect(reached.server.name()).expect("it listens");
    let mut before = state(&mut client);
    for line in bytes.split(|byte| *byte == b'\n') {
        let Some((method, path, body)) = request(line) else { continue };
        match client.call::<Value>(&method, &path, body.as_ref()) {
            Ok(_) => before = state(&mut client),
            Err(ClientError::Refused(refusal)) => {
                assert!(!refusal.message.is_empty(), "refused without a word");
                assert!(state(&mut client) == before, "refused, and something has changed");
            }
            // What is not a URL is not a request; a stream is no JSON.
            Err(ClientError::InvalidAnswer { .. }) => return,
            Err(error) => panic!("{error}"),
        }
    }
}

/// The request of a line, unless it would touch files or continues without end.
fn request(line: &[u8]) -> Option<(String, String, Option<Value>)> {
    let text = std::str::from_utf8(line).ok()?;
    let mut parts = text.splitn(3, ' ');
    let (method, path) = (parts.next()?, parts.next()?);
    let is_plain = path.starts_with('/') && path.bytes().all(|byte| byte.is_ascii_graphic());
    let touches_files = ["/snapshots", "/recordings", "/trace", "/layouts"];
    let is_tame = !touches_files.iter().any(|start| path.starts_with(start)) && !path.contains("format=");
    let body: Option<Value> = parts.next().and_then(|body| serde_json::from_str(body).ok());
    let loads = path.starts_with("/plugins") && body.is_some();
    let waits = matches!(path, "/watch" | "/measure");
    let known = ["GET", "PUT", "POST", "PATCH", "DELETE"].contains(&method);
    (known && is_plain && is_tame && !loads && !waits).then(|| (method.to_owned(), path.to_owned(), body))
}
