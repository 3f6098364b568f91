//! Ticks: ends of actions, transitions, and which actions run.

use std::sync::Arc;

use super::*;

/// Maximum number of transitions of a tick.
const MOST_STEPS: usize = 64;
/// Deepest nesting of a program that remains.
pub(super) const MOST_DEPTH: u16 = 300;

impl GologExecutor {
    /// Executes the program until it waits.
    /// It waits for the robot, for a condition, or for a search that continues.
    ///
    /// A tick has at most 64 transitions; the next one continues from there.
    ///
    /// # Errors
    /// If the program can't continue; the host has stopped all actions.
    pub fn tick(&mut self, host: &mut impl GologHost) -> Result<GologOutcome, GologRunError> {
        self.tick_at_most(MOST_STEPS, host)
    }

    /// Executes the program as [`tick`](Self::tick) does, with one transition at most.
    ///
    /// # Errors
    /// As [`tick`](Self::tick).
    pub fn step_once(&mut self, host: &mut impl GologHost) -> Result<GologOutcome, GologRunError> {
        self.tick_at_most(1, host)
    }

    fn tick_at_most(
        &mut self,
        steps: usize,
        host: &mut impl GologHost,
    ) -> Result<GologOutcome, GologRunError> {
        if self.outcome != GologOutcome::Running {
            return Ok(self.outcome);
        }
        let result = self.execute(steps, host);
        if result.is_err() {
            self.stop_all(host);
        }
        result.map(|()| self.outcome)
    }

    fn execute(&mut self, steps: usize, host: &mut impl GologHost) -> Result<(), GologRunError> {
        self.take_ends(host)?;
        if self.is_blocked {
            return Ok(());
        }
        self.changes += 1;
        let mut budget = self.limits.transitions_per_tick;
        for _ in 0..steps {
            if !self.step(&mut budget)? {
                break;
            }
        }
        // The places of a search have numbers of their own.
        if self.search.is_none() {
            let roots = [&mut self.program].into_iter().chain(self.hopeless.iter_mut());
            self.programs.collect(&self.theory.nodes, roots);
        }
        self.exchange(host)
    }

    /// Handles the ends of actions, in the order of their slots.
    fn take_ends(&mut self, host: &mut impl GologHost) -> Result<(), GologRunError> {
        for slot in 0..self.performances.len() {
            let Some(Performance { action, phase: PerformancePhase::Running }) = self.performances[slot]
            else {
                continue;
            };
            let model = &self.theory.actions[action.action as usize];
            let kind = match host.progress(slot) {
                GologProgress::Running => continue,
                GologProgress::Succeeded => EffectKind::Ended(Some(true)),
                GologProgress::Failed if model.senses.is_some() => EffectKind::Ended(Some(false)),
                GologProgress::Failed if model.failure_effects.is_some() => EffectKind::Failed,
                GologProgress::Failed => {
                    self.performances[slot] = None;
                    self.trace.add(action, TracedEvent::Failed);
                    let text = action.text(&self.theory);
                    let reason = format!(
                        "the action `{text}` has failed; declare its effects on failure: `if failed: ...`"
                    );
                    return Err(GologRunError { line: model.line, reason });
                }
            };
            self.performances[slot] = None;
            let has_succeeded = kind == EffectKind::Ended(Some(true));
            self.trace.add(action, if has_succeeded { TracedEvent::Succeeded } else { TracedEvent::Failed });
            self.situation.apply(&self.theory, &action, kind)?;
            // Slots are few.
            self.program = self.programs.without(self.program, slot as u32);
            self.change();
        }
        Ok(())
    }

    /// Performs a transition; returns true if another one may follow in this tick.
    fn step(&mut self, budget: &mut u64) -> Result<bool, GologRunError> {
        let slot = self.performances.iter().position(Option::is_none).unwrap_or(self.performances.len());
        let theory = Arc::clone(&self.theory);
        let mut found = std::mem::take(&mut self.found);
        found.clear();
        let mut plan = None;
        loop {
            let mode = TransitionMode::Executed {
                slot: slot as u32,
                situation: self.hash,
                hopeless: &self.hopeless,
                found: plan,
            };
            let view = SituationView { theory: &theory, cells: &self.situation.cells };
            let mut reader = TransitionReader::new(view, &mut self.programs, mode);
            reader.transitions(self.program, &mut found)?;
            let Some(ProgramTransition { program, needs_search: true, .. }) = found.first().copied() else {
                if found.is_empty() {
                    self.is_blocked = true;
                    if reader.is_final(self.program)? {
                        self.outcome = GologOutcome::Succeeded;
                    } else if self.performances.iter().all(Option::is_none) && self.observed.is_empty() {
                        self.outcome = GologOutcome::Failed;
                    }
                }
                break;
            };
            found.clear();
            match self.search(program, budget)? {
                SearchProgress::Found => plan = self.take_plan(program),
                SearchProgress::Exhausted => self.hopeless.push(program),
                SearchProgress::Interrupted => {
                    self.found = found;
                    return Ok(false);
                }
            }
        }
        let first = found.first().copied();
        self.found = found;
        let Some(ProgramTransition { action, program, .. }) = first else { return Ok(false) };
        self.take(action, program, slot)?;
        Ok(true)
    }

