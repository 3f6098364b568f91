//! Plan on failures and recoveries of sensors.

use serde::{Deserialize, Serialize};
use slate_plugin::module::Level;
use slate_plugin::prelude::*;

use crate::actions::{Choice, SwitchTo};
use crate::alternatives::Alternatives;
use crate::condition::{Condition, SensorCondition};

/// Percepts of the Plan, and its alternatives.
#[ports]
pub struct AdaptationPorts {
    /// Preferred sensor.
    first: Noticed<SensorCondition>,
    /// Substitute sensor.
    second: Noticed<SensorCondition>,
    /// Alternatives to choose from.
    alternatives: Required<Alternatives>,
}

/// State of the Plan.
#[derive(Default, Serialize, Deserialize)]
pub struct PlannerState {
    /// Condition of each sensor.
    sensors: [Option<Condition>; 2],
    /// Newest change: sensor and its number.
    news: (usize, u64),
    /// Counts the decisions from 1.
    decision: u64,
    /// Index of the chosen alternative; 0 is the configuration as written.
    chosen: usize,
    /// Number of failed attempts.
    failures: u32,
    /// Alternatives given up since the newest change.
    given_up: [bool; 3],
}

/// Number of attempts of an alternative.
const MAX_ATTEMPTS: u32 = 3;

/// Chooses the best alternative with a healthy sensor.
/// After three failed attempts it chooses the next one.
pub struct AdaptationPlanner;

impl Plan for AdaptationPlanner {
    const NAME: &'static str = "adaptation_planner";
    const DOC: &'static str = "Chooses a robot's configuration as its sensors fail and recover.";
    type Noticed = AdaptationPorts;
    type Params = ();
    type State = PlannerState;

    fn run(
        memory: &mut PlannerState,
        noticed: &AdaptationPorts,
        situation: &Situation<'_>,
        _: &(),
        now: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        for (sensor, news) in [&noticed.first, &noticed.second].into_iter().enumerate() {
            if let Some(news) = news.newest() {
                memory.sensors[sensor] = Some(news.condition);
                memory.news = (sensor, news.change);
                memory.given_up = [false; 3];
            }
        }
        let failed = situation.ended().any(|ended| ended.ending == Ending::FAILED);
        memory.failures += u32::from(failed);
        if memory.failures >= MAX_ATTEMPTS {
            memory.failures = 0;
            memory.given_up[memory.chosen] = true;
        }
        let alternatives = &noticed.alternatives;
        let PlannerState { sensors, given_up, .. } = &*memory;
        // A sensor of which nothing is known yet is taken to be well, and the last alternative needs none.
        let is_healthy = |sensor: &Option<Condition>| sensor.is_none_or(|is| is == Condition::HEALTHY);
        let is_possible = |number: &usize| {
            *number < alternatives.list.len()
                && !given_up[*number]
                && sensors.get(*number).is_none_or(is_healthy)
        };
        let Some(best) = (0..given_up.len()).find(is_possible) else {
            if failed || noticed.first.newest().is_some() || noticed.second.newest().is_some() {
                let what = "plan: no alternative is left, so the robot continues unchanged: stop it";
                now.log_with(Level::Error, format_args!("{what}"), &[("decision", memory.decision.into())]);
            }
            return;
        };
        if best == memory.chosen && !failed {
            return;
        }
        if best != memory.chosen {
            (memory.chosen, memory.failures) = (best, 0);
        }
        memory.decision += 1;
        let name = alternatives.name(best);
        let (sensor, change) = memory.news;
        let fields = [
            ("decision", memory.decision.into()),
            ("sensor", (sensor + 1).into()),
            ("change", change.into()),
            ("alternative", name.into()),
        ];
        now.log_with(Level::Info, format_args!("plan: continue with {name}"), &fields);
        // A robot's life has fewer decisions than an `f64` counts exactly.
        plan.replace(SwitchTo::request(Choice {
            alternative: best as f64,
            decision: memory.decision as f64,
        }));
    }
}
