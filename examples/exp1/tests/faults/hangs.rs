//! Blocks that hang: in lockstep they end the run, and on threads the robot goes on without them.

use std::sync::atomic::{AtomicU64, Ordering};

use slate::runtime::{Agent, Control, Cycle, End, Mode, Rate};

use super::trouble::{CYCLES, HANGING, HUNG, STOOD};
use super::{STAGED, agent_in, verdict, wheels};

/// Runs under the watchdog, ten times as fast as the wall clock when it has threads; counts the cycles in which the wheels
/// stood, and returns how the run ended.
fn run(agent: &mut Agent, stood: &'static AtomicU64) -> End {
    stood.store(0, Ordering::Relaxed);
    let observer = move |cycle: &Cycle<'_>| {
        // Another run, of another test, is not counted.
        if std::ptr::eq(stood, &STOOD) {
            CYCLES.fetch_add(1, Ordering::Relaxed);
        }
        let has_command = cycle.board.read("r2/wheels/command/left").unwrap().is_some();
        if has_command && wheels(cycle.board) == [0.0; 2] {
            stood.fetch_add(1, Ordering::Relaxed);
        }
        if verdict(cycle.board) == "RUNNING" { Control::Continue } else { Control::Stop }
    };
    agent.run(Box::new(observer)).unwrap()
}

/// Cycles in which a robot stands whose sensors hang.
const STANDS: u64 = 151;

const THREADED: (Mode, Rate) = (Mode::Threaded, Rate::Times(10.0));

/// Each block that hangs, the settings that make it, and the actuator's command when it hangs.
fn hanging() -> [(&'static str, [String; 2]); 3] {
    let block = |block: &str, plugin: &str, strike: &str| {
        let of = format!("robots.r2.modules.{block}");
        [format!("{of}.kind={plugin}"), format!("{of}.params.{strike}")]
    };
    [
        ("trouble", [format!("modules.trouble.params.kind={HANGING}"), "agent.seed=0".into()]),
        ("r2/planner", block("planner", "crashing_planner", "hang_at=5")),
        ("r2/avoid_obstacle", block("avoid_obstacle", "crashing_reflex", "hang_at=40")),
    ]
}

#[test]
fn who_hangs_in_lockstep_ends_the_run_by_name() {
    for (module, [first, second]) in hanging() {
        let mut agent = agent_in(STAGED, &[&first, &second, "loop.hang=100ms"]);
        static UNUSED: AtomicU64 = AtomicU64::new(0);
        let end = run(&mut agent, &UNUSED);
        assert_eq!(end, End::Hung { module: module.into() });
        assert_eq!(verdict(agent.board()), "RUNNING", "no verdict is made up");
    }
}

#[test]
fn who_hangs_on_threads_returns_and_the_goal_is_reached() {
    for (module, [first, second]) in hanging() {
        let stands = format!("modules.trouble.params.stands={STANDS}");
        let mut agent = agent_in(THREADED, &[&first, &second, "loop.hang=100ms", &stands]);
        let end = run(&mut agent, &STOOD);
        let stood = STOOD.load(Ordering::Relaxed);
        assert_eq!(end, End::Stopped, "{module}");
        let reached = agent.board().read("referee/metrics/goals_reached").unwrap();
        // While its reflex sleeps, the robot may touch something.
        assert_eq!(reached.and_then(|(value, _)| value.as_f64()), Some(1.0), "{module}");
        assert!(agent.counts(module).unwrap().0 > 60 || module == "r2/planner", "{module} works again");
        // It sleeps for 6 s of the agent's time, 300 cycles, or fewer and longer on a busy machine.
        let hung = HUNG.load(Ordering::Relaxed);
        assert!(hung > 0 || module != "trouble", "no cycle passed while the sensors hung");
        assert!(stood >= STANDS || module != "trouble", "without sensors it stood in {stood} cycles");
        assert!(
            2 * stood >= hung || module != "trouble",
            "without sensors it stood in {stood} of {hung} cycles"
        );
    }
}
