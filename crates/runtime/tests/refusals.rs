//! An agent that does not fit its configuration says where and what to do, and nothing of it is started.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and wall-clock time is what some are about"
)]

use crate::common;

use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};

use common::{Number, configuration, load};
use slate_module::blackboard::interface::Descriptor;
use slate_module::prelude::*;
use slate_module::{Direction, Plugin, Port, PortCursor, PortDescription, Spec, Stage, Trigger};
use slate_runtime::{Options, StartError};

/// Instances of [`Counted`] that live, and that were ever made.
static LIVING: AtomicI64 = AtomicI64::new(0);
static MADE: AtomicU64 = AtomicU64::new(0);

/// Ports of [`Counted`].
#[ports]
pub struct CountedIo {
    number: Output<Number>,
}

/// Counts its instances.
pub struct Counted;

/// The state of [`Counted`].
#[derive(serde::Serialize, serde::Deserialize)]
pub struct Life;

impl Drop for Life {
    fn drop(&mut self) {
        LIVING.fetch_sub(1, Ordering::SeqCst);
    }
}

#[module(stage = Think)]
impl Module for Counted {
    type Io = CountedIo;
    type Params = ();
    type State = Life;

    fn create(_: &Setup<'_>, _: &()) -> Result<Life, Refusal> {
        MADE.fetch_add(1, Ordering::SeqCst);
        LIVING.fetch_add(1, Ordering::SeqCst);
        Ok(Life)
    }

    fn tick(_: &mut Life, io: &CountedIo, _: &(), _: &Tick) -> Outcome {
        io.number.set(Number { value: 1.0 });
        Outcome::Ok
    }
}

/// Refuses to be made.
pub struct Unwilling;

#[module(stage = Think)]
impl Module for Unwilling {
    type Io = CountedIo;
    type Params = ();
    type State = ();

    fn create(_: &Setup<'_>, _: &()) -> Result<(), Refusal> {
        Err(Refusal::from("the map has no walls"))
    }

