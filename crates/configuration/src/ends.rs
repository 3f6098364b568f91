//! What links and other agents are called.

use slate_blackboard::Url;
use toml_edit::Key;

use super::diagnostic::{Diagnostic, Report};
use super::mistake::{Message, Mistake};
use super::team::TEAM;
use super::{Configuration, Link};

/// The path of a link in the configuration.
pub fn link_setting(to: &str) -> String {
    format!("links.{}", Key::new(to).display_repr())
}

/// The path of one of the senders of an inbox.
pub fn sender_setting(to: &str, from: &str) -> String {
    format!("{}.{}", link_setting(to), Key::new(from).display_repr())
}

impl Configuration {
    /// What a link says beside its ends, as it is written.
    pub fn link_options(&self, link: &Link) -> Vec<(String, String)> {
        let of_sender = sender_setting(&link.to.value, &link.from.value.to_string());
        let is_sender = self.value(&of_sender).is_some();
        let path = if is_sender { of_sender } else { link_setting(&link.to.value) };
        let depth = Key::parse(&path).map_or(0, |keys| keys.len());
        let options = self.settings(&path).unwrap_or_default().into_iter();
        let named = options.filter_map(|option| {
            let keys = Key::parse(&option.path).ok()?;
            let name = keys.get(depth).filter(|key| key.get() != "from")?;
            Some((name.get().to_owned(), option.value.to_string()))
        });
        named.collect()
    }

    /// The path in this agent that a text means.
    ///
    /// # Errors
    /// When it is no URL, or that of another agent.
    pub fn own_path(&self, text: &str) -> Result<String, Report> {
        let refusal = |message: Message, help: &str| {
            Report::from(Diagnostic::without_place(message, Some(help.into())))
        };
        let help = "a property is module/property, /module/property or slate://agent/module/property";
        let url = Url::parse(text).map_err(|error| refusal(Mistake::Value.of(error.to_string()), help))?;
        match url.agent() {
            Some(TEAM) => Ok(format!("{TEAM}/{}", url.path_in(""))),
            Some(agent) if agent != self.agent_name() => {
                let message = Mistake::OtherAgent
                    .of(format!("`{text}` belongs to agent `{agent}`, and this is `{}`", self.agent_name()));
                Err(refusal(message, &format!("ask that agent: --agent {agent}")))
            }
            _ => Ok(url.path_in("")),
        }
    }

    /// The parameters that links fill, all or in part, each behind its module.
    pub fn linked_parameters(&self) -> impl Iterator<Item = (&str, &str)> {
        self.links().iter().filter_map(|link| {
            let (module, rest) = link.to.value.split_once("/params/")?;
            Some((module, rest.split('/').next()?))
        })
    }

    /// Where another agent is found.
    pub fn endpoint_of(&self, agent: &str) -> String {
        let named = self.share().and_then(|share| share.agents.get(agent));
        named.map_or_else(|| format!("local:{agent}"), |at| at.value.clone())
    }
}
