use std::collections::BTreeMap;

/// Which part of a recording is played, and where.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    /// The topics that are played, or patterns such as `/r2/*`; all if there are none.
    pub select: Vec<String>,
    /// The topics among them that are not.
    pub exclude: Vec<String>,
    /// Topics that are played at other paths, such as `/scan` at `/r2/laser/scan`.
    pub map: BTreeMap<String, String>,
}

impl Choice {
    /// Whether everything is played where it was.
    pub(super) fn is_all(&self) -> bool {
        self.select.is_empty() && self.exclude.is_empty() && self.map.is_empty()
    }
}
