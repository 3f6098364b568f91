use std::collections::BTreeSet;
use std::sync::atomic::AtomicBool;

use slate_bag::{Compression, Reader, Selection, Writer};
use slate_logs::{Counts, copy, diff};
use slate_record::Recorder;
use slate_replay::{Choice, Comparison, Plan, Player, Recomputation, Recomputed};
use slate_runtime::Agent;
use slate_runtime::configuration::Record;

use crate::replay::support::{ROBOT, file, load, play, plugins, record, recorded};

fn plan(modules: &[&str]) -> Plan {
    Plan { modules: modules.iter().map(|name| (*name).to_owned()).collect(), ..Plan::default() }
}

/// Each depends on what it saw when: a value of the wrong cycle would be another sum.
#[test]
fn modules_that_run_on_a_recording_write_what_is_recorded() {
    let path = recorded("same.mcap");
    for modules in [
        &["front"][..],
        &["back"],
        &["gatherer"],
        &["late"],
        &["front", "back"],
        &["source", "back", "gatherer"],
        &["source", "late", "front", "back", "gatherer"],
    ] {
        let (_, outcome, player) = play(&path, plan(modules));
        let outcome = outcome.unwrap();
        assert_eq!(outcome.first, None, "{modules:?}");
        assert!(player.misses().is_empty());
        let compared: BTreeSet<_> =
            outcome.properties.iter().map(|own| own.url.split('/').nth(1).unwrap()).collect();
        assert_eq!(compared, modules.iter().copied().collect(), "{outcome:?}");
        let all: u64 =
            outcome.properties.iter().filter(|own| !own.url.ends_with("state")).map(|own| own.same).sum();
        assert!(all >= 10 * modules.len() as u64, "{outcome:?}");
    }
}

#[test]
fn another_parameter_gives_another_value_and_the_first_is_named() {
    let path = recorded("other.mcap");
    let plan = Plan { sets: vec!["modules.back.params.gain=3.0".into()], ..plan(&["back"]) };
    let (_, outcome, _) = play(&path, plan);
    let first = outcome.unwrap().first.unwrap();
    assert_eq!((first.time, first.url.as_str(), first.field.as_str()), (0, "/back/sum", "value"));
    assert_ne!(first.recorded, first.replayed);
}

#[test]
fn replay_repeats_recorded_changes() {
    let path = file("changed.mcap");
    record(&path, ROBOT, |agent, cycle| {
        let database = agent.database().unwrap();
        match cycle {
            9 => drop(database.set(&[("modules.back.params.gain", "5.0")]).unwrap()),
            12 => drop(database.set(&[("modules.front.params.gain", "7.0")]).unwrap()),
            _ => {}
        }
    });
    for modules in [&["back"][..], &["front"], &["front", "back"]] {
        assert_eq!(play(&path, plan(modules)).1.unwrap().first, None, "{modules:?}");
    }
}

/// What they remembered then is not recorded; what was changed in them is.
#[test]
fn late_modules_begin_with_fresh_state_and_their_parameters() {
    let path = file("later.mcap");
    record(&path, ROBOT, |agent, cycle| {
        let gain = match cycle {
            9 => "5.0",
            20 => "6.0",
            _ => return,
        };
        drop(agent.database().unwrap().set(&[("modules.back.params.gain", gain)]).unwrap());
    });
    let begun = |start| {
        let mut player =
            Player::open(&path, &plugins(), Plan { start: Some(start), ..plan(&["back"]) }).unwrap();
        let (mut agent, mut gains) = (load(&player, None), Vec::new());
        let gain =
            |agent: &Agent| agent.board().read("back/params/gain").unwrap().unwrap().0.as_f64().unwrap();
        player.run_with(&mut agent, &AtomicBool::new(false), |agent| gains.push(gain(agent))).unwrap();
        (player.outcome().unwrap().unwrap(), gains)
    };
    let (outcome, gains) = begun(155_000_000);
    assert_eq!(outcome.fresh_from, Some(150_000_000));
    assert!(outcome.first.is_some_and(|first| first.url == "/back/sum"), "it adds up all that it reads");
    assert_eq!(gains, [vec![5.0; 5], vec![6.0; 10]].concat());
    let (outcome, gains) = begun(5_000_000);
    assert_eq!((outcome.fresh_from, outcome.first, gains[0]), (None, None, 2.0));
}

#[test]
fn unwritten_values_do_not_count_as_lost() {
    let path = file("unwritten.mcap");
    let robot = ROBOT.replace("first = 20.0", "first = 1000.0");
    let robot =
        robot.replace("\"gatherer/numbers\" = \"source/number\"", "\"gatherer/numbers\" = \"late/number\"");
    record(&path, &format!("{robot}select = [\"/gatherer/**\"]\n"), |_, _| {});
    let (_, outcome, player) = play(&path, plan(&["gatherer"]));
    assert!(player.misses().is_empty(), "{:?}", player.misses());
    let count = |own: &&Recomputed| own.url == "/gatherer/count";
    let properties = outcome.unwrap().properties;
    let count = properties.iter().find(count).unwrap();
    assert!(count.is_same() && count.same == 30, "{count:?}");
    let lack = Comparison::open(&path).unwrap().run().obstacle().unwrap();
    assert!(lack.contains("/source/number") && !lack.contains("/late/number"), "{lack}");
}

