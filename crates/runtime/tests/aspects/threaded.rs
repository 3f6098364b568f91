//! Services between threads.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::Ordering;

use slate_module::Plugin;
use slate_runtime::{Control, Mode, Options};

use crate::common::{load, number};
use crate::light::{Watch, plugins};
use crate::{condition, wait};

/// Runs an agent in threaded mode until a test has seen what it wants.
fn run(
    text: &str,
    plugins: &[Plugin],
    test: impl FnOnce(&slate_runtime::Composer) + Send,
) -> slate_runtime::Agent {
    let options = Options { mode: Mode::Threaded, armed: true, ..Options::default() };
    let mut agent = load(text, plugins, options).unwrap();
    let (composer, stopper) = (agent.composer(), agent.stopper());
    std::thread::scope(|scope| {
        scope.spawn(|| {
            // Also a test that fails ends the run.
            let result = catch_unwind(AssertUnwindSafe(|| test(&composer)));
            stopper.stop();
            result.unwrap_or_else(|panic| resume_unwind(panic));
        });
        agent.run(Box::new(|_| Control::Continue)).unwrap();
    });
    agent
}

#[test]
fn a_service_that_comes_and_goes_is_never_dropped_under_its_user_nor_twice() {
    let watch = Watch::of(20);
    let text = "[modules.meter]\nevery = \"1ms\"\nparams = { watch = 20, flap = 1, hold = 2 }\n\
                [modules.lamp]\nevery = \"1ms\"\n\
                [modules.other]\nplugin = \"lamp\"\nevery = \"1ms\"\n";
    let agent = run(text, &plugins(), |_| {
        wait("readings", || watch.readings.load(Ordering::SeqCst) > 100);
    });
    drop(agent);
    let (provided, dropped) = watch.counts();
    assert!(provided > 10, "it came and went: {provided}");
    assert_eq!(provided, dropped);
    assert_eq!(watch.misused.load(Ordering::SeqCst), 0);
}

#[test]
fn who_sleeps_lets_go_of_a_service_that_is_gone() {
    let watch = Watch::of(21);
    // The lamp makes its next tick in a minute.
    let text = "[modules.meter]\nevery = \"5ms\"\nparams = { watch = 21, withdraw_at = 20 }\n\
                [modules.lamp]\nevery = \"60s\"\n";
    let agent = run(text, &plugins(), |_| {
        wait("the second light", || watch.counts().0 == 2);
        wait("the end of the first one", || watch.counts().1 == 1);
    });
    assert_eq!(watch.readings.load(Ordering::SeqCst), 1);
    drop(agent);
    assert_eq!(watch.counts(), (2, 2));
}

#[test]
fn a_provider_on_its_own_thread_is_switched_off_and_on() {
    let text = "[modules.meter]\nevery = \"1ms\"\nparams.watch = 22\n[modules.lamp]\nevery = \"1ms\"\n";
    let agent = run(text, &plugins(), |composer| {
        let is = |wanted: &str| {
            let modules = composer.modules();
            modules.iter().any(|status| status.name == "lamp" && status.condition == wanted)
        };
        wait("the lamp works", || is("WORKING") && Watch::of(22).readings.load(Ordering::SeqCst) > 0);
        composer.enable("meter", false).unwrap();
        wait("the lamp waits", || is("WAITING"));
    });
    assert_eq!(condition(&agent, "lamp"), "WAITING");
    assert_eq!(number(&agent, "lamp/brightness/value"), -1.0);
    assert_eq!(Watch::of(22).counts(), (1, 1));
}
