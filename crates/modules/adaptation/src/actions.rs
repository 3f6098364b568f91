//! Actions on sensor failures: change settings, and confirm the effect.
//!
//! | action | decomposition |
//! |---|---|
//! | `Reconfigure` | atomic: links, parameters and whatever else of the configuration may change, all in one moment |
//! | `Confirm` | atomic: waits for the effect |
//! | `SwitchTo` | `Reconfigure`; `Confirm` |

use std::fmt;

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Odometry, SonarScan};
use slate_plugin::module::Level;
use slate_plugin::module::aspect::{Aspect, RequestAnswer, Settings};
use slate_plugin::prelude::*;

use crate::alternatives::Alternatives;
use crate::range_health::invalid_share;

/// Progress of a decision.
#[interface]
#[derive(Serialize, Deserialize)]
pub enum Progress {
    /// Settings requested.
    Asked,
    /// Settings changed.
    Changed,
    /// Effect confirmed.
    Effective,
    /// Refused, or without effect.
    Failed,
}

/// Newest decision and its progress.
#[interface]
#[derive(PartialEq)]
pub struct Adaptation {
    /// Number of the decision, from 1.
    pub decision: u64,
    /// Chosen alternative.
    pub alternative: Text<28>,
    /// Progress.
    pub progress: Progress,
}

/// Settings of the agent, and measurements of their effect.
#[ports]
pub struct Managed {
    settings: Aspect<Settings>,
    /// Alternatives to choose from.
    alternatives: Required<Alternatives>,
    /// Scan that the robot's blocks use, of any sensor.
    #[stale(after = "300ms")]
    used: Input<SonarScan>,
    /// Odometry of the robot.
    #[stale(after = "300ms")]
    odometry: Input<Odometry>,
    /// Newest decision and its progress.
    adaptation: Output<Adaptation>,
}

impl Managed {
    /// Returns the speed of the robot, m/s, if known.
    fn speed(&self) -> Option<f64> {
        self.odometry.fresh().map(|odometry| odometry.twist.linear.abs())
    }

    /// Reports the progress on the blackboard and in the log.
    /// `waited` is the time since the start, seconds.
    fn report(&self, choice: Choice, progress: Progress, waited: f64, now: &Tick, what: fmt::Arguments<'_>) {
        let (decision, name) = (choice.decision as u64, self.alternatives.name(choice.number()));
        let alternative = Text::new(name);
        self.adaptation.set(Adaptation { decision, alternative, progress });
        let fields = [
            ("decision", decision.into()),
            ("alternative", name.into()),
            ("waited_s", ((waited * 1e3).round() / 1e3).into()),
            ("speed_m_s", self.speed().unwrap_or(f64::NAN).into()),
        ];
        let level = if progress == Progress::FAILED { Level::Error } else { Level::Info };
        now.log_with(level, what, &fields);
    }
}

/// Alternative, and the decision that selected it.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct Choice {
    /// Index in [`Alternatives`], from 0.
    pub alternative: f64,
    /// Number of the decision, from 1.
    pub decision: f64,
}
arguments!(Choice { alternative, decision });

impl Choice {
    fn number(&self) -> usize {
        // The Plan counts them from 0; the cast clamps numbers out of range.
        self.alternative as usize
    }
}

/// Changes the settings to those of an alternative, all in one moment.
#[derive(Serialize, Deserialize)]
pub struct Reconfigure {
    choice: Choice,
    /// Request to the host, and its time, nanoseconds.
    request: Option<(u64, u64)>,
}

impl ActionKind for Reconfigure {
    const KIND: &'static str = "Reconfigure";
    type Arguments = Choice;

    fn start(choice: Choice) -> Self {
        Self { choice, request: None }
    }
}