    fn tick(_: &mut (), _: &CountedIo, _: &(), _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

/// An input for what comes from a `monitor`, as frameworks of roles make them.
pub struct FromMonitor(Input<Number>);

#[allow(unsafe_code, reason = "a port is bound to the host's memory")]
impl Port for FromMonitor {
    const CARRIES: (Direction, &'static Descriptor) = <Input<Number> as Port>::CARRIES;

    fn describe(name: &str, doc: &str) -> PortDescription {
        PortDescription { role: "monitor".into(), ..<Input<Number> as Port>::describe(name, doc) }
    }

    unsafe fn bind(cursor: &mut PortCursor) -> Self {
        // SAFETY: passed on to the caller.
        Self(unsafe { Input::bind(cursor) })
    }
}

/// Ports of [`Plan`].
#[ports]
pub struct PlanIo {
    situation: FromMonitor,
    output: Output<Number>,
}

/// What a robot has one of.
pub struct Plan;

impl Module for Plan {
    type Io = PlanIo;
    type Params = ();
    type State = ();

    const NAME: &'static str = "plan";
    const STAGE: Stage = Stage::Think;

    fn spec() -> Spec {
        Spec { trigger: Trigger::Stage, deadline: None, unique: "Plan" }
    }

    fn create(_: &Setup<'_>, _: &()) -> Result<(), Refusal> {
        Ok(())
    }

    fn tick(_: &mut (), io: &PlanIo, _: &(), _: &Tick) -> Outcome {
        io.output.set(io.situation.0.get().copied().unwrap_or_default());
        Outcome::Ok
    }
}

/// Ports of [`Tuned`].
#[ports]
pub struct TunedIo {
    goal: Input<Number>,
}

/// Parameters of [`Tuned`].
#[params]
pub struct TunedParams {
    #[param(default = 0.5, range = 0.0..=2.0, unit = "1/s", doc = "gain")]
    gain: f64,
    #[param(default = 3, doc = "steps")]
    steps: u64,
}

/// Has parameters of several types.
pub struct Tuned;

#[module(stage = Act)]
impl Module for Tuned {
    type Io = TunedIo;
    type Params = TunedParams;
    type State = ();

    fn tick(_: &mut (), io: &TunedIo, params: &TunedParams, _: &Tick) -> Outcome {
        if io.goal.get().copied().unwrap_or_default().value > params.gain && params.steps > 0 {
            Outcome::Ok
        } else {
            Outcome::Degraded
        }
    }
}

fn more() -> [Plugin; 4] {
    [
        Plugin::linked::<Counted>(),
        Plugin::linked::<Unwilling>(),
        Plugin::linked::<Plan>(),
        Plugin::linked::<Tuned>(),
    ]
}

/// Loads `text` behind a module that counts its instances; its complaint has every one of `parts`.
///
/// Line 1 is that module's.
#[track_caller]
fn refused(text: &str, parts: &[&str]) {
    let text = format!("[modules.counted]\n{text}");
    let Err(StartError::Configuration(report)) = load(&text, &more(), Options::default()) else {
        panic!("it should not start:\n{text}");
    };
    let complaint = report.to_string();
    for part in parts {
        assert!(complaint.contains(part), "no `{part}` in\n{complaint}");
    }
    assert!(complaint.contains(')'), "says what to do:\n{complaint}");
    assert_eq!(LIVING.load(Ordering::SeqCst), 0, "an instance is left");
}

/// All in one test, as the instances are counted.
#[test]
fn each_mismatch_is_refused_with_place_and_remedy() {
    unknown_names();
    links_that_do_not_fit();
    one_writer_and_one_of_a_kind();
    parameters_and_inputs();
    triggers_and_actuators();
    assert_eq!(MADE.load(Ordering::SeqCst), 0, "nothing was even made");
    // What only the module itself can find comes last, and ends those that were made before.
    refused(
        "[modules.unwilling]\n",
        &["test.toml:2:10", "`unwilling` can't be set up", "the map has no walls"],
    );
    assert_eq!(MADE.load(Ordering::SeqCst), 1);

    let agent = load("[modules.counted]\n", &more(), Options::default()).unwrap();
    assert_eq!(LIVING.load(Ordering::SeqCst), 1);
    drop(agent);
    assert_eq!(LIVING.load(Ordering::SeqCst), 0, "an agent ends its modules");
}

fn unknown_names() {
    refused(
        "[modules.a]\nkind = \"relais\"\n",
        &["test.toml:3:8", "no plugin brings a module `relais`", "did you mean relay?"],
    );
    refused(
        "[modules.relay]\n[links]\n\"relai/input\" = \"counted/number\"\n",
        &["test.toml:4:1", "no module owns `relai/input`", "relay"],
    );
    refused(
        "[modules.relay]\n[links]\n\"relay/inptu\" = \"counted/number\"\n",
        &["test.toml:4:1", "`relay` has no port `inptu`", "did you mean input?"],
    );
    refused(
        "[modules.relay]\n[links]\n\"relay/input\" = \"count/number\"\n",
        &["test.toml:4:17", "nothing is called `/count/number`", "counted"],
    );
    refused(
        "[modules.relay]\n[links]\n\"relay/input\" = \"counted/numer\"\n",
        &["test.toml:4:17", "`counted` has no output `numer`", "did you mean number?"],
    );
    refused(
        "[modules.relay]\n[links]\n\"relay/input\" = \"slate://elsewhere/counted/number\"\n",
        &["test.toml:4:17", "belongs to agent `elsewhere`", "this agent is `test`"],
    );
    refused(
        "[time]\nsource = \"clock\"\n",
        &["test.toml:3:10", "no module `clock` to be the time source", "counted"],
    );
}

fn links_that_do_not_fit() {
    refused(
        "[modules.twin]\n[links]\n\"twin/left\" = \"counted/number\"\n",
        &["test.toml:4:15", "`twin/left` is Pair but `/counted/number` is Number", "the same interface"],
    );
    refused(
        "[modules.plan]\n[links]\n\"plan/situation\" = \"counted/number\"\n",
        &[
            "test.toml:4:20",
            "`plan/situation` is a monitor but `/counted/number` is a plain value",
            "can be attached",
        ],
    );
    refused(
        "[modules.receiver]\n[links]\n\"receiver/history\" = \"receiver/notes\"\n",
        &["test.toml:4:22", "receives messages", "link an input to an output"],
    );
    refused(
        "[modules.sender]\n[links]\n\"sender/note\" = \"counted/number\"\n",
        &["test.toml:4:1", "sends messages", "a link names its destination first"],
    );
    refused(
        "[modules.receiver]\n[links]\n\"receiver/notes\" = \"counted/number\"\n",
        &["test.toml:4:20", "receives messages", "link an outbox to an inbox"],
    );
    refused(
        "[modules.sender]\n[modules.second]\nkind = \"sender\"\n[modules.receiver]\n[links]\n\
         \"sender/note\" = \"receiver/notes\"\n\"second/note\" = \"receiver/notes\"\n",
        &["write \"receiver/notes\" = [\"second/note\", \"sender/note\"]"],
    );
    refused(
        "[modules.relay]\n[links]\n\"counted/number\" = \"relay/input\"\n",
        &["test.toml:4:1", "is an output", "write \"relay/input\" = \"counted/number\""],
    );
    refused(
        "[modules.relay]\n[modules.b]\nkind = \"relay\"\n[links]\n\"relay/input\" = \"b/input\"\n\"b/input\" = \"relay/input\"\n",
        &[
            "test.toml:7:13",
            "cyclic dependency: b/input -> relay/input -> b/input",
            "link one of them to an output",
        ],
    );
    refused(
        "[modules.relay]\n[links]\n\"relay/enabled\" = \"counted/number\"\n",
        &[
            "test.toml:4:19",
            "`relay/enabled` takes bool but `/counted/number` is Number",
            "the same interface",
        ],
    );
}

fn one_writer_and_one_of_a_kind() {
    // A property has one writer, as only its module can write it.
    refused(
        "[modules.relay]\n[links]\n\"counted/number\" = \"relay/output\"\n",
        &["test.toml:4:1", "`counted/number` is an output", "a link names its destination first"],
    );
    refused(
        "[modules.driver]\n[actuators.left]\ncommand = \"driver/wheel\"\n[actuators.right]\ncommand = \"driver/wheel\"\n",
        &["test.toml:6:11", "`/driver/wheel` commands `left` already", "a command port of its own"],
    );
    refused(
        "[modules.plan]\n[modules.other]\nkind = \"plan\"\n",
        &[
            "test.toml:3:10",
            "a robot has one Plan, and `plan` (test.toml:2) is it already",
            "put it into another robot",
        ],
    );
}

fn parameters_and_inputs() {
    refused(
        "[modules.tuned]\nparams.gian = 1.0\n",
        &["test.toml:3:8", "no parameter `gian`", "did you mean `gain`?"],
    );
    refused("[modules.tuned]\nparams.gain = \"high\"\n", &["test.toml:3:15", "gain", "its unit is 1/s"]);
    refused(
        "[modules.tuned]\nparams.gain = 7.5\n",
        &["test.toml:3:15", "`gain` is 7.5, outside 0 to 2", "the default is 0.5"],
    );
    refused("[modules.tuned]\nparams.steps = -1\n", &["test.toml:3:16", "steps"]);
    refused("[modules.tuned]\nparams.steps = 1.5\n", &["test.toml:3:16", "steps"]);
    refused(
        "[modules.counter]\nparams.hang = 1\n",
        &["test.toml:3:8", "no parameter `hang`", "available: panic_at, nan_at, hang_at, hang_ms"],
    );
    refused(
        "[modules.tuned]\ninputs.goal = { value = \"far\" }\n",
        &["test.toml:3:15", "value", "Number is { value: f64 }"],
    );
    refused(
        "[modules.tuned]\ninputs.goal = { speed = 1.0 }\n",
        &["test.toml:3:15", "speed", "Number is { value: f64 }"],
    );
    refused(
        "[modules.tuned]\ninputs.gaol = { value = 1.0 }\n",
        &["test.toml:3:8", "`tuned` has no input `gaol`", "did you mean goal?"],
    );
}

fn triggers_and_actuators() {
    refused(
        "[modules.relay]\non = \"inputs\"\n",
        &[
            "test.toml:3:6",
            "`relay` is to run on `inputs`, which is not one of its ports",
            "did you mean input?",
        ],
    );
    refused(
        "[actuators.wheel]\ncommand = \"counted/number\"\n",
        &["test.toml:3:11", "`/counted/number` is not a command", "name a Command port"],
    );
    refused(
        "[actuators.wheel]\ncommand = \"driver/wheel\"\n",
        &["test.toml:3:11", "`/driver/wheel` is not a command", "name a Command port"],
    );
    refused(
        "[modules.driver]\n[actuators.wheel]\ncommand = \"driver/wheel\"\nrate_limits = { speed = 1.0 }\n",
        &["test.toml:5", "speed", "see the fields"],
    );
    refused(
        "[modules.driver]\n[modules.twin]\n[actuators.wheel]\ncommand = \"driver/wheel\"\n[links]\n\"twin/left\" = \"wheel/command\"\n",
        &["test.toml:7", "`twin/left` is Pair but `/wheel/command` is Number", "the same interface"],
    );
}

#[test]
fn every_misfit_is_shown_at_once() {
    let text = "[modules.a]\nkind = \"nothing\"\n[modules.tuned]\nparams = { gain = 9.0, gian = 1.0 }\n";
    let Err(StartError::Configuration(report)) = load(text, &more(), Options::default()) else {
        panic!("it should not start");
    };
    assert_eq!(report.diagnostics().len(), 3, "{report}");
    let shown = report.render(false);
    assert!(shown.contains("test.toml:2") && shown.contains("here"), "{shown}");
}

#[test]
fn a_configuration_that_fits_is_not_refused() {
    let text = "[modules.counted]\n[modules.tuned]\nparams = { gain = 2.0, steps = 0 }\ninputs.goal = { value = 1 }\n";
    let _ = configuration(text);
    // Instances are counted in the other test, so this one makes none of them.
    let text = text.replace("[modules.counted]\n", "");
    assert!(load(&text, &more(), Options::default()).is_ok());
}

#[test]
fn a_program_that_can_not_be_started_again_isolates_nothing() {
    let Err(error) = load("[modules.counter]\nisolated = true", &[], Options::default()) else {
        panic!("it should not start");
    };
    let text = error.to_string();
    assert!(text.contains("`main` does not call `slate_runtime::isolation::enter` first"), "{text}");
}
