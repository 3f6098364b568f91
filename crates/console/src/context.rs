//! What all requests share.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde_json::Value as Json;
use slate_blackboard::message::Sender;
use slate_blackboard::{Board, Pattern};
use slate_module::Level;
use slate_record::page::Followed;
use slate_runtime::log::Logger;
use slate_runtime::remote::Desk;
use tokio::sync::Semaphore;

use crate::lease::Leases;
use crate::socket::MOST_TOOLS;

/// A file that a browser gets without a token, such as a page and what belongs to it.
#[derive(Clone, Debug)]
pub struct Page {
    /// Where it is, such as `/` or `/panels/map.js`.
    pub path: String,
    /// What it is, such as `text/javascript; charset=utf-8`.
    pub kind: String,
    /// What is in it.
    pub content: Vec<u8>,
}

/// Something that the program knows and the blackboard does not, such as the world of a simulator.
#[derive(Clone)]
pub struct Document {
    /// Its name, at `/api/v1/documents/NAME`.
    pub name: String,
    /// What it says now. It is called in a thread of the console.
    pub read: Arc<dyn Fn() -> Json + Send + Sync>,
}

impl std::fmt::Debug for Document {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Document").field("name", &self.name).finish_non_exhaustive()
    }
}

/// What requests are answered from.
pub(crate) struct Context {
    pub desk: Desk,
    pub logger: Arc<Logger>,
    pub is_lockstep: bool,
    pub documents: Vec<Document>,
    /// Parameters that an operator may set.
    operable: Vec<Pattern>,
    /// The robots that the configuration names.
    pub robots: Vec<Followed>,
    /// Tells one run from another.
    pub session: String,
    /// Controls that are had over plain requests.
    pub leases: Leases,
    /// Places of tools with a connection of their own.
    pub tools: Arc<Semaphore>,
    /// Who sends messages, by the path of the mailbox.
    senders: Mutex<BTreeMap<String, Sender>>,
    /// Held by who changes something under a condition.
    turn: Mutex<()>,
}

impl Context {
    pub fn new(
        desk: Desk,
        logger: Arc<Logger>,
        is_lockstep: bool,
        documents: Vec<Document>,
        operable: Vec<Pattern>,
        robots: Vec<Followed>,
        session: String,
    ) -> Self {
        Self {
            operable,
            session,
            robots,
            desk,
            logger,
            is_lockstep,
            documents,
            leases: Leases::default(),
            tools: Arc::new(Semaphore::new(MOST_TOOLS)),
            senders: Mutex::default(),
            turn: Mutex::default(),
        }
    }

    pub fn board(&self) -> &Arc<Board> {
        self.desk.composer().board()
    }

    pub fn agent(&self) -> &str {
        self.board().agent()
    }

    /// Whether an operator may set what a value names of a setting: its fields if it has some, else the whole at the path.
    pub fn is_operable(&self, path: &str, value: &Json) -> bool {
        let is_named = |path: &str| self.operable.iter().any(|pattern| pattern.matches(path));
        match value.as_object().filter(|fields| !fields.is_empty()) {
            Some(fields) => fields.keys().all(|name| is_named(&format!("{path}/{name}"))),
            None => is_named(path),
        }
    }

    pub fn now(&self) -> u64 {
        self.desk.composer().now()
    }

    pub fn log(&self, level: Level, text: &str) {
        self.logger.log(self.now(), level, text);
    }

    pub fn senders(&self) -> MutexGuard<'_, BTreeMap<String, Sender>> {
        self.senders.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The right to change something under a condition, for one at a time.
    pub fn turn(&self) -> MutexGuard<'_, ()> {
        self.turn.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
