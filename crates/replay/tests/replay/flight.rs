//! The last seconds of a run, and modules that run on them.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use slate_record::Recorder;
use slate_replay::{Plan, Player, Run};
use slate_runtime::configuration::{Database, Options as Layers, RecordSelection};
use slate_runtime::recording::Recording;
use slate_runtime::{Agent, Options, RecordedTimes};

use crate::replay::support::{ROBOT, file, load, play, plugins, values};

const SCALE: &str = r#"
[modules.scale]
[links]
"scale/number" = "source/number"
"#;

/// Its cycles, each 10 ms after the other.
const TIMES: std::ops::Range<u64> = 0..30;

/// What is set before the cycle of that number.
type Set<'a> = (usize, &'a str, &'a str);

/// The last seconds of the robot, and what is recorded of it from its 13th cycle on.
fn saved(name: &str, keep: &str, sets: &[Set<'_>]) -> [PathBuf; 2] {
    let links = SCALE.replace("[links]\n", "");
    let (module, link) = links.trim().split_once('\n').unwrap();
    let text = ROBOT.replace("[links]", &format!("{module}\n[links]\n{link}"));
    let text = text.replace("enabled = true", &format!("flight = {{ keep = \"{keep}\" }}"));
    let database = Database::from_text("robot.toml", &text, Layers::default()).unwrap();
    let recorder = Recorder::on_demand(database.current().record());
    let options = Options {
        time_source: Some(Box::new(RecordedTimes::new(TIMES.map(|cycle| cycle * 10_000_000).collect()))),
        recording: Some(Arc::new(recorder.clone())),
        ..Options::default()
    };
    let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
    recorder.attach(&agent, Path::new(env!("CARGO_TARGET_TMPDIR")));
    let [path, later] = [file(name), file(&format!("later-{name}"))];
    [&path, &later].into_iter().for_each(|path| drop(std::fs::remove_file(path)));
    let control = recorder.control().unwrap();
    for cycle in 0..TIMES.end as usize {
        let own: Vec<_> =
            sets.iter().filter(|(at, ..)| *at == cycle).map(|(_, path, to)| (*path, *to)).collect();
        if !own.is_empty() {
            drop(agent.database().unwrap().set(&own).unwrap());
        }
        if cycle == 13 {
            control.start(&agent.composer(), &later, &RecordSelection::default()).unwrap();
        }
        assert!(agent.step());
    }
    control.save(&agent.composer(), &path).unwrap();
    control.stop(&agent.composer(), None).unwrap();
    recorder.finish(&mut agent);
    [path, later]
}

fn plan(module: &str) -> Plan {
    Plan { modules: [module.to_owned()].into(), ..Plan::default() }
}

const GAIN: &str = "modules.scale.params.gain";
const LINK: &str = "links.\"scale/number\"";

#[test]
fn last_seconds_from_the_start_recompute_with_their_changes() {
    let sets = [(9, GAIN, "5.0"), (14, LINK, "\"late/number\""), (14, GAIN, "7.0")];
    let sets = [&sets[..], &[(25, LINK, "\"front/sum\""), (27, "modules.front.params.gain", "0.5")]].concat();
    let [path, _] = saved("flight-whole.mcap", "60s", &sets);
    for module in ["scale", "front", "back", "gatherer", "source"] {
        let (_, outcome, player) = play(&path, plan(module));
        let outcome = outcome.unwrap();
        assert_eq!(outcome.first, None, "{module}");
        assert!(outcome.has_compared() && player.misses().is_empty(), "{module}");
    }
}

#[test]
fn last_seconds_begin_with_the_configuration_of_their_start() {
    // Before them, and within them.
    let sets = [(3, GAIN, "5.0"), (5, LINK, "\"late/number\""), (6, LINK, "\"front/sum\"")];
    let sets = [&sets[..], &[(24, GAIN, "7.0"), (26, LINK, "\"source/number\"")]].concat();
    let [path, later] = saved("flight-part.mcap", "100ms", &sets);
    let text = Run::read(&path).unwrap().configuration(Vec::new()).unwrap().current();
    let link = text.links().iter().find(|link| link.to.value == "scale/number").unwrap();
    assert_eq!(link.from.value.to_string(), "/front/sum");
    // It begins with what was there when it was requested, however late the thread is that writes it.
    assert_eq!(values(&later, "/scale/scaled")[0].1, 120_000_000);
    [path, later].iter().for_each(|path| made_again(path));
}

/// A recording that begins before the 24th cycle is computed again from there on with what was changed in that one and later.
fn made_again(path: &Path) {
    let refused = Player::open(path, &plugins(), plan("scale")).unwrap_err().to_string();
    assert!(refused.contains("begins after cycle 1"), "{refused}");
    let partial = Plan { is_partial: true, ..plan("scale") };
    let mut player = Player::open(path, &plugins(), partial).unwrap();
    let (mut agent, mut gains) = (load(&player, None), Vec::new());
    let gain = |agent: &Agent| agent.board().read("scale/params/gain").unwrap().unwrap().0.as_f64().unwrap();
    player
        .run_with(&mut agent, &AtomicBool::new(false), |agent| {
            gains.push((agent.now() / 10_000_000, gain(agent)))
        })
        .unwrap();
    let expected = |(cycle, _): &(u64, f64)| (*cycle, if *cycle < 24 { 5.0 } else { 7.0 });
    assert_eq!(gains, gains.iter().map(expected).collect::<Vec<_>>());
    assert!(gains[0].0 < 22, "{gains:?}");
    let outcome = player.outcome().unwrap().unwrap();
    let from = values(path, "/scale/scaled")[0].1;
    let scaled = outcome.properties.iter().find(|own| own.url == "/scale/scaled").unwrap();
    // In the first moment stands what was there before too.
    assert!(scaled.same >= 10 && scaled.different + scaled.only_recorded <= 2, "{outcome:?}");
    assert_eq!(outcome.first.as_ref().map_or(from, |first| first.time), from, "{outcome:?}");
}
