//! The aspect `Settings`: modules request other settings of their agent, and no tick waits for them.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and timeouts are a matter of the wall clock"
)]

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use slate_module::Plugin;
use slate_module::aspect::{Aspect, RequestAnswer, Settings};
use slate_module::prelude::*;
use slate_runtime::configuration::{self, Configuration, Database};
use slate_runtime::{Agent, Control, Mode, Options, Rate};

/// A number.
#[interface]
#[derive(PartialEq)]
pub struct Number {
    /// The number.
    pub value: f64,
}

#[ports]
struct BeatIo {
    count: Output<Number>,
    twice: Output<Number>,
}

/// Counts cycles, and is the clock in lockstep.
struct Beat;

#[module(stage = PreLoop)]
impl Module for Beat {
    type Io = BeatIo;
    type Params = ();
    type State = u64;

    fn tick(state: &mut u64, io: &BeatIo, _: &(), _: &Tick) -> Outcome {
        *state += 1;
        io.count.set(Number { value: *state as f64 });
        io.twice.set(Number { value: 2.0 * *state as f64 });
        Outcome::Ok
    }
}

#[ports]
struct GaugeIo {
    input: Input<Number>,
    product: Output<Number>,
}

/// By what it multiplies.
#[params]
struct GaugeParams {
    #[param(default = 1.0, range = 0.0..=100.0, doc = "a factor")]
    gain: f64,
}

/// Multiplies what it reads.
struct Gauge;

#[module(stage = SensorProcess)]
impl Module for Gauge {
    type Io = GaugeIo;
    type Params = GaugeParams;
    type State = ();

    fn tick(_: &mut (), io: &GaugeIo, params: &GaugeParams, _: &Tick) -> Outcome {
        io.product.set(Number { value: params.gain * io.input.get().copied().unwrap_or_default().value });
        Outcome::Ok
    }
}

#[ports]
struct AskerIo {
    settings: Aspect<Settings>,
}

type Script = Box<dyn FnMut(&Settings, &Tick) -> Outcome + Send>;

static SCRIPTS: Mutex<BTreeMap<String, Script>> = Mutex::new(BTreeMap::new());

/// Asks for what the test says; each test has one of its own name.
struct Asker;

#[module(stage = Act)]
impl Module for Asker {
    type Io = AskerIo;
    type Params = ();
    type State = String;

    fn create(setup: &Setup<'_>, (): &()) -> Result<String, Refusal> {
        Ok(setup.name.into())
    }

    fn tick(name: &mut String, io: &AskerIo, _: &(), now: &Tick) -> Outcome {
        SCRIPTS.lock().unwrap().get_mut(name).map_or(Outcome::Ok, |script| script(&io.settings, now))
    }
}

/// What came of the requests of an asker, in their order, with the tick in which it was known.
type Answers = Arc<Mutex<Vec<(u64, RequestAnswer)>>>;