    fn take(&mut self, action: Option<GroundAction>, program: u32, slot: usize) -> Result<(), GologRunError> {
        self.program = program;
        self.steps = self.steps.saturating_add(1);
        if self.programs.depth(program) > MOST_DEPTH {
            let reason = format!("programs nest deeper than {MOST_DEPTH}: check the recursion of procedures");
            return Err(GologRunError { line: self.theory.procedures[self.theory.main].line, reason });
        }
        let Some(action) = action else { return Ok(()) };
        let model = &self.theory.actions[action.action as usize];
        if model.performs.is_none() {
            self.trace.add(action, TracedEvent::Done);
            self.situation.apply(&self.theory, &action, EffectKind::Ended(None))?;
            self.change();
            return Ok(());
        }
        if slot == MOST_ACTIONS {
            let reason = format!("expected at most {MOST_ACTIONS} actions of the robot at a time");
            return Err(GologRunError { line: model.line, reason });
        }
        self.performances.resize(self.performances.len().max(slot + 1), None);
        self.performances[slot] = Some(Performance { action, phase: PerformancePhase::New });
        Ok(())
    }

    /// Searches for a plan of a program in this situation.
    fn search(&mut self, program: u32, budget: &mut u64) -> Result<SearchProgress, GologRunError> {
        if self.search.as_ref().is_none_or(|search| search.program != program) {
            let mut search = DepthFirstSearch::of_plan(&self.situation.cells);
            let is_found = search.begin(&self.theory, &mut self.programs, program)?;
            self.search = Some(RunningSearch { program, search });
            if is_found {
                return Ok(SearchProgress::Found);
            }
        }
        let Some(RunningSearch { search, .. }) = &mut self.search else {
            return Ok(SearchProgress::Exhausted);
        };
        let before = search.transitions;
        let most = (*budget).min(self.limits.most_transitions.saturating_sub(before));
        let progress = search.run(&self.theory, &mut self.programs, most)?;
        *budget -= search.transitions - before;
        if progress == SearchProgress::Interrupted && search.transitions >= self.limits.most_transitions {
            let most = self.limits.most_transitions;
            let reason = format!(
                "the search has found no plan within {most} transitions: raise the limit, or guide it by tests"
            );
            return Err(GologRunError { line: self.line(program), reason });
        }
        if progress == SearchProgress::Exhausted {
            self.search = None;
        }
        Ok(progress)
    }

    /// Returns the line of a program.
    fn line(&self, program: u32) -> usize {
        match self.programs.get(program) {
            Remaining::Code(node, _) => self.theory.nodes[node as usize].line,
            Remaining::Then(first, _) | Remaining::Both(first, _) | Remaining::Priority(first, _) => {
                self.line(first)
            }
            _ => self.theory.procedures[self.theory.main].line,
        }
    }

    /// Stores the plan of a search; returns the program and its first step.
    fn take_plan(&mut self, program: u32) -> Option<(u32, u32)> {
        let RunningSearch { search, .. } = self.search.take()?;
        let mut next = None;
        let mut action = None;
        for (program, expected, led) in search.path().rev() {
            let step =
                PlannedStep { program, expected, action: if next.is_some() { action } else { None }, next };
            // A plan is at most as long as a search.
            next = Some(self.programs.plans.len() as u32);
            self.programs.plans.push(step);
            action = led;
        }
        next.map(|first| (program, first))
    }

    /// Stops, starts and continues actions of the robot.
    fn exchange(&mut self, host: &mut impl GologHost) -> Result<(), GologRunError> {
        self.suspended.clear();
        self.suspended.resize(self.performances.len(), false);
        self.programs.mark_suspended(self.program, false, &mut self.suspended);
        for (slot, own) in self.performances.iter_mut().enumerate() {
            if let (Some(own), true) = (own, self.suspended[slot]) {
                if own.phase == PerformancePhase::Running {
                    host.stop(slot);
                }
                own.phase = PerformancePhase::Suspended;
            }
        }
        for slot in 0..self.performances.len() {
            let Some(Performance { action, phase }) = self.performances[slot] else { continue };
            if self.suspended[slot] || phase == PerformancePhase::Running {
                continue;
            }
            let robot_action = self.robot_action(&action)?;
            let line = self.theory.actions[action.action as usize].line;
            host.start(slot, &robot_action).map_err(|reason| GologRunError { line, reason })?;
            self.trace.add(action, TracedEvent::Started);
            self.performances[slot] = Some(Performance { action, phase: PerformancePhase::Running });
        }
        Ok(())
    }

    fn stop_all(&mut self, host: &mut impl GologHost) {
        for (slot, own) in self.performances.iter_mut().enumerate() {
            if let Some(Performance { phase: PerformancePhase::Running, .. }) = own.take() {
                host.stop(slot);
            }
        }
        self.outcome = GologOutcome::Failed;
    }
}
