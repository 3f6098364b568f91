//! Planner and reflex that crash or hang.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use slate::prelude::*;
use slate_wheeled::avoid_obstacle::{AvoidObstacleModel, AvoidObstacleSensors};
use slate_wheeled::go_to_origin::{GoToOriginPlanner, GoToOriginPorts};

use super::{agent, finish, number, verdict};

/// When a block of the robot goes wrong.
#[params]
pub struct CrashParams {
    #[param(default = 0, doc = "panics in that run of the block; 0 for never")]
    panic_at: u64,
    #[param(default = 0, doc = "panics when a plan is needed after so many changes of route; 0 for never")]
    panic_when_needed: u64,
    #[param(default = 0, doc = "hangs in that run of the block; 0 for never")]
    hang_at: u64,
}

impl CrashParams {
    fn strike(&self, now: &Tick) {
        assert!(now.number() != self.panic_at, "as the test wants");
        if now.number() == self.hang_at {
            std::thread::sleep(Duration::from_millis(600));
        }
    }
}

/// Whether the planner has crashed when it was needed; it does so once.
static CRASHED: AtomicBool = AtomicBool::new(false);

/// EXP1's planner, which crashes.
pub struct CrashingPlanner;

impl Plan for CrashingPlanner {
    const NAME: &'static str = "crashing_planner";
    type Noticed = GoToOriginPorts;
    type Params = CrashParams;
    type State = <GoToOriginPlanner as Plan>::State;

    fn run(
        memory: &mut Self::State,
        noticed: &GoToOriginPorts,
        situation: &Situation<'_>,
        params: &CrashParams,
        now: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        params.strike(now);
        // Its memory is lost in the moment in which it is needed.
        let after = params.panic_when_needed;
        let needed = after > 0 && situation.route_switches == after && situation.needs_plan();
        assert!(!(needed && !CRASHED.swap(true, Ordering::Relaxed)), "as the test wants");
        GoToOriginPlanner::run(memory, noticed, situation, &Default::default(), now, plan);
    }
}

/// EXP1's reflex, which crashes.
pub struct CrashingReflex;

impl ReactiveModel for CrashingReflex {
    const NAME: &'static str = "crashing_reflex";
    type Sensors = AvoidObstacleSensors;
    type Params = CrashParams;
    type State = <AvoidObstacleModel as ReactiveModel>::State;

    fn run(
        avoider: &mut Self::State,
        sensors: &AvoidObstacleSensors,
        params: &CrashParams,
        now: &Tick,
    ) -> Option<ActionRequest> {
        params.strike(now);
        AvoidObstacleModel::run(avoider, sensors, &Default::default(), now)
    }
}

#[test]
fn a_planner_that_crashes_begins_anew() {
    for crash in ["panic_at=2", "panic_at=20", "panic_when_needed=1"] {
        for seed in 0..4 {
            let setting = format!("robots.r2.modules.planner.params.{crash}");
            let seed = format!("agent.seed={seed}");
            let plugin = "robots.r2.modules.planner.kind=crashing_planner";
            let mut agent = agent(&[plugin, &setting, &seed]);
            CRASHED.store(false, Ordering::Relaxed);
            finish(&mut agent);
            assert!(agent.counts("r2/planner").unwrap().2 > 0, "{crash}, {seed}: it did not panic");
        }
    }
}

#[test]
fn a_reflex_that_crashes_begins_anew() {
    let plugin = "robots.r2.modules.avoid_obstacle.kind=crashing_reflex";
    for seed in 0..4 {
        let seed = format!("agent.seed={seed}");
        let mut agent = agent(&[plugin, "robots.r2.modules.avoid_obstacle.params.panic_at=40", &seed]);
        while verdict(agent.board()) == "RUNNING" {
            agent.step();
        }
        assert_eq!(verdict(agent.board()), "SUCCEEDED");
        let (ticks, _, panics) = agent.counts("r2/avoid_obstacle").unwrap();
        assert!(ticks > 100 && panics == 1, "{ticks} ticks, {panics} panics");
        assert!(number(agent.board(), "r2/execute/status/reflexes") > 0.0);
    }
}
