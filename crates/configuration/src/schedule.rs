//! Which stages the main loop has.

use std::collections::BTreeSet;
use std::time::Duration;

use slate_module::Stage;

/// A stage of the main loop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScheduledStage {
    /// Its name: of the ten stages' names, or another one.
    pub name: String,
    /// The stages of modules that it runs, one after the other.
    pub members: Vec<Stage>,
    /// How long it may take on the wall clock; when that is over, its running module counts as late, and those that
    /// have not begun are left out.
    pub timeout: Option<Duration>,
}

/// The stages of the main loop in their order. Modules name one of the ten standard stages; a schedule puts those
/// together to the stages that the loop has, so modules need no change when the loop has others.
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

/// Why stages are no schedule.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ScheduleError {
    /// A name that no stage can have.
    #[error(
        "`{name}` can't name a stage: expected up to 32 letters, digits and `_`, and neither `state` nor `histogram`"
    )]
    Name {
        /// The name.
        name: String,
    },
    /// Two stages of a name.
    #[error("two stages are named `{name}`")]
    SameName {
        /// The name.
        name: String,
    },
    /// A stage of modules would run twice.
    #[error("the modules of {} would run both in `{first}` and in `{second}`", .stage.name())]
    Twice {
        /// The stage of modules.
        stage: Stage,
        /// The stage of the loop that has it.
        first: String,
        /// The one that has it too.
        second: String,
    },
    /// Stages of modules would never run.
    #[error("no stage of the loop runs the modules of {}", names(.stages))]
    Missing {
        /// The stages of modules.
        stages: Vec<Stage>,
    },
    /// There is no such stage.
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
    /// The ten stages, in order and without time-outs.
    fn default() -> Self {
        let own =
            |stage: Stage| ScheduledStage { name: stage.name().into(), members: vec![stage], timeout: None };
        Self { stages: Stage::ALL.map(own).into() }
    }
}

impl Schedule {
    /// A schedule of stages in that order.
    ///
    /// # Errors
    /// When a name can't be one or comes twice, or when not each of the ten stages of modules is in exactly one.
    pub fn new(stages: Vec<ScheduledStage>) -> Result<Self, ScheduleError> {
        let mut named = BTreeSet::new();
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

    /// With a time-out of one stage.
    ///
    /// # Errors
    /// When there is no stage of that name.
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

/// Whether a stage can have that name: it is a part of paths on the blackboard.
pub fn is_stage_name(name: &str) -> bool {
    let letter = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
    (1..=32).contains(&name.len())
        && name.bytes().all(letter)
        // These are properties beside those of the stages.
        && !["state", "histogram"].contains(&name)
}
