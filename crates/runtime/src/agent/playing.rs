//! Agent that plays a recording.

use std::sync::Arc;

use slate_blackboard::channel::Budget;
use slate_blackboard::interface::{Descriptor, Interface};
use slate_sorted::SortedSet;

use super::handle::AgentHandle;
use crate::playback::{Playback, PlaybackControl, Played};
use crate::recording::{History, HistoryRequest, Recording, RecordingRefusal, TakeValue};
use slate_configuration::{Configuration, Diagnostic, Report};
use slate_engine::main_loop::{LoopReplay, ReplayedCondition, SharedLoop};
use slate_engine::runner::ModuleState;

/// Readers of properties without a link at the start.
const READERS: Budget = Budget { latest: 16, queues: 4, window: 16 };
/// Values kept for queues that are linked later; [`BYTES`] limits their memory.
const DEPTH: usize = 32;
/// Most memory for the kept values of a property, bytes.
const BYTES: usize = 64 << 10;

/// Adds the unlinked properties of a recording to the board.
/// The playback then controls all of them.
pub(super) fn begin(
    mut playback: Box<dyn Playback>,
    played: &[Played],
    configuration: &Configuration,
    agent: &AgentHandle,
    shared: &SharedLoop,
) -> Result<(), Report> {
    let mut properties = Vec::new();
    for played in played.iter().filter(|played| !played.is_mailbox) {
        let there = shared.board.properties().into_iter().find(|property| property.path() == played.path);
        if let Some(property) = there.filter(|property| !property.has_writer()) {
            properties.push(property);
            continue;
        }
        let bytes = played.descriptor.shape(played.capacity).bytes(played.capacity).max(1);
        let added = played.add(&shared.board, (BYTES / bytes).clamp(1, DEPTH), READERS);
        properties.push(added.map_err(|error| {
            let message = format!("the recording can't be played beside the agent's own properties: {error}");
            let help = format!("leave it out: --exclude /{}", played.path);
            let name = configuration.agent_name();
            Report::from(Diagnostic::without_place(format!("agent `{name}`: {message}"), Some(help)))
        })?);
    }
    let conditions = conditions(played, agent, shared);
    playback.begin(&properties, &shared.board).map_err(|message| {
        let name = configuration.agent_name();
        Report::from(Diagnostic::without_place(format!("agent `{name}`: {message}"), None))
    })?;
    shared.play(Some(LoopReplay { playback, conditions }));
    Ok(())
}

/// Returns the conditions of the replayed modules.
/// They follow the modules' recorded states; before the first one a module counts as healthy.
fn conditions(played: &[Played], agent: &AgentHandle, shared: &SharedLoop) -> Vec<ReplayedCondition> {
    let modules: SortedSet<&String> = played.iter().filter_map(|played| played.module.as_ref()).collect();
    let mut composition = agent.composition();
    let mut conditions = Vec::new();
    for module in modules {
        if composition.assembly.modules.contains_key(module) {
            continue;
        }
        let health = composition.assembly.resources.signals(module).health;
        health.begin();
        let state = shared.board.get(&format!("{module}/state")).map(|(state, _)| state);
        // Those of earlier versions have the condition at the same place.
        let place = std::mem::offset_of!(ModuleState, condition);
        let is_state = |descriptor: &Descriptor| {
            let condition = descriptor.field("condition");
            descriptor.name == ModuleState::DESCRIPTOR.name
                && condition.is_some_and(|condition| condition.offset == place)
        };
        let state = state.filter(|state| is_state(state.descriptor()));
        // Without a reader it is not reported.
        let reader = state.and_then(|state| state.channel()?.latest().ok());
        conditions.extend(reader.map(|state| ReplayedCondition { state, health }));
    }
    conditions
}

/// Access of tools to the past, and control of a playback.
pub(super) struct PlaybackAccess<'c> {
    agent: &'c AgentHandle,
}

impl<'c> PlaybackAccess<'c> {
    pub fn new(agent: &'c AgentHandle) -> Self {
        Self { agent }
    }

    /// Reads the earlier values of a property.
    /// They come from the recording that is played, else from the last seconds, if these are kept.
    pub fn history(
        &self,
        request: &HistoryRequest,
        take: &mut TakeValue<'_>,
    ) -> Result<History, RecordingRefusal> {
        if let Some(playback) = self.playback() {
            return playback
                .history(request, take)
                .map_err(|(message, help)| RecordingRefusal { message, help });
        }
        let control = self.agent.recorder.recording.as_deref().and_then(Recording::control);
        let control = control.ok_or_else(|| RecordingRefusal {
            message: "nothing is kept of this agent's past".into(),
            help: "`slate run` has a recorder; a program gives its agent one with `Options::recording`"
                .into(),
        })?;
        control.history(request, take)
    }

    /// Sets the playback that tools control; the application makes its cycles.
    pub fn control(&self, control: Arc<dyn PlaybackControl>) {
        self.agent.composition().playback = Some(control);
    }

    /// Control of the playback; `None` if the agent plays no recording.
    pub fn playback(&self) -> Option<Arc<dyn PlaybackControl>> {
        self.agent.composition().playback.clone()
    }
}
