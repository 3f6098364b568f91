//! Slow, full, stuck and missing disks.

use std::io::{self, Cursor, Write};
use std::path::Path;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use mcap::MessageStream;
use slate_bag::{Reader, repair_into};
use slate_blackboard::interface::Value;
use slate_runtime::Control;
use slate_runtime::recording::RecordingControl;

use crate::recorder::support::{Bytes, Full, LOCKSTEP, Stuck, agent, numbers, read};

#[test]
fn in_lockstep_the_loop_waits_for_a_recorder_that_is_behind() {
    let (mut agent, recorder, _) = agent(LOCKSTEP, "buffer = \"1KiB\"\nchunk = \"1KiB\"");
    let (bytes, (go, may)) = (Bytes::default(), channel());
    let writer = Stuck { bytes: bytes.clone(), may, writes: 0 };
    recorder.begin_with(&agent, Path::new("here"), Box::new(writer));
    let steps = std::thread::spawn(move || {
        (0..1000).for_each(|_| assert!(agent.step()));
        agent
    });
    for _ in 0..20 {
        go.send(()).unwrap();
    }
    drop(go);
    let mut agent = steps.join().unwrap();
    let recorded = recorder.end(&mut agent).unwrap();
    assert_eq!(recorded.dropped, 0);
    let file = bytes.0.lock().unwrap().clone();
    assert_eq!(recorded.bytes, file.len() as u64);
    assert_eq!(numbers(&file, "/counter/number"), (1..=1000).collect::<Vec<_>>());
}

#[test]
fn wall_clock_recording_never_waits_and_counts_drops() {
    let small =
        "buffer = \"1KiB\"\nchunk = \"1KiB\"\nselect = [\"/counter/**\"]\nexclude = [\"/**/histogram\"]";
    let (mut agent, recorder, _) = agent(!LOCKSTEP, small);
    let (bytes, (go, may)) = (Bytes::default(), channel());
    let writer = Stuck { bytes: bytes.clone(), may, writes: 0 };
    recorder.begin_with(&agent, Path::new("here"), Box::new(writer));
    // The file takes nothing meanwhile, and the run ends all the same.
    let stop =
        |cycle: &slate_runtime::Cycle<'_>| if cycle.number < 100 { Control::Continue } else { Control::Stop };
    agent.run(Box::new(stop)).unwrap();
    drop(go);
    let written = agent.board().read("counter/number").unwrap().unwrap().1.sequence;
    let recorded = recorder.end(&mut agent).unwrap();
    let file = bytes.0.lock().unwrap().clone();
    let numbers = numbers(&file, "/counter/number");
    assert!(recorded.dropped > 0 && numbers.is_sorted(), "{recorded:?}");
    let summary = mcap::Summary::read(&file).unwrap().unwrap();
    let index = summary.metadata_indexes.iter().find(|index| index.name == "dropped").unwrap();
    let dropped = mcap::read::metadata(&file, index).unwrap().metadata;
    let own: u64 = dropped["/counter/number"].parse().unwrap();
    assert_eq!(numbers.len() as u64 + own, written, "every value is in the file or counted");
}

/// Takes its time.
struct Slow(Bytes);

