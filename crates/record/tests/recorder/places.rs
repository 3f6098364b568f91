//! Where recordings go, and what they leave alone.

use std::path::{Path, PathBuf};

use slate_blackboard::interface::Value;
use slate_runtime::recording::{Recording, selection};

use super::support::{LOCKSTEP, agent, numbers, read};

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("record-{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    folder
}

fn count(file: &Path) -> usize {
    numbers(&std::fs::read(file).unwrap(), "/counter/number").len()
}

#[test]
fn a_run_keeps_the_recordings_of_those_before_it() {
    let folder = folder("kept");
    for (steps, earlier) in [(3, None), (5, Some("run-1.mcap")), (7, Some("run-2.mcap"))] {
        let (mut agent, recorder, _) = agent(LOCKSTEP, "");
        recorder.attach(&agent, &folder);
        (0..steps).for_each(|_| assert!(agent.step()));
        let recorded = recorder.end(&mut agent).unwrap();
        assert_eq!(recorded.file, folder.join("run.mcap"));
        assert_eq!(recorded.earlier, earlier.map(|name| folder.join(name)));
    }
    let counts = ["run-1.mcap", "run-2.mcap", "run.mcap"].map(|name| count(&folder.join(name)));
    assert_eq!(counts, [3, 5, 7]);
}

#[test]
fn of_two_runs_in_one_folder_at_once_each_has_its_own_file() {
    let folder = folder("both");
    let (mut first, its, _) = agent(LOCKSTEP, "");
    let (mut second, other, log) = agent(LOCKSTEP, "");
    its.attach(&first, &folder);
    other.attach(&second, &folder);
    (0..4).for_each(|_| assert!(first.step() && second.step()));
    assert!(first.step());
    second.logger().flush(std::time::Duration::from_secs(10));
    let [first, second] = [its.end(&mut first).unwrap(), other.end(&mut second).unwrap()];
    assert_eq!([&first.file, &second.file], [&folder.join("run.mcap"), &folder.join("run-1.mcap")]);
    assert_eq!([&first, &second].map(|recorded| count(&recorded.file)), [5, 4]);
    let said = log.lines();
    assert!(said.iter().any(|line| line.message().contains("another run records into")), "{said:?}");
}

#[test]
fn a_fault_does_not_take_the_place_of_that_of_the_run_before() {
    let folder = folder("faults");
    for name in ["flight-fault-1.mcap", "flight-fault-2.mcap"] {
        let (mut agent, recorder, _) =
            agent(LOCKSTEP, "flight = { keep = \"100ms\", trigger = [\"fault\"] }");
        agent.board().write("counter/params/limit", &Value::Float(40.0), 0).unwrap();
        recorder.attach(&agent, &folder);
        (0..50).for_each(|_| assert!(agent.step()));
        recorder.end(&mut agent).unwrap();
        assert!(!read(&std::fs::read(folder.join(name)).unwrap()).unwrap().is_empty());
    }
    assert!(!folder.join("flight-fault-3.mcap").exists());
}

#[test]
fn a_tool_without_a_file_does_not_end_the_recording_of_the_run() {
    let folder = folder("own");
    let (mut agent, recorder, _) = agent(LOCKSTEP, "");
    recorder.attach(&agent, &folder);
    assert!(agent.step());
    let control = recorder.control().unwrap();
    let refused = control.stop(&agent.composer(), None).unwrap_err();
    assert!(refused.message.contains("only the run's own recording continues"), "{refused:?}");
    let file = std::path::absolute(folder.join("run.mcap")).unwrap();
    assert!(refused.help.contains(file.to_str().unwrap()), "{refused:?}");
    assert_eq!(control.status().recordings[0].file, file);
    control.stop(&agent.composer(), Some(&file)).unwrap();
    assert!(control.status().recordings.is_empty());
    recorder.end(&mut agent).unwrap();
}

#[test]
fn a_pattern_without_a_match_is_reported_with_nearest_names() {
    let extra = "select = [\"/counter/nummber\"]\n[[record.rules]]\nselect = \"/conter/**\"\nrate = 5.0\n";
    let (mut agent, recorder, log) = agent(LOCKSTEP, extra);
    recorder.attach(&agent, &folder("misspelt"));
    assert!(agent.step());
    recorder.end(&mut agent).unwrap();
    agent.logger().flush(std::time::Duration::from_secs(10));
    let said = log.lines();
    let told = |words: &str| said.iter().any(|line| line.message().contains(words));
    assert!(told("no property fits /counter/nummber of record.select"), "{said:?}");
    assert!(told("the nearest are /counter/number"), "{said:?}");
    assert!(told("no property fits /conter/** of record.rules"), "{said:?}");
}

#[test]
fn ninth_recording_at_a_time_is_refused() {
    let folder = folder("ninth");
    let (mut agent, recorder, _) = agent(LOCKSTEP, "");
    recorder.attach(&agent, &folder);
    assert!(agent.step());
    let control = recorder.control().unwrap();
    let all = selection(&[], &[], None, false).unwrap();
    let file = |number: u32| std::path::absolute(folder.join(format!("tool-{number}.mcap"))).unwrap();
    let start = |number| control.start(&agent.composer(), &file(number), &all);
    // The recording of the run is the first one.
    (2..=8).for_each(|number| start(number).unwrap());
    let refused = start(9).unwrap_err();
    assert!(refused.message.contains("8 recordings"), "{refused:?}");
    assert!(!file(9).exists());
    recorder.end(&mut agent).unwrap();
}
