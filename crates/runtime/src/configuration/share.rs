use std::collections::BTreeMap;

use super::build::Build;
use super::model::Share;
use super::source::Spanned;
use super::value::Table;

impl Build<'_> {
    /// How the agent shares; nothing when it says nothing of it.
    pub(super) fn share(&mut self, root: &Table, agent: &str) -> Option<Share> {
        let entry = root.entries.get("share")?;
        let table = self.problems.as_table("share", entry)?;
        self.problems.unknown_keys(table, "in [share]", &["listen", "agents"]);
        let listen = match table.get("listen") {
            Some(_) => self.problems.text(table, "listen", "local:base").filter(|at| self.endpoint(at))?,
            None => Spanned::new(format!("local:{agent}"), entry.key),
        };
        let mut agents = BTreeMap::new();
        let others = self.problems.table(table, "agents");
        for (name, entry) in others.into_iter().flat_map(Table::iter) {
            self.problems.agent_name(name, entry.key);
            let Some(table) = self.problems.as_table(&format!("share.agents.{name}"), entry) else {
                continue;
            };
            self.problems.unknown_keys(table, &format!("of agent `{name}`"), &["at"]);
            if let Some(at) = self.problems.text(table, "at", "local:base").filter(|at| self.endpoint(at)) {
                agents.insert(name.to_owned(), at);
            }
        }
        // A table for all agents has this one too.
        agents.remove(agent);
        Some(Share { listen, agents })
    }

    fn endpoint(&mut self, at: &Spanned<String>) -> bool {
        let good = at.value.split_once(':').is_some_and(|(carrier, rest)| {
            !carrier.is_empty() && !rest.is_empty() && carrier.chars().all(|c| c.is_ascii_alphanumeric())
        });
        if !good {
            let help = "an endpoint is a carrier and a place, such as local:base";
            self.problems.add(at.span, format!("`{}` is no endpoint", at.value), help);
        }
        good
    }
}
