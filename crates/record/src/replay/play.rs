//! Cycles of a playback, and its orders meanwhile.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use slate_runtime::playback::{LoopSection, Order, PlaybackStatus};
use slate_runtime::recording::Change;
use slate_runtime::{Agent, Rate};

use super::changes::make_until;
use super::orders::OrderOutcome;
use super::plan::{PlayError, PlayedRun};
use super::player::{Player, rate};

/// Position of a playback.
struct Turn {
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

const INSIDE: &str = "give seconds after the first value, such as 1.5; `slate replay status` shows the length of the recording";

/// Polling period for the end of a playback that stands still.
const LOOK: Duration = Duration::from_millis(50);

/// Period at which measurements are shown.
const SHOW: Duration = Duration::from_millis(100);

impl Player {
    /// Plays in an agent that was loaded for it, until the end or until `stop` is set.
    ///
    /// # Errors
    /// When the file has become another one, or a module does not return.
    pub fn run(&mut self, agent: &mut Agent, stop: &AtomicBool) -> Result<PlayedRun, PlayError> {
        self.run_with(agent, stop, |_| {})
    }

    /// Plays as [`run`](Player::run), and calls `look` after each cycle.
    ///
    /// # Errors
    /// As [`run`](Player::run).
    #[allow(clippy::disallowed_methods, reason = "what is measured is shown on the wall clock")]
    pub fn run_with(
        &mut self,
        agent: &mut Agent,
        stop: &AtomicBool,
        mut look: impl FnMut(&mut Agent),
    ) -> Result<PlayedRun, PlayError> {
        let mut turn = Turn {
            time: self.bounds.0,
            cycles: 0,
            has_begun: false,
            is_paused: self.plan.is_paused,
            rate: self.plan.rate,
            section: self.plan.repeats.then_some(LoopSection { from: self.bounds.0, to: self.bounds.1 }),
            is_whole: false,
        };
        if self.bounds.0 > self.span.0 {
            self.reel.get().jump(self.bounds.0)?;
        }
        let mut shown = Instant::now();
        while !stop.load(Ordering::Relaxed) {
            if let Some((order, answer)) =
                self.orders.next(if turn.is_paused { LOOK } else { Duration::ZERO })
            {
                let done = self.obey(order, agent, &mut turn, &mut look, stop)?;
                // The caller may be gone.
                let _ = answer.send(done);
                continue;
            }
            if turn.is_paused {
                continue;
            }
            if self.is_over(&turn) {
                let Some(section) = turn.section else {
                    turn.is_whole = true;
                    if self.plan.stays {
                        turn.is_paused = true;
                        agent.publish_timing();
                        continue;
                    }
                    break;
                };
                self.jump(section.from, agent, &mut turn)?;
            }
            self.cycle(agent, &mut turn, &mut look)?;
            if shown.elapsed() > SHOW {
                shown = Instant::now();
                agent.publish_timing();
            }
        }
        let values = self.reel.get().values;
        let time = turn.time.saturating_sub(self.span.0);
        Ok(PlayedRun { values, cycles: turn.cycles, time, is_whole: turn.is_whole })
    }

    /// Returns true if nothing is left before the end.
    fn is_over(&self, turn: &Turn) -> bool {
        let end = turn.section.map_or(self.bounds.1, |section| section.to);
        turn.has_begun && self.reel.get().following(turn.time).is_none_or(|next| next > end)
    }

    fn cycle(
        &mut self,
        agent: &mut Agent,
        turn: &mut Turn,
        look: &mut impl FnMut(&mut Agent),
    ) -> Result<(), PlayError> {
        let (until, place) = self.due(turn);
        let due = self.changes.iter().filter(|(after, _)| *after <= until);
        let mut orders = due.filter_map(|(_, change)| match change {
            Change::Order { stages } => Some(stages),
            _ => None,
        });
        if let Some(stages) = orders.next_back() {
            let stages: Vec<_> = stages.iter().map(|(_, modules)| modules.clone()).collect();
            self.reel.get().place(&stages, &self.plan.modules);
        }
        while let Err(reason) = make_until(agent, &mut self.changes, until, &place) {
            self.misses.push(reason);
        }
        // In lockstep they came after the cycle of their time; none came before the first.
        let next = self.period.map(|period| turn.time.saturating_add(period));
        if let Some(time) = next.or(turn.has_begun.then_some(turn.time))
            && let Err(reason) = self.external.set_until(agent, time)
        {
            self.misses.push(reason);
        }
        if !agent.step() {
            return Err(PlayError::Hung);
        }
        (turn.cycles, turn.has_begun) = (turn.cycles + 1, true);
        turn.time = agent.now();
        self.reached = turn.time;
        let sent = self.reel.get().take_sent(turn.time);
        if let Some(witness) = &mut self.witness {
            witness.look()?;
            witness.hear(sent)?;
        }
        let mut reel = self.reel.get();
        reel.check()?;
        while let Some(line) = reel.timeline.lines.get(self.line).filter(|line| line.time <= turn.time) {
            agent.logger().log_recorded(&line.module, line.time, line.level, &line.text);
            self.line += 1;
        }
        drop(reel);
        look(agent);
        Ok(())
    }

