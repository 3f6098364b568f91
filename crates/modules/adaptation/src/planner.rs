//! What is to be done about sensors that fail and recover.

use serde::{Deserialize, Serialize};
use slate_plugin::module::Level;
use slate_plugin::prelude::*;

use crate::actions::{Choice, SwitchTo};
use crate::alternatives::Alternatives;
use crate::condition::{Condition, SensorCondition};

/// What the Plan notices, and what it can choose between.
#[ports]
pub struct Noticing {
    /// The sensor that is used when it can be.
    first: Noticed<SensorCondition>,
    /// The one that can take its place.
    second: Noticed<SensorCondition>,
    /// What there is to choose between.
    alternatives: Required<Alternatives>,
}

/// What the Plan remembers.
#[derive(Default, Serialize, Deserialize)]
pub struct Memory {
    /// How each sensor is.
    sensors: [Option<Condition>; 2],
    /// The latest news: of which sensor, and which change of it.
    news: (usize, u64),
    /// Counts the decisions from 1.
    decision: u64,
    /// Which alternative was chosen last; the configuration as it is written is the first.
    chosen: usize,
    /// How often it was tried without success.
    failures: u32,
    /// Which alternatives were tried often enough since the latest news.
    given_up: [bool; 3],
}

/// So often an alternative is tried.
const TRIES: u32 = 3;

/// Chooses the best alternative whose sensor is healthy; when it can't be had after three tries, the next one.
pub struct AdaptationPlanner;

impl Plan for AdaptationPlanner {
    const NAME: &'static str = "adaptation_planner";
    const DOC: &'static str = "Chooses what a robot does about its sensors that fail and recover.";
    type Noticed = Noticing;
    type Params = ();
    type State = Memory;

    fn run(
        memory: &mut Memory,
        noticed: &Noticing,
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
        if memory.failures >= TRIES {
            memory.failures = 0;
            memory.given_up[memory.chosen] = true;
        }
        let alternatives = &noticed.alternatives;
        let Memory { sensors, given_up, .. } = &*memory;
        // A sensor of which nothing is known yet is taken to be well, and the last alternative needs none.
        let is_healthy = |sensor: &Option<Condition>| sensor.is_none_or(|is| is == Condition::HEALTHY);
        let is_possible = |number: &usize| {
            *number < alternatives.list.len()
                && !given_up[*number]
                && sensors.get(*number).is_none_or(is_healthy)
        };
        let Some(best) = (0..given_up.len()).find(is_possible) else {
            if failed || noticed.first.newest().is_some() || noticed.second.newest().is_some() {
                let what = "plan: there is no alternative left, so the robot goes on as it is: stop it";
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
        now.log_with(Level::Info, format_args!("plan: go on with {name}"), &fields);
        // Fewer decisions than what a number of that kind counts exactly are made in a life.
        plan.replace(SwitchTo::request(Choice {
            alternative: best as f64,
            decision: memory.decision as f64,
        }));
    }
}
