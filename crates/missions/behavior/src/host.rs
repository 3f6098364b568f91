//! View of the robot for skills.

/// Action of the robot that a skill or an interface performs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BehaviorAction {
    /// Skill of the action, or interface of the message.
    pub owner: String,
    /// Name of its variable in the skill, or of the message.
    pub name: String,
    /// Kind of the action at the robot, such as `GoToOrigin`.
    pub kind: String,
}

/// Progress of an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BehaviorProgress {
    /// The action runs.
    Running,
    /// The action has reached its goal.
    Succeeded,
    /// The action can't reach its goal.
    Failed,
    /// Preempted by a request of a higher rank; the host resumes it later.
    Preempted,
}

/// Status of a mission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BehaviorStatus {
    /// A skill runs.
    Running,
    /// All skills have succeeded.
    Succeeded,
    /// A skill has failed.
    Failed,
}

/// Level of a message of a script.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScriptLevel {
    /// `print_debug`
    Debug,
    /// `print`, `printf` and `print_info`
    Information,
    /// `print_warn`
    Warning,
    /// `print_error`
    Error,
}

/// Host of a mission: performs its actions and answers its conditions.
///
/// `index` is the place of an action in [`BehaviorEngine::actions`](crate::BehaviorEngine::actions).
pub trait BehaviorHost {
    /// Returns whether a condition holds; `None` while it is unknown.
    fn condition(&mut self, name: &str) -> Option<bool>;

    /// Starts an action.
    ///
    /// # Errors
    /// The reason for which it is refused; the skill fails.
    fn start(&mut self, index: usize, action: &BehaviorAction, arguments: &[f64]) -> Result<(), String>;

    /// Returns how far a started action has come.
    fn progress(&mut self, index: usize) -> BehaviorProgress;

    /// Stops an action, which may have ended.
    fn stop(&mut self, index: usize);

    /// Returns 64 random bits of the mission's stream.
    fn random(&mut self) -> u64;

    /// Logs a message of a script.
    fn log(&mut self, level: ScriptLevel, text: &str);
}

/// Host without a robot, for files that are loaded.
pub(crate) struct NoRobot;

impl BehaviorHost for NoRobot {
    fn condition(&mut self, _: &str) -> Option<bool> {
        None
    }

    fn start(&mut self, _: usize, _: &BehaviorAction, _: &[f64]) -> Result<(), String> {
        Err("an action starts when the mission runs, not while its files are loaded".into())
    }

    fn progress(&mut self, _: usize) -> BehaviorProgress {
        BehaviorProgress::Running
    }

    fn stop(&mut self, _: usize) {}

    fn random(&mut self) -> u64 {
        0
    }

    fn log(&mut self, _: ScriptLevel, _: &str) {}
}
