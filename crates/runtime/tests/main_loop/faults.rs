use std::time::Duration;

use slate_module::prelude::*;
use slate_runtime::{Options, Rate};

use crate::main_loop::common::Number;

/// Ports of [`Slow`].
#[ports]
pub struct SlowIo {
    number: Output<Number>,
}

/// Takes 10 ms for each tick.
pub struct Slow;

#[module(stage = Think)]
impl Module for Slow {
    type Io = SlowIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &SlowIo, _: &(), _: &Tick) -> Outcome {
        std::thread::sleep(Duration::from_millis(10));
        io.number.set(Number { value: 1.0 });
        Outcome::Ok
    }
}

/// Ports of [`Unlucky`].
#[ports]
pub struct UnluckyIo {
    number: Output<Number>,
}

/// Parameters of [`Unlucky`].
#[params]
pub struct UnluckyParams {
    #[param(default = 101, doc = "ticks from one panic to the next")]
    interval: u64,
}

/// Panics now and then.
pub struct Unlucky;

#[module(stage = Think)]
impl Module for Unlucky {
    type Io = UnluckyIo;
    type Params = UnluckyParams;
    type State = ();

    fn tick(_: &mut (), io: &UnluckyIo, params: &UnluckyParams, now: &Tick) -> Outcome {
        assert!(!now.number().is_multiple_of(params.interval), "injected");
        io.number.set(Number { value: now.number() as f64 });
        Outcome::Ok
    }
}

#[test]
fn a_module_that_panics_now_and_then_stays_on() {
    let text = |interval: u64| {
        format!(
            "time.source = \"unlucky\"\n[modules.unlucky]\nparams.interval = {interval}\n[modules.counter]\n"
        )
    };
    let panics = |interval| {
        let options = Options { rate: Rate::Max, ..Options::default() };
        let plugins = [slate_module::Plugin::linked::<Unlucky>()];
        let mut agent = crate::main_loop::common::load(&text(interval), &plugins, options).unwrap();
        (0..2000).for_each(|_| assert!(agent.step()));
        assert_eq!(agent.counts("counter"), Some((2000, 0, 0)));
        agent.counts("unlucky").unwrap()
    };
    assert_eq!(panics(101), (2000, 0, 19), "it is started anew each time");
    assert_eq!(panics(100), (500, 0, 5), "five in a row are too many");
}
