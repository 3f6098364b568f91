//! Which inputs something writes, as their module sees it.

use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{Database, Options as Reading};
use slate_runtime::{Agent, Options, Rate};

use crate::links::common::Number;
use crate::links::support::{all, steps};

/// The inputs of [`Witness`].
const INPUTS: [&str; 7] = ["linked", "chained", "part", "set", "unset", "of_set", "of_parameter"];

#[ports]
pub struct WitnessIo {
    linked: Input<Number>,
    chained: Input<Number>,
    part: Input<Number>,
    set: Input<Number>,
    unset: Input<Number>,
    of_set: Input<Number>,
    of_parameter: Input<Number>,
    /// A bit for each input with a writer, in their order.
    written: Output<Number>,
    /// A bit for each that is not stale.
    fresh: Output<Number>,
}

/// Tells which of its inputs have a writer.
pub struct Witness;

#[module(stage = Act)]
impl Module for Witness {
    type Io = WitnessIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &WitnessIo, _: &(), _: &Tick) -> Outcome {
        let WitnessIo { linked, chained, part, set, unset, of_set, of_parameter, .. } = io;
        let inputs = [linked, chained, part, set, unset, of_set, of_parameter];
        let bits = |has: &dyn Fn(&Input<Number>) -> bool| {
            let bits = inputs.iter().enumerate().map(|(at, input)| f64::from(u32::from(has(input)) << at));
            Number { value: bits.sum() }
        };
        io.written.set(bits(&|input| input.has_writer()));
        io.fresh.set(bits(&|input| !input.is_stale()));
        Outcome::Ok
    }
}

/// Names of the inputs whose bits are set.
fn named(agent: &Agent, output: &str) -> Vec<&'static str> {
    let (value, _) = agent.board().read(&format!("witness/{output}/value")).unwrap().unwrap();
    let bits = value.as_f64().unwrap() as u32;
    INPUTS.into_iter().enumerate().filter(|(at, _)| bits & (1 << at) != 0).map(|(_, name)| name).collect()
}

#[test]
fn only_what_a_link_leads_to_has_a_writer() {
    let text = "time.source = \"counter\"\n[modules.counter]\n[modules.relay]\n[modules.idle]\nkind = \"relay\"\n\
                [modules.twins]\n[modules.witness]\ninputs.set = { value = 3.0 }\n\
                [links]\n\"witness/linked\" = \"counter/number\"\n\"relay/input\" = \"counter/number\"\n\
                \"witness/chained\" = \"relay/input\"\n\"witness/part/value\" = \"twins/one/first\"\n\
                \"witness/of_set\" = \"idle/input\"\n\"witness/of_parameter/value\" = \"twins/params/offset\"\n";
    let database = Database::from_text("test.toml", text, Reading::default()).unwrap();
    let plugins: Vec<_> = all().into_iter().chain([Plugin::linked::<Witness>()]).collect();
    let options = Options { rate: Rate::Max, ..Options::default() };
    let mut agent = Agent::load_with(&database, &plugins, options).unwrap();
    steps(&mut agent, 3);
    let linked = ["linked", "chained", "part"];
    let written = named(&agent, "written");
    assert!(linked.iter().all(|name| written.contains(name)), "{written:?}");
    for name in ["set", "unset", "of_set"] {
        assert!(!written.contains(&name), "{name}: {written:?}");
    }
    // What the configuration sets is no less fresh for that.
    let fresh = named(&agent, "fresh");
    assert!(fresh.contains(&"set") && !fresh.contains(&"unset"), "{fresh:?}");
    // A manual value has no writer either.
    for input in ["witness/unset", "idle/input"] {
        agent
            .board()
            .find(input)
            .unwrap()
            .0
            .set("value", &slate_blackboard::interface::Value::Float(1.0), 0)
            .unwrap();
    }
    steps(&mut agent, 1);
    let (written, fresh) = (named(&agent, "written"), named(&agent, "fresh"));
    assert!(!written.contains(&"unset") && !written.contains(&"of_set"), "{written:?}");
    assert!(fresh.contains(&"unset") && fresh.contains(&"of_set"), "{fresh:?}");
}
