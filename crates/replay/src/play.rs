//! Cycles of a playback, and its orders meanwhile.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use slate_runtime::playback::{LoopSection, Order, PlaybackStatus};
use slate_runtime::recording::Change;
use slate_runtime::{Agent, Rate};

use super::changes::{after_cycle, make_until};
use super::orders::OrderOutcome;
use super::plan::{PlayError, PlayedRun};
use super::player::{Player, rate};

/// Position of a playback.
struct PlaybackPosition {
    time: u64,
    cycles: u64,
    /// Set once the playback is at a time of the recording.
    /// It was sent there, or has made a cycle.
    has_begun: bool,
    is_paused: bool,
    rate: Option<f64>,
    section: Option<LoopSection>,
    is_whole: bool,
}

const SEEK_HELP: &str = "give seconds after the first value, such as 1.5; `slate replay status` shows the length of the recording";

/// Polling period for the end of a playback that stands still.
const PAUSE_POLL_PERIOD: Duration = Duration::from_millis(50);

/// Period at which measurements are shown.
const TIMING_PERIOD: Duration = Duration::from_millis(100);

impl Player {
    /// Plays in an agent that was loaded for it, until the end or until `stop` is set.
    ///
    /// # Errors
    /// When the file has become another one, or a module does not return.
    pub fn run(&mut self, agent: &mut Agent, stop: &AtomicBool) -> Result<PlayedRun, PlayError> {
        self.run_with(agent, stop, |_| {})
    }

    /// Plays as [`run`](Player::run), and calls `on_cycle` after each cycle.
    ///
    /// # Errors
    /// As [`run`](Player::run).
    #[allow(clippy::disallowed_methods, reason = "wall-clock measurements are not replayed")]
    pub fn run_with(
        &mut self,
        agent: &mut Agent,
        stop: &AtomicBool,
        mut on_cycle: impl FnMut(&mut Agent),
    ) -> Result<PlayedRun, PlayError> {
        let mut position = PlaybackPosition {
            time: self.bounds.0,
            cycles: 0,
            has_begun: false,
            is_paused: self.plan.is_paused,
            rate: self.plan.rate,
            section: self.plan.repeats.then_some(LoopSection { from: self.bounds.0, to: self.bounds.1 }),
            is_whole: false,
        };
        if self.bounds.0 > self.span.0 {
            self.playback.get().jump(self.bounds.0)?;
        }
        let mut shown = Instant::now();
        while !stop.load(Ordering::Relaxed) {
            if let Some((order, answer)) =
                self.orders.next(if position.is_paused { PAUSE_POLL_PERIOD } else { Duration::ZERO })
            {
                let done = self.execute_order(order, agent, &mut position, &mut on_cycle, stop)?;
                // The caller may be gone.
                let _ = answer.send(done);
                continue;
            }
            if position.is_paused {
                continue;
            }
            if self.is_over(&position) {
                let Some(section) = position.section else {
                    position.is_whole = true;
                    if self.plan.stays {
                        position.is_paused = true;
                        agent.publish_timing();
                        continue;
                    }
                    break;
                };
                self.jump(section.from, agent, &mut position)?;
            }
            self.cycle(agent, &mut position, &mut on_cycle)?;
            if shown.elapsed() > TIMING_PERIOD {
                shown = Instant::now();
                agent.publish_timing();
            }
        }
        let values = self.playback.get().values;
        let time = position.time.saturating_sub(self.span.0);
        Ok(PlayedRun { values, cycles: position.cycles, time, is_whole: position.is_whole })
    }

    /// Returns true if nothing is left before the end.
    fn is_over(&self, position: &PlaybackPosition) -> bool {
        let end = position.section.map_or(self.bounds.1, |section| section.to);
        position.has_begun && self.playback.get().following(position.time).is_none_or(|next| next > end)
    }

    fn cycle(
        &mut self,
        agent: &mut Agent,
        position: &mut PlaybackPosition,
        on_cycle: &mut impl FnMut(&mut Agent),
    ) -> Result<(), PlayError> {
        let (until, moment) = self.due(position);
        let due = self.changes.iter().filter(|own| own.after <= until);
        let mut orders = due.filter_map(|own| match &own.change {
            Change::Order { stages } => Some(stages),
            _ => None,
        });
        if let Some(stages) = orders.next_back() {
            let stages: Vec<_> = stages.iter().map(|(_, modules)| modules.clone()).collect();
            self.playback.get().assign_positions(&stages, &self.plan.modules);
        }
        while let Err(reason) = make_until(agent, &mut self.changes, until, &moment) {
            self.misses.push(reason);
        }
        // In lockstep they came after the cycle of their time; none came before the first.
        let next = self.period.map(|period| position.time.saturating_add(period));
        if let Some(time) = next.or(position.has_begun.then_some(position.time))
            && let Err(reason) = self.external.set_until(agent, time)
        {
            self.misses.push(reason);
        }
        if !agent.step() {
            return Err(PlayError::Hung);
        }
        (position.cycles, position.has_begun) = (position.cycles + 1, true);
        position.time = agent.now();
        self.reached = position.time;
        let sent = self.playback.get().take_sent(position.time);
        if let Some(output_comparer) = &mut self.output_comparer {
            output_comparer.compare_values()?;
            output_comparer.compare_sent_messages(sent)?;
        }
        let mut playback = self.playback.get();
        playback.check()?;
        while let Some(line) =
            playback.timeline.lines.get(self.line).filter(|line| line.time <= position.time)
        {
            agent.logger().log_recorded(&line.module, line.time, line.level, &line.text);
            self.line += 1;
        }
        drop(playback);
        on_cycle(agent);
        Ok(())
    }

