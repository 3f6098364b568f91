//! Stages of the main loop.

use std::time::Duration;

use slate_module::Stage;
use slate_sorted::SortedSet;

/// Stage of the main loop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScheduledStage {
    /// Name, one of the ten standard names or another one.
    pub name: String,
    /// Standard stages of modules that it runs, one after the other.
    pub members: Vec<Stage>,
    /// Timeout on the wall clock.
    /// When it expires, the running module counts as late, and those that have not begun are skipped.
    pub timeout: Option<Duration>,
}

/// Stages of the main loop, in order.
/// Modules name one of the ten standard stages. A schedule groups these into the loop's stages, so modules need no
/// change when the loop has others.
///
/// ```
/// use slate_configuration::{Schedule, ScheduledStage};
/// use slate_module::Stage;
///
/// let (sense, act) = Stage::ALL.split_at(5);
/// let stage = |name: &str, members: &[Stage]| ScheduledStage {
///     name: name.into(),
///     members: members.into(),
///     timeout: None,
/// };
/// let schedule = Schedule::new(vec![stage("Sense", sense), stage("Act", act)])?;
/// assert_eq!(schedule.stages().len(), 2);
/// assert_eq!(Schedule::default().stages().len(), Stage::ALL.len());
/// # Ok::<(), slate_configuration::ScheduleError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schedule {
    stages: Vec<ScheduledStage>,
}

/// Error of stages that form no schedule.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ScheduleError {
    /// Invalid name of a stage.
    #[error(
        "`{name}` can't name a stage: expected up to 32 letters, digits and `_`, and neither `state` nor `histogram`"
    )]
    Name {
        /// The name.
        name: String,
    },
    /// Two stages with the same name.
    #[error("two stages are named `{name}`")]
    SameName {
        /// The name.
        name: String,
    },
    /// Standard stage in two stages of the loop.
    #[error("the modules of {} would run both in `{first}` and in `{second}`", .stage.name())]
    Twice {
        /// Standard stage.
        stage: Stage,
        /// First stage of the loop that has it.
        first: String,
        /// Second stage of the loop that has it.
        second: String,
    },
    /// Standard stages in no stage of the loop.
    #[error("no stage of the loop runs the modules of {}", names(.stages))]
    Missing {
        /// Standard stages.
        stages: Vec<Stage>,
    },
    /// Unknown stage.
    #[error("the loop has no stage `{name}`")]
    Unknown {
        /// The name.
        name: String,
    },
}

fn names(stages: &[Stage]) -> String {
    stages.iter().map(|stage| stage.name()).collect::<Vec<_>>().join(", ")
}

impl Default for Schedule {
    /// Returns the ten stages, in order and without timeouts.
    fn default() -> Self {
        let own =
            |stage: Stage| ScheduledStage { name: stage.name().into(), members: vec![stage], timeout: None };
        Self { stages: Stage::ALL.map(own).into() }
    }
}

impl Schedule {
    /// Makes a schedule of stages in that order.
    ///
    /// # Errors
    /// When a name can't be one or comes twice, or when not each of the ten stages of modules is in exactly one.
    pub fn new(stages: Vec<ScheduledStage>) -> Result<Self, ScheduleError> {
        let mut named = SortedSet::new();
        for stage in &stages {
            if !is_stage_name(&stage.name) {
                return Err(ScheduleError::Name { name: stage.name.clone() });
            }
            if !named.insert(&stage.name) {
                return Err(ScheduleError::SameName { name: stage.name.clone() });
            }
        }
        let mut missing = Vec::new();
        for stage in Stage::ALL {
            let mut those = stages
                .iter()
                .flat_map(|own| own.members.iter().filter(|member| **member == stage).map(|_| &own.name));
            match (those.next(), those.next()) {
                (None, _) => missing.push(stage),
                (Some(_), None) => {}
                (Some(first), Some(second)) => {
                    let (first, second) = (first.clone(), second.clone());
                    return Err(ScheduleError::Twice { stage, first, second });
                }
            }
        }
        if !missing.is_empty() {
            return Err(ScheduleError::Missing { stages: missing });
        }
        Ok(Self { stages })
    }

    /// Returns the schedule with a timeout of one stage.
    ///
    /// # Errors
    /// When the stage is unknown.
    pub fn with_timeout(mut self, name: &str, timeout: Duration) -> Result<Self, ScheduleError> {
        let stage = self.stages.iter_mut().find(|stage| stage.name == name);
        stage.ok_or_else(|| ScheduleError::Unknown { name: name.into() })?.timeout = Some(timeout);
        Ok(self)
    }

    /// The stages, in order.
    pub fn stages(&self) -> &[ScheduledStage] {
        &self.stages
    }
}

/// Returns true if a stage can have that name.
/// The name is a part of paths on the blackboard.
pub fn is_stage_name(name: &str) -> bool {
    let letter = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
    (1..=32).contains(&name.len())
        && name.bytes().all(letter)
        // These are properties beside those of the stages.
        && !["state", "histogram"].contains(&name)
}
