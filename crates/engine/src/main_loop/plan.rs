//! What the loop runs: the stages of its schedule, with the modules that are there.

use std::collections::BTreeMap;
use std::sync::Arc;

use slate_module::Stage;

use super::gauges::StageGauge;
use super::takeover::{Takeover, Wish};
use super::{Schedule, Seat};

/// The modules of a stage: levels, of which each depends on those before it.
pub type Levels = Vec<Vec<Arc<Seat>>>;

/// What a plan is made from.
#[derive(Default)]
pub(super) struct PlanParts {
    /// The program's stages.
    pub schedule: Schedule,
    /// The module that may take the loop.
    pub takeover: Option<Arc<Takeover>>,
    /// The stages that it has taken the loop with, or is about to.
    pub wish: Option<Wish>,
    /// The modules on the loop, by their own stage.
    pub levels: Vec<Levels>,
    /// Modules with threads of their own.
    pub threaded: Vec<Arc<Seat>>,
    /// What is measured of the stages of all plans, by name.
    pub gauges: BTreeMap<Arc<str>, Arc<StageGauge>>,
}

/// The stages of the loop and their modules in the order in which they run.
#[derive(Default)]
pub(super) struct Plan {
    pub stages: Vec<PlannedStage>,
    pub names: Arc<[Arc<str>]>,
    pub seats: Vec<Arc<Seat>>,
    /// For each seat, where its level ends: modules up to there do not depend on each other.
    pub ends: Vec<usize>,
    /// Those that want values of the last cycle, of what is written before their turn in this one.
    pub early: Vec<Arc<Seat>>,
}

/// A stage of the loop.
pub(super) struct PlannedStage {
    pub gauge: Arc<StageGauge>,
    /// Its seats.
    pub first: usize,
    pub end: usize,
    /// Wall-clock nanoseconds; 0 for none.
    pub timeout: u64,
}

/// A longer time-out is one without an end, nanoseconds.
const LONGEST: u128 = 1 << 62;

impl PlannedStage {
    /// Whether it has no modules.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.first == self.end
    }
}

impl PlanParts {
    /// Takes note of the stages that a module wants now; whether they are other ones than before.
    pub fn look_at_takeover(&mut self) -> bool {
        let before = self.wish.as_ref().map(|(number, _)| *number);
        let wish = self.takeover.as_ref().and_then(|takeover| {
            let wish = takeover.wish().or(self.wish.take());
            wish.filter(|(number, _)| takeover.wants(*number))
        });
        self.wish = wish;
        before != self.wish.as_ref().map(|(number, _)| *number)
    }

    /// The stages that the loop has, or is about to have.
    pub fn stages(&self) -> &Schedule {
        self.wish.as_ref().map_or(&self.schedule, |(_, schedule)| schedule)
    }

    /// The plan of a schedule; the gauges of all its stages are there.
    pub fn plan(&self, schedule: &Schedule) -> Plan {
        let mut plan = Plan::default();
        for stage in schedule.stages() {
            let Some(gauge) = self.gauges.get(stage.name.as_str()) else { continue };
            let first = plan.seats.len();
            for level in stage.members.iter().flat_map(|member| self.levels_of(*member)) {
                plan.seats.extend(level.iter().cloned());
                plan.ends.resize(plan.seats.len(), plan.seats.len());
            }
            let timeout = stage.timeout.map_or(0, |timeout| timeout.as_nanos().min(LONGEST) as u64);
            plan.stages.push(PlannedStage {
                gauge: Arc::clone(gauge),
                first,
                end: plan.seats.len(),
                timeout,
            });
        }
        plan.early = plan.seats.iter().filter(|seat| seat.is_early()).cloned().collect();
        plan.names = plan.stages.iter().map(|stage| Arc::clone(&stage.gauge.name)).collect();
        plan
    }

    fn levels_of(&self, stage: Stage) -> &[Vec<Arc<Seat>>] {
        self.levels.get(stage as usize).map_or(&[], Vec::as_slice)
    }

    /// The stages, each with the names of its modules in their order.
    pub fn order(&self) -> Vec<(String, Vec<String>)> {
        let stages = self.stages().stages().iter().map(|stage| {
            let seats = stage.members.iter().flat_map(|member| self.levels_of(*member).iter().flatten());
            (stage.name.clone(), seats.map(|seat| seat.name.to_string()).collect())
        });
        stages.collect()
    }

    /// All modules, each with its stage in the loop if it is on the loop.
    pub fn watched(&self) -> impl Iterator<Item = (Arc<Seat>, Option<Arc<str>>)> {
        let staged = self.stages().stages().iter().flat_map(|stage| {
            let name: Arc<str> = stage.name.as_str().into();
            let seats = stage.members.iter().flat_map(|member| self.levels_of(*member).iter().flatten());
            seats.map(move |seat| (Arc::clone(seat), Some(Arc::clone(&name))))
        });
        staged.chain(self.threaded.iter().map(|seat| (Arc::clone(seat), None)))
    }
}