impl Action<Managed> for Reconfigure {
    fn act(&mut self, acting: &Acting<'_, Managed>) -> Step {
        let Acting { body, now, .. } = acting;
        let answer =
            self.request.map_or(RequestAnswer::Unknown, |(request, _)| body.settings.answer(request));
        let waited = self.request.map_or(0.0, |(_, since)| now.now().saturating_sub(since) as f64 * 1e-9);
        let report =
            |progress, what: fmt::Arguments<'_>| body.report(self.choice, progress, waited, now, what);
        match answer {
            RequestAnswer::Pending => Step::Running,
            // It was never requested, or in a tick that failed.
            RequestAnswer::Unknown => {
                report(Progress::ASKED, format_args!("action: other settings are requested"));
                let changes = body.alternatives.changes(self.choice.number());
                self.request = Some((body.settings.change(changes), now.now()));
                Step::Running
            }
            // The agent logs the settings itself.
            RequestAnswer::Done(_) => {
                report(Progress::CHANGED, format_args!("action: other settings hold"));
                Step::Done
            }
            RequestAnswer::Refused(reason) => {
                report(Progress::FAILED, format_args!("action: the settings are refused: {reason}"));
                Step::Failed
            }
        }
    }
}

/// Timeout of the effect, seconds.
const EFFECT_TIMEOUT: f64 = 3.0;
/// Largest fraction of NaN of a sensor that works.
const INVALID: f64 = 0.25;
/// Tolerance of the speed, m/s: wheels and encoders are not exact.
const TOLERANCE: f64 = 0.03;

/// Waits for the effect: the sensor in use measures, and the robot is not too fast.
#[derive(Serialize, Deserialize)]
pub struct Confirm {
    choice: Choice,
    /// Time of the change of the settings, nanoseconds.
    since: Option<u64>,
}

impl ActionKind for Confirm {
    const KIND: &'static str = "Confirm";
    type Arguments = Choice;

    fn start(choice: Choice) -> Self {
        Self { choice, since: None }
    }
}

impl Action<Managed> for Confirm {
    fn act(&mut self, acting: &Acting<'_, Managed>) -> Step {
        let Acting { body, now, .. } = acting;
        let since = *self.since.get_or_insert(now.now());
        let waited = now.now().saturating_sub(since) as f64 * 1e-9;
        let limit = body.alternatives.list.get(self.choice.number()).map_or(0.0, |chosen| chosen.speed);
        // In the first cycle, the Sensor of a link that has changed hands on an older scan.
        let answers = body
            .used
            .fresh()
            .is_some_and(|scan| body.used.stamp().time > since && invalid_share(scan) <= INVALID);
        // A standing robot needs no sensor.
        let senses = answers || limit == 0.0;
        let report =
            |progress, what: fmt::Arguments<'_>| body.report(self.choice, progress, waited, now, what);
        if senses && body.speed().is_some_and(|speed| speed <= limit + TOLERANCE) {
            report(
                Progress::EFFECTIVE,
                format_args!("effect: the sensor in use answers, and the speed is right"),
            );
            return Step::Done;
        }
        if waited < EFFECT_TIMEOUT {
            return Step::Running;
        }
        let wrong = if senses { "the robot is too fast" } else { "the sensor in use does not answer" };
        report(Progress::FAILED, format_args!("effect: {wrong}"));
        Step::Failed
    }
}

/// Switches to another alternative.
#[derive(Serialize, Deserialize)]
pub struct SwitchTo {
    steps: InSequence<(Reconfigure, Confirm)>,
}

impl ActionKind for SwitchTo {
    const KIND: &'static str = "SwitchTo";
    type Arguments = Choice;

    fn start(choice: Choice) -> Self {
        Self { steps: InSequence::start((choice, choice)) }
    }

    fn children(&self, tree: &mut ActionTree) {
        tree.child(&self.steps);
    }
}

impl Action<Managed> for SwitchTo {
    fn act(&mut self, acting: &Acting<'_, Managed>) -> Step {
        self.steps.act(acting)
    }
}

repertoire! {
    /// Actions on sensor failures.
    pub enum AdaptationActions for Managed as "adaptation_execute" { Reconfigure, Confirm, SwitchTo }
}