    /// Returns the limit of the changes due before the next cycle, and its name.
    /// The limit is a cycle, or on the wall clock a time.
    fn due(&self, turn: &Turn) -> (u64, String) {
        let Some(period) = self.period else {
            let cycle = self.skipped + turn.cycles;
            return (cycle, format!("after cycle {cycle}"));
        };
        let next = if turn.has_begun { turn.time.saturating_add(period) } else { self.bounds.0 };
        // Cycles were not made exactly when they were due, and some not at all: values that were written in each cycle say
        // between which of them a change was, and others are waited for a little.
        let has_come = |time: u64| self.witness.as_ref().is_none_or(|witness| witness.has_all_until(time));
        let counts = self.witness.as_ref().is_some_and(|witness| witness.counts_cycles(period));
        let is_late = |time: u64| next.saturating_sub(time) > 2 * period;
        let is_due = |time: u64| {
            if counts { has_come(time) } else { time <= next && (is_late(time) || has_come(time)) }
        };
        let due = self.changes.iter().map(|(time, _)| *time).take_while(|time| is_due(*time)).last();
        let until = due.unwrap_or(0);
        (until, format!("at {:.3} s", until as f64 * 1e-9))
    }

    fn jump(&mut self, time: u64, agent: &mut Agent, turn: &mut Turn) -> Result<bool, PlayError> {
        if !agent.jump(time) {
            return Ok(false);
        }
        let mut reel = self.reel.get();
        reel.jump(time)?;
        self.line = reel.timeline.lines.partition_point(|line| line.time <= time);
        (turn.time, turn.has_begun) = (time, true);
        Ok(true)
    }

    fn obey(
        &mut self,
        order: Order,
        agent: &mut Agent,
        turn: &mut Turn,
        look: &mut impl FnMut(&mut Agent),
        stop: &AtomicBool,
    ) -> Result<OrderOutcome, PlayError> {
        let at = |time: u64| self.span.0.saturating_add(time);
        let refused = |message: String, help: &str| Ok(Err((message, help.to_owned())));
        let has_modules = !self.plan.modules.is_empty();
        match order {
            Order::Status => {}
            Order::Pause => turn.is_paused = true,
            Order::Resume => {
                turn.is_paused = false;
                agent.set_rate(rate(turn.rate));
            }
            Order::Rate(Some(factor)) if !(factor.is_finite() && factor > 0.0) => {
                return refused(
                    format!("the rate is {factor}: expected a positive factor"),
                    "give a factor such as 0.5, or max",
                );
            }
            Order::Rate(factor) => {
                turn.rate = factor;
                agent.set_rate(rate(factor));
            }
            Order::Step(count) => {
                turn.is_paused = true;
                agent.set_rate(Rate::Max);
                for _ in 0..count {
                    if stop.load(Ordering::Relaxed) || self.is_over(turn) {
                        break;
                    }
                    self.cycle(agent, turn, look)?;
                }
                agent.set_rate(rate(turn.rate));
                agent.publish_timing();
            }
            Order::Seek(_) | Order::Loop(Some(_)) if has_modules => {
                return refused(
                    "modules run on the recording, and their time never goes back".into(),
                    "play it anew with --start, or without --recompute",
                );
            }
            Order::Seek(time) if at(time) > self.span.1 => return refused(self.beyond(time), INSIDE),
            Order::Seek(time) => drop(self.jump(at(time), agent, turn)?),
            Order::Loop(None) => turn.section = None,
            Order::Loop(Some(LoopSection { from, to })) if from >= to => {
                let seconds = |time: u64| time as f64 * 1e-9;
                let (from, to) = (seconds(from), seconds(to));
                let message =
                    format!("the loop ends at {to:.3} s: expected an end after its begin at {from:.3} s");
                return refused(message, INSIDE);
            }
            Order::Loop(Some(LoopSection { from, .. })) if at(from) > self.span.1 => {
                return refused(self.beyond(from), INSIDE);
            }
            Order::Loop(Some(LoopSection { from, to })) => {
                let section = LoopSection { from: at(from), to: at(to).min(self.span.1) };
                turn.section = Some(section);
                if !(section.from..=section.to).contains(&turn.time) {
                    self.jump(section.from, agent, turn)?;
                }
            }
        }
        Ok(Ok(self.status(turn)))
    }

    fn beyond(&self, time: u64) -> String {
        let seconds = |time: u64| time as f64 * 1e-9;
        let end = seconds(self.span.1 - self.span.0);
        format!("{:.3} s is after the end of the recording: expected 0 to {end:.3} s", seconds(time))
    }

    fn status(&self, turn: &Turn) -> PlaybackStatus {
        let after = |time: u64| time.saturating_sub(self.span.0);
        PlaybackStatus {
            file: self.file.clone(),
            begin: self.span.0,
            time: after(turn.time),
            from: after(self.bounds.0),
            to: after(self.bounds.1),
            is_paused: turn.is_paused,
            rate: turn.rate,
            section: turn.section.map(|own| LoopSection { from: after(own.from), to: after(own.to) }),
            values: self.reel.get().values,
            modules: self.plan.modules.iter().cloned().collect(),
        }
    }
}
