//! Variants of a configuration: `controller = "rocs"` takes over the settings of `[choices.controller.rocs]`.

use std::collections::BTreeMap;

use super::Configuration;
use super::layers::Layers;
use super::set::flat;
use super::source::{Span, Spanned, TextPlace};
use super::value::{Table, TableEntry, Value};
use crate::mistake::Mistake;

/// Name of the table with the variants.
pub(super) const CHOICES: &str = "choices";

/// A variant that holds.
#[derive(Clone, Copy, Debug)]
pub struct ChosenVariant<'a> {
    /// Name of the setting that chooses it.
    pub choice: &'a str,
    /// Name of the variant.
    pub name: &'a str,
    /// Whether it has settings; the one without is the configuration as it is written.
    pub is_other: bool,
}

impl<'a> ChosenVariant<'a> {
    /// The variants that hold, by name of the choice.
    pub fn all(configuration: &'a Configuration) -> impl Iterator<Item = Self> {
        let all = configuration.table(CHOICES).into_iter().flat_map(Table::iter);
        all.filter_map(|(choice, variants)| {
            let name = configuration.merged.get(choice)?.as_str()?;
            let settings = variants.value.as_table()?.get(name)?.as_table()?;
            Some(Self { choice, name, is_other: !settings.is_empty() })
        })
    }
}

impl Layers {
    /// Takes over the variants that the files choose, or `settings` above them, in the order of the names.
    pub(super) fn choose<'a>(&mut self, settings: impl Iterator<Item = &'a str>) {
        let Some(choices) = self.merged.get(CHOICES).and_then(|choices| choices.as_table()).cloned() else {
            return;
        };
        let settings: Vec<_> = settings.filter_map(flat).collect();
        for (name, variants) in choices.iter() {
            let of_wanted = |setting: &Table| {
                let wanted = self.agents.wanted.as_deref().unwrap_or_default();
                let own = setting.at(["agents", wanted, name].into_iter()).or_else(|| setting.get(name))?;
                own.as_str().map(str::to_owned)
            };
            let chosen = settings.iter().rev().find_map(of_wanted);
            let chosen = chosen.or_else(|| self.merged.get(name)?.as_str().map(str::to_owned));
            // An unknown one is reported where the setting is read.
            let variant =
                chosen.and_then(|variant| Some((variants.value.as_table()?.entries.get(&variant)?, variant)));
            if let Some((entry, variant)) = variant
                && let Some(settings) = self.problems.as_table(&format!("{CHOICES}.{name}.{variant}"), entry)
            {
                self.variant([CHOICES, name, &variant], settings.clone());
            }
        }
    }

    /// Takes over a variant: a part of the texts that it is written in, which goes over all of them.
    fn variant(&mut self, path: [&str; 3], mut settings: Table) {
        for key in ["include", "agents", CHOICES] {
            if let Some(TableEntry { key: span, .. }) = settings.entries.remove(key) {
                let message = Mistake::Key.of(format!("`{key}` stands in a variant"));
                self.problems.add(span, message, "write it at the top of the file");
            }
        }
        let mut parts = BTreeMap::new();
        each_span(&mut settings, &mut |span| {
            span.source = *parts.entry(span.source).or_insert_with(|| self.part_at(span.source, &path));
        });
        let settings = super::scope::flatten(settings, &mut self.problems);
        super::senders::merge_layer(&mut self.merged, settings);
    }

    /// A source of what stands in a table of a text, above all that was read.
    fn part_at(&mut self, text: usize, path: &[&str]) -> usize {
        let TextPlace { part_of, table, own, .. } = &self.sources.0[text].place;
        let (whole, own) = (part_of.unwrap_or(text), *own);
        let table = table.iter().cloned().chain(path.iter().map(|&name| name.to_owned())).collect();
        let part = self.part(whole, table, own);
        self.rank(part);
        part
    }
}

fn each_span(table: &mut Table, change: &mut impl FnMut(&mut Span)) {
    for entry in table.entries.values_mut() {
        change(&mut entry.key);
        each_span_of(&mut entry.value, change);
    }
}

fn each_span_of(value: &mut Spanned<Value>, change: &mut impl FnMut(&mut Span)) {
    change(&mut value.span);
    match &mut value.value {
        Value::Table(inner) => each_span(inner, change),
        Value::List(items) => items.iter_mut().for_each(|item| each_span_of(item, change)),
        _ => {}
    }
}
