use slate_sorted::SortedMap;

/// The topics of a recording that are played, and their paths.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    /// The played topics, or patterns such as `/r2/*`; all if empty.
    pub select: Vec<String>,
    /// Exceptions from these.
    pub exclude: Vec<String>,
    /// Topics that are played at other paths, such as `/scan` at `/r2/laser/scan`.
    pub map: SortedMap<String, String>,
}

impl Choice {
    /// Returns true if everything is played at its recorded path.
    pub(super) fn is_all(&self) -> bool {
        self.select.is_empty() && self.exclude.is_empty() && self.map.is_empty()
    }
}