#[test]
fn recomputed_values_are_recorded_beside_played_ones() {
    let (path, again) = (recorded("before.mcap"), file("after.mcap"));
    let plan = Plan { sets: vec!["modules.back.params.gain=3.0".into()], ..plan(&["back"]) };
    let mut player = Player::open(&path, &plugins(), plan).unwrap();
    let recorder = Recorder::new(&Record { enabled: true, ..Record::default() });
    let mut agent = load(&player, Some(&recorder));
    recorder.begin(&agent, &again);
    player.run(&mut agent, &AtomicBool::new(false)).unwrap();
    recorder.end(&mut agent).unwrap();
    let diff = diff(&path, &again).unwrap();
    let counts = |topic: &str| -> &Counts { &diff.topics[topic] };
    assert_eq!(counts("/front/sum").different + counts("/front/sum").only_a, 0);
    assert_eq!(counts("/back/sum").different, 30);
}

#[test]
fn a_part_that_is_not_recorded_is_not_compared() {
    let path = file("partly.mcap");
    let text = format!("{ROBOT}select = [\"/source/**\", \"/front/**\", \"/late/**\"]\n");
    record(&path, &text, |_, _| {});
    let (_, outcome, player) = play(&path, plan(&["back"]));
    assert_eq!(outcome.unwrap().first, None);
    assert!(player.misses().is_empty(), "it has all that it reads");
}

/// What is said of modules that would not have what they had, and what comes of it when they run all the same.
fn lacking(path: &std::path::Path, modules: &[&str]) -> (String, Recomputation, Vec<String>) {
    let refused = Player::open(path, &plugins(), plan(modules)).unwrap_err().to_string();
    assert!(refused.contains("--partial"), "{refused}");
    let (_, outcome, player) = play(path, Plan { is_partial: true, ..plan(modules) });
    assert!(!player.misses().is_empty());
    (refused, outcome.unwrap(), player.misses().to_vec())
}

#[test]
fn modules_run_on_missing_inputs_only_on_request() {
    let path = file("lacking.mcap");
    record(&path, &format!("{ROBOT}select = [\"/source/**\", \"/front/**\", \"/late/**\"]\n"), |_, _| {});
    let (refused, outcome, misses) = lacking(&path, &["front"]);
    assert!(refused.contains("nothing of /back/sum is recorded"), "{refused}");
    assert_eq!(misses, ["nothing of /back/sum is recorded"]);
    assert!(outcome.first.is_some(), "it adds up something else: {outcome:?}");
    for (rule, words) in [
        ("rate = 20.0", "of 26 values of /source/number are recorded"),
        // Each value is another one, so that none is left out in fact; nothing in the file says so.
        ("on_change = true", "not every value of /source/number is recorded"),
    ] {
        let text = format!("{ROBOT}[[record.rules]]\nselect = \"/source/number\"\n{rule}\n");
        record(&path, &text, |_, _| {});
        let (refused, ..) = lacking(&path, &["gatherer"]);
        assert!(refused.contains(words), "{refused}");
        // Its writer has all its inputs, and the recorded part is the same.
        let outcome = play(&path, plan(&["source"])).1.unwrap();
        assert_eq!((outcome.first, outcome.unseen), (None, Vec::new()));
    }
    let choice = Choice { exclude: vec!["/source/number".into()], ..Choice::default() };
    let refused = Player::open(&recorded("left.mcap"), &plugins(), Plan { choice, ..plan(&["gatherer"]) });
    assert!(refused.unwrap_err().to_string().contains("/source/number is left out"));
}

#[test]
fn a_part_of_a_recording_is_not_all_that_modules_read_either() {
    let (path, part) = (recorded("copied.mcap"), file("copied-part.mcap"));
    let mut later = Selection::default();
    later.from = Some(50_000_000);
    copy(&path, &part, &later).unwrap();
    let (refused, ..) = lacking(&part, &["gatherer"]);
    assert!(refused.contains("only 25 of 30 values of /source/number are recorded"), "{refused}");
    // By a program that knows nothing of what a run is.
    let mut reader = Reader::open(&path).unwrap();
    let mut writer = Writer::new(Vec::new(), &part, reader.header(), Compression::Lz4).unwrap();
    while let Some(message) = reader.next_message().unwrap() {
        if message.channel.topic == "/source/number" {
            continue;
        }
        writer.schema(message.schema.unwrap()).unwrap();
        writer.channel(message.channel).unwrap();
        let (sequence, time) = (message.sequence, message.log_time);
        writer.message(message.channel.id, sequence, time, message.publish_time, message.data).unwrap();
    }
    reader.metadata().unwrap().iter().for_each(|metadata| writer.metadata(metadata).unwrap());
    for number in 0..reader.attachments() {
        writer.attachment(&reader.attachment(number).unwrap().unwrap()).unwrap();
    }
    std::fs::write(&part, writer.finish().unwrap()).unwrap();
    let (refused, ..) = lacking(&part, &["gatherer"]);
    assert!(refused.contains("nothing of /source/number is recorded"), "{refused}");
}

#[test]
fn a_module_that_the_recorded_agent_has_not_is_refused_by_name() {
    let path = recorded("names.mcap");
    let error = Player::open(&path, &plugins(), plan(&["bakc"])).unwrap_err().to_string();
    assert!(error.contains("no module `bakc`") && error.contains("`back`"), "{error}");
    let choice = Choice { exclude: vec!["/source/number".into()], ..Choice::default() };
    let plan = Plan { choice, is_partial: true, ..plan(&["back"]) };
    let without = Player::open(&path, &plugins(), plan).unwrap();
    drop(load(&without, None));
}
