//! A tool, such as the `slate` command, that speaks as at the local socket: the agent greets, and answers each call in order.
//!
//! Calls may take long and wait, so each tool has a thread of its own, beside that of the console; at most so many are there
//! that others who look and drive are never in want of a place.

mod need;

use std::time::Duration;

use serde::Deserialize;
use serde_json::Value as Json;
use slate_module::Level;
use slate_runtime::remote::{Answer, Call, Greeting, Refusal, VERSION, Visit};
use tokio::sync::mpsc::{Receiver, Sender, channel};
use tokio::time::{Instant, sleep_until};

use super::{Listener, MESSAGES, PING, Said, Sink, Visitor, ping, say};
use crate::Role;
use crate::lease::TERM;

/// How many tools there may be.
pub(crate) const MOST: usize = 12;

/// The longest call, bytes.
pub(super) const CALL: usize = slate_runtime::remote::LINE_LIMIT;

/// How long a tool may say nothing; one that has controls may for as long as a lease holds.
const SILENCE: Duration = Duration::from_secs(120);

/// How much faster than it may for long a tool may ask for a moment.
const MOMENT: Duration = Duration::from_millis(250);

/// The longest name of who drives, letters.
const NAME: usize = 80;

pub(super) async fn visit(visitor: Visitor, mut sink: Sink, mut listener: Listener) {
    let agent = visitor.context.agent().to_owned();
    let greeting = serde_json::to_string(&Greeting { slate: VERSION, agent }).unwrap_or_default();
    let (calls, asked) = channel(1);
    let (answers, mut answered) = channel(1);
    let work = std::thread::Builder::new().name("console tool".into());
    // It has the visitor, and so counts until its end, also when the tool is gone in the middle of something.
    let begun = work.spawn(move || serve(&visitor, asked, &answers));
    if begun.is_err() || !say(&mut sink, greeting).await {
        return;
    }
    let (mut silence, mut paid) = (SILENCE, Instant::now());
    while let Some(said) = listener.next_within(silence).await {
        let Said::Text(text) = said else { continue };
        if calls.send(text).await.is_err() {
            return;
        }
        let Some((answer, has_controls)) = hear(&mut answered, &mut sink).await else { return };
        if !say(&mut sink, answer).await {
            return;
        }
        silence = if has_controls { TERM } else { SILENCE };
        // Whoever asks too fast is answered more slowly; what he says meanwhile waits at his end.
        paid = paid.max(Instant::now()) + Duration::from_secs_f64(1.0 / MESSAGES);
        if paid > Instant::now() + MOMENT {
            sleep_until(paid - MOMENT).await;
        }
    }
}

/// Waits for an answer, and meanwhile shows the tool that the agent is there; nothing when the tool is not.
async fn hear(answered: &mut Receiver<(String, bool)>, sink: &mut Sink) -> Option<(String, bool)> {
    let mut last = Instant::now();
    loop {
        match tokio::time::timeout(PING, answered.recv()).await {
            Ok(answer) => return answer,
            Err(_) if ping(sink, &mut last).await => {}
            Err(_) => return None,
        }
    }
}

/// Answers the calls of a tool until it is gone.
fn serve(visitor: &Visitor, mut asked: Receiver<String>, answers: &Sender<(String, bool)>) {
    let mut visit = Visit::default();
    while let Some(text) = asked.blocking_recv() {
        let answer = visitor.answer(&mut visit, &text).map_or_else(Answer::Error, Answer::Result);
        let answer = serde_json::to_string(&answer).unwrap_or_default();
        if answers.blocking_send((answer, visit.has_controls())).is_err() {
            break;
        }
    }
    visit.leave(false);
}

/// What a call is called.
#[derive(Deserialize)]
struct Named {
    call: String,
}

impl Visitor {
    fn answer(&self, visit: &mut Visit, text: &str) -> Result<Json, Refusal> {
        let refusal =
            |message: String, help: &str| Refusal { message, help: help.into(), code: None, report: None };
        let mut call: Call = serde_json::from_str(text).map_err(|error| {
            refusal(format!("this is no call: {error}"), r#"send one such as {"call":"plugin/list"}"#)
        })?;
        let need = need::need(&self.context, &mut call);
        let role = need.role;
        if self.role < role {
            let message = format!("{} may not do this", self.role.one());
            return Err(refusal(message, &format!("ask with the token of {}", role.one())));
        }
        if let Some((file, files)) = need.file {
            *file = files.place(&self.context, file).map_err(|problem| problem.refusal())?;
        }
        if let Call::ControlsTake { who, .. } = &mut call {
            let own: String = who.chars().take(NAME).collect();
            *who = format!("{own} ({})", self.who);
        }
        // Who drives says so many times a second, and who has the controls is in the log.
        let is_told = role > Role::Viewer
            && !matches!(
                call,
                Call::ControlsCommand { .. } | Call::ControlsRelease {} | Call::TraceProgress {}
            );
        let made = self.context.desk.make_for(visit, call);
        if is_told {
            let name = serde_json::from_str(text).map_or_else(|_| String::new(), |named: Named| named.call);
            let done = if made.is_ok() { "is done" } else { "is refused" };
            self.context.log(Level::Info, &format!("{}: {name} {done}", self.who));
        }
        made
    }
}
