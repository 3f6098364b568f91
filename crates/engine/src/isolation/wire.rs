//! Protocol between the host and an isolated module's process, over a socket pair.
//! Values are not part of it: they are in shared memory.

use std::io::{self, IoSlice, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use slate_module::blackboard::interface::Value;
use slate_module::{Entry, Frame, PortSlot, Refusal, Setup};

use super::python::PythonSource;

/// Topic of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum Topic {
    /// [`Begin`]; the answer is a list of the addresses of its arenas.
    Begin = 1,
    /// Request for the kinds; the answer is a list of [`KindText`].
    Kinds,
    /// [`InstanceRequest`]; the answer is a portable description.
    Describe,
    /// [`InstanceRequest`].
    Create,
    /// Step over the frame; the answer's code is its outcome.
    Tick,
    /// Request for the state, which is the answer.
    Save,
    /// Restored state.
    Restore,
    MayUnload,
    Destroy,
    /// Answer to a request, with the code of a module's table.
    Answer,
    /// Line of the log, with its level as code; any number of them precede an answer.
    Log,
    /// First request: the [`build`] of the host.
    /// A process of another build refuses it, and names its own.
    Build,
}

/// Version of this protocol and of the layout of shared memory.
const ABI: u32 = 1;

/// Returns the version of this program and its layout of shared memory.
/// The two ends of a connection may be built apart: the program `slate`, and the package for Python.
pub(super) fn build() -> String {
    let [frame, slot, entry] = [size_of::<Frame>(), size_of::<PortSlot>(), size_of::<Entry>()];
    format!("{} {ABI} {frame} {slot} {entry}", env!("CARGO_PKG_VERSION"))
}

/// Compares the build of the host with that of this process.
///
/// # Errors
/// The versions of both, if the two can't work together.
pub(super) fn check_build(host: &[u8], own: &str, what: &str) -> Result<(), Refusal> {
    let host = String::from_utf8_lossy(host);
    if host == own {
        return Ok(());
    }
    let version = |build: &str| build.split(' ').next().unwrap_or_default().to_owned();
    let (host, own) = (version(&host), version(own));
    let same = if host == own { ", built from other sources" } else { "" };
    Err(Refusal(format!("{what} is {own}, the agent {host}{same}")))
}

const TOPICS: [Topic; 12] = [
    Topic::Begin,
    Topic::Kinds,
    Topic::Describe,
    Topic::Create,
    Topic::Tick,
    Topic::Save,
    Topic::Restore,
    Topic::MayUnload,
    Topic::Destroy,
    Topic::Answer,
    Topic::Log,
    Topic::Build,
];

/// Location of a module's code.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) enum Code {
    /// Linked into the program.
    Linked,
    /// Library file.
    Library(PathBuf),
    /// Python, run by an interpreter.
    Python(PythonSource),
}

/// First request to a process.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Begin {
    /// Name of the module in the agent.
    pub name: String,
    pub code: Code,
    /// Limit of its memory, bytes; 0 for none.
    pub memory: u64,
    /// For each arena, whose file came first, whether it may be written to.
    pub arenas: Vec<bool>,
    pub arena_length: usize,
}

/// Kind of module.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct KindText {
    pub name: String,
    pub doc: String,
    pub section: String,
}

/// Request for a description or an instance.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct InstanceRequest {
    pub kind: String,
    pub name: String,
    pub seed: u64,
    pub period: u64,
    pub section: Option<Value>,
    pub params: Vec<u8>,
    /// Address of the frame in the receiving process.
    pub frame: usize,
}

impl InstanceRequest {
    pub fn new(kind: &str, setup: &Setup<'_>, params: &[u8], frame: usize) -> Self {
        Self {
            kind: kind.into(),
            name: setup.name.into(),
            seed: setup.seed,
            period: setup.period,
            section: setup.section.cloned(),
            params: params.into(),
            frame,
        }
    }

    pub fn setup(&self) -> Setup<'_> {
        Setup {
            name: &self.name,
            seed: self.seed,
            period: self.period,
            section: self.section.as_ref(),
            params: None,
        }
    }
}

/// Topic, code, and how many bytes follow.
const HEADER: usize = 12;

/// Sends a message in one go.
pub(super) fn send(mut stream: &UnixStream, topic: Topic, code: i32, body: &[u8]) -> io::Result<()> {
    let length = u32::try_from(body.len()).map_err(|_| io::ErrorKind::FileTooLarge)?;
    let mut header = [0; HEADER];
    header[..4].copy_from_slice(&(topic as u32).to_ne_bytes());
    header[4..8].copy_from_slice(&code.to_ne_bytes());
    header[8..].copy_from_slice(&length.to_ne_bytes());
    let sent = stream.write_vectored(&[IoSlice::new(&header), IoSlice::new(body)])?;
    if sent < HEADER {
        stream.write_all(&header[sent..])?;
    }
    stream.write_all(&body[sent.saturating_sub(HEADER).min(body.len())..])
}

/// Receives a message: topic and code; its payload is in `body`.
pub(super) fn receive(mut stream: &UnixStream, body: &mut Vec<u8>) -> io::Result<(Topic, i32)> {
    let mut header = [0; HEADER];
    stream.read_exact(&mut header)?;
    let word = |at: usize| [header[at], header[at + 1], header[at + 2], header[at + 3]];
    let (topic, code) = (u32::from_ne_bytes(word(0)), i32::from_ne_bytes(word(4)));
    let length = u32::from_ne_bytes(word(8));
    let topic = TOPICS.into_iter().find(|known| *known as u32 == topic).ok_or(io::ErrorKind::InvalidData)?;
    body.clear();
    if length > 0 && stream.take(length.into()).read_to_end(body)? < length as usize {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    Ok((topic, code))
}

#[cfg(test)]
mod tests {
    use super::{build, check_build};

    #[test]
    fn process_of_another_build_is_refused_with_both_versions() {
        let what = "the package slate-robotics";
        assert_eq!(check_build(build().as_bytes(), &build(), what), Ok(()));
        let refused = |host: &str| check_build(host.as_bytes(), "0.1.0 1 96 80 48", what).unwrap_err().0;
        assert_eq!(refused("0.2.0 1 96 80 48"), "the package slate-robotics is 0.1.0, the agent 0.2.0");
        let layout = "the package slate-robotics is 0.1.0, the agent 0.1.0, built from other sources";
        assert_eq!(refused("0.1.0 1 96 88 48"), layout);
        assert_eq!(refused("0.1.0 2 96 80 48"), layout);
        assert_eq!(refused(""), "the package slate-robotics is 0.1.0, the agent ");
    }
}
