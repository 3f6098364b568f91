use super::super::layers::Layers;
use super::super::senders::merge_layer;
use super::super::set::parse_set;
use super::super::value::Table;
use super::*;

/// Finds out which changes of an edited file can't be made before the next start, by their place in the list.
pub(super) type Patience = dyn Fn(&Configuration, &[Change]) -> BTreeSet<usize> + Send + Sync;

impl Database {
    /// What edited files say and only the next start can have: `before` holds until then, `after` from there on.
    pub fn waiting(&self) -> Vec<Change> {
        lock(&self.shared.state).waiting.clone()
    }

    /// Adds who knows which changes of an edited file have to wait for the next start, by their places in the list.
    /// Those keep their values, and the rest of the edit is taken over. A change that is made by [`set`](Self::set)
    /// does not wait: it holds at once or is refused.
    pub fn wait_with(
        &self,
        patience: impl Fn(&Configuration, &[Change]) -> BTreeSet<usize> + Send + Sync + 'static,
    ) {
        lock(&self.shared.patience).push(Arc::new(patience));
    }

    /// Those of the changes that wait.
    pub(super) fn held(&self, configuration: &Configuration, changes: &[Change]) -> Vec<Change> {
        let patience = lock(&self.shared.patience).clone();
        let places: BTreeSet<usize> =
            patience.iter().flat_map(|patience| patience(configuration, changes)).collect();
        places.into_iter().filter_map(|place| changes.get(place).cloned()).collect()
    }
}

impl Layers {
    /// Puts back what files say otherwise and only the next start can have, here and in what the files say.
    pub(in super::super) fn hold(&mut self, waiting: &[Change], mut of_files: Table) -> Table {
        for Change { path, before, names, known, .. } in waiting {
            let Some(value) = before else {
                take_out(&mut self.merged, names, *known);
                take_out(&mut of_files, names, *known);
                continue;
            };
            let text = format!("{path}={value}");
            let id = self.setting(SourceKind::Waiting, &text);
            if let Some(table) = parse_set(&text, Some(path.len()), id, &mut self.problems) {
                merge_layer(&mut self.merged, table.clone());
                merge_layer(&mut of_files, table);
            }
        }
        of_files
    }
}

/// Takes out what is at a path, and the tables that only led there from the first `known` names.
fn take_out(table: &mut Table, path: &[String], known: usize) {
    table.remove(path);
    let parents = (known + 1..path.len()).rev().map(|depth| &path[..depth]);
    for parent in parents {
        match table.entry(parent).map(|entry| entry.value.as_table().is_some_and(Table::is_empty)) {
            Some(true) => table.remove(parent),
            _ => return,
        }
    }
}
