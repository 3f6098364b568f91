use slate_module::Level;
use slate_sorted::SortedMap;

/// Log levels by module.
///
/// A level may name a module or what its name begins with, such as `r2` for `r2/planner`; the longest name wins.
///
/// ```
/// use slate_module::Level;
/// use slate_configuration::Levels;
///
/// let mut levels = Levels::new(Level::Info);
/// levels.set(Some("r2"), Level::Warn);
/// levels.set(Some("r2/planner"), Level::Debug);
/// assert_eq!(levels.of("r2/planner"), Level::Debug);
/// assert_eq!(levels.of("r2/follower"), Level::Warn);
/// assert_eq!(levels.of("r22"), Level::Info);
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Levels {
    most: Level,
    named: SortedMap<String, Level>,
}

impl Levels {
    /// Makes one level for all modules.
    pub fn new(level: Level) -> Self {
        Self { most: level, named: SortedMap::new() }
    }

    /// Sets the log level of a module and of all modules below it.
    /// These are the modules whose names continue after a slash. `None` sets the level of all modules without one.
    pub fn set(&mut self, module: Option<&str>, level: Level) {
        match module {
            Some(module) => {
                self.named.insert(module.into(), level);
            }
            None => self.most = level,
        }
    }

    /// Returns the levels by module; the empty name stands for all others.
    pub fn entries(&self) -> impl Iterator<Item = (&str, Level)> {
        let named = self.named.iter().map(|(name, level)| (name.as_str(), *level));
        std::iter::once(("", self.most)).chain(named)
    }

    /// Returns the level of a module.
    pub fn of(&self, module: &str) -> Level {
        let mut name = module;
        loop {
            match (self.named.get(name), name.rfind('/')) {
                (Some(level), _) => return *level,
                (None, Some(slash)) => name = &name[..slash],
                (None, None) => return self.most,
            }
        }
    }
}
