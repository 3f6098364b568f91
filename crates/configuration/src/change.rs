use super::value::Value;

/// Change of a setting.
#[derive(Clone, Debug)]
pub struct Change {
    /// Path as of `--set`; module names include those of their robots.
    pub path: String,
    /// Value before the change, if any.
    pub before: Option<Value>,
    /// Value after the change, if any.
    pub after: Option<Value>,
    pub(super) names: Vec<String>,
    /// Number of leading names that existed before the change.
    pub(super) known: usize,
}

impl Change {
    /// Names of the path, such as `modules`, `r2/planner`, `params`, `speed`.
    pub fn names(&self) -> &[String] {
        &self.names
    }
}