impl Write for Slow {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        std::thread::sleep(Duration::from_millis(30));
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn acknowledged_change_is_in_the_file() {
    let (mut agent, recorder, _) = agent(!LOCKSTEP, "");
    let bytes = Bytes::default();
    recorder.begin_with(&agent, Path::new("here"), Box::new(Slow(bytes.clone())));
    let (composer, stopper) = (agent.composer(), agent.stopper());
    let database = agent.database().unwrap().clone();
    let run = std::thread::spawn(move || {
        agent.run(Box::new(|_| Control::Continue)).unwrap();
        agent
    });
    for step in 2..6 {
        let changes = vec![("modules.counter.params.step".to_owned(), format!("{step}.0"))];
        database.set(&changes).unwrap();
        composer.settle_changes();
        // As a kill would leave it now.
        let file = bytes.0.lock().unwrap().clone();
        let mut reader = Reader::unfinished(Cursor::new(&file), "here").unwrap();
        let mut told = 0;
        while let Some(message) = reader.next_message().unwrap() {
            told += usize::from(message.channel.topic == "/record/change");
        }
        assert_eq!(told, step - 1);
    }
    stopper.stop();
    recorder.end(&mut run.join().unwrap()).unwrap();
}

#[test]
fn a_full_disk_ends_the_recording_with_one_line_and_no_stop() {
    let (mut without, _, _) = agent(LOCKSTEP, "");
    let (mut agent, recorder, log) = agent(LOCKSTEP, "chunk = \"1KiB\"");
    let bytes = Bytes::default();
    let full = Full(bytes.clone(), 20_000);
    recorder.begin_with(&agent, Path::new("here"), Box::new(full));
    for _ in 0..2000 {
        assert!(agent.step() && without.step());
    }
    assert_eq!(agent.digest(), without.digest());
    let error = recorder.end(&mut agent).unwrap_err().to_string();
    assert!(error.contains("the recording here is incomplete: "), "{error}");
    agent.logger().flush(std::time::Duration::from_secs(10));
    let lines = log.lines();
    let said = lines.iter().filter(|line| line.text.contains("the recording here ends here")).count();
    assert_eq!(said, 1, "{lines:?}");
    let (state, _) = agent.board().read("record/state").unwrap().unwrap();
    assert_eq!(state.get("is_on"), Some(&Value::Bool(false)));
    // What was closed before is there.
    let file = bytes.0.lock().unwrap().clone();
    let options = mcap::read::Options::IgnoreEndMagic.into();
    let there = MessageStream::new_with_options(&file, options).unwrap().filter(Result::is_ok).count();
    assert!(there > 50, "{there}");
}

/// Panics when so many bytes are there.
struct Broken(Bytes, usize);

impl Write for Broken {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        assert!(self.0.0.lock().unwrap().len() < self.1, "a disk that is no disk");
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_panicking_writer_ends_the_recording_and_not_the_agent() {
    let (mut without, _, _) = agent(LOCKSTEP, "");
    let (mut agent, recorder, log) = agent(LOCKSTEP, "chunk = \"1KiB\"\nbuffer = \"1KiB\"");
    let bytes = Bytes::default();
    recorder.begin_with(&agent, Path::new("here"), Box::new(Broken(bytes.clone(), 20_000)));
    for _ in 0..2000 {
        assert!(agent.step() && without.step());
    }
    assert_eq!(agent.digest(), without.digest());
    let error = recorder.end(&mut agent).unwrap_err().to_string();
    assert!(error.contains("the recording here is incomplete: ") && error.contains("panicked"), "{error}");
    agent.logger().flush(std::time::Duration::from_secs(10));
    let lines = log.lines();
    let said = lines.iter().filter(|line| line.text.contains("the recording here ends here")).count();
    assert_eq!(said, 1, "{lines:?}");
    let (state, _) = agent.board().read("record/state").unwrap().unwrap();
    assert_eq!(state.get("is_on"), Some(&Value::Bool(false)));
    let file = bytes.0.lock().unwrap().clone();
    let options = mcap::read::Options::IgnoreEndMagic.into();
    let there = MessageStream::new_with_options(&file, options).unwrap().filter(Result::is_ok).count();
    assert!(there > 50, "{there}");
}

/// Waits until something is so.
fn wait_for(what: &str, mut is_so: impl FnMut() -> bool) {
    for _ in 0..4000 {
        if is_so() {
            return;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("{what}: not within 20 s");
}

/// The last seconds in a file that is not there yet.
fn file(name: &str) -> std::path::PathBuf {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_file(&file);
    file
}

#[test]
#[allow(clippy::disallowed_methods, reason = "a disk stands still on the wall clock")]
fn a_stalled_disk_delays_neither_agent_nor_last_seconds() {
    let extra = "buffer = \"8KiB\"\nchunk = \"1KiB\"\nflight = { keep = \"60s\" }";
    let (mut agent, recorder, log) = agent(!LOCKSTEP, extra);
    let (bytes, (go, may)) = (Bytes::default(), channel());
    let writer = Stuck { bytes: bytes.clone(), may, writes: 0 };
    recorder.begin_with(&agent, Path::new("here"), Box::new(writer));
    let (composer, board, stopper) =
        (agent.composer(), std::sync::Arc::clone(agent.board()), agent.stopper());
    let newest = || board.read("counter/number").unwrap().map_or(0, |(_, stamp)| stamp.sequence);
    std::thread::scope(|scope| {
        scope.spawn(|| agent.run(Box::new(|_| Control::Continue)).unwrap());
        // Far more than may wait for the disk.
        wait_for("a thousand cycles", || newest() > 1000);
        let (before, asked) = (newest(), Instant::now());
        let saved = recorder.save(&composer, &file("stuck-wall.mcap")).unwrap();
        assert!(asked.elapsed() < Duration::from_secs(5), "{:?}", asked.elapsed());
        let kept = numbers(&std::fs::read(&saved.file).unwrap(), "/counter/number");
        assert_eq!(kept[..], (1..=kept.len() as u32).collect::<Vec<_>>(), "none of them is missing");
        assert!(kept.len() as u64 >= before, "{} of {before}", kept.len());
        let status = recorder.status();
        assert!(status.recordings[0].dropped > 500, "{status:?}");
        wait_for("a line that says so", || {
            let said = "the disk of the recording here has accepted no data for";
            log.lines().iter().any(|line| line.text.contains(said))
        });
        stopper.stop();
    });
    drop(go);
    let recorded = recorder.end(&mut agent).unwrap();
    let file = bytes.0.lock().unwrap().clone();
    read(&file).unwrap();
    let all = numbers(&file, "/counter/number").len() as u64;
    let said = recorded.dropped;
    assert!(all < newest() && all + said >= newest(), "{all} values, {said} dropped of {}", newest());
}

#[test]
fn in_lockstep_the_last_seconds_exist_while_waiting_for_a_disk() {
    let extra = "buffer = \"4KiB\"\nchunk = \"1KiB\"\nflight = { keep = \"60s\" }";
    let (mut agent, recorder, _) = agent(LOCKSTEP, extra);
    let (bytes, (go, may)) = (Bytes::default(), channel());
    let writer = Stuck { bytes: bytes.clone(), may, writes: 0 };
    recorder.begin_with(&agent, Path::new("here"), Box::new(writer));
    let (composer, board) = (agent.composer(), std::sync::Arc::clone(agent.board()));
    let steps = std::thread::spawn(move || {
        (0..1000).for_each(|_| assert!(agent.step()));
        agent
    });
    let newest = || board.read("counter/number").unwrap().map_or(0, |(_, stamp)| stamp.sequence);
    let mut last = 0;
    wait_for("the loop to wait", || {
        std::thread::sleep(Duration::from_millis(100));
        std::mem::replace(&mut last, newest()) == newest() && last > 0
    });
    assert!(last < 1000, "{last}");
    let saved = recorder.save(&composer, &file("stuck-lockstep.mcap")).unwrap();
    assert!(!numbers(&std::fs::read(&saved.file).unwrap(), "/counter/number").is_empty());
    drop(go);
    let mut agent = steps.join().unwrap();
    assert_eq!(recorder.end(&mut agent).unwrap().dropped, 0);
    let file = bytes.0.lock().unwrap().clone();
    assert_eq!(numbers(&file, "/counter/number"), (1..=1000).collect::<Vec<_>>());
}

#[test]
fn recording_with_removed_file_fails() {
    let (mut agent, recorder, _) = agent(LOCKSTEP, "");
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("removed.mcap");
    recorder.begin(&agent, &path);
    assert!(agent.step());
    std::fs::remove_file(&path).unwrap();
    let error = recorder.end(&mut agent).unwrap_err().to_string();
    assert!(error.contains("removed.mcap") && error.contains("its file was removed or moved"), "{error}");
}

#[test]
fn a_damaged_chunk_costs_no_other_chunk() {
    let (mut agent, recorder, _) = agent(LOCKSTEP, "chunk = \"4KiB\"");
    let bytes = Bytes::default();
    recorder.begin_with(&agent, Path::new("here"), Box::new(bytes.clone()));
    (0..300).for_each(|_| assert!(agent.step()));
    recorder.end(&mut agent).unwrap();
    let whole = bytes.0.lock().unwrap().clone();
    let all = read(&whole).unwrap().len();
    let first = whole.windows(14).position(|part| part == b"/counter/state").unwrap();
    // A kill, so that there is no summary, and one wrong bit in the piece that defines what there is.
    let mut cut = whole[..whole.len() * 3 / 4].to_vec();
    let kept = |file: &[u8]| {
        let mut out = Vec::new();
        let repaired = repair_into(Cursor::new(file), &mut out).unwrap();
        (read(&out).unwrap(), repaired)
    };
    let (sound, _) = kept(&cut);
    assert!(sound.len() > all / 2, "{} of {all}", sound.len());
    cut[first] ^= 1;
    let (left, repaired) = kept(&cut);
    assert_eq!(repaired.lost.len(), 2, "the piece and the end: {:?}", repaired.lost);
    assert!(left.len() > sound.len() - 40 && sound.ends_with(&left), "{} of {}", left.len(), sound.len());
    // What is repeated is checked, too.
    let again = whole.windows(17).position(|part| part == b"slate definitions").unwrap();
    for place in [again + 20, again + 40] {
        let mut other = whole[..whole.len() * 3 / 4].to_vec();
        other[place] ^= 1;
        let error = Reader::unfinished(Cursor::new(&other), "here").map(drop).unwrap_err().to_string();
        assert!(error.contains("repeated definitions"), "{error}");
        assert_eq!(kept(&other).0, sound);
    }
}
