//! Ports and parameters of managers of missions.

use slate_plugin::interfaces::{Pose2, Verdict};
use slate_plugin::prelude::*;

use crate::conditions::{ConditionName, ConditionValues};

/// Name of an action in a mission, such as `search`.
pub type ActivityName = Text<44>;

/// Action of a mission, for the modules that perform it.
#[interface]
pub struct ManagedActivity {
    /// Number of its starts.
    pub starts: u64,
    /// Arguments at the newest start; 0 beyond them.
    pub arguments: [f64; 8],
    /// First three arguments as x, y and heading.
    pub target: Pose2,
    /// Activity: true if the action runs, for `enabled` of a module.
    pub is_active: Bool,
}

/// Result of an action, from the module that performs it.
#[interface]
pub struct ActivityResult {
    /// Success: true if it has reached its goal.
    pub has_succeeded: Bool,
    /// Failure: true if it can't reach its goal.
    pub has_failed: Bool,
}

/// Condition of a mission, from a field of any property.
#[interface]
pub struct SwitchCondition {
    /// Value of the condition: true if it holds.
    pub holds: Bool,
}

/// State of a managed mission.
#[interface]
pub struct ManagedMissionStatus {
    /// Actions that run, with their arguments, or the reason of the end.
    pub active: Text<252>,
}

/// Conditions, actions and results of a mission.
#[ports]
pub struct MissionManagerPorts {
    /// Conditions, each as it changes.
    pub(super) conditions: Queue<ConditionValues>,
    /// Conditions of a module or of a person.
    pub(super) facts: Input<ConditionValues>,
    /// Conditions that others send.
    pub(super) messages: Inbox<ConditionValues>,
    /// First condition of the parameter `conditions`.
    condition_1: Input<SwitchCondition>,
    condition_2: Input<SwitchCondition>,
    condition_3: Input<SwitchCondition>,
    condition_4: Input<SwitchCondition>,
    condition_5: Input<SwitchCondition>,
    condition_6: Input<SwitchCondition>,
    condition_7: Input<SwitchCondition>,
    condition_8: Input<SwitchCondition>,
    /// Result of the first action of the parameter `actions`.
    result_1: Input<ActivityResult>,
    result_2: Input<ActivityResult>,
    result_3: Input<ActivityResult>,
    result_4: Input<ActivityResult>,
    result_5: Input<ActivityResult>,
    result_6: Input<ActivityResult>,
    result_7: Input<ActivityResult>,
    result_8: Input<ActivityResult>,
    /// Target of the first action in `actions` if its arguments have none.
    target_1: Input<Pose2>,
    target_2: Input<Pose2>,
    target_3: Input<Pose2>,
    target_4: Input<Pose2>,
    target_5: Input<Pose2>,
    target_6: Input<Pose2>,
    target_7: Input<Pose2>,
    target_8: Input<Pose2>,
    /// First action of the parameter `actions`.
    action_1: Output<ManagedActivity>,
    action_2: Output<ManagedActivity>,
    action_3: Output<ManagedActivity>,
    action_4: Output<ManagedActivity>,
    action_5: Output<ManagedActivity>,
    action_6: Output<ManagedActivity>,
    action_7: Output<ManagedActivity>,
    action_8: Output<ManagedActivity>,
    /// Target of the newest active action that has one.
    /// It comes from two arguments or more, or from a link.
    pub(super) target: Output<Pose2>,
    /// State of the mission, written when it changes.
    pub(super) mission: Output<ManagedMissionStatus>,
    /// Verdict on the mission, for the end of a run.
    pub(super) verdict: Output<Verdict>,
}

impl MissionManagerPorts {
    pub(super) fn switches(&self) -> [&Input<SwitchCondition>; 8] {
        let first = [&self.condition_1, &self.condition_2, &self.condition_3, &self.condition_4];
        let last = [&self.condition_5, &self.condition_6, &self.condition_7, &self.condition_8];
        eight(first, last)
    }

    pub(super) fn results(&self) -> [&Input<ActivityResult>; 8] {
        let first = [&self.result_1, &self.result_2, &self.result_3, &self.result_4];
        let last = [&self.result_5, &self.result_6, &self.result_7, &self.result_8];
        eight(first, last)
    }

    pub(super) fn targets(&self) -> [&Input<Pose2>; 8] {
        let first = [&self.target_1, &self.target_2, &self.target_3, &self.target_4];
        let last = [&self.target_5, &self.target_6, &self.target_7, &self.target_8];
        eight(first, last)
    }

    pub(super) fn activities(&self) -> [&Output<ManagedActivity>; 8] {
        let first = [&self.action_1, &self.action_2, &self.action_3, &self.action_4];
        let last = [&self.action_5, &self.action_6, &self.action_7, &self.action_8];
        eight(first, last)
    }
}

fn eight<T: Copy>([a, b, c, d]: [T; 4], [e, f, g, h]: [T; 4]) -> [T; 8] {
    [a, b, c, d, e, f, g, h]
}

/// Parameters of managers of missions.
#[params]
pub struct MissionManagerParams {
    #[param(default = "", doc = "file of the mission")]
    pub mission_filename: Text<252>,
    #[param(default = 0, range = 0..=1_000_000, doc = "raise it to read the file again while the mission runs")]
    pub revision: u32,
    #[param(default = Sequence::default(), doc = "kinds of the actions, in the order of `action_1` to `action_8`")]
    pub actions: Sequence<ActivityName, 8>,
    #[param(default = Sequence::default(), doc = "names of conditions, in the order of `condition_1` to `condition_8`")]
    pub conditions: Sequence<ConditionName, 8>,
    #[param(default = 0.1, range = 0.0..=10.0, unit = "s", doc = "time after the start of an action in which a result is that of the one before")]
    pub settle_time: f64,
    #[param(
        default = "",
        doc = "call of a skill in Lua, such as `moveto{x = 1, y = 2}`; empty for the skill of the file"
    )]
    pub skill: Text<252>,
}
