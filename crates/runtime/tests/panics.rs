//! A module's panic is logged and not printed: a backtrace takes longer to print than a cycle.
#![cfg(not(feature = "shuttle"))]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

mod common;

use std::sync::atomic::{AtomicU32, Ordering};

use common::{load, number};
use slate_runtime::log::MemoryTarget;
use slate_runtime::{Control, Options};

static PRINTED: AtomicU32 = AtomicU32::new(0);

#[test]
fn a_panic_of_a_module_is_in_the_log_and_is_not_printed() {
    // Replaces the printing hook; full backtraces remain available.
    std::panic::set_hook(Box::new(|_| {
        PRINTED.fetch_add(1, Ordering::Relaxed);
    }));
    let is_full = std::env::var_os("RUST_BACKTRACE").is_some_and(|wanted| wanted == "full");
    let log = MemoryTarget::default();
    let options = Options { log: vec![Box::new(log.clone())], ..Options::default() };
    let mut agent = load("[modules.counter]\nparams.panic_at = 3", &[], options).unwrap();
    let end = |cycle: u64| if cycle == 6 { Control::Stop } else { Control::Continue };
    agent.run(Box::new(move |cycle| end(cycle.number))).unwrap();
    assert_eq!(agent.counts("counter").unwrap().2, 1);
    assert_eq!(number(&agent, "counter/number/value"), 3.0, "it begins anew");
    agent.logger().flush(std::time::Duration::from_secs(10));
    let lines = log.lines();
    let told = lines.iter().find(|line| line.text.contains("panicked: as the test wants (at "));
    assert!(told.is_some_and(|line| line.text.contains("common/mod.rs:")), "{lines:?}");
    assert_eq!(PRINTED.load(Ordering::Relaxed), u32::from(is_full));

    // Panics that no module's call contains are printed as ever.
    std::thread::spawn(|| panic!("elsewhere")).join().unwrap_err();
    assert_eq!(PRINTED.load(Ordering::Relaxed), 1 + u32::from(is_full));
}
