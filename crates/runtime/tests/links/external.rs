//! Links to and from programs that are not agents, while the agent runs.

use std::sync::Arc;

use slate_blackboard::interface::Value;
use slate_runtime::{Agent, ExternalContent, ExternalPorts, ExternalValue, NewLink};

use crate::links::common::number;
use crate::links::support::{lockstep, steps};

const TEXT: &str = r#"
[modules.a]
kind = "counter"
[modules.relay]
stage = "Think"
[modules.collector]
[links]
"relay/input" = { from = "ros2:/number", depth = 1 }
"collector/numbers" = "zenoh:demo/numbers"
"ros2:/count" = "a/number"
"#;

fn set(agent: &Agent, input: &str, content: ExternalContent) {
    let results = agent.composer().set_external(vec![ExternalValue { input: input.into(), content }]);
    assert!(matches!(results[..], [Ok(())]), "{results:?}");
}

#[test]
fn links_to_programs_are_listed_and_stay_as_they_are() {
    let agent = lockstep(TEXT);
    let composer = agent.composer();
    let links = composer.links();
    let shown: Vec<_> =
        links.iter().map(|link| (link.to.as_str(), link.from.as_str(), link.external)).collect();
    let expected = [
        ("collector/numbers", "zenoh:demo/numbers", true),
        ("relay/input", "ros2:/number", true),
        ("ros2:/count", "/a/number", true),
    ];
    assert_eq!(shown, expected);
    assert_eq!(links[1].options, [("depth".to_owned(), "1".to_owned())]);
    // Nothing carries them here, until a bridge says so.
    assert!(links[0].trouble.as_ref().is_some_and(|trouble| trouble.contains("nothing carries `zenoh:`")));
    let (input, _) = composer.external_input("relay/input").unwrap();
    input.set_external("ros2:/number");
    assert_eq!(composer.links()[1].trouble, None);
    for (to, from) in
        [("relay/input", "a/number"), ("relay/input", "ros2:/other"), ("ros2:/other", "a/number")]
    {
        let error = composer.link(&NewLink::new(to, from)).unwrap_err().to_string();
        assert!(error.contains("can't change while the agent runs"), "{error}");
    }
    for to in ["relay/input", "ros2:/count"] {
        let error = composer.unlink(to).unwrap_err().to_string();
        assert!(error.contains("can't change while the agent runs"), "{error}");
    }
    assert_eq!(composer.links().len(), 3);
}

#[test]
fn a_queue_takes_each_value_that_comes_from_outside() {
    let mut agent = lockstep(TEXT);
    steps(&mut agent, 1);
    let (queue, field) = agent.composer().external_input("collector/numbers").unwrap();
    assert_eq!((queue.path(), field.as_str()), ("collector/numbers", ""));
    let bytes = |value: f64| ExternalContent::Bytes(value.to_ne_bytes().to_vec());
    let values = [1.0, 2.0, 4.0]
        .map(|value| ExternalValue { input: "collector/numbers".into(), content: bytes(value) });
    assert!(agent.composer().set_external(values.to_vec()).iter().all(Result::is_ok));
    steps(&mut agent, 1);
    assert_eq!((number(&agent, "collector/count/value"), number(&agent, "collector/sum/value")), (3.0, 7.0));
    let error = agent.composer().external_input("collector/numbers/value").unwrap_err();
    assert!(error.to_string().contains("a queue takes whole values"), "{error}");
}

#[test]
fn a_field_is_filled_from_outside_and_tools_learn_of_it() {
    let mut agent = lockstep(TEXT);
    steps(&mut agent, 1);
    let (input, field) = agent.composer().external_input("relay/input/value").unwrap();
    assert_eq!((input.path(), field.as_str()), ("relay/input", "value"));
    input.set_external("ros2:/number");
    let content = ExternalContent::Value { field, value: Value::Float(6.0) };
    set(&agent, "relay/input/value", content);
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "relay/output/value"), 7.0);
    let refused = input.set("value", &Value::Float(1.0), 0).unwrap_err();
    assert!(refused.to_string().contains("ros2:/number"), "{refused}");
    let _: Arc<_> = input;
}
