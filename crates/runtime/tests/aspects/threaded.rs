//! Services between threads.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::Ordering;

use slate_module::Plugin;
use slate_runtime::{Control, Mode, Options};

use crate::aspects::common::{load, number};
use crate::aspects::light::{Watch, plugins};
use crate::aspects::{condition, wait};

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
fn a_service_is_never_dropped_under_its_user_nor_twice() {
    let watch = Watch::of(20);
    let text = "[modules.meter]\nevery = \"1ms\"\nparams = { watch = 20, flap = 1, hold = 2 }\n\
                [modules.lamp]\nevery = \"1ms\"\n\
                [modules.other]\nkind = \"lamp\"\nevery = \"1ms\"\n";
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
fn sleeping_module_releases_withdrawn_service() {
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

#[test]
fn a_service_of_a_late_provider_is_not_called_until_it_returns() {
    for (watch, trigger) in [(23, ""), (24, "every = \"1ms\"\n")] {
        let text = format!(
            "loop.period = \"2ms\"\nloop.hang = \"100ms\"\n[modules.meter]\n{trigger}\
             params = {{ watch = {watch}, hang_at = 30, hang = 1500 }}\n\
             [modules.lamp]\n[modules.other]\nkind = \"lamp\"\nevery = \"1ms\"\n\
             [modules.filter]\n[modules.candle]\n"
        );
        let watch = Watch::of(watch);
        let readings = || watch.readings.load(Ordering::SeqCst);
        let users = ["lamp", "other", "filter", "candle"];
        let agent = run(&text, &plugins(), |composer| {
            let is = |name: &str, wanted: &str| {
                let modules = composer.modules();
                modules.iter().any(|status| status.name == name && status.condition == wanted)
            };
            let all = |wanted: &str| users.iter().all(|name| is(name, wanted));
            wait("all work", || all("WORKING") && readings() > 0);
            wait("the meter is late", || is("meter", "LATE"));
            wait("its users wait", || all("WAITING"));
            let before = readings();
            wait("the meter returns", || {
                let read = readings();
                // Looked at afterwards, so that what is read after the return does not count.
                let late = is("meter", "LATE");
                assert!(!late || read == before, "it was called while its provider was late");
                !late
            });
            wait("all work again", || all("WORKING") && readings() > before);
            assert_eq!(watch.counts(), (1, 0), "it is the same service");
        });
        drop(agent);
        // A thread that does not return within `hang`, as on a busy machine, drops its module later.
        wait("the service is dropped once", || watch.counts() == (1, 1));
    }
}
