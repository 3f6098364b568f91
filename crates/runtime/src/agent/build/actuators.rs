//! Gates of the actuators.

use std::sync::Arc;

use slate_blackboard::Access;
use slate_blackboard::channel::Writer;
use slate_blackboard::interface::Descriptor;
use slate_module::Interface;
use slate_safety::{Gate, GateState};

use super::{Failed, ModuleBuilder, new_writer};
use slate_composition::{BuildPlan, GATE, PlannedGate, SAME_ACTUATOR, gate_stores, planned_gate};
use slate_engine::actuators::Actuator;

/// Builder of the actuators' gates.
pub(super) struct GateBuilder<'b, 'a, 's> {
    plan: BuildPlan<'a, 's>,
    builder: &'b mut ModuleBuilder<'a, 's>,
}

impl<'b, 'a, 's> GateBuilder<'b, 'a, 's> {
    pub fn new(builder: &'b mut ModuleBuilder<'a, 's>) -> Self {
        Self { plan: builder.plan, builder }
    }

    /// Makes the missing gates whose commands are known.
    pub fn all(&mut self) {
        for (i, wanted) in self.plan.configuration.actuators().iter().enumerate() {
            if self.builder.resources.actuators.contains_key(&wanted.name.value) {
                continue;
            }
            // The error was reported.
            if let Ok(Some(actuator)) = self.actuator(i, wanted) {
                for wake in self.builder.wakes(&format!("{}/command", wanted.name.value)) {
                    actuator.add_wake(wake);
                }
                self.builder.resources.actuators.insert(wanted.name.value.clone(), Arc::new(actuator));
            }
        }
    }

    /// Makes an actuator; `None` while its commanders are absent.
    fn actuator(
        &mut self,
        index: usize,
        wanted: &slate_configuration::Actuator,
    ) -> Result<Option<Actuator>, Failed> {
        let planned = planned_gate(self.plan, index, &mut self.builder.diagnostics);
        let Some(PlannedGate { descriptor, configuration }) = planned else { return Ok(None) };
        let gate = configuration.stop_latch(&self.builder.resources.stop);
        let (command, state) = self.gate_properties(index, wanted, descriptor)?;
        let ports = wanted.commands.iter().map(|url| url.value.path_in(""));
        let commanding_modules = wanted.modules.iter().map(|module| module.value.clone());
        let commanders = ports.chain(commanding_modules).collect();
        let resources = &mut *self.builder.resources;
        resources.index += 1;
        let own = (resources.index, Arc::clone(&resources.service_context.clock));
        Ok(Some(Actuator::new(&wanted.name.value, commanders, Gate::new(gate), command, state, own)))
    }

    /// Returns the writers of a gate's command and of its state.
    fn gate_properties(
        &mut self,
        index: usize,
        wanted: &slate_configuration::Actuator,
        descriptor: &'static Descriptor,
    ) -> Result<(Writer, Writer), Failed> {
        let name = &wanted.name.value;
        let (command_store, state_store) = gate_stores(self.plan, index);
        let board = &self.builder.resources.board;
        let command = board.add_channel(
            &format!("{name}/command"),
            "Command that passed the gate.",
            descriptor,
            command_store,
            Access::Output,
        );
        let state = board.add_channel(
            &format!("{name}/gate"),
            "State of the gate.",
            GateState::DESCRIPTOR,
            state_store,
            Access::Output,
        );
        if let Ok(command) = &command {
            command.set_part(GATE);
        }
        match (command, state) {
            (Ok(command), Ok(state)) => new_writer(&command).zip(new_writer(&state)).ok_or(Failed),
            (Err(error), _) | (_, Err(error)) => {
                self.builder.diagnostics.add(wanted.name.span, error.to_string(), SAME_ACTUATOR);
                Err(Failed)
            }
        }
    }
}
