//! Inputs without whose value a module does not run.

use slate_blackboard::interface::Value;
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{Database, Options as Reading};
use slate_runtime::{Agent, Options, Rate};

use crate::links::common::{Number, Pair};
use crate::links::support::{all, steps};

#[ports]
pub struct DoublerIo {
    input: Required<Number>,
    output: Output<Number>,
}

/// Doubles a number that it requires.
pub struct Doubler;

#[module(stage = SensorProcess)]
impl Module for Doubler {
    type Io = DoublerIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &DoublerIo, _: &(), _: &Tick) -> Outcome {
        io.output.set(Number { value: 2.0 * io.input.value });
        Outcome::Ok
    }
}

#[ports]
pub struct AdderIo {
    pair: Required<Pair>,
    more: Required<Number>,
    /// Not required.
    offset: Input<Number>,
    #[safe(Number { value: -1.0 })]
    sum: Output<Number>,
}

/// Adds numbers up, when the pair is another one.
pub struct Adder;

#[module(stage = Act, on = pair)]
impl Module for Adder {
    type Io = AdderIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &AdderIo, _: &(), _: &Tick) -> Outcome {
        let offset = io.offset.get().map_or(0.0, |offset| offset.value);
        io.sum.set(Number { value: io.pair.first + io.pair.second + io.more.value + offset });
        Outcome::Ok
    }
}

fn load(text: &str) -> Result<Agent, String> {
    let text = format!("time.source = \"counter\"\n[modules.counter]\n{text}");
    let database = Database::from_text("test.toml", &text, Reading::default()).unwrap();
    let own = [Plugin::linked::<Doubler>(), Plugin::linked::<Adder>()];
    let plugins: Vec<_> = all().into_iter().chain(own).collect();
    let options = Options { rate: Rate::Max, ..Options::default() };
    Agent::load_with(&database, &plugins, options).map_err(|error| format!("{error:?}"))
}

fn agent(text: &str) -> Agent {
    load(text).unwrap()
}

fn value(agent: &Agent, path: &str) -> Option<f64> {
    agent.board().read(path).unwrap().and_then(|(value, _)| value.as_f64())
}

/// The condition of a module, and what it waits for.
fn state(agent: &Agent, module: &str) -> (String, String) {
    let text = |field: &str| match agent.board().read(&format!("{module}/state/{field}")).unwrap() {
        Some((Value::Text(text), _)) => text,
        other => format!("{other:?}"),
    };
    (text("condition"), text("waiting_for"))
}

/// The same in the list of modules.
fn listed(agent: &Agent, module: &str) -> (&'static str, Option<String>) {
    let listed = agent.composer().modules().into_iter().find(|listed| listed.name == module).unwrap();
    (listed.condition, listed.waiting_for)
}

fn waits_for(port: &str) -> (String, String) {
    ("WAITING".into(), port.into())
}

#[test]
fn module_waits_for_the_first_value_of_a_required_input() {
    let mut agent = agent("[modules.doubler]\n");
    steps(&mut agent, 2);
    assert_eq!(state(&agent, "doubler"), waits_for("input"));
    assert_eq!(listed(&agent, "doubler"), ("WAITING", Some("input".into())));
    assert_eq!(value(&agent, "doubler/output/value"), None);
    agent.board().write("doubler/input/value", &Value::Float(2.0), agent.now()).unwrap();
    steps(&mut agent, 1);
    assert_eq!(value(&agent, "doubler/output/value"), Some(4.0));
    assert_eq!(state(&agent, "doubler"), ("WORKING".into(), String::new()));
    assert_eq!(listed(&agent, "doubler"), ("WORKING", None));
}

#[test]
fn configured_value_fills_a_required_input() {
    let mut agent = agent("[modules.doubler]\ninputs.input = { value = 3.0 }\n");
    steps(&mut agent, 1);
    assert_eq!(value(&agent, "doubler/output/value"), Some(6.0));
}

