use slate_blackboard::Pattern;
use slate_sorted::SortedMap;

use super::model::{Allowance, Credentials, Share, ShareSecurity, SharedKnowledge};
use super::problems::Problems;
use super::source::{Sources, Span, Spanned};
use super::value::{Table, TableEntry};
use crate::error_code::ErrorCode;
use crate::team::is_topic;

/// Default and minimum polling interval for changes, ns.
const PERIOD: u64 = 200_000_000;
const SHORTEST: u64 = 10_000_000;

/// Default number of facts of a topic that are shown.
const DEFAULT_FACT_CAPACITY: usize = 256;

/// Reader of `[share]`.
pub(super) struct ShareReader<'a> {
    pub(super) sources: &'a Sources,
    pub(super) problems: &'a mut Problems,
    pub(super) agent: &'a str,
}

impl ShareReader<'_> {
    /// Reads the sharing of the agent; `None` without such a section.
    pub(super) fn share(&mut self, root: &Table) -> Option<Share> {
        let agent = self.agent;
        let entry = root.entries.get("share")?;
        let table = self.problems.as_table("share", entry)?;
        self.problems.unknown_keys(table, "in [share]", &["listen", "agents", "knowledge", "security"]);
        let listen = match table.get("listen") {
            Some(value) => {
                let texts = self.problems.texts("listen", value, "local:base");
                if texts.is_empty() && value.as_list().is_some_and(<[_]>::is_empty) {
                    let help = "name at least one; without [share] no other agent finds this one";
                    self.problems.add(value.span, "`listen` names no endpoint", help);
                }
                texts.into_iter().filter(|at| self.endpoint(at)).collect()
            }
            None => vec![Spanned::new(format!("local:{agent}"), entry.key)],
        };
        let security = table.entries.get("security").and_then(|entry| self.share_security(entry));
        let mut agents = SortedMap::new();
        let others = self.problems.table(table, "agents");
        for (name, entry) in others.into_iter().flat_map(Table::iter) {
            self.problems.agent_name(name, entry.key);
            let Some(table) = self.problems.as_table(&format!("share.agents.{name}"), entry) else {
                continue;
            };
            self.problems.unknown_keys(table, &format!("of agent `{name}`"), &["at"]);
            let at = match table.get("at") {
                Some(_) => self.problems.text(table, "at", "local:base").filter(|at| self.endpoint(at)),
                None => Some(Spanned::new(format!("local:{name}"), entry.key)),
            };
            agents.extend(at.map(|at| (name.to_owned(), at)));
        }
        // A table for all agents has this one too.
        agents.remove(agent);
        let knowledge = self.knowledge(table);
        Some(Share { listen, agents, knowledge, security })
    }

    fn knowledge(&mut self, share: &Table) -> Option<SharedKnowledge> {
        let agent = self.agent;
        let table = match share.get("knowledge")?.as_bool() {
            // An agent of a team that takes no part, where others do.
            Some(false) => return None,
            _ => self.problems.table(share, "knowledge")?,
        };
        let known = ["facts", "period", "room", "save"];
        self.problems.unknown_keys(table, "in [share.knowledge]", &known);
        let mut facts = SortedMap::new();
        for (topic, entry) in self.problems.table(table, "facts").into_iter().flat_map(Table::iter) {
            let property = self.problems.as_text(topic, &entry.value, "scout/found");
            if self.topic(topic, entry.key)
                && let Some(property) = property
                && let Some(url) = self.problems.url(&property.value, property.span)
            {
                if url.agent().is_some_and(|other| other != agent) {
                    let help = "name the output of a block of this agent: \"block/output\"";
                    let message = format!("`{url}` is not of agent `{agent}`, which states its own facts");
                    self.problems.add(property.span, message, help);
                }
                facts.insert(topic.to_owned(), Spanned::new(url.path_in(""), property.span));
            }
        }
        let period = self.problems.duration(table, "period");
        if let Some(period) = period.filter(|period| period.value < SHORTEST) {
            let help = "the shortest is 10ms; 200ms is usual";
            self.problems.add(period.span, "`period` is too short", help);
        }
        Some(SharedKnowledge {
            facts,
            period: period.map_or(PERIOD, |period| period.value),
            room: self
                .problems
                .count_from_one(table, "room", 65_536)
                .map_or(DEFAULT_FACT_CAPACITY, |room| room.value as usize),
            save: self
                .problems
                .text(table, "save", "knowledge")
                .map(|folder| self.sources.beside(&folder).value),
        })
    }

    fn topic(&mut self, topic: &str, span: Span) -> bool {
        let good = is_topic(topic);
        if !good {
            let help = "a topic is at most 48 small letters, digits and _, as in slate://team/victims";
            self.problems.add(span, format!("`{topic}` can't be a topic of facts"), help);
        }
        good
    }

    fn share_security(&mut self, entry: &TableEntry) -> Option<ShareSecurity> {
        let table = self.problems.as_table("share.security", entry)?;
        let files = ["certificate", "key", "authority"];
        self.problems.unknown_keys(table, "in [share.security]", &[&files[..], &["allow"]].concat());
        let given = files.iter().filter(|name| table.get(name).is_some()).count();
        let mut file = |name: &str| {
            let Some(value) = table.get(name) else {
                if given > 0 {
                    let help = "`certificate`, `key` and `authority` belong together";
                    self.problems.add(entry.key, format!("[share.security] lacks `{name}`"), help);
                }
                return None;
            };
            let text = self.problems.as_text(name, value, &format!("keys/{name}.pem"))?;
            Some(self.sources.beside(&text))
        };
        let [certificate, key, authority] = files.map(&mut file);
        let credentials = certificate
            .zip(key)
            .zip(authority)
            .map(|((certificate, key), authority)| Credentials { certificate, key, authority });
        let allow = table.entries.get("allow").and_then(|entry| {
            let agents = self.problems.as_table("share.security.allow", entry)?;
            let each = agents
                .iter()
                .filter_map(|(name, entry)| Some((name.to_owned(), self.allowance(name, entry)?)));
            Some(each.collect())
        });
        if given == 0 && table.get("allow").is_none() && !table.entries.contains_key("allow") {
            let help =
                "give `certificate`, `key` and `authority`, or a table `allow`, or take the section away";
            self.problems.add(entry.key, "[share.security] is empty", help);
        }
        Some(ShareSecurity { place: entry.key, credentials, allow })
    }

    fn allowance(&mut self, agent: &str, entry: &TableEntry) -> Option<Allowance> {
        self.problems.agent_name(agent, entry.key);
        let name = format!("share.security.allow.{agent}");
        let table = self.problems.as_table(&name, entry)?;
        self.problems.unknown_keys(table, &format!("in [{name}]"), &["read", "send", "team"]);
        let mut patterns = |name: &str| {
            let texts = table.get(name).map(|value| self.problems.texts(name, value, "localizer/**"));
            let mut patterns = Vec::new();
            for text in texts.into_iter().flatten() {
                match Pattern::parse(&text.value) {
                    Ok(pattern) => patterns.push(pattern),
                    Err(error) => self.problems.add(text.span, error.to_string(), "such as \"localizer/**\""),
                }
            }
            patterns
        };
        let (read, send) = (patterns("read"), patterns("send"));
        let team = self.problems.flag(table, "team").is_some_and(|flag| flag.value);
        Some(Allowance { read, send, team })
    }

    fn endpoint(&mut self, at: &Spanned<String>) -> bool {
        let good = at.value.split_once(':').is_some_and(|(carrier, rest)| {
            !carrier.is_empty() && !rest.is_empty() && carrier.chars().all(|c| c.is_ascii_alphanumeric())
        });
        if !good {
            let help = "an endpoint is a carrier and a place, such as local:base";
            self.problems.add(
                at.span,
                ErrorCode::OtherAgent.of(format!("`{}` is not an endpoint", at.value)),
                help,
            );
        }
        good
    }
}
