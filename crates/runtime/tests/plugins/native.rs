//! A plugin in C, built with gcc from the header, and the same things done to it.

use crate::fixtures::libraries;
use crate::support::*;
use slate_blackboard::interface::Value;
use slate_runtime::{Mode, PluginError};

fn robot() -> String {
    format!(
        "{}[modules.smoother]\nparams = {{ gain = 0.25 }}\n[links]\n\"smoother/input\" = \"beat/count\"\n",
        library("smoother", &libraries().other("smoother"))
    )
}

fn mean(agent: &slate_runtime::Agent) -> f64 {
    agent.board().read("smoother/mean/value").unwrap().unwrap().0.as_f64().unwrap()
}

#[test]
fn a_plugin_in_c_reads_computes_and_writes() {
    let mut agent = lockstep(&robot());
    let mut expected = 0.0;
    for cycle in 1..=50_u32 {
        step(&mut agent, 1);
        expected += 0.25 * (f64::from(cycle) - expected);
        assert_eq!(mean(&agent), expected);
    }
    let plugins = agent.composer().plugins();
    let plugin = plugins.iter().find(|plugin| plugin.name == "smoother").unwrap();
    assert_eq!((plugin.version.as_str(), plugin.loaded), ("0.9.0", true));
}

#[test]
fn a_plugin_in_c_obeys_its_parameter_and_its_range() {
    let mut agent = lockstep(&robot());
    step(&mut agent, 1);
    agent.board().write("smoother/params/gain", &Value::Float(1.0), 0).unwrap();
    step(&mut agent, 1);
    assert_eq!(mean(&agent), 2.0);
    let text = robot().replace("0.25", "1.5");
    assert_says(&complaint(&try_lockstep(&text).unwrap_err()), &["gain", "1.5", "0", "1"]);
}

#[test]
fn a_plugin_in_c_keeps_its_state_over_a_reload() {
    let running = Running::start(&robot(), Mode::Staged, &["beat/count/value", "smoother/mean/samples"]);
    for _ in 0..5 {
        let reload = running.composer.reload("smoother", None).unwrap();
        assert_eq!(reload.modules, [("smoother".into(), Ok(()))]);
        assert!(reload.in_place);
        running.cycles(5);
    }
    let (_, _, samples) = running.stop();
    for row in &samples {
        assert_eq!(row[0], row[1], "a sample for each cycle, over every reload");
    }
}

#[test]
fn a_plugin_in_c_can_refuse_unloading() {
    let mut agent = lockstep(&robot());
    agent.board().write("smoother/params/held", &Value::Integer(1), 0).unwrap();
    step(&mut agent, 2);
    let refusal = agent.composer().unload("smoother").unwrap_err();
    assert!(matches!(refusal, PluginError::Veto { .. }), "{refusal:?}");
    assert_says(&complaint(&refusal), &["smoother", "its mean is being used"]);
    agent.board().write("smoother/params/held", &Value::Integer(0), 0).unwrap();
    step(&mut agent, 1);
    assert_eq!(agent.composer().unload("smoother").unwrap(), [("smoother".into(), "unmapped")]);
    step(&mut agent, 2);
    agent.composer().load("smoother").unwrap();
    step(&mut agent, 1);
    assert_eq!(number(&agent, "smoother/mean/samples"), 1);
}
