//! Missions followed by a plain module, as OpenRDK's missionManager.
//! Its actions are outputs, which are linked to inputs, parameters and `enabled` of other modules, and its conditions
//! come from links.

mod missions;
mod ports;

use std::fmt::Write;
use std::marker::PhantomData;

use serde::{Deserialize, Serialize};
use slate_petri_net::ActionProgress;
use slate_plugin::interfaces::{MissionState, Pose2, Verdict};
use slate_plugin::mapek::ActionRequest;
use slate_plugin::module::{Spec, Stage, Trigger};
use slate_plugin::prelude::*;

pub use missions::{ManagedMission, MissionSettings};
pub use ports::{
    ActivityName, ActivityResult, ManagedActivity, ManagedMissionStatus, MissionManagerParams,
    MissionManagerPorts, SwitchCondition,
};

use crate::mission::PlanMission;

/// Number of actions, and of conditions with an input of their own.
const SLOTS: usize = 8;

/// State of a [`MissionManager`].
#[derive(Serialize, Deserialize)]
#[serde(bound = "")]
pub struct MissionManagerState<E: ManagedMission> {
    mission: PlanMission<E>,
    /// State of each output: starts, and time of the newest one, ns.
    /// 0 while it is inactive.
    slots: [SlotState; SLOTS],
    /// True if the outputs were written once.
    written: bool,
    /// Value of the output `target`.
    #[serde(default)]
    target: Option<[f64; 3]>,
}

/// State of an output.
#[derive(Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct SlotState {
    starts: u64,
    /// Start of its current action, ns; `None` while it is inactive.
    since: Option<u64>,
    arguments: [f64; SLOTS],
    /// Number of its arguments at the newest start.
    #[serde(default)]
    given: usize,
    /// Value of its target input, while it is active without a target argument.
    #[serde(default)]
    linked: Option<[f64; 3]>,
}

impl SlotState {
    /// Target of the action: its arguments as a pose, or what its input has.
    fn target(&self) -> Pose2 {
        let [x, y, theta] = self.linked.unwrap_or([self.arguments[0], self.arguments[1], self.arguments[2]]);
        Pose2 { x, y, theta }
    }

    /// Returns true if it has a target.
    fn has_target(&self) -> bool {
        self.since.is_some() && (self.given >= 2 || self.linked.is_some())
    }
}

impl<E: ManagedMission> Default for MissionManagerState<E> {
    fn default() -> Self {
        let slots = [SlotState::default(); SLOTS];
        Self { mission: PlanMission::default(), slots, written: false, target: None }
    }
}

/// Follows a mission without a Plan: the actions that run are outputs.
pub struct MissionManager<E>(PhantomData<fn() -> E>);

impl<E: ManagedMission> Module for MissionManager<E> {
    type Io = MissionManagerPorts;
    type Params = MissionManagerParams;
    type State = MissionManagerState<E>;

    const NAME: &'static str = E::MANAGER;
    const DOC: &'static str = E::DOC;
    const STAGE: Stage = Stage::Think;

    fn spec() -> Spec {
        Spec { trigger: Trigger::Stage, deadline: None, unique: "" }
    }

    fn create(_: &Setup<'_>, _: &MissionManagerParams) -> Result<Self::State, Refusal> {
        Ok(Self::State::default())
    }

    fn tick(
        state: &mut MissionManagerState<E>,
        io: &MissionManagerPorts,
        params: &MissionManagerParams,
        now: &Tick,
    ) -> Outcome {
        let mission = &mut state.mission;
        let file = params.mission_filename.as_str();
        let settings = MissionSettings { file, params };
        if mission.read(file, params.revision, now, |saved| load::<E>(&settings, saved)) {
            mission.executor.iter_mut().for_each(E::wake);
        }
        if let Err(error) = take_conditions(mission, io, params)
            && mission.failure.is_none()
        {
            mission.fail(&error, now);
        }
        take_results(state, io, params, now);
        if let Err(error) = E::advance(&mut state.mission, now) {
            state.mission.fail(&error, now);
        }
        state.perform(io, params, now);
        state.report(io);
        match state.mission.failure {
            None => Outcome::Ok,
            Some(_) => Outcome::Degraded,
        }
    }
}

/// Loads a mission whose actions are known and have an output.
fn load<E: ManagedMission>(
    settings: &MissionSettings<'_>,
    saved: &E::Saved,
) -> Result<(E, crate::actions::MissionActions), String> {
    let (executor, actions) = E::load(settings, saved)?;
    let unknown = actions.kinds().find(|kind| !kind.is_empty() && slot_of(settings.params, kind).is_none());
    match unknown {
        None => Ok((executor, actions)),
        Some(kind) => Err(format!("{}: {}", settings.file, no_output(kind))),
    }
}

fn no_output(kind: &str) -> String {
    format!("expected the action `{kind}` among the parameter `actions`, whose first is that of `action_1`")
}

fn slot_of(params: &MissionManagerParams, kind: &str) -> Option<usize> {
    params.actions.iter().position(|name| name.as_str() == kind)
}

