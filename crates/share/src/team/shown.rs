//! Statements of the team about a topic, as a property of this agent.

use std::sync::Arc;

use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::interface::{Descriptor, View, difference};
use slate_blackboard::{Access, Board, Property, Store};
use slate_interfaces::{FactHead, FactTableHead};
use slate_module::Text;
use slate_runtime::sharing::TEAM;
use slate_sorted::{SortedMap, SortedSet};
use xxhash_rust::xxh3::xxh3_64;

use super::{Layout, Member, TeamFact};
use crate::knowledge::Version;

/// Largest number of unfitting schemas per topic whose difference is reported.
const MAX_REPORTED_SCHEMAS: usize = 8;

/// A topic on the board.
pub(super) struct ShownFacts {
    board: Arc<Board>,
    property: Arc<Property>,
    writer: Writer,
    pub layout: Layout,
    room: usize,
    /// Head of the shown table.
    head: Option<FactTableHead>,
    /// Time since which each fact is known here, by key and robot.
    known_since: SortedMap<(String, u32), (Version, u64)>,
    /// Schemas of unfitting facts whose difference was reported.
    unfit: SortedSet<u64>,
}

impl ShownFacts {
    pub fn new(board: &Arc<Board>, topic: &str, layout: Layout, room: usize) -> Result<Self, String> {
        let store = Store { capacity: room, depth: 1, budget: Budget { latest: 16, queues: 1, window: 4 } };
        let doc = "Statements of the team about a topic.";
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
            head: None,
            known_since: SortedMap::new(),
            unfit: SortedSet::new(),
        })
    }

    /// Returns the number of facts that do not fit.
    pub fn unfit_facts(&self) -> u32 {
        self.head.map_or(0, |head| head.unfit)
    }

    /// Returns whether a fact has a value of the shown interface.
    pub fn fits(&self, known: &TeamFact<'_>) -> bool {
        let statement = known.fact.statement;
        statement.schema == self.layout.descriptor().hash && statement.value.len() == self.layout.value_size()
    }

    /// Shows the facts at this agent's time `now`, ns, if they have changed.
    /// Returns the differences of facts that have not fitted since the last call.
    pub fn update(
        &mut self,
        topic: &str,
        facts: Vec<TeamFact<'_>>,
        member: &Member,
        now: u64,
    ) -> Vec<String> {
        let (mut facts, other): (Vec<_>, Vec<_>) = facts.into_iter().partition(|known| self.fits(known));
        let schemas: SortedSet<u64> = other.iter().map(|known| known.fact.statement.schema).collect();
        self.unfit.retain(|schema| schemas.contains(schema));
        let mut differences = Vec::new();
        for schema in schemas {
            if self.unfit.len() < MAX_REPORTED_SCHEMAS && self.unfit.insert(schema) {
                differences.push(describe_difference(
                    topic,
                    self.layout.descriptor(),
                    member.interface(schema),
                    schema,
                ));
            }
        }
        let left_out = facts.len().saturating_sub(self.room);
        facts.truncate(self.room);
        let before = std::mem::take(&mut self.known_since);
        let mut head = FactTableHead { revision: 0, left_out: left_out as u32, unfit: other.len() as u32 };
        let mut table = View::of(&mut head).bytes().to_vec();
        for TeamFact { key, robot, fact } in &facts {
            let key_and_origin = ((*key).to_owned(), fact.origin);
            let known = before.get(&key_and_origin).filter(|(version, _)| *version == fact.version);
            let heard = known.map_or(now, |(_, heard)| *heard);
            self.known_since.insert(key_and_origin, (fact.version, heard));
            let mut entry = FactHead {
                epoch: fact.version.epoch,
                sequence: fact.version.sequence,
                time: fact.time,
                order: fact.order,
                heard,
                certainty: fact.statement.certainty,
                origin: fact.origin,
                robot: Text::new(robot),
                key: Text::new(key),
                ..FactHead::default()
            };
            table.extend(View::of(&mut entry).bytes());
            table.extend(fact.statement.value);
        }
        // Not a count, as that begins anew with each run, and a world model that was saved continues.
        head.revision = xxh3_64(&table);
        // Also an empty one is shown once, so that readers see that there is nothing.
        if self.head != Some(head) {
            self.head = Some(head);
            let begin = View::of(&mut head).bytes();
            table[..begin.len()].copy_from_slice(begin);
            // It has room for so many.
            let _ = self.writer.write(&table, facts.len(), now);
        }
        differences
    }
}

/// Returns the difference of a schema of another robot.
fn describe_difference(topic: &str, here: &Descriptor, there: Option<&Descriptor>, schema: u64) -> String {
    let what = there.and_then(|there| difference(here, there, ("here", "there")));
    let what = what.unwrap_or_else(|| format!("its interface {schema:016x} is unknown"));
    format!("facts about `{topic}` don't fit and are only passed on: {what}")
}

impl Drop for ShownFacts {
    fn drop(&mut self) {
        let path = self.property.path();
        if self.board.get(path).is_some_and(|(found, _)| Arc::ptr_eq(&found, &self.property)) {
            // Another thread may have removed it.
            let _ = self.board.remove(path);
        }
    }
}
