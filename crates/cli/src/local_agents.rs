//! Agents that run on this machine, queried all at once.

use std::sync::Arc;
use std::sync::mpsc::channel;
use std::time::Duration;

use slate::control::{Client, ClientError};
use slate::runtime::directory::agents;

use crate::clock::now;
use crate::endpoint::access_at;

/// Time within which agents must answer.
const ANSWER_TIMEOUT: Duration = Duration::from_millis(500);

/// Returns the agent that the variable `SLATE_AGENT` names, by name or address.
pub fn default_agent() -> Option<String> {
    std::env::var("SLATE_AGENT").ok().filter(|name| !name.is_empty())
}

/// Queries all local agents in parallel, and returns the answers that came in time.
pub fn query_all<T: Send + 'static>(
    query: impl Fn(&str) -> T + Send + Sync + 'static,
) -> Vec<(String, Option<T>)> {
    let (query, (sender, answers)) = (Arc::new(query), channel());
    let mut answers_by_name: Vec<(String, Option<T>)> =
        agents().into_iter().map(|name| (name, None)).collect();
    for (index, (name, answer)) in answers_by_name.iter_mut().enumerate() {
        let (own, sender, agent) = (Arc::clone(&query), sender.clone(), name.clone());
        // An agent that hangs keeps its thread until the end of this program.
        let thread = std::thread::Builder::new().spawn(move || sender.send((index, own(&agent))));
        // Without a thread for it, this one asks.
        if thread.is_err() {
            *answer = Some(query(name));
        }
    }
    drop(sender);
    let until = now() + ANSWER_TIMEOUT;
    while let Ok((index, answer)) = answers.recv_timeout(until.saturating_duration_since(now())) {
        answers_by_name[index].1 = Some(answer);
    }
    answers_by_name
}

/// Queries the default agent if it is remote, else all local ones.
/// Returns the answers that came in time.
pub fn query_default<T: Send + 'static>(
    query: impl Fn(&mut Client) -> Result<T, ClientError> + Send + Sync + 'static,
) -> Vec<T> {
    if let Some(address) = default_agent().filter(|agent| agent.contains("://")) {
        let client = access_at(&address, None).ok().and_then(|access| Client::at(&access).ok());
        return client.and_then(|mut client| query(&mut client).ok()).into_iter().collect();
    }
    let answers_by_name = query_all(move |name| query(&mut Client::connect(name)?));
    answers_by_name.into_iter().filter_map(|(_, answer)| answer?.ok()).collect()
}
