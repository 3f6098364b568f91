//! Thread of the team's knowledge.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::interface::{Interface, View};
use slate_blackboard::{Access, Board, Store};
use slate_module::{Level, Text};
use slate_runtime::configuration::SharedKnowledge;
use slate_runtime::sharing::{DemandState, RemotePath, SharingHost, Site, TEAM};
use slate_sorted::{SortedMap, SortedSet};

use super::shown_topics::ShownTopics;
use super::stated_topic::StatedTopic;
use super::{Member, SavedKnowledge, TeamEvent, TeamInbox, TeamRequests, TeamRoute, TeamState, Topics};
use crate::peers::{Clock, Peers, lock};

/// Saving period, ns.
const SAVE_PERIOD: u64 = 10_000_000_000;

/// Shortest period between updates of the board, ns.
const BOARD_PERIOD: u64 = 20_000_000;

pub(super) struct TeamWork {
    member: Member,
    peers: Arc<Peers>,
    inbox: Arc<TeamInbox>,
    host: SharingHost,
    board: Arc<Board>,
    /// Clock of the values, and monotonic clock.
    time: Clock,
    steady: Clock,
    stated: Vec<StatedTopic>,
    topics: Topics,
    shown_topics: ShownTopics,
    /// Routes to other robots; each robot has at least one.
    routes: SortedMap<String, SortedSet<TeamRoute>>,
    reported: SortedMap<String, DemandState>,
    period: u64,
    saved: Option<SavedKnowledge>,
    /// Time of the next save, and flag of unsaved changes.
    saves_at: u64,
    unsaved: bool,
    state: TeamState,
    state_writer: Option<Writer>,
    /// Subjects already logged, so none is logged twice.
    logged: Vec<String>,
}

impl TeamWork {
    pub fn new(
        site: &Site,
        knowledge: SharedKnowledge,
        peers: Arc<Peers>,
        inbox: Arc<TeamInbox>,
        random: u32,
    ) -> Self {
        let own = site.board.agent();
        let mut saved = knowledge.save.map(|folder| SavedKnowledge::new(&folder, own));
        let (member, error) = saved.as_mut().map_or((None, None), |saved| saved.restore(own, random));
        // Nothing else can be refused than what was saved.
        let member = member.or_else(|| Member::new(own, random, None).ok());
        let member = member.unwrap_or_else(|| unreachable!("a robot that restores nothing is not refused"));
        if let Some(error) = error {
            site.host.log(Level::Error, &error);
        }
        let store = Store { capacity: 0, depth: 1, budget: Budget { latest: 8, queues: 1, window: 4 } };
        let doc = "This robot's part in the knowledge of its team.";
        let state =
            site.board.add_channel("share/knowledge", doc, TeamState::DESCRIPTOR, store, Access::Output);
        let state_writer =
            state.ok().and_then(|state| state.channel().and_then(|channel| channel.writer().ok()));
        Self {
            state: TeamState { robot: member.replica().robot(), ..TeamState::default() },
            member,
            peers,
            inbox,
            host: site.host.clone(),
            board: Arc::clone(&site.board),
            time: Arc::clone(&site.time),
            steady: Arc::clone(&site.steady),
            stated: knowledge
                .facts
                .iter()
                .map(|(topic, path)| StatedTopic::new(topic, &path.value))
                .collect(),
            topics: Topics::new(),
            shown_topics: ShownTopics::new(&site.board, knowledge.room),
            routes: SortedMap::new(),
            reported: SortedMap::new(),
            period: knowledge.period,
            saved,
            saves_at: 0,
            unsaved: false,
            state_writer,
            logged: Vec::new(),
        }
    }

    pub fn run(&mut self, requests: &TeamRequests) {
        let mut next = 0;
        // Restored facts are published at once.
        let (mut changed, mut shows_at) = (true, 0);
        while !requests.ended.load(Ordering::Acquire) {
            if let Some(topics) = lock(&requests.topics).take() {
                self.topics = topics;
                self.reported.retain(|topic, _| self.topics.contains_key(topic));
                changed = true;
            }
            for news in self.inbox.take() {
                self.take(news);
            }
            let now = (self.steady)();
            let is_due = now >= next;
            if is_due {
                next = now + self.period;
                let (time, date) = ((self.time)(), date());
                self.stated
                    .iter_mut()
                    .for_each(|stated| stated.forward(&self.board, &mut self.member, time, date));
                self.member.tick();
            }
            self.send();
            if self.member.take_changed() {
                (changed, self.unsaved) = (true, true);
            }
            if changed && now >= shows_at {
                (changed, shows_at) = (false, now + BOARD_PERIOD);
                self.update_board();
            }
            if is_due {
                self.publish();
                self.save(now);
            }
            let next_check = if changed { next.min(shows_at) } else { next };
            let left = next_check.saturating_sub((self.steady)());
            requests.wake.wait_timeout(Duration::from_nanos(left.max(1)));
        }
        self.saves_at = 0;
        self.save(u64::MAX);
    }

