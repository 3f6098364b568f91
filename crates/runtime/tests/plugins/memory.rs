//! Many reloads cost no memory and leave no thread.

use std::fs;

use slate_runtime::Mode;

use crate::damage::in_a_process_of_its_own;
use crate::fixtures::libraries;
use crate::support::*;

/// Kilobytes in memory, threads, and open or mapped files of this process.
fn usage() -> (u64, u64, usize) {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let field = |name: &str| -> u64 {
        let line = status.lines().find(|line| line.starts_with(name)).unwrap();
        line.split_whitespace().nth(1).unwrap().parse().unwrap()
    };
    let maps = fs::read_to_string("/proc/self/maps").unwrap();
    (field("VmRSS:"), field("Threads:"), maps.lines().filter(|line| line.contains("libcounter.so")).count())
}

/// Folders of this process for copies of libraries.
fn copies() -> usize {
    let own = format!("slate-{}-", std::process::id());
    let files = fs::read_dir(std::env::temp_dir()).unwrap();
    files.filter(|file| file.as_ref().unwrap().file_name().to_string_lossy().starts_with(&own)).count()
}

#[test]
fn two_hundred_reloads_cost_no_memory_and_leave_no_thread() {
    in_a_process_of_its_own("memory::two_hundred_reloads_cost_no_memory_and_leave_no_thread", || {
        for mode in [Mode::Staged, Mode::Threaded] {
            let text = robot(&plain()).replace("[modules.reader]", "every = \"2ms\"\n[modules.reader]");
            let running = Running::start(&text, mode, &[]);
            let reload = |round: usize| {
                let file = libraries().counter(["more", "plain", "ports", "plain"][round % 4]);
                let reload = running.composer.reload("counter", Some(&file)).unwrap();
                assert!(reload.modules[0].1.is_ok(), "{reload:?}");
            };
            (0..20).for_each(reload);
            let (memory, threads, maps) = usage();
            (0..200).for_each(reload);
            running.cycles(2);
            let (memory_after, threads_after, maps_after) = usage();
            assert_eq!((threads_after, maps_after), (threads, maps), "{mode:?}");
            assert!(memory_after < memory + 4096, "{mode:?}: {memory} kB became {memory_after} kB");
            assert_eq!(copies(), 1, "of all copies that of the code in use is left");
            running.stop();
        }
    });
}
