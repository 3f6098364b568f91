//! Bytes that belong to no field reach neither readers nor the digest.
#![allow(unsafe_code, reason = "padding is written and read as bytes")]

use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{Database, Options as Reading};
use slate_runtime::{Agent, Options, Rate};

use crate::links::support::steps;

/// With padding between its fields and behind them.
#[interface]
#[derive(PartialEq)]
pub struct Gapped {
    /// Before padding.
    pub small: u8,
    /// Counts.
    pub big: u64,
    /// Before padding.
    pub end: u16,
}

#[ports]
pub struct PoisonerIo {
    value: Output<Gapped>,
    note: Outbox<Gapped>,
}

#[params]
pub struct PoisonerParams {
    /// Beside padding, too.
    #[param(default = 0, doc = "what is written into padding")]
    poison: u8,
    #[param(default = 1.0, doc = "not used")]
    factor: f64,
}

/// Fills padding with bytes.
pub struct Poisoner;

fn poison(value: &mut Gapped, poison: u8, count: u64) {
    // SAFETY: every bit pattern is valid.
    unsafe { std::ptr::from_mut(value).cast::<u8>().write_bytes(poison, size_of::<Gapped>()) };
    (value.small, value.big, value.end) = (7, count, 9);
}

#[module(stage = SensorAcquire)]
impl Module for Poisoner {
    type Io = PoisonerIo;
    type Params = PoisonerParams;
    type State = u64;

    fn tick(count: &mut u64, io: &PoisonerIo, params: &PoisonerParams, _: &Tick) -> Outcome {
        *count += 1;
        io.value.write(0, |value| poison(value, params.poison, *count));
        let mut note = Gapped::default();
        poison(&mut note, params.poison, *count);
        io.note.send(note);
        Outcome::Ok
    }
}

/// The sum of the bytes that came.
#[interface]
pub struct Sums {
    /// Of values.
    pub values: u64,
    /// Of messages.
    pub notes: u64,
}

#[ports]
pub struct ProbeIo {
    value: Required<Gapped>,
    notes: Inbox<Gapped>,
    sums: Output<Sums>,
}

/// Adds up all bytes that it receives.
pub struct Probe;

fn sum(value: &Gapped) -> u64 {
    // SAFETY: the host's memory is initialized.
    let bytes = unsafe { std::slice::from_raw_parts(std::ptr::from_ref(value).cast::<u8>(), 24) };
    bytes.iter().map(|byte| u64::from(*byte)).sum()
}

#[module(stage = Think)]
impl Module for Probe {
    type Io = ProbeIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &ProbeIo, _: &(), _: &Tick) -> Outcome {
        let notes = io.notes.iter().map(|note| sum(&note)).sum();
        io.sums.set(Sums { values: sum(&io.value), notes });
        Outcome::Ok
    }
}

fn run(poison: u8) -> (Agent, u64) {
    let text = format!(
        "time.source = \"poisoner\"\n[modules.poisoner]\nparams.poison = {poison}\n[modules.probe]\n[links]\n\
         \"probe/value\" = \"poisoner/value\"\n\"probe/notes\" = \"poisoner/note\"\n"
    );
    let database = Database::from_text("test.toml", &text, Reading::default()).unwrap();
    let plugins = [Plugin::linked::<Poisoner>(), Plugin::linked::<Probe>()];
    let options = Options { rate: Rate::Max, ..Options::default() };
    let mut agent = Agent::load_with(&database, &plugins, options).unwrap();
    steps(&mut agent, 3);
    let digest = agent.digest().unwrap();
    (agent, digest)
}

#[test]
fn poisoned_padding_changes_no_digest_value_or_message() {
    let (clean, clean_digest) = run(0);
    let (poisoned, poisoned_digest) = run(0xAA);
    assert_eq!(clean_digest, poisoned_digest);
    for agent in [&clean, &poisoned] {
        let (property, _) = agent.board().get("poisoner/value").unwrap();
        let mut reader = property.channel().unwrap().latest().unwrap();
        assert!(reader.refresh());
        let mut expected = [0; 24];
        (expected[0], expected[8], expected[16]) = (7, 3, 9);
        assert_eq!(reader.value().unwrap().bytes(), expected);
        let sums = ["values", "notes"]
            .map(|field| agent.board().read(&format!("probe/sums/{field}")).unwrap().unwrap().0);
        assert_eq!(sums.map(|sum| sum.as_integer()), [Some(19), Some(19)]);
    }
}
