use std::fmt;

/// Rights of a caller; each role also has those of the roles before it.
/// Every role may stop the actuators.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// Looks, and stops the actuators.
    Viewer,
    /// Drives, sets goals, arms, resets a stop.
    Operator,
    /// Changes parameters, links, modules and plugins.
    Developer,
}

impl Role {
    /// Roles, the one with the fewest rights first.
    pub const ALL: [Self; 3] = [Self::Viewer, Self::Operator, Self::Developer];

    /// Returns the role of that name.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|role| role.name() == name)
    }

    /// Returns the summary of the rights, in a line.
    pub fn doc(self) -> &'static str {
        match self {
            Self::Viewer => "Looks, and stops the actuators",
            Self::Operator => "Also drives, sets goals, arms, and resets a stop",
            Self::Developer => "Also changes parameters, links, modules and plugins",
        }
    }

    /// Returns the name with its article, for sentences.
    pub fn with_article(self) -> &'static str {
        match self {
            Self::Viewer => "a viewer",
            Self::Operator => "an operator",
            Self::Developer => "a developer",
        }
    }

    /// Returns the name in configurations and tools.
    pub fn name(self) -> &'static str {
        match self {
            Self::Viewer => "viewer",
            Self::Operator => "operator",
            Self::Developer => "developer",
        }
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
