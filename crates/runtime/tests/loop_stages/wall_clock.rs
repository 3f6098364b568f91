//! On the wall clock the agent runs beside the test.

use super::*;

/// Waits for what comes soon.
#[track_caller]
fn until(what: &str, mut condition: impl FnMut() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < Duration::from_secs(30), "waited in vain: {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// An agent that runs beside a test.
struct Beside {
    composer: Composer,
    log: MemoryTarget,
    stopper: Stopper,
}

impl Drop for Beside {
    fn drop(&mut self) {
        self.stopper.stop();
    }
}

impl Beside {
    fn until_shown(&self, stages: &[String]) {
        until("stages", || self::shown(self.composer.board()) == stages);
    }

    /// Lets the director do that in a tick that comes soon.
    fn soon(&self, what: &str) {
        let modules = self.composer.modules();
        let ticks = modules.iter().find(|module| module.name == "director").unwrap().ticks;
        let path = format!("director/params/{what}");
        let when = slate_blackboard::interface::Value::Integer(i128::from(ticks) + 50);
        self.composer.board().write(&path, &when, self.composer.now()).unwrap();
    }

    fn until_said(&self, part: &str) {
        until(part, || !lines(&self.log, part).is_empty());
    }
}

/// On the wall clock: looks at an agent with that director while it runs. No other module misses a cycle.
fn running(director: &str, mode: Mode, look: impl FnOnce(&Beside)) {
    let text =
        format!("loop.period = \"1ms\"\nloop.hang = \"50ms\"\n[modules.director]\n{director}\n{}", workers());
    let (mut agent, log) = load(&text, mode, Options::default().rate).unwrap();
    let beside = Beside { composer: agent.composer(), log, stopper: agent.stopper() };
    let run = std::thread::spawn(move || {
        let end = agent.run(Box::new(|_| Control::Continue));
        (agent, end.unwrap())
    });
    beside.until_said("director has the main loop");
    look(&beside);
    drop(beside);
    let (agent, end) = run.join().unwrap();
    assert_eq!(end, End::Stopped);
    let cycles = number(&agent, "loop/state/cycles");
    for stage in &Stage::ALL[..5] {
        assert_eq!(agent.counts(&name(*stage)).unwrap().0 as f64, cycles, "{}", stage.name());
    }
}

fn owned(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

#[test]
fn wall_clock_stages_change_later_and_none_is_missed() {
    running("", Mode::Staged, |agent| {
        agent.until_shown(&owned(&["Act", "Sense"]));
        assert_eq!(lines(&agent.log, "director has").len(), 1);
        agent.composer.enable("director", false).unwrap();
        agent.until_said(BACK);
        agent.until_shown(&ten());
    });
}

#[test]
fn a_hanging_module_or_policy_loses_the_loop_until_it_returns() {
    for (how, said) in [
        ("", "director has not returned"),
        ("params.policy_hangs_at = 50", "the policy of a module did not return"),
    ] {
        // It would have a thread of its own, if it were not to be watched in the loop.
        for (mode, trigger) in [(Mode::Staged, ""), (Mode::Threaded, "every = \"1ms\"\n")] {
            running(&format!("{trigger}{how}"), mode, |agent| {
                if how.is_empty() {
                    agent.soon("hang_at");
                }
                agent.until_said(said);
                agent.until_said(BACK);
                agent.until_shown(&ten());
                agent.until_said("director returned after");
                agent.soon("one_at");
                agent.until_said("director has the main loop, with the stages One");
                agent.until_shown(&owned(&["One"]));
                let records = agent.log.lines();
                let time = |part| records.iter().find(|record| record.text.contains(part)).unwrap().time;
                let ahead = Duration::from_nanos(time("director returned after") - time(BACK));
                assert!(ahead > Duration::from_millis(100), "not only when it returned: {ahead:?}");
            });
        }
    }
}

#[test]
fn the_loop_is_claimed_and_released_amid_program_changes() {
    running("params.churn = 10", Mode::Staged, |agent| {
        let cycles = || lines(&agent.log, "director has the main loop,").len();
        let mut round = 0_u64;
        until("rounds", || {
            round += 1;
            let scheduled = ScheduledStage {
                name: format!("All{}", round % 3),
                members: Stage::ALL.to_vec(),
                timeout: Some(Duration::from_secs(1)),
            };
            agent.composer.set_schedule(Schedule::new(vec![scheduled]).unwrap());
            agent.composer.enable("think", round.is_multiple_of(2)).unwrap();
            // It is taken between two cycles, too.
            agent.composer.snapshot().unwrap();
            cycles() >= 20 && round >= 50
        });
        agent.composer.set_schedule(Schedule::default());
        agent.composer.unload("director").unwrap();
        agent.until_shown(&ten());
    });
}
