//! The robots that a report follows.

use slate_configuration::Configuration;

/// A robot that a report follows, with its topics.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Followed {
    /// Name.
    pub name: String,
    /// Topic of its pose.
    pub pose: String,
    /// Topic of the status of its Execute.
    pub status: Option<String>,
    /// Topic of its clearance.
    pub clearance: Option<String>,
}

impl Followed {
    /// Returns the robots that a configuration's `[report]` names.
    pub fn of(configuration: &Configuration) -> Vec<Self> {
        let robots = configuration.value("report.robots").and_then(|robots| robots.value.as_table());
        let robots = robots.into_iter().flat_map(|table| table.iter());
        let followed = robots.filter_map(|(name, entry)| {
            let robot = entry.value.as_table()?;
            // Topics of another agent are in that agent's recording.
            let is_own = |topic: &&str| !topic.starts_with("slate://");
            let topic = |key: &str| Some(robot.get(key)?.value.as_str().filter(is_own)?.to_owned());
            let (pose, status, clearance) = (topic("pose")?, topic("status"), topic("clearance"));
            Some(Self { name: name.into(), pose, status, clearance })
        });
        followed.collect()
    }
}
