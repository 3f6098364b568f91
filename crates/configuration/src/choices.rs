//! Variants of a configuration.
//! `controller = "rocs"` applies the settings of `[choices.controller.rocs]`.

use slate_sorted::SortedMap;

use super::Configuration;
use super::layers::{CHOICES, Layers};
use super::path;
use super::set::flat;
use super::source::{Span, Spanned, TextPlace};
use super::value::{Table, TableEntry, Value};
use crate::error_code::ErrorCode;

/// A variant of a configuration.
#[derive(Clone, Copy, Debug)]
pub struct Variant<'a> {
    /// Name of the setting that chooses it.
    pub choice: &'a str,
    /// Name of the variant.
    pub name: &'a str,
    /// Place of its name.
    pub span: Span,
    /// True for the chosen variant.
    pub is_chosen: bool,
    /// True if it has settings; one without is the configuration as written.
    pub has_settings: bool,
}

impl<'a> Variant<'a> {
    /// Returns all variants, by name of the choice.
    pub fn all(configuration: &'a Configuration) -> impl Iterator<Item = Self> {
        let all = configuration.table(CHOICES).into_iter().flat_map(Table::iter);
        all.flat_map(|(choice, variants)| {
            let chosen = configuration.merged.get(choice).and_then(|chosen| chosen.as_str());
            let entries = variants.value.as_table().into_iter().flat_map(Table::iter);
            entries.map(move |(name, entry)| Self {
                choice,
                name,
                span: entry.key,
                is_chosen: chosen == Some(name),
                has_settings: entry.value.as_table().is_some_and(|settings| !settings.is_empty()),
            })
        })
    }

    /// Returns the chosen variants, by name of the choice.
    pub fn chosen(configuration: &'a Configuration) -> impl Iterator<Item = Self> {
        Self::all(configuration).filter(|variant| variant.is_chosen)
    }

    /// Returns the setting that chooses it, such as `controller = "rocs"`.
    pub fn setting(&self) -> String {
        format!("{} = {:?}", path::render(&[self.choice.into()]), self.name)
    }
}

impl Layers {
    /// Applies the chosen variants in the order of their names.
    /// The files choose them, or `settings` above the files. The other variants are checked.
    ///
    /// A recorded text (`is_recorded`) contains the settings of its variants already.
    pub(super) fn choose<'a>(&mut self, settings: impl Iterator<Item = &'a str>, is_recorded: bool) {
        self.drop_choices();
        let Some(choices) = self.merged.get(CHOICES).and_then(|choices| choices.as_table()).cloned() else {
            return;
        };
        let settings: Vec<_> = settings.filter_map(flat).collect();
        let names: Vec<&str> = choices.iter().map(|(name, _)| name).collect();
        for (name, variants) in choices.iter() {
            let of_wanted = |setting: &Table| {
                let wanted = self.agents.wanted.as_deref().unwrap_or_default();
                let own = setting.at(["agents", wanted, name].into_iter()).or_else(|| setting.get(name))?;
                own.as_str().map(str::to_owned)
            };
            // An unknown variant is reported at the setting that chooses it.
            let chosen = settings.iter().rev().find_map(of_wanted);
            let of_text = self.merged.get(name).filter(|_| !is_recorded);
            let chosen = chosen.or_else(|| of_text?.as_str().map(str::to_owned));
            for (variant, entry) in variants.value.as_table().into_iter().flat_map(Table::iter) {
                let path = [CHOICES, name, variant];
                if let Some(settings) = self.problems.as_table(&path.join("."), entry) {
                    let mut settings = self.variant(path, settings.clone(), &names);
                    if chosen.as_deref() == Some(variant) {
                        self.refuse_ghosts(&mut settings);
                        super::senders::merge_layer(&mut self.merged, settings);
                    }
                }
            }
        }
    }

    /// Removes choices of included files that are `false`, with their settings.
    fn drop_choices(&mut self) {
        let choices = self.merged.entries.get_mut(CHOICES).map(|entry| &mut entry.value.value);
        let Some(Value::Table(choices)) = choices else { return };
        let is_dropped = |entry: &TableEntry| matches!(entry.value.value, Value::Bool(false));
        let dropped = choices.entries.extract_if(|_, entry| is_dropped(entry));
        for (name, _) in dropped {
            self.merged.entries.remove(&name);
        }
    }

    /// Reads a variant as a part of the texts, above everything read before.
    fn variant(&mut self, path: [&str; 3], mut settings: Table, choices: &[&str]) -> Table {
        for key in ["include", "agents", CHOICES].iter().chain(choices) {
            if let Some(TableEntry { key: span, .. }) = settings.entries.remove(*key) {
                let message = ErrorCode::Key.of(format!("a variant can't set `{key}`"));
                self.problems.add(span, message, "write it at the top of the file");
            }
        }
        let mut parts = SortedMap::new();
        each_span(&mut settings, &mut |span| {
            span.source = *parts.entry(span.source).or_insert_with(|| self.part_at(span.source, &path));
        });
        super::scope::flatten(settings, &mut self.problems)
    }

    /// Reports settings of undescribed modules and actuators.
    fn refuse_ghosts(&mut self, settings: &mut Table) {
        // A module may be another agent's.
        if !self.incomplete && self.agents.known.is_empty() {
            self.refuse_new(false, settings, "modules", "module", &["kind"]);
            self.refuse_new(false, settings, "actuators", "actuator", &["command", "commands"]);
        }
    }

    /// Makes a source for a table of a text, above everything read before.
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
