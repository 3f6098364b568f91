//! Plan of the loop: the stages of its schedule, with their modules.

use std::sync::Arc;

use slate_module::Stage;
use slate_sorted::SortedMap;

use super::gauges::StageGauge;
use super::takeover::{StageRequest, Takeover};
use super::{RunnerCell, Schedule};

/// Modules of a stage in levels, each of which depends on those before it.
pub type Levels = Vec<Vec<Arc<RunnerCell>>>;

/// Parts from which plans are made.
#[derive(Default)]
pub(super) struct PlanParts {
    /// Program's stages.
    pub schedule: Schedule,
    /// Module that may take the loop.
    pub takeover: Option<Arc<Takeover>>,
    /// Requested stages: those of the active takeover, or of the next.
    pub request: Option<StageRequest>,
    /// Modules on the loop, by their own stage.
    pub levels: Vec<Levels>,
    /// Modules with threads of their own.
    pub threaded: Vec<Arc<RunnerCell>>,
    /// Measurements of the stages of all plans, by name.
    pub gauges: SortedMap<Arc<str>, Arc<StageGauge>>,
}

/// Stages of the loop and their modules in execution order.
#[derive(Default)]
pub(super) struct Plan {
    pub stages: Vec<PlannedStage>,
    pub names: Arc<[Arc<str>]>,
    pub cells: Vec<Arc<RunnerCell>>,
    /// End of each cell's level, as an index into the cells.
    /// Modules of a level do not depend on each other.
    pub ends: Vec<usize>,
    /// Modules that read values of the last cycle that are written before their turn.
    pub previous_readers: Vec<Arc<RunnerCell>>,
}

/// Stage of the loop.
pub(super) struct PlannedStage {
    pub gauge: Arc<StageGauge>,
    /// Range of its cells.
    pub first: usize,
    pub end: usize,
    /// Timeout, wall-clock ns; 0 for none.
    pub timeout: u64,
}

/// Longest timeout, ns; a longer one has no end.
const LONGEST_TIMEOUT: u128 = 1 << 62;

impl PlannedStage {
    /// Returns true if the stage has no modules.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.first == self.end
    }
}

impl PlanParts {
    /// Updates the stages that a module requests; true if they have changed.
    pub fn update_request(&mut self) -> bool {
        let before = self.request.as_ref().map(|(number, _)| *number);
        let request = self.takeover.as_ref().and_then(|takeover| {
            let request = takeover.next_request().or(self.request.take());
            request.filter(|(number, _)| takeover.needs_plan(*number))
        });
        self.request = request;
        before != self.request.as_ref().map(|(number, _)| *number)
    }

    /// Returns the stages that the loop has, or is about to have.
    pub fn stages(&self) -> &Schedule {
        self.request.as_ref().map_or(&self.schedule, |(_, schedule)| schedule)
    }

    /// Returns the plan of a schedule; the gauges of all its stages must exist.
    pub fn plan(&self, schedule: &Schedule) -> Plan {
        let mut plan = Plan::default();
        for stage in schedule.stages() {
            let Some(gauge) = self.gauges.get(stage.name.as_str()) else { continue };
            let first = plan.cells.len();
            for level in stage.members.iter().flat_map(|member| self.levels_of(*member)) {
                plan.cells.extend(level.iter().cloned());
                plan.ends.resize(plan.cells.len(), plan.cells.len());
            }
            let timeout = stage.timeout.map_or(0, |timeout| timeout.as_nanos().min(LONGEST_TIMEOUT) as u64);
            plan.stages.push(PlannedStage {
                gauge: Arc::clone(gauge),
                first,
                end: plan.cells.len(),
                timeout,
            });
        }
        plan.previous_readers = plan.cells.iter().filter(|cell| cell.reads_previous()).cloned().collect();
        plan.names = plan.stages.iter().map(|stage| Arc::clone(&stage.gauge.name)).collect();
        plan
    }

    fn levels_of(&self, stage: Stage) -> &[Vec<Arc<RunnerCell>>] {
        self.levels.get(stage as usize).map_or(&[], Vec::as_slice)
    }

    /// Returns the stages, each with the names of its modules in order.
    pub fn order(&self) -> Vec<(String, Vec<String>)> {
        let stages = self.stages().stages().iter().map(|stage| {
            let cells = stage.members.iter().flat_map(|member| self.levels_of(*member).iter().flatten());
            (stage.name.clone(), cells.map(|cell| cell.name.to_string()).collect())
        });
        stages.collect()
    }

    /// Returns all modules, each with its stage if it is on the loop.
    pub fn watched(&self) -> impl Iterator<Item = (Arc<RunnerCell>, Option<Arc<str>>)> {
        let staged = self.stages().stages().iter().flat_map(|stage| {
            let name: Arc<str> = stage.name.as_str().into();
            let cells = stage.members.iter().flat_map(|member| self.levels_of(*member).iter().flatten());
            cells.map(move |cell| (Arc::clone(cell), Some(Arc::clone(&name))))
        });
        staged.chain(self.threaded.iter().map(|cell| (Arc::clone(cell), None)))
    }
}
