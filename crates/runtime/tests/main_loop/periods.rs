use std::sync::Mutex;

use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::{Control, End, Mode, Options, Rate};

use super::{run, ticks, wall_clock};
use crate::main_loop::common::Number;

/// Ports of [`Metronome`].
#[ports]
pub struct MetronomeIo {
    wrong: Output<Number>,
}

/// Parameters of [`Metronome`].
#[params]
pub struct MetronomeParams {
    #[param(default = 1, doc = "its period")]
    period: u64,
    #[param(default = 1, doc = "the period of the loop")]
    cycle: u64,
}

/// Counts its ticks that are not at the first cycle after a whole number of its periods.
pub struct Metronome;

/// How often it ticked, and how often at another time than it should.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct Beats(u64, u64);

#[module(stage = Think)]
impl Module for Metronome {
    type Io = MetronomeIo;
    type Params = MetronomeParams;
    type State = Beats;

    fn tick(state: &mut Beats, io: &MetronomeIo, params: &MetronomeParams, now: &Tick) -> Outcome {
        let due = state.0 * params.period;
        state.1 += u64::from(now.now() != due.next_multiple_of(params.cycle));
        state.0 += 1;
        io.wrong.set(Number { value: state.1 as f64 });
        Outcome::Ok
    }
}

#[test]
fn periods_do_not_drift_in_a_million() {
    // In microseconds: the period of the loop divides the first, and none of the others.
    const CYCLE: u64 = 10_000;
    const PERIODS: [u64; 4] = [10_000, 15_000, 10_007, 33_331];
    const MILLION: u64 = 1_000_000;
    let mut text = format!("time.source = \"m0\"\nloop.period = \"{CYCLE}us\"\n");
    for (number, period) in PERIODS.iter().enumerate() {
        text += &format!(
            "[modules.m{number}]\nkind = \"metronome\"\nevery = \"{period}us\"\n\
             params = {{ period = {}, cycle = {} }}\n",
            period * 1000,
            CYCLE * 1000
        );
    }
    let options = Options { rate: Rate::Max, ..Options::default() };
    let mut agent = crate::main_loop::common::load(&text, &[Plugin::linked::<Metronome>()], options).unwrap();
    let cycles = (MILLION * PERIODS[2]).div_ceil(CYCLE) + 1;
    (0..cycles).for_each(|_| assert!(agent.step()));
    assert_eq!(agent.now(), (cycles - 1) * CYCLE * 1000, "nor does the loop's own");
    for (number, period) in PERIODS.iter().enumerate() {
        let module = format!("m{number}");
        let expected = (cycles - 1) * CYCLE / period + 1;
        assert_eq!((ticks(&agent, &module), agent.now() % 1000), (expected, 0), "every {period} us");
        assert_eq!(
            crate::main_loop::common::number(&agent, &format!("{module}/wrong/value")),
            0.0,
            "every {period} us"
        );
    }
    assert!(ticks(&agent, "m2") > MILLION);
}

#[test]
fn on_the_wall_clock_a_module_of_the_loops_period_never_skips() {
    // A thread wakes up some microseconds late, now more and now less, which must not cost a cycle.
    let text = "loop.period = \"2ms\"\n[modules.same]\nkind = \"witness\"\nevery = \"2ms\"\n\
                [modules.double]\nkind = \"witness\"\nevery = \"4ms\"\n";
    let (mut agent, _) = wall_clock(text);
    run(&mut agent, 300);
    assert_eq!(ticks(&agent, "same"), 300);
    // Where cycles were left out, it is due in more than every other of those that are left.
    assert!((150..250).contains(&ticks(&agent, "double")), "{}", ticks(&agent, "double"));
}

/// Which threads modules of a name were seen on.
static SEEN: Mutex<Vec<(String, String)>> = Mutex::new(Vec::new());

/// Says on which thread it runs.
pub struct Tell;

/// Ports of [`Tell`].
#[ports]
pub struct TellIo {
    input: Input<Number>,
    output: Output<Number>,
}

/// Parameters of [`Tell`].
#[params]
pub struct TellParams {
    #[param(default = 0, doc = "tells it from others")]
    number: u64,
}

#[module(stage = Act)]
impl Module for Tell {
    type Io = TellIo;
    type Params = TellParams;
    type State = ();

    fn tick(_: &mut (), io: &TellIo, params: &TellParams, now: &Tick) -> Outcome {
        let thread = std::thread::current().name().unwrap_or_default().to_owned();
        if now.number() == 1 {
            SEEN.lock().unwrap().push((params.number.to_string(), thread));
        }
        io.output.set(Number { value: io.input.get().copied().unwrap_or_default().value + 1.0 });
        Outcome::Ok
    }
}

#[test]
fn modules_of_every_trigger_and_own_threads_share_an_agent() {
    let text = r#"
loop.period = "2ms"
[modules.staged]
kind = "tell"
params.number = 1
[modules.periodic]
kind = "tell"
every = "3ms"
params.number = 2
[modules."robot_1/woken_by_a_value"]
kind = "tell"
on = "input"
params.number = 3
[links]
"robot_1/woken_by_a_value/input" = "staged/output"
"#;
    let options = Options { mode: Mode::Threaded, ..Options::default() };
    let mut agent = crate::main_loop::common::load(text, &[Plugin::linked::<Tell>()], options).unwrap();
    let mut cycles = 0;
    let woken = agent.composer();
    let end = agent.run(Box::new(move |_| {
        cycles += 1;
        let modules = woken.modules();
        let done = modules.iter().all(|module| module.ticks >= 100) || cycles >= 20_000;
        if done { Control::Stop } else { Control::Continue }
    }));
    assert_eq!(end.unwrap(), End::Stopped);
    let cycles = super::whole(&agent, "loop/state/cycles");
    assert_eq!(ticks(&agent, "staged"), cycles);
    assert!((100..=cycles).contains(&ticks(&agent, "robot_1/woken_by_a_value")));
    assert!((100..=cycles).contains(&ticks(&agent, "periodic")));
    let mut seen = SEEN.lock().unwrap().clone();
    seen.sort();
    let expected = [("1", "main loop"), ("2", "periodic"), ("3", "bot_1/n_by_a_va")];
    let names: Vec<_> = seen.iter().map(|(number, name)| (number.as_str(), name.as_str())).collect();
    assert_eq!(names[..2], expected[..2]);
    // Debuggers show fifteen letters of it.
    assert!(names[2].1.len() == 15 && names[2].1.starts_with("bot_1/") && names[2].1.ends_with("a_value"));
}
