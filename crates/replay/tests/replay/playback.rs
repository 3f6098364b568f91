use std::collections::BTreeSet;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use slate_record::Recorder;
use slate_replay::{Choice, Plan, Player};
use slate_runtime::configuration::Record;

use crate::replay::support::{
    Written, file, load, play, plugins, record_on_the_wall_clock, record_on_the_wall_clock_with, recorded,
    times, values,
};

#[test]
fn every_value_is_played_with_its_number_and_its_time() {
    let (path, again) = (recorded("values.mcap"), file("values-again.mcap"));
    let mut player = Player::open(&path, &plugins(), Plan::default()).unwrap();
    assert!(player.left_out().is_empty() && player.remarks().is_empty() && player.backwards().is_empty());
    let recorder = Recorder::new(&Record { enabled: true, ..Record::default() });
    let mut agent = load(&player, Some(&recorder));
    recorder.begin(&agent, &again);
    let played = player.run(&mut agent, &AtomicBool::new(false)).unwrap();
    recorder.end(&mut agent).unwrap();
    assert!(played.is_whole);
    for topic in
        ["/source/number", "/late/number", "/front/sum", "/back/sum", "/gatherer/count", "/front/params"]
    {
        let wanted = values(&path, topic);
        assert!(!wanted.is_empty(), "{topic}");
        assert_eq!(values(&again, topic), wanted, "{topic}");
    }
    assert_eq!(agent.modules(), Vec::<String>::new());
}

#[test]
fn the_cycles_are_those_of_the_recorded_run() {
    let path = recorded("cycles.mcap");
    let cycles = || {
        let mut player = Player::open(&path, &plugins(), Plan::default()).unwrap();
        let (mut agent, mut cycles) = (load(&player, None), Vec::new());
        player.run_with(&mut agent, &AtomicBool::new(false), |agent| cycles.push(agent.now())).unwrap();
        cycles
    };
    assert_eq!(cycles(), times());
    assert_eq!(cycles(), cycles());
}

#[test]
fn a_part_is_played_from_its_start_to_its_end() {
    let path = recorded("part.mcap");
    let plan = Plan { start: Some(95_000_000), end: Some(200_000_000), ..Plan::default() };
    let mut player = Player::open(&path, &plugins(), plan).unwrap();
    let (mut agent, mut seen) = (load(&player, None), Vec::new());
    let number = |agent: &slate_runtime::Agent| agent.board().read("source/number/value").unwrap().unwrap();
    let look = |agent: &mut slate_runtime::Agent| {
        let (value, stamp) = number(agent);
        seen.push((agent.now(), value.as_f64().unwrap(), stamp.sequence));
    };
    player.run_with(&mut agent, &AtomicBool::new(false), look).unwrap();
    // It begins with the last value before.
    assert_eq!(seen.first(), Some(&(90_000_000, 10.0, 10)));
    assert_eq!(seen[1], (100_000_000, 11.0, 11));
    assert_eq!(seen.last(), Some(&(200_000_000, 21.0, 21)));
}

#[test]
fn topics_are_chosen_and_played_elsewhere() {
    let path = recorded("chosen.mcap");
    let choice = Choice {
        select: vec!["/source/*".into(), "/back/sum".into()],
        exclude: vec!["/*/timing".into()],
        map: [("/back/sum".into(), "/other/place".into())].into(),
    };
    let player = Player::open(&path, &plugins(), Plan { choice, ..Plan::default() }).unwrap();
    let agent = load(&player, None);
    let paths: Vec<_> =
        agent.board().properties().iter().map(|property| property.path().to_owned()).collect();
    let has = |path: &str| paths.iter().any(|own| own == path);
    assert!(has("source/number") && has("other/place"), "{paths:?}");
    assert!(!has("back/sum") && !has("front/sum") && !has("source/timing"), "{paths:?}");
}

#[test]
fn playback_ends_with_final_recorded_values() {
    let (played, outcome, _) = play(&recorded("end.mcap"), Plan::default());
    assert!(played.is_whole && outcome.is_none());
    assert_eq!((played.cycles, played.time), (30, 290_000_000));
}

/// On the wall clock the cycles are unknown, but every value is recorded, with its number and time.
#[test]
fn a_run_on_the_wall_clock_is_played_too() {
    let path = file("wall.mcap");
    record_on_the_wall_clock(&path);
    let wanted = values(&path, "/source/number");
    assert!(wanted.len() >= 20);
    let mut player = Player::open(&path, &plugins(), Plan::default()).unwrap();
    let date = player.date().unwrap().duration_since(std::time::UNIX_EPOCH).unwrap().as_nanos() as u64;
    let mut agent = load(&player, None);
    let mut seen = Vec::new();
    player
        .run_with(&mut agent, &AtomicBool::new(false), |agent| {
            seen.extend(
                agent.board().read("source/number").unwrap().map(|(_, stamp)| (stamp.sequence, stamp.time)),
            );
        })
        .unwrap();
    let (sequence, time, _) = wanted.last().unwrap();
    assert_eq!(seen.last(), Some(&(u64::from(*sequence), time - date)));
    let plan = Plan { modules: ["source".into()].into(), ..Plan::default() };
    let outcome = play(&path, plan).1.unwrap();
    let number = outcome.properties.iter().find(|own| own.url == "/source/number").unwrap();
    assert_eq!(number.different, 0, "{outcome:?}");
}

/// On the wall clock a change has a time and no cycle: as many values come before it as then.
#[test]
fn wall_clock_changes_are_replayed_at_their_time() {
    let path = file("wall-changed.mcap");
    let step = |after: u64, value| (Duration::from_millis(after), "modules.source.params.step", value);
    record_on_the_wall_clock_with(&path, &[step(95, "3.0"), step(183, "0.5")]);
    let read = |value: &Written| f64::from_le_bytes(value.2[4..12].try_into().unwrap());
    let numbers: Vec<_> = values(&path, "/source/number").iter().map(read).collect();
    let steps: BTreeSet<_> = numbers.windows(2).map(|two| ((two[1] - two[0]) * 10.0) as u64).collect();
    assert_eq!(steps, [5, 10, 30].into(), "both changes were made: {numbers:?}");
    let plan = Plan { modules: ["source".into()].into(), ..Plan::default() };
    let (_, outcome, player) = play(&path, plan);
    let outcome = outcome.unwrap();
    let number = outcome.properties.iter().find(|own| own.url == "/source/number").unwrap();
    assert!(number.different == 0 && number.same >= 25, "{outcome:?}");
    assert!(player.misses().is_empty(), "{:?}", player.misses());
}
