//! Modules that are slow, hang or panic, and their reports.

use std::time::Duration;

use slate_module::prelude::*;

use crate::faults::common::{Number, Pair};

/// Ports of [`Watcher`].
#[ports]
pub struct WatcherIo {
    #[stale(after = "10s")]
    input: Input<Number>,
    seen: Output<Pair>,
}

/// Shows what a reader sees: the value, and whether it is stale.
pub struct Watcher;

#[module(stage = Think)]
impl Module for Watcher {
    type Io = WatcherIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &WatcherIo, _: &(), _: &Tick) -> Outcome {
        let stale = if io.input.is_stale() { 1.0 } else { 0.0 };
        io.seen.set(Pair { first: io.input.get().copied().unwrap_or_default().value, second: stale });
        Outcome::Ok
    }
}

/// Ports of [`Slow`].
#[ports]
pub struct SlowIo {
    input: Input<Number>,
    ticks: Output<Number>,
}

/// Takes 20 ms for a tick.
pub struct Slow;

#[module(stage = Think, on = input)]
impl Module for Slow {
    type Io = SlowIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &SlowIo, _: &(), _: &Tick) -> Outcome {
        std::thread::sleep(Duration::from_millis(20));
        *state += 1.0;
        assert!(io.input.get().copied().unwrap_or_default().value > 0.0, "it runs on what was written");
        io.ticks.set(Number { value: *state });
        Outcome::Ok
    }
}

/// Ports of [`Sleeper`].
#[ports]
pub struct SleeperIo {
    input: Input<Number>,
    kept: Output<Pair>,
}

/// Takes 300 ms for its third tick, and shows in the next one what it read before and after that.
pub struct Sleeper;

#[module(stage = Think)]
impl Module for Sleeper {
    type Io = SleeperIo;
    type Params = ();
    type State = (u32, f64, f64);

    fn tick((ticks, before, after): &mut (u32, f64, f64), io: &SleeperIo, _: &(), _: &Tick) -> Outcome {
        *ticks += 1;
        if *ticks == 3 {
            *before = std::hint::black_box(&io.input).get().copied().unwrap_or_default().value;
            std::thread::sleep(Duration::from_millis(300));
            *after = std::hint::black_box(&io.input).get().copied().unwrap_or_default().value;
        }
        if *ticks > 3 {
            io.kept.set(Pair { first: *before, second: *after });
        }
        Outcome::Ok
    }
}

/// Ports of [`Player`].
#[ports]
pub struct PlayerIo {
    kick: Input<Number>,
    ball: Input<Number>,
    played: Output<Number>,
}

/// Plays a ball back, plus one; begins when it is kicked.
pub struct Player;

#[module(stage = Think)]
impl Module for Player {
    type Io = PlayerIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &PlayerIo, _: &(), _: &Tick) -> Outcome {
        if io.ball.is_new() {
            io.played.set(Number { value: io.ball.get().copied().unwrap_or_default().value + 1.0 });
        } else if io.kick.is_new() {
            io.played.set(io.kick.get().copied().unwrap_or_default());
        }
        Outcome::Ok
    }
}

/// Ports of [`Bomb`].
#[ports]
pub struct BombIo {
    #[safe(Number { value: -1.0 })]
    number: Output<Number>,
}

/// Panics in every tick.
pub struct Bomb;

#[module(stage = Think)]
impl Module for Bomb {
    type Io = BombIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &BombIo, _: &(), _: &Tick) -> Outcome {
        io.number.set(Number { value: 1.0 });
        panic!("as always");
    }
}

/// Ports of [`Poster`].
#[ports]
pub struct PosterIo {
    #[window(4)]
    notes: Outbox<Number>,
    fares: Output<Pair>,
}

/// Posts a message a tick, takes 300 ms for the third one, and shows how that message fares: 1 when it is done, 2 when it is
/// lost.
pub struct Poster;

#[module(stage = Think)]
impl Module for Poster {
    type Io = PosterIo;
    type Params = ();
    type State = (u32, u64);

    fn tick((ticks, third): &mut (u32, u64), io: &PosterIo, _: &(), _: &Tick) -> Outcome {
        *ticks += 1;
        let posted = io.notes.send_tracked(Number { value: f64::from(*ticks) }).unwrap_or(0);
        if *ticks == 3 {
            *third = posted;
            std::thread::sleep(Duration::from_millis(300));
        } else if *ticks == 5 {
            let fares = match io.notes.delivery(*third) {
                slate_module::Delivery::Done => 1.0,
                slate_module::Delivery::Lost => 2.0,
                _ => 0.0,
            };
            io.fares.set(Pair { first: fares, second: f64::from(*ticks) });
        }
        Outcome::Ok
    }
}
