//! Modules that panic are started anew, and stay off when they do it again and again.

use slate_runtime::{End, Mode, Options, Rate};

use crate::faults::common::number;
use crate::faults::{after, agent, count};

#[test]
fn fawkes_an_exception_in_one_thread_does_not_end_the_process() {
    let text = r#"
loop.period = "5ms"
[modules.counter]
every = "5ms"
params.panic_at = 3
[modules.other]
kind = "counter"
every = "5ms"
[modules.relay]
[links]
"relay/input" = "counter/number"
"#;
    let mut agent = agent(text, Options { mode: Mode::Threaded, ..Options::default() });
    assert_eq!(agent.run(after(100)).unwrap(), End::Stopped);
    let (ticks, _, panics) = agent.counts("counter").unwrap();
    assert_eq!(panics, 1);
    assert!(ticks > 10 && count(&agent, "other") > 10, "all go on");
    assert!(number(&agent, "counter/number/value") > 5.0, "started anew");
    assert!(number(&agent, "relay/output/value") > 5.0, "and read");
}

#[test]
fn a_module_that_panics_five_times_stays_off() {
    let text = "time.source = \"bomb\"\n[modules.bomb]\n[modules.counter]\n";
    let mut agent = agent(text, Options { rate: Rate::Max, ..Options::default() });
    (0..20).for_each(|_| assert!(agent.step()));
    assert_eq!(agent.counts("bomb"), Some((5, 0, 5)));
    assert_eq!(agent.counts("counter"), Some((20, 0, 0)));
    assert_eq!(number(&agent, "bomb/number/value"), -1.0);
}
