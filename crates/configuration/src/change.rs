use super::value::Value;

/// A setting that changes.
#[derive(Clone, Debug)]
pub struct Change {
    /// Its path, as `--set` takes it; the names of robots are part of those of their modules.
    pub path: String,
    /// The value until now, if there was one.
    pub before: Option<Value>,
    /// The value from now on, if there is one.
    pub after: Option<Value>,
    pub(super) names: Vec<String>,
    /// With how many of the names there was something before.
    pub(super) known: usize,
}

impl Change {
    /// The names of the path, such as `modules`, `r2/planner`, `params`, `speed`.
    pub fn names(&self) -> &[String] {
        &self.names
    }
}
