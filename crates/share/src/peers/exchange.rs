//! Properties exchanged with another agent, for use by its session.

use std::collections::VecDeque;
use std::sync::Arc;

use slate_blackboard::Board;
use slate_blackboard::wake::Wake;
use slate_sorted::SortedMap;

use super::Allowance;
use super::export::Export;
use super::import::Import;
use crate::carrier::SharedMemory;
use crate::session::{Application, Estimate, Event, Sample};

/// Properties exchanged with another agent: exports, imports and their events.
#[derive(Debug)]
pub(super) struct PeerExchange {
    pub board: Arc<Board>,
    pub agent: String,
    pub wake: Arc<Wake>,
    pub exports: SortedMap<u32, Export>,
    pub imports: SortedMap<u32, Import>,
    pub events: VecDeque<Event>,
    pub estimate: Option<Estimate>,
    /// Rights of the other agent; unrestricted if `None`.
    pub allowance: Option<Allowance>,
    /// Offset of the values' clock to the agent's, ns.
    pub clock_offset: i64,
    /// Flag of writes to mirrors since the last query.
    pub updated: bool,
}

impl PeerExchange {
    /// Creates an empty exchange.
    /// `wake` is notified when this agent has something for the other one.
    pub fn new(board: &Arc<Board>, agent: &str, wake: &Arc<Wake>) -> Self {
        Self {
            board: Arc::clone(board),
            agent: agent.into(),
            wake: Arc::clone(wake),
            exports: SortedMap::new(),
            imports: SortedMap::new(),
            events: VecDeque::new(),
            estimate: None,
            allowance: None,
            clock_offset: 0,
            updated: false,
        }
    }

    /// Takes the mirrors off the board.
    pub fn remove_mirrors(&mut self) {
        for import in std::mem::take(&mut self.imports).into_values() {
            if import.mirror.is_some() {
                // It may be removed already.
                let _ = self.board.remove(&import.mirror_path);
            }
        }
    }
}

/// Exchange during use by a session, with shared memory.
pub(super) struct LiveExchange<'a> {
    pub exchange: &'a mut PeerExchange,
    pub memory: Option<&'a dyn SharedMemory>,
}

impl Application for LiveExchange<'_> {
    fn event(&mut self, event: Event) {
        self.exchange.events.push_back(event);
    }

    fn sample(&mut self, id: u32, sample: &Sample, skipped: u64, content: &[u8]) {
        let (estimate, clock_offset) = (self.exchange.estimate, self.exchange.clock_offset);
        if let Some(import) = self.exchange.imports.get_mut(&id) {
            self.exchange.updated |=
                import.show(sample, skipped, content, self.memory, (estimate, clock_offset));
        }
    }

    fn discard(&mut self, sample: &Sample, content: &[u8]) {
        if let Some(memory) = self.memory {
            memory.read(content, sample.length as usize, &mut |_| {});
        }
    }

    fn has_update(&mut self, id: u32) -> bool {
        self.exchange
            .exports
            .get(&id)
            .and_then(|export| export.source.as_ref())
            .is_some_and(|source| source.has_update())
    }

    fn take(&mut self, id: u32, content: &mut Vec<u8>) -> Option<Sample> {
        let export = self.exchange.exports.get_mut(&id)?;
        let compression = export.options.compression;
        let mut sample = export.source.as_mut()?.take(compression, self.memory, content)?;
        sample.stamp.time =
            sample.stamp.time.saturating_add_signed(self.exchange.clock_offset.saturating_neg());
        Some(sample)
    }
}