    fn take(&mut self, news: TeamEvent) {
        match news {
            TeamEvent::Connected(agent, route) => {
                self.routes.entry(agent.clone()).or_default().insert(route);
                if let Err(error) = self.member.add_neighbor(&agent) {
                    self.log(Level::Error, &error, &error);
                }
            }
            TeamEvent::Disconnected(agent, route) => {
                let Some(routes) = self.routes.get_mut(&agent) else { return };
                routes.remove(&route);
                if routes.is_empty() {
                    self.routes.remove(&agent);
                    self.member.remove_neighbor(&agent);
                }
            }
            TeamEvent::Message(agent, message) => {
                self.state.received += 1;
                if let Err(error) = self.member.receive(&agent, &message) {
                    self.state.refused += 1;
                    // In another message it is wrong in another place.
                    let text = format!("the team message of `{agent}` is {error}");
                    self.log(Level::Warn, &agent, &text);
                }
            }
        }
    }

    fn send(&mut self) {
        let carrier = self.inbox.carrier();
        while let Some((agent, message)) = self.member.outgoing() {
            let is_carried = || carrier.as_ref().is_some_and(|carrier| carrier.send(agent, &message));
            if self.peers.send_knowledge(agent, &message) || is_carried() {
                self.state.sent += 1;
            } else {
                self.state.dropped += 1;
            }
        }
    }

    /// Updates the topics on the board.
    fn update_board(&mut self) {
        let now = (self.time)();
        let result = self.shown_topics.update(&self.member, &self.topics, &self.stated, now);
        let (facts, unfit, unshown) = (result.facts, result.unfit, result.unshown);
        self.state = TeamState { facts, unfit, unshown, ..self.state };
        result.errors.iter().for_each(|error| self.host.log(Level::Warn, error));
        for (topic, placed) in result.topics {
            match placed {
                Ok(is_another) => {
                    if is_another {
                        let reason = "it looks otherwise from now on".to_owned();
                        self.report(&topic, DemandState::Absent { reason });
                    }
                    self.report(&topic, DemandState::Served { property: topic.clone() });
                }
                Err(reason) => self.report(&topic, DemandState::Absent { reason }),
            }
        }
        self.host.news();
    }

    /// Reports the status of a topic that the agent reads.
    fn report(&mut self, topic: &str, state: DemandState) {
        if self.topics.contains_key(topic) && self.reported.get(topic) != Some(&state) {
            self.reported.insert(topic.to_owned(), state.clone());
            self.host.report(&RemotePath { agent: TEAM.into(), path: topic.into() }, state);
        }
    }

    fn publish(&mut self) {
        let counters = self.member.counters();
        if counters.contested {
            let name = self.member.name();
            let text = format!(
                "another robot has the number of `{name}`, and the team does not agree on its facts: rename one of them"
            );
            self.log(Level::Error, &text, &text);
        }
        let errors = self.stated.iter().filter_map(|stated| stated.error.clone());
        let errors: Vec<String> = errors.collect();
        let error = errors.first().cloned().unwrap_or_default();
        errors.into_iter().for_each(|text| self.log(Level::Warn, &text, &text));
        let state = TeamState {
            bytes: self.member.replica().memory() as u64,
            neighbours: self.member.neighbors() as u32,
            contested: counters.contested.into(),
            trouble: Text::new(&error),
            ..self.state
        };
        let mut whole = TeamState {
            dropped: state.dropped + counters.dropped,
            refused: state.refused + counters.refused,
            ..state
        };
        self.state = state;
        if let Some(writer) = &mut self.state_writer {
            // Nothing blocks a writer on the wall clock.
            let _ = writer.write(View::of(&mut whole).bytes(), 0, (self.time)());
        }
    }

    fn save(&mut self, now: u64) {
        let Some(saved) = self.saved.clone().filter(|_| self.unsaved && now >= self.saves_at) else { return };
        self.saves_at = now.saturating_add(SAVE_PERIOD);
        match saved.save(&self.member) {
            Ok(()) => self.unsaved = false,
            Err(error) => {
                let file = saved.file().display();
                let text = format!("the knowledge of the team can't be saved to {file}: {error}");
                self.log(Level::Error, &text, &text);
            }
        }
    }

    /// Logs a text, once per subject.
    fn log(&mut self, level: Level, subject: &str, text: &str) {
        if self.logged.iter().any(|logged| logged == subject) {
            return;
        }
        self.host.log(level, text);
        if self.logged.len() == MAX_LOGGED_SUBJECTS {
            self.logged.remove(0);
        }
        self.logged.push(subject.to_owned());
    }
}

/// Largest number of remembered subjects.
const MAX_LOGGED_SUBJECTS: usize = 64;

/// Returns the calendar time, ns since 1970.
/// Statements travel between robots and starts, so they use it.
#[allow(clippy::disallowed_methods, reason = "no clock of an agent means anything to another one")]
fn date() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}