fn take_conditions<E: ManagedMission>(
    mission: &mut PlanMission<E>,
    io: &MissionManagerPorts,
    params: &MissionManagerParams,
) -> Result<(), String> {
    io.conditions.iter().try_for_each(|values| mission.conditions.update(&values))?;
    if let Some(facts) = io.facts.get() {
        mission.conditions.update(facts)?;
    }
    for (name, input) in params.conditions.iter().zip(io.switches()) {
        if let Some(SwitchCondition { holds }) = input.get().filter(|_| !name.as_str().is_empty()) {
            mission.conditions.set(name.as_str(), holds.get())?;
        }
    }
    // A message is the newest that is said.
    io.messages.iter().try_for_each(|values| mission.conditions.update(&values))
}

/// Ends the actions whose result has come since their start.
fn take_results<E: ManagedMission>(
    state: &mut MissionManagerState<E>,
    io: &MissionManagerPorts,
    params: &MissionManagerParams,
    now: &Tick,
) {
    // The cast clamps numbers out of range.
    let settle = (params.settle_time * 1e9) as u64;
    for (slot, result) in io.results().into_iter().enumerate() {
        let Some(since) = state.slots[slot].since else { continue };
        let is_new = result.stamp().time > since && now.now() >= since.saturating_add(settle);
        let Some(ActivityResult { has_succeeded, has_failed }) = result.get().filter(|_| is_new) else {
            continue;
        };
        let progress = match (has_failed.get(), has_succeeded.get()) {
            (true, _) => ActionProgress::Failed,
            (false, true) => ActionProgress::Succeeded,
            (false, false) => continue,
        };
        let actions = &mut state.mission.actions;
        let running = actions.running();
        let of_slot = |(_, request, start): &(usize, ActionRequest, u64)| {
            *start == since && slot_of(params, request.kind.as_str()) == Some(slot)
        };
        let index = running.into_iter().find(of_slot).map(|(index, ..)| index);
        if let Some(index) = index {
            actions.finish(index, progress);
        }
    }
}

impl<E: ManagedMission> MissionManagerState<E> {
    /// Writes the outputs of actions that have begun or ended.
    fn perform(&mut self, io: &MissionManagerPorts, params: &MissionManagerParams, now: &Tick) {
        let mut next = self.slots.map(|slot| SlotState { since: None, ..slot });
        let mut ended = None;
        for (index, request, since) in self.mission.actions.running() {
            let Some(slot) = slot_of(params, request.kind.as_str()) else {
                now.error(format_args!("{}; the action has failed", no_output(request.kind.as_str())));
                ended = Some((index, ActionProgress::Failed));
                continue;
            };
            if let Some(other) = next[slot].since {
                // The newest one has the output.
                ended = Some((index, ActionProgress::Preempted));
                if other > since {
                    continue;
                }
            }
            let mut arguments = [0.0; SLOTS];
            arguments[..request.arguments.len()].copy_from_slice(&request.arguments);
            let is_new = self.slots[slot].since != Some(since);
            let starts = self.slots[slot].starts + u64::from(is_new);
            let given = request.arguments.len();
            let linked = io.targets()[slot].get().filter(|target| given < 2 && target.is_known());
            let linked = linked.map(|target| [target.x, target.y, target.theta]);
            next[slot] = SlotState { starts, since: Some(since), arguments, given, linked };
        }
        if let Some((index, progress)) = ended {
            self.mission.actions.finish(index, progress);
        }
        for ((output, slot), before) in io.activities().into_iter().zip(&next).zip(&self.slots) {
            if slot != before || !self.written {
                let SlotState { starts, since, arguments, .. } = *slot;
                let (target, is_active) = (slot.target(), since.is_some().into());
                output.set(ManagedActivity { starts, arguments, target, is_active });
            }
        }
        (self.slots, self.written) = (next, true);
        self.show_target(io);
    }

    /// Publishes the target of the newest action that has one, if changed.
    /// It stays when the action ends.
    fn show_target(&mut self, io: &MissionManagerPorts) {
        let leading = self.slots.iter().filter(|slot| slot.has_target());
        let Some(newest) = leading.max_by_key(|slot| slot.since) else { return };
        let Pose2 { x, y, theta } = newest.target();
        if self.target != Some([x, y, theta]) {
            self.target = Some([x, y, theta]);
            io.target.set(Pose2 { x, y, theta });
        }
    }

    /// Writes the running actions, if they have changed.
    fn report(&mut self, io: &MissionManagerPorts) {
        let mission = &mut self.mission;
        mission.report_text.clear();
        let (text, actions) = (&mut mission.report_text, &mission.actions);
        for (_, request, _) in actions.running() {
            text.push_str(if text.is_empty() { "" } else { ", " });
            text.push_str(request.kind.as_str());
            for argument in request.arguments.iter() {
                // Writing into a string can't fail.
                let _ = write!(text, " {argument}");
            }
        }
        let ended = mission.executor.as_ref().and_then(E::ending);
        let verdict: Verdict =
            mission.verdict(ended.as_ref().map(|ended| ended.as_deref().map_err(String::as_str)));
        if verdict.state != MissionState::RUNNING {
            mission.report_text.clear();
            mission.report_text.push_str(verdict.reason.as_str());
        }
        if mission.takes_report() {
            io.mission.set(ManagedMissionStatus { active: Text::new(&mission.report_text) });
            io.verdict.set(verdict);
        }
    }
}