#[test]
fn link_fills_a_required_input_in_the_first_cycle() {
    let mut agent = agent("[modules.doubler]\n[links]\n\"doubler/input\" = \"counter/number\"\n");
    steps(&mut agent, 1);
    assert_eq!(value(&agent, "doubler/output/value"), Some(2.0));
}

#[test]
fn previous_link_fills_a_required_input_in_the_second_cycle() {
    let mut agent = agent(
        "[modules.doubler]\n[links]\n\"doubler/input\" = { from = \"counter/number\", previous = true }\n",
    );
    steps(&mut agent, 1);
    assert_eq!(state(&agent, "doubler"), waits_for("input"));
    steps(&mut agent, 1);
    assert_eq!(value(&agent, "doubler/output/value"), Some(2.0));
}

#[test]
fn state_names_each_missing_input_in_turn() {
    let mut agent = agent("[modules.adder]\n");
    steps(&mut agent, 1);
    assert_eq!(state(&agent, "adder"), waits_for("pair"));
    agent.board().write("adder/pair/first", &Value::Float(1.0), agent.now()).unwrap();
    steps(&mut agent, 1);
    assert_eq!(state(&agent, "adder"), waits_for("more"));
    assert_eq!(value(&agent, "adder/sum/value"), Some(-1.0), "the safe value");
    agent.board().write("adder/more/value", &Value::Float(5.0), agent.now()).unwrap();
    steps(&mut agent, 1);
    assert_eq!(value(&agent, "adder/sum/value"), Some(6.0), "an optional input is not waited for");
}

#[test]
fn fields_linked_one_by_one_are_all_waited_for() {
    let mut agent = agent(
        "[modules.doubler]\n[modules.adder]\ninputs.more = { value = 0.0 }\n[links]\n\
         \"adder/pair/first\" = \"counter/number/value\"\n\"adder/pair/second\" = \"doubler/output/value\"\n",
    );
    steps(&mut agent, 3);
    assert_eq!(state(&agent, "adder"), waits_for("pair"));
    agent.board().write("doubler/input/value", &Value::Float(50.0), agent.now()).unwrap();
    steps(&mut agent, 1);
    assert_eq!(value(&agent, "adder/sum/value"), Some(104.0));
}

#[test]
fn relinked_required_input_waits_again() {
    let mut agent = agent(
        "[modules.doubler]\n[modules.other]\nkind = \"doubler\"\n[links]\n\"doubler/input\" = \"counter/number\"\n",
    );
    steps(&mut agent, 1);
    assert_eq!(value(&agent, "doubler/output/value"), Some(2.0));
    agent.composer().link(&slate_runtime::NewLink::new("doubler/input", "other/output")).unwrap();
    steps(&mut agent, 2);
    assert_eq!(state(&agent, "doubler"), waits_for("input"));
}

#[test]
fn ring_of_required_inputs_is_refused_by_name() {
    let ring = "[modules.a]\nkind = \"doubler\"\n[modules.b]\nkind = \"doubler\"\n[links]\n\
                \"a/input\" = \"b/output\"\n\"b/input\" = { from = \"a/output\", previous = true }\n";
    let Err(refusal) = load(ring) else { panic!("the ring never runs") };
    for part in ["b -> a -> b", "wait for each other's first value", "Input<T>"] {
        assert!(refusal.contains(part), "{refusal}");
    }
}

#[test]
fn ring_with_a_first_value_runs() {
    // The relay's input is not a required one.
    let mut agent = agent(
        "[modules.doubler]\n[modules.relay]\nevery = \"1ms\"\n[links]\n\"doubler/input\" = \"relay/output\"\n\
         \"relay/input\" = { from = \"doubler/output\", previous = true }\n",
    );
    steps(&mut agent, 3);
    assert_eq!(value(&agent, "doubler/output/value"), Some(14.0));
}