/// Asks for those changes in those ticks, each a list; the outcome of such a tick is `outcome`.
fn asks(asker: &str, requests: &'static [(u64, &'static [&'static str])], outcome: Outcome) -> Answers {
    let answers = Answers::default();
    let (told, mut open) = (Arc::clone(&answers), Vec::new());
    let script = move |settings: &Settings, now: &Tick| {
        open.retain(|request| match settings.answer(*request) {
            RequestAnswer::Pending => true,
            answer => {
                told.lock().unwrap().push((now.number(), answer));
                false
            }
        });
        let mut result = Outcome::Ok;
        for (_, changes) in requests.iter().filter(|(tick, _)| *tick == now.number()) {
            let request = settings.change(changes.iter().copied());
            assert_eq!(settings.answer(request), RequestAnswer::Pending);
            open.push(request);
            result = outcome;
        }
        result
    };
    SCRIPTS.lock().unwrap().insert(asker.into(), Box::new(script));
    answers
}

const LINK: &str = "links.\"gauge/input\"=\"beat/twice\"";

fn text(asker: &str, clock: &str) -> String {
    format!(
        "{clock}[modules.beat]\n[modules.gauge]\n[modules.{asker}]\nkind = \"asker\"\n\
         [links]\n\"gauge/input\" = \"beat/count\"\n"
    )
}

const LOCKSTEP: &str = "time.source = \"beat\"\n";

fn plugins() -> [Plugin; 3] {
    [Plugin::linked::<Beat>(), Plugin::linked::<Gauge>(), Plugin::linked::<Asker>()]
}

fn agent(asker: &str) -> Agent {
    let database = Database::from_text("test.toml", &text(asker, LOCKSTEP), Default::default()).unwrap();
    Agent::load_with(&database, &plugins(), Options { rate: Rate::Max, ..Options::default() }).unwrap()
}

/// The product of each of so many cycles.
fn products(agent: &mut Agent, cycles: usize) -> Vec<f64> {
    let product =
        |agent: &Agent| agent.board().read("gauge/product/value").unwrap().unwrap().0.as_f64().unwrap();
    (0..cycles)
        .map(|_| {
            assert!(agent.step());
            product(agent)
        })
        .collect()
}

#[test]
fn changes_hold_at_once_from_the_next_cycle_and_can_be_undone() {
    let requests: &[(u64, &[&str])] = &[
        (2, &[LINK, "modules.gauge.params.gain=10"]),
        (4, &["links.\"gauge/input\"", "modules.gauge.params"]),
    ];
    let answers = asks("asker_of_both", requests, Outcome::Ok);
    let mut agent = agent("asker_of_both");
    // Ticks are counted from 1 or 0, as cycles are; the change is made between two of them.
    let products = products(&mut agent, 8);
    let changed = products.iter().position(|product| *product >= 20.0).unwrap();
    let expected: Vec<f64> = (1..=8)
        .map(|cycle| if (changed + 1..changed + 3).contains(&cycle) { 20.0 } else { 1.0 } * cycle as f64)
        .collect();
    assert_eq!(products, expected, "the link and the gain in the same cycles");
    let answers = answers.lock().unwrap();
    let told: Vec<_> = answers.iter().map(|(_, answer)| answer.clone()).collect();
    let done = |text: &str| RequestAnswer::Done(text.into());
    assert_eq!(
        told,
        [
            done(
                "links.\"gauge/input\": \"/beat/count\" -> \"/beat/twice\", modules.gauge.params.gain: 1.0 (default) -> 10"
            ),
            done(
                "links.\"gauge/input\": \"/beat/twice\" -> \"/beat/count\", modules.gauge.params.gain: 10 -> 1.0 (default)"
            ),
        ]
    );
    assert_eq!(answers.iter().map(|(tick, _)| *tick).collect::<Vec<_>>(), [3, 5], "known in the next tick");
}

#[test]
fn a_run_with_threads_equals_single_steps() {
    let digest = |name: &'static str, run: &dyn Fn(&mut Agent)| {
        let _answers = asks(name, &[(50, &[LINK]), (120, &["modules.gauge.enabled=false"])], Outcome::Ok);
        let mut agent = agent(name);
        run(&mut agent);
        agent.digest().unwrap()
    };
    let steps = digest("asker_of_steps", &|agent| (0..200).for_each(|_| assert!(agent.step())));
    for _ in 0..3 {
        let run = digest("asker_of_steps", &|agent| {
            let observer = |cycle: &slate_runtime::Cycle<'_>| {
                if cycle.number < 200 { Control::Continue } else { Control::Stop }
            };
            agent.run(Box::new(observer)).unwrap();
        });
        assert_eq!(run, steps);
    }
    let unchanged = {
        let _answers = asks("asker_of_steps", &[], Outcome::Ok);
        let mut agent = agent("asker_of_steps");
        (0..200).for_each(|_| assert!(agent.step()));
        agent.digest().unwrap()
    };
    assert_ne!(unchanged, steps, "the changes are in what was written");
}

#[test]
fn mismatch_is_refused_as_a_whole_with_reason() {
    let requests: &[(u64, &[&str])] = &[
        (1, &["modules.gauge.params.gain=10", "modules.gauge.params.gaim=3"]),
        (1, &["modules.gauge.params.gain=1000"]),
        (1, &["loop.period=\"1ms\""]),
        (1, &["modules.gauge.params.gain=10", "links.\"gauge/inputs\"=\"beat/count\""]),
    ];
    let answers = asks("asker_of_nonsense", requests, Outcome::Ok);
    let mut agent = agent("asker_of_nonsense");
    assert_eq!(products(&mut agent, 4), [1.0, 2.0, 3.0, 4.0]);
    let answers = answers.lock().unwrap();
    assert_eq!(answers.len(), 4);
    for ((_, answer), word) in
        answers.iter().zip(["gaim", "outside 0 to 100", "loop.period", "no port `inputs`"])
    {
        assert!(
            matches!(answer, RequestAnswer::Refused(reason) if reason.contains(word)),
            "{word}: {answer:?}"
        );
    }
}

