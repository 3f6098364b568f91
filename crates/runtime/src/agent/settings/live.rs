//! Settings that may change while an agent runs.

use slate_blackboard::is_within;
use slate_sorted::SortedSet;

use super::super::links::unchanging;
use slate_configuration::{Change, Configuration, Diagnostic, ExternalLink, Variant};

/// Setting that may change while the agent runs.
pub(super) enum LiveSetting<'a> {
    Parameter { module: &'a str, name: &'a str },
    Enabled { module: &'a str },
    Input { module: &'a str, port: &'a str },
    Link,
    LogLevel,
}

impl<'a> LiveSetting<'a> {
    pub fn of(change: &'a Change) -> Option<Self> {
        let names: Vec<&str> = change.names().iter().map(String::as_str).collect();
        match names[..] {
            ["modules", module, "params", name, ..] => Some(Self::Parameter { module, name }),
            ["modules", module, "enabled"] => Some(Self::Enabled { module }),
            ["modules", module, "inputs", port, ..] => Some(Self::Input { module, port }),
            ["links", _, ..] => Some(Self::Link),
            ["log", "level"] | ["log", "levels", _] => Some(Self::LogLevel),
            _ => None,
        }
    }
}

const LATER: &str = "it takes effect at the next start: write it into the file, and start the agent again";

/// Two configurations, and the modules that only one of them has.
pub(super) struct OtherModules<'a> {
    before: &'a Configuration,
    after: &'a Configuration,
    modules: SortedSet<&'a str>,
}

impl<'a> OtherModules<'a> {
    pub fn of(before: &'a Configuration, after: &'a Configuration) -> Self {
        let names = |configuration: &'a Configuration| -> SortedSet<&'a str> {
            configuration.modules().iter().map(|module| module.name.value.as_str()).collect()
        };
        let (old, new) = (names(before), names(after));
        let modules = old.difference(&new).chain(new.difference(&old)).copied().collect();
        Self { before, after, modules }
    }

    /// Returns true if a change belongs to one of these modules.
    fn have(&self, change: &Change) -> bool {
        matches!(change.names(), [section, module, ..] if section == "modules" && self.modules.contains(module.as_str()))
    }

    /// Returns true if a change is one of a link from or to one of these modules.
    fn touches(&self, change: &Change) -> bool {
        let [section, port, ..] = change.names() else { return false };
        let of_module = |end: &str| {
            self.modules
                .iter()
                .any(|module| end.strip_prefix(module).is_some_and(|rest| rest.starts_with('/')))
        };
        let links = self.before.links().iter().chain(self.after.links());
        let mut ends = links.map(|link| [link.from.value.path_in(""), link.to.value.clone()]);
        section == "links" && ends.any(|ends| ends.contains(port) && ends.iter().any(|end| of_module(end)))
    }

    /// Returns true if a change chooses another variant, or changes one.
    fn chooses(&self, change: &Change) -> bool {
        let [first, rest @ ..] = change.names() else { return false };
        first == "choices"
            || (rest.is_empty() && Variant::chosen(self.after).any(|variant| variant.choice == first))
    }

    /// Returns why a running agent can't make a change, with the remedy.
    fn obstacle(&self, change: &Change) -> Option<(String, String)> {
        let path = &change.path;
        let linked = |configuration: &Configuration, input: &str| {
            configuration.links().iter().any(|link| link.to.value == input)
        };
        match LiveSetting::of(change) {
            Some(LiveSetting::Parameter { module, name }) => {
                let parameter = format!("{module}/params/{name}");
                let mut links = self.after.links().iter();
                let link = links.find(|link| is_within(&link.to.value, &parameter));
                // One that is linked by the same change is not read any more.
                let link = link.filter(|link| linked(self.before, &link.to.value));
                link.map(|link| {
                    let message = format!("`{path}` follows `{}`, so it can't be set", link.from.value);
                    (message, format!("remove the link first: slate unlink {}", link.to.value))
                })
            }
            Some(LiveSetting::LogLevel) => None,
            Some(LiveSetting::Link) => self.external(change).map(unchanging),
            Some(LiveSetting::Enabled { module }) => [self.before, self.after]
                .iter()
                .all(|configuration| linked(configuration, &format!("{module}/enabled")))
                .then(|| {
                    let message = format!("`{path}` has no effect, as a link switches the module");
                    (message, format!("remove the link first: slate unlink {module}/enabled"))
                }),
            Some(LiveSetting::Input { module, port }) => {
                let input = format!("{module}/{port}");
                let value = self.after.modules().iter().find(|own| own.name.value == module);
                let has_value = value.is_some_and(|module| module.inputs.get(port).is_some());
                (!has_value && !linked(self.before, &input) && !linked(self.after, &input))
                    .then(|| format!("the value of `{input}` can't be taken back while the agent runs"))
                    .map(|message| (message, LATER.into()))
            }
            // The settings of the variant are changes of their own.
            None if self.chooses(change) => None,
            None => Some((format!("`{path}` can't change while the agent runs"), LATER.into())),
        }
    }

    /// Returns the external link that a change makes, removes or alters.
    /// One of its ends is a program that is not an agent.
    fn external(&self, change: &Change) -> Option<&'a ExternalLink> {
        let [_, to, ..] = change.names() else { return None };
        let of = |configuration: &'a Configuration| {
            configuration.external_links().iter().filter(|link| link.ends().0 == *to).collect::<Vec<_>>()
        };
        let (before, after) = (of(self.before), of(self.after));
        let texts = |links: &[&ExternalLink]| {
            links.iter().map(|link| (link.ends(), link.option_texts())).collect::<Vec<_>>()
        };
        let is_same = texts(&before) == texts(&after);
        after.into_iter().chain(before).next().filter(|_| !is_same)
    }

    /// Returns the changes that a running agent can't make, as diagnostics.
    pub fn refusals(&self, changes: &[Change]) -> Vec<Diagnostic> {
        let place = |path: &str, message: String, help: &str| match self.after.value(path) {
            Some(value) => self.after.diagnostic(value.span, message, Some(help.into())),
            None => Diagnostic::without_place(message, Some(help.into())),
        };
        let of_modules = self.modules.iter().map(|module| {
            let is_new = self.after.modules().iter().any(|own| own.name.value == **module);
            let what = if is_new { "added" } else { "taken out" };
            let message = format!("module `{module}` can't be {what} while the agent runs");
            let help = format!("{LATER}; or load and unload the plugin that brings it");
            place(&format!("modules.\"{module}\""), message, &help)
        });
        let of_others = changes.iter().filter(|change| !self.have(change)).filter_map(|change| {
            let (message, help) = self.obstacle(change)?;
            Some(place(&change.path, message, &help))
        });
        of_modules.chain(of_others).collect()
    }

    /// Returns the indices of the changes that only the next start can make.
    /// These are all changes if one of another variant is among them, as a variant can't be applied in part.
    pub fn waiting(&self, changes: &[Change]) -> SortedSet<usize> {
        let waits =
            |change: &Change| self.have(change) || self.touches(change) || self.obstacle(change).is_some();
        let waiting: SortedSet<_> =
            changes.iter().enumerate().filter(|(_, change)| waits(change)).map(|(place, _)| place).collect();
        let is_whole = waiting.is_empty() || !changes.iter().any(|change| self.chooses(change));
        if is_whole { waiting } else { (0..changes.len()).collect() }
    }
}
