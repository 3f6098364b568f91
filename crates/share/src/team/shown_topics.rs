//! Topics on this agent's board, and their layouts.

use std::sync::Arc;

use slate_blackboard::Board;
use slate_runtime::sharing::is_topic;
use slate_sorted::{SortedMap, SortedSet};

use super::shown::ShownFacts;
use super::stated_topic::StatedTopic;
use super::{Layout, Member, TeamFact, Topics};

/// Largest number of shown topics that are neither read nor stated here.
/// Topics of other robots have no other limit.
const MAX_UNUSED_TOPICS: usize = 64;

/// Topics on the board.
pub(super) struct ShownTopics {
    board: Arc<Board>,
    room: usize,
    shown: SortedMap<String, ShownFacts>,
    /// Reasons why topics can't be shown.
    errors: SortedMap<String, String>,
}

/// Result of an update.
#[derive(Default)]
pub(super) struct TopicUpdate {
    /// Number of known facts.
    pub facts: u64,
    /// Facts that are not on the board, except unfitting ones.
    pub unshown: u64,
    /// Facts that do not fit the interface of their topic.
    pub unfit: u64,
    /// Topics that are used here or shown, or the reason against showing.
    /// True if it replaces one with another layout.
    pub topics: Vec<(String, Result<bool, String>)>,
    /// New problems, for the log.
    pub errors: Vec<String>,
}

impl ShownTopics {
    pub fn new(board: &Arc<Board>, room: usize) -> Self {
        Self { board: Arc::clone(board), room, shown: SortedMap::new(), errors: SortedMap::new() }
    }

    /// Shows the known facts at this agent's time `now`, ns.
    pub fn update(
        &mut self,
        member: &Member,
        read: &Topics,
        stated: &[StatedTopic],
        now: u64,
    ) -> TopicUpdate {
        let mut known = member.known();
        let mut result = TopicUpdate { facts: count(&known), ..TopicUpdate::default() };
        let mut errors = SortedMap::new();
        for topic in self.choose(&known, read, stated) {
            let facts = known.remove(topic.as_str()).unwrap_or_default();
            let layout = self.layout(&topic, &facts, member, read, stated);
            let placed = self.place(&topic, layout);
            if let Err(reason) = &placed {
                if self.errors.get(&topic) != Some(reason) {
                    result.errors.push(format!("team/{topic}: {reason}"));
                }
                errors.insert(topic.clone(), reason.clone());
            }
            match self.shown.get_mut(&topic) {
                Some(shown) => {
                    result.errors.extend(shown.update(&topic, facts, member, now));
                    result.unfit += u64::from(shown.unfit_facts());
                }
                None => result.unshown += facts.len() as u64,
            }
            result.topics.push((topic, placed));
        }
        self.errors = errors;
        result.unshown += count(&known);
        result
    }

    /// Selects all topics that are used here, and others as far as there is room.
    /// Of the others, those already shown come first.
    fn choose(
        &mut self,
        known: &SortedMap<&str, Vec<TeamFact<'_>>>,
        read: &Topics,
        stated: &[StatedTopic],
    ) -> SortedSet<String> {
        let stated = stated.iter().map(|stated| stated.topic.clone());
        let used: SortedSet<String> = read.keys().cloned().chain(stated).collect();
        let unused = |shown: &SortedMap<String, ShownFacts>| {
            shown.keys().filter(|topic| !used.contains(*topic)).count()
        };
        if unused(&self.shown) >= MAX_UNUSED_TOPICS {
            // Drops empty topics.
            self.shown.retain(|topic, _| used.contains(topic) || known.contains_key(topic.as_str()));
        }
        let room = MAX_UNUSED_TOPICS.saturating_sub(unused(&self.shown));
        let is_new =
            |topic: &&str| is_topic(topic) && !used.contains(*topic) && !self.shown.contains_key(*topic);
        let new = known.keys().copied().filter(is_new).take(room).map(str::to_owned);
        self.shown.keys().cloned().chain(new).chain(used.iter().cloned()).collect()
    }

    /// Determines the layout of the table of a topic.
    /// Precedence: readers here, statements here, statements of other robots.
    fn layout(
        &self,
        topic: &str,
        facts: &[TeamFact<'_>],
        member: &Member,
        read: &Topics,
        stated: &[StatedTopic],
    ) -> Result<Layout, String> {
        if let Some(descriptor) = read.get(topic).copied().flatten() {
            return Layout::of(descriptor);
        }
        let own = stated.iter().find(|stated| stated.topic == topic);
        if let Some(table) = own.and_then(|own| own.table(&self.board)) {
            return table.map(|(_, layout)| layout);
        }
        // Robots of several versions may differ, and the layout shown here must not alternate.
        if let Some(shown) = self.shown.get(topic)
            && (facts.is_empty() || facts.iter().any(|known| shown.fits(known)))
        {
            return Ok(shown.layout);
        }
        let mut seen = SortedSet::new();
        let schemas = facts.iter().map(|known| known.fact.statement.schema);
        let mut schemas = schemas.filter(|schema| seen.insert(*schema));
        match schemas.find_map(|schema| member.interface(schema)) {
            Some(descriptor) => Layout::of(descriptor),
            None => Err("it is not known yet what facts about it look like".into()),
        }
    }

    /// Puts a topic on the board unless it is there.
    /// Returns whether it replaces one with another layout.
    fn place(&mut self, topic: &str, layout: Result<Layout, String>) -> Result<bool, String> {
        let layout = match (layout, self.shown.get(topic)) {
            // It keeps its layout when no robot announces it any more.
            (Err(_), Some(_)) => return Ok(false),
            (layout, _) => layout?,
        };
        let is_same = |shown: &ShownFacts| shown.layout.descriptor().hash == layout.descriptor().hash;
        if self.shown.get(topic).is_some_and(is_same) {
            return Ok(false);
        }
        let was_there = self.shown.remove(topic).is_some();
        self.shown.insert(topic.to_owned(), ShownFacts::new(&self.board, topic, layout, self.room)?);
        Ok(was_there)
    }
}

fn count(known: &SortedMap<&str, Vec<TeamFact<'_>>>) -> u64 {
    known.values().map(|facts| facts.len() as u64).sum()
}