    /// Returns the limit of the changes due before the next cycle, and its name.
    /// The limit is a cycle, or on the wall clock a time.
    fn due(&self, position: &PlaybackPosition) -> (u64, String) {
        let Some(period) = self.period else {
            let cycle = self.skipped + position.cycles;
            return (cycle, after_cycle(cycle));
        };
        let next = if position.has_begun { position.time.saturating_add(period) } else { self.bounds.0 };
        // Cycles were not made exactly when they were due, and some not at all: values that were written in each cycle say
        // between which of them a change was, and others are waited for a little.
        let has_come = |time: u64| {
            self.output_comparer.as_ref().is_none_or(|output_comparer| output_comparer.has_all_until(time))
        };
        let counts = self
            .output_comparer
            .as_ref()
            .is_some_and(|output_comparer| output_comparer.has_cyclic_property(period));
        let is_late = |time: u64| next.saturating_sub(time) > 2 * period;
        let is_due = |time: u64| {
            if counts { has_come(time) } else { time <= next && (is_late(time) || has_come(time)) }
        };
        let due = self.changes.iter().map(|own| own.after).take_while(|time| is_due(*time)).last();
        let until = due.unwrap_or(0);
        (until, format!("at {:.3} s", until as f64 * 1e-9))
    }

    fn jump(
        &mut self,
        time: u64,
        agent: &mut Agent,
        position: &mut PlaybackPosition,
    ) -> Result<bool, PlayError> {
        if !agent.jump(time) {
            return Ok(false);
        }
        let mut playback = self.playback.get();
        playback.jump(time)?;
        self.line = playback.timeline.lines.partition_point(|line| line.time <= time);
        (position.time, position.has_begun) = (time, true);
        Ok(true)
    }

    fn execute_order(
        &mut self,
        order: Order,
        agent: &mut Agent,
        position: &mut PlaybackPosition,
        on_cycle: &mut impl FnMut(&mut Agent),
        stop: &AtomicBool,
    ) -> Result<OrderOutcome, PlayError> {
        let at = |time: u64| self.span.0.saturating_add(time);
        let refused = |message: String, help: &str| Ok(Err((message, help.to_owned())));
        let has_modules = !self.plan.modules.is_empty();
        match order {
            Order::Status => {}
            Order::Pause => position.is_paused = true,
            Order::Resume => {
                position.is_paused = false;
                agent.set_rate(rate(position.rate));
            }
            Order::Rate(Some(factor)) if !(factor.is_finite() && factor > 0.0) => {
                return refused(
                    format!("the rate is {factor}: expected a positive factor"),
                    "give a factor such as 0.5, or max",
                );
            }
            Order::Rate(factor) => {
                position.rate = factor;
                agent.set_rate(rate(factor));
            }
            Order::Step(count) => {
                position.is_paused = true;
                agent.set_rate(Rate::Max);
                for _ in 0..count {
                    if stop.load(Ordering::Relaxed) || self.is_over(position) {
                        break;
                    }
                    self.cycle(agent, position, on_cycle)?;
                }
                agent.set_rate(rate(position.rate));
                agent.publish_timing();
            }
            Order::Seek(_) | Order::Loop(Some(_)) if has_modules => {
                return refused(
                    "modules run on the recording, and their time never goes back".into(),
                    "play it anew with --start, or without --recompute",
                );
            }
            Order::Seek(time) if at(time) > self.span.1 => return refused(self.beyond_end(time), SEEK_HELP),
            Order::Seek(time) => drop(self.jump(at(time), agent, position)?),
            Order::Loop(None) => position.section = None,
            Order::Loop(Some(LoopSection { from, to })) if from >= to => {
                let seconds = |time: u64| time as f64 * 1e-9;
                let (from, to) = (seconds(from), seconds(to));
                let message =
                    format!("the loop ends at {to:.3} s: expected an end after its begin at {from:.3} s");
                return refused(message, SEEK_HELP);
            }
            Order::Loop(Some(LoopSection { from, .. })) if at(from) > self.span.1 => {
                return refused(self.beyond_end(from), SEEK_HELP);
            }
            Order::Loop(Some(LoopSection { from, to })) => {
                let section = LoopSection { from: at(from), to: at(to).min(self.span.1) };
                position.section = Some(section);
                if !(section.from..=section.to).contains(&position.time) {
                    self.jump(section.from, agent, position)?;
                }
            }
        }
        Ok(Ok(self.status(position)))
    }

    fn beyond_end(&self, time: u64) -> String {
        let seconds = |time: u64| time as f64 * 1e-9;
        let end = seconds(self.span.1 - self.span.0);
        format!("{:.3} s is after the end of the recording: expected 0 to {end:.3} s", seconds(time))
    }

    fn status(&self, position: &PlaybackPosition) -> PlaybackStatus {
        let after = |time: u64| time.saturating_sub(self.span.0);
        PlaybackStatus {
            file: self.file.clone(),
            begin: self.span.0,
            time: after(position.time),
            from: after(self.bounds.0),
            to: after(self.bounds.1),
            is_paused: position.is_paused,
            rate: position.rate,
            section: position.section.map(|own| LoopSection { from: after(own.from), to: after(own.to) }),
            values: self.playback.get().values,
            modules: self.plan.modules.iter().cloned().collect(),
        }
    }
}
