//! What the team states about a topic, as a property of this agent.

use std::collections::BTreeMap;
use std::sync::Arc;

use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::interface::Descriptor;
use slate_blackboard::{Access, Board, Property, Store};
use slate_interfaces::{FactHead, FactTableHead};
use slate_runtime::sharing::TEAM;

use super::layout::texts;
use super::{Known, Layout, Member};
use crate::knowledge::Version;
use crate::schema::difference;

/// A topic on the board.
pub(super) struct Shown {
    board: Arc<Board>,
    property: Arc<Property>,
    writer: Writer,
    pub layout: Layout,
    room: usize,
    head: FactTableHead,
    table: Vec<u8>,
    /// Since when each fact is known here, by key and robot.
    heard: BTreeMap<(String, u32), (Version, u64)>,
    /// The schemas of facts that don't fit, with what is different about them.
    pub unfit: BTreeMap<u64, String>,
}

impl Shown {
    pub fn new(board: &Arc<Board>, topic: &str, layout: Layout, room: usize) -> Result<Self, String> {
        let store = Store { capacity: room, depth: 1, budget: Budget { latest: 16, queues: 1, window: 4 } };
        let doc = "What the team states about a topic.";
        let property = board
            .add_channel(&format!("{TEAM}/{topic}"), doc, layout.descriptor(), store, Access::Output)
            .map_err(|error| error.to_string())?;
        let writer = property.channel().and_then(|channel| channel.writer().ok());
        let writer = writer.ok_or("its property has a writer already")?;
        Ok(Self {
            board: Arc::clone(board),
            property,
            writer,
            layout,
            room,
            head: FactTableHead::default(),
            table: Vec::new(),
            heard: BTreeMap::new(),
            unfit: BTreeMap::new(),
        })
    }

    /// How many facts don't fit.
    pub fn unfit_facts(&self) -> u32 {
        self.head.unfit
    }

    /// Shows what is known at this agent's time `now`, nanoseconds, if it is something else than before.
    pub fn update(&mut self, topic: &str, mut facts: Vec<Known<'_>>, member: &Member, now: u64) {
        let whole = facts.len();
        let schema = self.layout.descriptor().hash;
        let fits = |known: &Known<'_>| {
            let statement = known.fact.statement;
            statement.schema == schema && statement.value.len() == self.layout.value_size()
        };
        let other = facts.iter().filter(|known| !fits(known)).map(|known| known.fact.statement.schema);
        let other: Vec<u64> = other.collect();
        self.unfit.retain(|schema, _| other.contains(schema));
        for other in other {
            let here = self.layout.descriptor();
            self.unfit.entry(other).or_insert_with(|| different(topic, here, member.interface(other), other));
        }
        facts.retain(fits);
        let unfit = whole - facts.len();
        let left_out = facts.len().saturating_sub(self.room);
        facts.truncate(self.room);
        let before = std::mem::take(&mut self.heard);
        let mut head = FactTableHead { left_out: left_out as u32, unfit: unfit as u32, ..self.head };
        let mut table = Vec::with_capacity(self.table.len());
        self.layout.begin(&mut table, &head);
        for Known { key, robot, fact } in &facts {
            let place = ((*key).to_owned(), fact.origin);
            let known = before.get(&place).filter(|(version, _)| *version == fact.version);
            let heard = known.map_or(now, |(_, heard)| *heard);
            self.heard.insert(place, (fact.version, heard));
            let (robot, key, retracted) = texts(robot, key);
            let entry = FactHead {
                epoch: fact.version.epoch,
                sequence: fact.version.sequence,
                time: fact.time,
                order: fact.order,
                heard,
                certainty: fact.statement.certainty,
                origin: fact.origin,
                retracted,
                reserved: [0; 3],
                robot,
                key,
            };
            Layout::append(&mut table, &entry, fact.statement.value);
        }
        // Also an empty one is shown once, so that readers see that there is nothing.
        if table == self.table {
            return;
        }
        self.table.clone_from(&table);
        head.revision += 1;
        let mut begin = Vec::new();
        self.layout.begin(&mut begin, &head);
        table[..begin.len()].copy_from_slice(&begin);
        self.table[..begin.len()].copy_from_slice(&begin);
        self.head = head;
        // It has room for so many.
        let _ = self.writer.write(&table, facts.len(), now);
    }
}

/// What is different about a schema of another robot.
fn different(topic: &str, here: &Descriptor, there: Option<&Descriptor>, schema: u64) -> String {
    let what = there.and_then(|there| difference(here, there));
    let what = what.unwrap_or_else(|| format!("its interface {schema:016x} is not known here"));
    format!("facts about `{topic}` don't fit and are only passed on: {what}")
}

impl Drop for Shown {
    fn drop(&mut self) {
        let path = self.property.path();
        if self.board.get(path).is_some_and(|(found, _)| Arc::ptr_eq(&found, &self.property)) {
            // If somebody was quicker, it is gone all the same.
            let _ = self.board.remove(path);
        }
    }
}
