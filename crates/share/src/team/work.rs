//! Thread of the team's knowledge.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::interface::{Interface, View};
use slate_blackboard::{Access, Board, Store};
use slate_module::{Level, Text};
use slate_runtime::configuration::SharedKnowledge;
use slate_runtime::sharing::{RemotePath, SharingHost, Site, Standing, TEAM};

use super::showing::Showing;
use super::stating::Stating;
use super::{Member, SavedKnowledge, TeamInbox, TeamNews, TeamPost, TeamRoute, TeamState, Topics};
use crate::peers::{Clock, Peers, locked};

/// Saving period, ns.
const SAVING: u64 = 10_000_000_000;

/// Shortest period between updates of the board, ns.
const SHOWING: u64 = 20_000_000;

pub(super) struct TeamWork {
    member: Member,
    peers: Arc<Peers>,
    inbox: Arc<TeamInbox>,
    host: SharingHost,
    board: Arc<Board>,
    /// Clock of the values, and monotonic clock.
    time: Clock,
    steady: Clock,
    stating: Vec<Stating>,
    topics: Topics,
    showing: Showing,
    /// Routes to other robots; each robot has at least one.
    routes: BTreeMap<String, BTreeSet<TeamRoute>>,
    told: BTreeMap<String, Standing>,
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
        let (member, trouble) = saved.as_mut().map_or((None, None), |saved| saved.restore(own, random));
        // Nothing else can be refused than what was saved.
        let member = member.or_else(|| Member::new(own, random, None).ok());
        let member = member.unwrap_or_else(|| unreachable!("a robot that restores nothing is not refused"));
        if let Some(trouble) = trouble {
            site.host.log(Level::Error, &trouble);
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
            stating: knowledge.facts.iter().map(|(topic, path)| Stating::new(topic, &path.value)).collect(),
            topics: Topics::new(),
            showing: Showing::new(&site.board, knowledge.room),
            routes: BTreeMap::new(),
            told: BTreeMap::new(),
            period: knowledge.period,
            saved,
            saves_at: 0,
            unsaved: false,
            state_writer,
            logged: Vec::new(),
        }
    }

    pub fn run(&mut self, post: &TeamPost) {
        let mut next = 0;
        // What was restored is shown at once.
        let (mut changed, mut shows_at) = (true, 0);
        while !post.ended.load(Ordering::Acquire) {
            if let Some(topics) = locked(&post.topics).take() {
                self.topics = topics;
                self.told.retain(|topic, _| self.topics.contains_key(topic));
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
                self.stating
                    .iter_mut()
                    .for_each(|stating| stating.look(&self.board, &mut self.member, time, date));
                self.member.tick();
            }
            self.send();
            if self.member.take_changed() {
                (changed, self.unsaved) = (true, true);
            }
            if changed && now >= shows_at {
                (changed, shows_at) = (false, now + SHOWING);
                self.show();
            }
            if is_due {
                self.publish();
                self.save(now);
            }
            let next_look = if changed { next.min(shows_at) } else { next };
            let left = next_look.saturating_sub((self.steady)());
            post.wake.wait_timeout(Duration::from_nanos(left.max(1)));
        }
        self.saves_at = 0;
        self.save(u64::MAX);
    }

    fn take(&mut self, news: TeamNews) {
        match news {
            TeamNews::Connected(agent, route) => {
                self.routes.entry(agent.clone()).or_default().insert(route);
                if let Err(trouble) = self.member.meet(&agent) {
                    self.log(Level::Error, &trouble, &trouble);
                }
            }
            TeamNews::Disconnected(agent, route) => {
                let Some(routes) = self.routes.get_mut(&agent) else { return };
                routes.remove(&route);
                if routes.is_empty() {
                    self.routes.remove(&agent);
                    self.member.part(&agent);
                }
            }
            TeamNews::Told(agent, message) => {
                self.state.received += 1;
                if let Err(error) = self.member.hear(&agent, &message) {
                    self.state.refused += 1;
                    // In another message it is wrong in another place.
                    let text = format!("what `{agent}` tells of the team's knowledge is {error}");
                    self.log(Level::Warn, &agent, &text);
                }
            }
        }
    }

    fn send(&mut self) {
        let carrier = self.inbox.carrier();
        while let Some((agent, message)) = self.member.outgoing() {
            let is_carried = || carrier.as_ref().is_some_and(|carrier| carrier.tell(agent, &message));
            if self.peers.tell(agent, &message) || is_carried() {
                self.state.sent += 1;
            } else {
                self.state.dropped += 1;
            }
        }
    }

    /// Updates the topics on the board.
    fn show(&mut self) {
        let now = (self.time)();
        let sight = self.showing.update(&self.member, &self.topics, &self.stating, now);
        let (facts, unfit, unshown) = (sight.facts, sight.unfit, sight.unshown);
        self.state = TeamState { facts, unfit, unshown, ..self.state };
        sight.troubles.iter().for_each(|trouble| self.host.log(Level::Warn, trouble));
        for (topic, placed) in sight.topics {
            match placed {
                Ok(is_another) => {
                    if is_another {
                        let reason = "it looks otherwise from now on".to_owned();
                        self.tell(&topic, Standing::Absent { reason });
                    }
                    self.tell(&topic, Standing::Served { property: topic.clone() });
                }
                Err(reason) => self.tell(&topic, Standing::Absent { reason }),
            }
        }
        self.host.news();
    }

    /// Reports the status of a topic that the agent reads.
    fn tell(&mut self, topic: &str, standing: Standing) {
        if self.topics.contains_key(topic) && self.told.get(topic) != Some(&standing) {
            self.told.insert(topic.to_owned(), standing.clone());
            self.host.report(&RemotePath { agent: TEAM.into(), path: topic.into() }, standing);
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
        let troubles = self.stating.iter().filter_map(|stating| stating.trouble.clone());
        let troubles: Vec<String> = troubles.collect();
        let trouble = troubles.first().cloned().unwrap_or_default();
        troubles.into_iter().for_each(|text| self.log(Level::Warn, &text, &text));
        let state = TeamState {
            bytes: self.member.replica().memory() as u64,
            neighbours: self.member.neighbours() as u32,
            contested: counters.contested.into(),
            trouble: Text::new(&trouble),
            ..self.state
        };
        let mut whole = TeamState {
            dropped: state.dropped + counters.dropped,
            refused: state.refused + counters.refused,
            ..state
        };
        self.state = state;
        if let Some(writer) = &mut self.state_writer {
            // Nobody holds a writer up on the wall clock.
            let _ = writer.write(View::of(&mut whole).bytes(), 0, (self.time)());
        }
    }

    fn save(&mut self, now: u64) {
        let Some(saved) = self.saved.clone().filter(|_| self.unsaved && now >= self.saves_at) else { return };
        self.saves_at = now.saturating_add(SAVING);
        match saved.save(&self.member) {
            Ok(()) => self.unsaved = false,
            Err(error) => {
                let file = saved.file().display();
                let text = format!("what the team knows can't be saved to {file}: {error}");
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
        if self.logged.len() == LOGGED {
            self.logged.remove(0);
        }
        self.logged.push(subject.to_owned());
    }
}

/// Largest number of remembered subjects.
const LOGGED: usize = 64;

/// Returns the calendar time, ns since 1970.
/// Statements travel between robots and starts, so they use it.
#[allow(clippy::disallowed_methods, reason = "no clock of an agent means anything to another one")]
fn date() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}
