//! Output of several agents, line by line with their names.

use std::io::{self, BufRead, BufReader, IsTerminal, Read, Write};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use crossterm::style::{Color, Stylize};
use serde_json::Value;

/// Length from which a line is split, bytes.
const MAX_LINE_LENGTH: u64 = 64 << 10;

/// Time to wait for the last lines of an ended agent.
/// Processes that it started may hold the streams open.
const LAST_LINES_TIMEOUT: Duration = Duration::from_secs(1);

const COLORS: [Color; 6] =
    [Color::Cyan, Color::Magenta, Color::Yellow, Color::Green, Color::Blue, Color::Red];

/// Destination of the lines.
#[derive(Clone, Copy)]
pub enum OutputStream {
    Stdout,
    Stderr,
}

impl OutputStream {
    /// Returns the prefix of an agent's lines.
    pub fn prefix(self, index: usize, name: &str, width: usize) -> String {
        let terminal = match self {
            Self::Stdout => io::stdout().is_terminal(),
            Self::Stderr => io::stderr().is_terminal(),
        };
        let name = format!("{name:width$} |");
        match terminal && std::env::var_os("NO_COLOR").is_none() {
            true => format!("{} ", name.with(COLORS[index % COLORS.len()])),
            false => format!("{name} "),
        }
    }

    fn write(self, line: &[u8]) {
        // In one piece, so that the lines of others don't come between; a closed stream is ignored.
        let _ = match self {
            Self::Stdout => io::stdout().lock().write_all(line),
            Self::Stderr => io::stderr().lock().write_all(line),
        };
    }
}

/// Stream of lines that is passed on by a thread of its own.
pub struct Relay(Receiver<Option<Value>>);

impl Relay {
    /// Begins. A summary, which is an object of JSON, is kept back if `keeps_summary`.
    pub fn start(
        stream: impl Read + Send + 'static,
        output: OutputStream,
        prefix: String,
        keeps_summary: bool,
    ) -> io::Result<Self> {
        let (sender, receiver) = channel();
        let relay = move || {
            let mut stream = BufReader::new(stream);
            let (mut line, mut summary) = (Vec::new(), None);
            loop {
                line.clear();
                line.extend_from_slice(prefix.as_bytes());
                match stream.by_ref().take(MAX_LINE_LENGTH).read_until(b'\n', &mut line) {
                    Ok(0) | Err(_) => break,
                    Ok(_) => {}
                }
                let text = &line[prefix.len()..];
                if keeps_summary
                    && text.starts_with(b"{")
                    && let Ok(value) = serde_json::from_slice(text)
                {
                    summary = Some(value);
                    continue;
                }
                if !line.ends_with(b"\n") {
                    line.push(b'\n');
                }
                output.write(&line);
            }
            // The waiting thread may have given up.
            let _ = sender.send(summary);
        };
        std::thread::Builder::new().name("lines".into()).spawn(relay)?;
        Ok(Self(receiver))
    }

    /// Waits for the last line, and returns the summary.
    pub fn finish(self) -> Option<Value> {
        self.0.recv_timeout(LAST_LINES_TIMEOUT).ok().flatten()
    }
}
