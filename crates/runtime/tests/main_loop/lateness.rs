use std::sync::Arc;
use std::time::{Duration, Instant};

use slate_runtime::{Control, End, Options, Rate};

use super::{Collected, after, lines, load, run, ticks, wall_clock, whole, witnesses};

/// One module that takes 300 ms once, one behind it in its stage, and one in a later stage.
const LATE: &str = r#"
[loop]
period = "2ms"
timeouts.Think = "20ms"
[modules.planner]
kind = "witness"
params = { sleep_at = 5, sleep_ms = 300 }
[modules.second]
kind = "witness"
[modules.motor]
kind = "witness"
stage = "Act"
[links]
"#;

#[test]
fn a_stage_ends_at_its_time_and_the_late_module_is_named() {
    let (mut agent, log) = wall_clock(LATE);
    let composer = agent.composer();
    let conditions: Collected<&'static str> = Arc::default();
    let taken = Arc::clone(&conditions);
    let seen = log.clone();
    let start = Instant::now();
    let end = agent.run(Box::new(move |_| {
        let modules = composer.modules();
        let planner = modules.iter().find(|module| module.name == "planner").unwrap();
        taken.lock().unwrap().push(planner.condition);
        // The watchdog sees its return when it looks next.
        let returned = planner.ticks >= 10 && !lines(&seen, "planner returned after").is_empty();
        let done = returned || start.elapsed() > Duration::from_secs(30);
        if done { Control::Stop } else { Control::Continue }
    }));
    assert_eq!(end.unwrap(), End::Stopped);
    let conditions = conditions.lock().unwrap();
    let cycles = conditions.len() as u64;
    let late = conditions.iter().filter(|condition| **condition == "LATE").count();
    assert!(late >= 20, "in the 280 ms after its time was up the loop made {late} cycles without it");
    assert!(conditions[..4].iter().all(|condition| *condition == "WORKING"), "{conditions:?}");
    assert_eq!(conditions[4], "LATE", "in the cycle of its fifth tick");
    assert_eq!(ticks(&agent, "motor"), cycles, "other stages miss nothing");
    assert_eq!(ticks(&agent, "second"), cycles - 1, "its turn in the stage that was over is left out");
    assert_eq!(agent.counts("second").unwrap().1, 1, "and counted");
    let said = lines(&log, "planner has not returned");
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(said[0].contains("before the time of stage Think was up"), "{said:?}");
    let said = lines(&log, "20 ms of stage Think");
    assert_eq!(said, ["the 20 ms of stage Think were over before the turn of second"]);
    let said = lines(&log, "planner returned after");
    assert!(said.len() == 1 && said[0].ends_with("ms and runs again"), "{said:?}");
    let took: f64 = said[0].split(' ').nth(3).unwrap().parse().unwrap();
    assert!((300.0..3000.0).contains(&took), "{said:?}");
}

#[test]
fn in_lockstep_a_stage_has_the_time_that_it_takes() {
    let text = format!(
        "time.source = \"motor\"\n{}",
        LATE.replace("20ms", "1ms").replace("sleep_ms = 300", "sleep_ms = 30")
    );
    let mut agent = load(&text, Options { rate: Rate::Max, ..Options::default() });
    run(&mut agent, 20);
    assert!(["planner", "second", "motor"].iter().all(|module| ticks(&agent, module) == 20));
}

#[test]
fn repeatedly_late_module_is_reported_once_a_second() {
    let text = r#"
[loop]
period = "1ms"
timeouts.Think = "2ms"
[modules.slow]
kind = "slow"
[modules.counter]
"#;
    let log = slate_runtime::log::MemoryTarget::default();
    let options = Options { log: vec![Box::new(log.clone())], ..Options::default() };
    let mut agent = crate::main_loop::common::load(
        text,
        &[slate_module::Plugin::linked::<super::faults::Slow>()],
        options,
    )
    .unwrap();
    let start = Instant::now();
    let stop = Duration::from_millis(500);
    let end =
        agent.run(Box::new(move |_| if start.elapsed() > stop { Control::Stop } else { Control::Continue }));
    assert_eq!(end.unwrap(), End::Stopped);
    let (cycles, late) = (whole(&agent, "loop/state/cycles"), ticks(&agent, "slow"));
    assert!(late >= 5, "{late} ticks of 10 ms each");
    assert_eq!(ticks(&agent, "counter"), cycles);
    let seconds = start.elapsed().as_secs() as usize;
    let said = lines(&log, "slow has not returned").len();
    assert!((1..=1 + seconds).contains(&said), "{said} lines in {seconds} s");
}

#[test]
fn an_overrun_names_what_took_longest() {
    let text = format!(
        "loop.period = \"5ms\"\n{}[modules.slow]\nkind = \"witness\"\n\
         params = {{ sleep_at = 5, sleep_ms = 40 }}\n",
        witnesses(&[("quick", "Act"), ("other", "WorldState")])
    );
    let (mut agent, log) = wall_clock(&text);
    run(&mut agent, 20);
    let said = lines(&log, "longer than its period of 5 ms");
    let of_slow = said.iter().filter(|line| line.contains("it took longest in slow (4")).count();
    assert_eq!(of_slow, 1, "{said:?}");
    assert!(whole(&agent, "loop/state/overruns") >= 1);
    assert!(whole(&agent, "loop/state/longest") >= 40_000_000);
}

#[test]
fn time_between_runs_is_no_overrun() {
    let (mut agent, log) = wall_clock(&format!("loop.period = \"50ms\"\n{}", witnesses(&[("a", "Act")])));
    run(&mut agent, 2);
    std::thread::sleep(Duration::from_millis(200));
    run(&mut agent, 2);
    assert_eq!(lines(&log, "longer than its period"), Vec::<String>::new());
}

#[test]
fn a_loop_as_fast_as_it_goes_keeps_the_least_time_of_a_cycle() {
    let text = format!("[loop]\nperiod = \"20ms\"\nminimum = \"2ms\"\n{}", witnesses(&[("a", "Act")]));
    let mut agent = load(&text, Options { rate: Rate::Max, ..Options::default() });
    let start = Instant::now();
    assert_eq!(agent.run(after(50)).unwrap(), End::Stopped);
    assert!(start.elapsed() >= Duration::from_millis(49 * 2), "{:?}", start.elapsed());
}

#[test]
fn a_loop_that_is_behind_does_not_spin() {
    let text = r#"
[loop]
period = "4ms"
minimum = "3ms"
[modules.slow]
kind = "witness"
params = { sleep_at = 3, sleep_ms = 7 }
"#;
    let (mut agent, _) = wall_clock(text);
    let begins: Collected<u64> = Arc::default();
    let taken = Arc::clone(&begins);
    let end = agent.run(Box::new(move |cycle| {
        taken.lock().unwrap().push(cycle.now);
        if cycle.number == 20 { Control::Stop } else { Control::Continue }
    }));
    assert_eq!(end.unwrap(), End::Stopped);
    // The slow cycle begins 8 ms after the first and ends after 15 ms; the next one is due since 12 ms, and the one after
    // that at 16 ms, which would be a millisecond later.
    let begins = begins.lock().unwrap();
    let intervals: Vec<_> = begins.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(intervals.iter().all(|interval| *interval >= 2_990_000), "{intervals:?}");
}
