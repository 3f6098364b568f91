use std::collections::BTreeMap;

use serde_json::Value;
use slate_runtime::{Options, Rate};

use super::{load, lockstep, run, ticks, wall_clock, whole, witnesses};

const MODULES: [(&str, &str); 2] = [("planner", "Think"), ("motor", "Act")];

#[test]
fn the_durations_of_modules_stages_and_cycles_are_properties() {
    let text = format!(
        "loop.period = \"1ms\"\n{}[modules.slow]\nkind = \"witness\"\nparams = {{ sleep_at = 7, sleep_ms = 5 }}\n",
        witnesses(&MODULES)
    );
    let (mut agent, _) = wall_clock(&text);
    run(&mut agent, 100);
    for of in ["loop", "loop/Think", "loop/Act"] {
        assert_eq!(whole(&agent, &format!("{of}/histogram/count")), 100, "{of}");
    }
    for of in ["planner", "motor", "slow"] {
        // Those of seven cycles stand for sixteen each, and long ones for themselves.
        let count = whole(&agent, &format!("{of}/histogram/count"));
        assert!((85..180).contains(&count), "{of}: {count}");
    }
    for of in ["slow", "loop", "loop/Think"] {
        let longest = whole(&agent, &format!("{of}/histogram/max"));
        assert!(longest >= 5_000_000, "{of}: {longest}");
    }
    assert!(whole(&agent, "motor/histogram/p50") < whole(&agent, "slow/histogram/max"));
    let quantiles =
        ["p50", "p90", "p99", "p999", "max"].map(|part| whole(&agent, &format!("loop/histogram/{part}")));
    assert!(quantiles.is_sorted(), "{quantiles:?}");
    assert_eq!(whole(&agent, "loop/state/cycles"), 100);
    assert_eq!(whole(&agent, "loop/state/longest"), quantiles[4]);
    assert!(whole(&agent, "loop/state/last") <= quantiles[4]);
    assert!(agent.board().read("loop/Skill/histogram").unwrap().is_none(), "a stage without modules");
}

#[test]
fn lockstep_times_one_cycle_in_16_and_steps_with_deadlines() {
    let text = format!("{}[modules.dated]\nkind = \"witness\"\ndeadline = \"10s\"\n", witnesses(&MODULES));
    let mut agent = lockstep(&text);
    (0..160).for_each(|_| assert!(agent.step()));
    agent.publish_timing();
    // Each stands for the fifteen that follow it.
    for of in ["planner", "dated", "loop", "loop/Think"] {
        assert_eq!(whole(&agent, &format!("{of}/histogram/count")), 160, "{of}");
    }
    (0..10).for_each(|_| assert!(agent.step()));
    agent.publish_timing();
    assert_eq!(whole(&agent, "planner/histogram/count"), 176);
    assert_eq!(whole(&agent, "dated/histogram/count"), 170);
}

#[test]
fn measurements_change_no_output_of_modules() {
    let text = format!("time.source = \"planner\"\n[modules.counter]\n{}", witnesses(&MODULES));
    let digest = |text: &str, traced: bool| {
        // Witnesses count for all tests together, so what they write is not part of this.
        let text = text.replace("witness", "dice");
        let mut agent = load(&text, Options { rate: Rate::Max, ..Options::default() });
        if traced {
            agent.trace().start();
        }
        run(&mut agent, 50);
        agent.digest().unwrap()
    };
    assert_eq!(digest(&text, false), digest(&text, true));
}

/// The spans of a track, by its name: what, from, to.
type Tracks = BTreeMap<String, Vec<(String, f64, f64)>>;

fn tracks(agent: &slate_runtime::Agent, from: u64, to: u64) -> Tracks {
    let mut file = Vec::new();
    agent.trace().export(from, to, &mut file).unwrap();
    let file: Value = serde_json::from_slice(&file).unwrap();
    let events = file["traceEvents"].as_array().unwrap();
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    let named = events.iter().filter(|event| event["name"] == "thread_name");
    let names: BTreeMap<_, _> =
        named.map(|event| (event["tid"].as_u64().unwrap(), text(&event["args"]["name"]))).collect();
    let mut tracks: Tracks = names.values().map(|name| (name.clone(), Vec::new())).collect();
    for event in events.iter().filter(|event| event["ph"] == "X") {
        let (start, duration) = (event["ts"].as_f64().unwrap(), event["dur"].as_f64().unwrap());
        let track = tracks.get_mut(&names[&event["tid"].as_u64().unwrap()]).unwrap();
        track.push((text(&event["name"]), start, start + duration));
    }
    tracks
}

#[test]
fn a_trace_of_any_span_of_time_has_modules_and_stages() {
    let (mut agent, _) = wall_clock(&format!("loop.period = \"1ms\"\n{}", witnesses(&MODULES)));
    run(&mut agent, 5);
    assert!(tracks(&agent, 0, u64::MAX).is_empty(), "off at first");
    let trace = agent.trace();
    trace.start();
    run(&mut agent, 20);
    let middle = trace.now();
    run(&mut agent, 30);
    trace.stop();
    run(&mut agent, 10);
    let all = tracks(&agent, 0, u64::MAX);
    assert_eq!(all.keys().collect::<Vec<_>>(), ["main loop", "motor", "planner"]);
    assert_eq!((all["motor"].len(), all["planner"].len()), (50, 50));
    let cycles: Vec<_> = all["main loop"].iter().filter(|span| span.0 == "cycle").collect();
    assert_eq!(cycles.len(), 50);
    let of = |stage: &str| all["main loop"].iter().filter(|span| span.0 == stage).collect::<Vec<_>>();
    // Nanoseconds are written as microseconds with three digits, so sums of them are nearly exact.
    let within = |inner: &(String, f64, f64), outer: &(String, f64, f64)| {
        inner.1 >= outer.1 - 0.002 && inner.2 <= outer.2 + 0.002
    };
    for (number, cycle) in cycles.iter().enumerate() {
        let (think, act) = (of("Think")[number], of("Act")[number]);
        assert!(within(think, cycle) && within(act, cycle) && think.2 <= act.1 + 0.002);
        assert!(within(&all["planner"][number], think) && within(&all["motor"][number], act));
    }
    let late = tracks(&agent, middle, trace.now());
    assert_eq!((late["motor"].len(), late["main loop"].len()), (30, 90));
    assert_eq!(ticks(&agent, "motor"), 65);
}