#[test]
fn failed_tick_requests_nothing() {
    let answers = asks("asker_that_fails", &[(1, &["modules.gauge.params.gain=10"])], Outcome::Failed);
    let mut agent = agent("asker_that_fails");
    assert_eq!(products(&mut agent, 4), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!(*answers.lock().unwrap(), [(2, RequestAnswer::Unknown)]);
}

#[test]
fn without_a_database_nothing_can_change() {
    let answers = asks("asker_without_database", &[(1, &["modules.gauge.params.gain=10"])], Outcome::Ok);
    let text = text("asker_without_database", LOCKSTEP);
    let configuration =
        Configuration::from_text("test.toml", &text, &configuration::Options::default()).unwrap();
    let options = Options { rate: Rate::Max, ..Options::default() };
    let mut agent = Agent::load(&configuration, &plugins(), options).unwrap();
    assert_eq!(products(&mut agent, 3), [1.0, 2.0, 3.0]);
    let answers = answers.lock().unwrap();
    let (_, answer) = &answers[0];
    assert!(
        matches!(answer, RequestAnswer::Refused(reason) if reason.contains("load it with a database")),
        "{answer:?}"
    );
}

#[test]
fn on_the_wall_clock_they_are_made_beside_the_loop() {
    let answers = asks("asker_on_the_clock", &[(1, &["modules.gauge.params.gain=10"])], Outcome::Ok);
    let text = text("asker_on_the_clock", "");
    let database = Database::from_text("test.toml", &text, Default::default()).unwrap();
    let mut agent = Agent::load_with(&database, &plugins(), Options::default()).unwrap();
    let (told, start) = (Arc::clone(&answers), Instant::now());
    let observer = move |_: &slate_runtime::Cycle<'_>| {
        let is_over = !told.lock().unwrap().is_empty() || start.elapsed() > Duration::from_secs(20);
        if is_over { Control::Stop } else { Control::Continue }
    };
    agent.run(Box::new(observer)).unwrap();
    let answers = answers.lock().unwrap();
    assert!(matches!(&answers[..], [(_, RequestAnswer::Done(_))]), "{answers:?}");
    assert_eq!(database.get("modules.gauge.params.gain").unwrap()[0].value.as_f64(), Some(10.0));
}

#[test]
fn requests_of_threads_at_the_same_time_do_not_wait() {
    const TIMES: u64 = 30;
    let done: [Arc<AtomicU64>; 2] = Default::default();
    let mut modules = String::new();
    for (asker, done) in ["asker_on_a_thread", "asker_on_another"].into_iter().zip(&done) {
        let (done, mut open) = (Arc::clone(done), None);
        let script = move |settings: &Settings, _: &Tick| {
            if open.is_some_and(|request| settings.answer(request) != RequestAnswer::Pending) {
                done.fetch_add(1, Ordering::Relaxed);
                open = None;
            }
            let gain = format!("modules.gauge.params.gain={}", done.load(Ordering::Relaxed) + 2);
            open.get_or_insert_with(|| settings.change([gain.as_str()]));
            Outcome::Ok
        };
        SCRIPTS.lock().unwrap().insert(asker.into(), Box::new(script));
        modules += &format!("[modules.{asker}]\nkind = \"asker\"\n");
    }
    let text = format!("[loop]\nperiod = \"2ms\"\n[modules.beat]\n[modules.gauge]\n{modules}");
    let database = Database::from_text("test.toml", &text, Default::default()).unwrap();
    let options = Options { mode: Mode::Threaded, ..Options::default() };
    let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
    let (told, start) = (done.clone(), Instant::now());
    let observer = move |_: &slate_runtime::Cycle<'_>| {
        let are_done = told.iter().all(|done| done.load(Ordering::Relaxed) >= TIMES);
        let is_over = are_done || start.elapsed() > Duration::from_secs(60);
        if is_over { Control::Stop } else { Control::Continue }
    };
    agent.run(Box::new(observer)).unwrap();
    let counts = done.map(|done| done.load(Ordering::Relaxed));
    assert!(counts.iter().all(|count| *count >= TIMES), "{counts:?}");
}
