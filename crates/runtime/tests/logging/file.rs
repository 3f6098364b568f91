use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;

use proptest::prelude::*;
use slate_module::Level;
use slate_runtime::log::{FileTarget, LogTarget, MemoryTarget, Rotation};

use crate::logging::{folder, logger, record};

const LARGE: Rotation = Rotation { size: 1_000_000, keep: 5 };

/// The lines of all files, oldest first.
fn kept(path: &Path, keep: u32) -> Vec<String> {
    let older = (1..=keep + 2).rev().map(|number| format!("{}.{number}", path.display()));
    let files = older.chain([path.display().to_string()]);
    files.filter_map(|file| fs::read_to_string(file).ok()).flat_map(|text| lines(&text)).collect()
}

fn lines(text: &str) -> Vec<String> {
    text.lines().map(str::to_owned).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn files_hold_the_newest_lines_within_size_and_number(
        lengths in prop::collection::vec(0_usize..60, 1..60),
        size in 30_u64..200,
        keep in 0_u32..4,
        reopened in 0_usize..60,
    ) {
        let folder = folder("rotation");
        let path = folder.join("agent.log");
        let mut target = FileTarget::open(&path, Rotation { size, keep }).unwrap();
        let mut written = Vec::new();
        for (number, length) in lengths.iter().enumerate() {
            if number == reopened {
                target = FileTarget::open(&path, Rotation { size, keep }).unwrap();
            }
            let record = record(&format!("{number} {}", "x".repeat(*length)));
            target.write(&record);
            written.push(record.to_string());
            prop_assert_eq!(target.diagnostic(), None);
        }
        let kept = kept(&path, keep);
        prop_assert!(written.ends_with(&kept) && !kept.is_empty());
        let files: Vec<_> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        prop_assert!(files.len() <= keep as usize + 1);
        for file in &files {
            let text = fs::read_to_string(file).unwrap();
            prop_assert!(text.len() as u64 <= size || text.lines().count() == 1);
        }
        // Nothing is thrown away before all files are there.
        prop_assert!(files.len() == keep as usize + 1 || kept.len() == written.len());
    }
}

#[test]
fn a_full_disk_is_reported_once_until_there_is_space() {
    let folder = folder("full");
    let path = folder.join("agent.log");
    symlink("/dev/full", &path).unwrap();
    let file = FileTarget::open(&path, LARGE).unwrap();
    let memory = MemoryTarget::default();
    let logger = logger(0, vec![Box::new(file), Box::new(memory.clone())]);
    (0..10).for_each(|number| logger.log(0, Level::Info, &format!("before {number}")));
    logger.flush(crate::logging::LONG);
    fs::remove_file(&path).unwrap();
    (0..10).for_each(|number| logger.log(0, Level::Info, &format!("after {number}")));
    drop(logger);
    let said: Vec<_> = memory.lines().into_iter().filter(|line| line.level == Level::Warn).collect();
    assert_eq!(said.len(), 2, "{said:?}");
    assert!(said[0].text.contains("agent.log can't be written, so lines are missing there: No space left"));
    // The ten lines, and the one that says so.
    assert!(said[1].text.ends_with("agent.log can be written again; lines missing there: 11"));
    let text = fs::read_to_string(&path).unwrap();
    let texts: Vec<_> = text.lines().map(|line| line.rsplit(": ").next().unwrap()).collect();
    assert_eq!(texts[..3], ["after 0", "11", "after 1"]);
    assert_eq!(texts.len(), 11, "nothing else is missing");
}

#[test]
fn a_file_that_cannot_rotate_is_reported_once_and_keeps_older() {
    let folder = folder("stuck");
    let path = folder.join("agent.log");
    // A folder that is not empty can't be replaced by a file.
    fs::create_dir_all(folder.join("agent.log.2/in-the-way")).unwrap();
    fs::write(folder.join("agent.log.1"), "old\n").unwrap();
    let mut target = FileTarget::open(&path, Rotation { size: 50, keep: 2 }).unwrap();
    (0..5).for_each(|_| target.write(&record("a line of forty characters or so")));
    assert!(target.diagnostic().unwrap().contains("agent.log can't be written"));
    assert_eq!(target.diagnostic(), None);
    assert_eq!(fs::read_to_string(folder.join("agent.log.1")).unwrap(), "old\n");
    fs::remove_dir_all(folder.join("agent.log.2")).unwrap();
    target.write(&record("last"));
    assert!(target.diagnostic().unwrap().ends_with("lines missing there: 4"));
    assert_eq!(fs::read_to_string(folder.join("agent.log.2")).unwrap(), "old\n");
    assert!(fs::read_to_string(&path).unwrap().ends_with("m: last\n"));
}

#[test]
fn a_folder_that_is_missing_is_made_and_an_old_log_goes_on() {
    let path = folder("again").join("logs/deep/agent.log");
    for text in ["first", "second"] {
        FileTarget::open(&path, LARGE).unwrap().write(&record(text));
    }
    assert_eq!(
        lines(&fs::read_to_string(&path).unwrap()),
        ["first", "second"].map(|t| record(t).to_string())
    );
}
