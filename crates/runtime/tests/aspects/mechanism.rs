//! Services that modules provide to each other.

use crate::aspects::common::number;
use crate::aspects::light::{Watch, plugins};
use crate::aspects::{agent, complaint, condition, full, steps, ticks};

#[test]
fn module_waits_for_its_service_and_then_runs() {
    let mut agent = agent("[modules.meter]\nparams.provide_at = 3\n[modules.lamp]\n", &plugins());
    steps(&mut agent, 2);
    assert_eq!(ticks(&agent, "lamp"), 0);
    assert_eq!(condition(&agent, "lamp"), "WAITING");
    assert_eq!(number(&agent, "lamp/brightness/value"), -1.0, "its outputs are safe");
    steps(&mut agent, 2);
    assert_eq!(ticks(&agent, "lamp"), 2, "from the cycle on in which it is provided");
    assert_eq!(condition(&agent, "lamp"), "WORKING");
    assert_eq!(number(&agent, "lamp/brightness/value"), 3.0);
}

#[test]
fn a_withdrawn_service_stops_its_users_until_it_returns() {
    let text = "[modules.meter]\nparams = { watch = 1, withdraw_at = 3 }\n[modules.lamp]\n";
    let mut agent = agent(text, &plugins());
    steps(&mut agent, 3);
    assert_eq!((ticks(&agent, "lamp"), condition(&agent, "lamp")), (2, "WAITING"));
    assert_eq!(number(&agent, "lamp/brightness/value"), -1.0);
    assert_eq!(Watch::of(1).counts(), (1, 1), "nobody holds it any more");
    steps(&mut agent, 1);
    assert_eq!(condition(&agent, "lamp"), "WORKING");
    assert_eq!(number(&agent, "lamp/brightness/value"), 4.0);
}

#[test]
fn a_panicking_provider_takes_its_service_and_brings_it_back() {
    let text = "[modules.meter]\nparams = { watch = 2, panic_at = 3 }\n[modules.lamp]\n";
    let mut agent = agent(text, &plugins());
    steps(&mut agent, 3);
    assert_eq!((ticks(&agent, "lamp"), condition(&agent, "lamp")), (2, "WAITING"));
    assert_eq!(number(&agent, "lamp/brightness/value"), -1.0);
    assert_eq!(Watch::of(2).counts(), (1, 1));
    steps(&mut agent, 1);
    assert_eq!(condition(&agent, "lamp"), "WORKING");
    assert_eq!(number(&agent, "lamp/brightness/value"), 4.0);
}

#[test]
fn a_provider_that_panics_too_often_leaves_nothing_behind() {
    let text = "[modules.meter]\nparams = { watch = 3, panic_from = 2 }\n[modules.lamp]\n";
    let mut agent = agent(text, &plugins());
    steps(&mut agent, 20);
    assert_eq!(condition(&agent, "meter"), "FAULTED");
    assert_eq!((ticks(&agent, "lamp"), condition(&agent, "lamp")), (1, "WAITING"));
    assert_eq!(Watch::of(3).counts(), (1, 1));
}

#[test]
fn a_provider_that_is_switched_off_provides_nothing() {
    let text = "[modules.meter]\nparams.watch = 4\n[modules.lamp]\n";
    let mut agent = agent(text, &plugins());
    steps(&mut agent, 2);
    agent.composer().enable("meter", false).unwrap();
    steps(&mut agent, 2);
    assert_eq!((ticks(&agent, "lamp"), condition(&agent, "lamp")), (2, "WAITING"));
    assert_eq!(number(&agent, "lamp/brightness/value"), -1.0);
    assert_eq!(Watch::of(4).counts(), (1, 1));
    agent.composer().enable("meter", true).unwrap();
    steps(&mut agent, 1);
    assert_eq!(condition(&agent, "lamp"), "WORKING");
    assert_eq!(Watch::of(4).counts(), (2, 1));
}

#[test]
fn disabled_module_keeps_no_withdrawn_service() {
    let text = "[modules.meter]\nparams = { watch = 5, withdraw_at = 4 }\n[modules.lamp]\n";
    let mut agent = agent(text, &plugins());
    steps(&mut agent, 2);
    agent.composer().enable("lamp", false).unwrap();
    steps(&mut agent, 1);
    assert_eq!(condition(&agent, "lamp"), "INACTIVE");
    assert_eq!(Watch::of(5).counts(), (1, 0));
    steps(&mut agent, 1);
    assert_eq!(Watch::of(5).counts(), (1, 1));
    assert_eq!(condition(&agent, "lamp"), "INACTIVE", "and does not wait either");
}

#[test]
fn waiting_module_provides_no_dependent_service() {
    let text =
        "[modules.meter]\nparams = { watch = 6, withdraw_at = 3 }\n[modules.filter]\n[modules.candle]\n";
    let mut agent = agent(text, &plugins());
    steps(&mut agent, 2);
    assert_eq!(number(&agent, "candle/brightness/value"), 1.0);
    steps(&mut agent, 1);
    assert_eq!((condition(&agent, "filter"), condition(&agent, "candle")), ("WAITING", "WAITING"));
    assert_eq!(number(&agent, "candle/brightness/value"), -1.0);
    assert_eq!(Watch::of(6).counts(), (1, 1));
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "candle/brightness/value"), 4.0);
}

#[test]
fn a_provider_that_is_used_is_not_unloaded() {
    let mut agent = agent("[modules.meter]\nparams.watch = 7\n[modules.lamp]\n", &plugins());
    steps(&mut agent, 2);
    let error = full(&agent.composer().unload("meter").unwrap_err());
    for part in ["`lamp`", "`light_meter 1`", "nothing provides"] {
        assert!(error.contains(part), "{part}: {error}");
    }
    steps(&mut agent, 1);
    assert_eq!(ticks(&agent, "lamp"), 3, "nothing has happened to them");
    assert_eq!(Watch::of(7).counts(), (1, 0));
    agent.composer().unload("lamp").unwrap();
    agent.composer().unload("meter").unwrap();
    assert_eq!(Watch::of(7).counts(), (1, 1));
    steps(&mut agent, 1);
}

#[test]
fn the_end_of_an_agent_ends_its_services() {
    let mut agent = agent("[modules.meter]\nparams.watch = 8\n[modules.lamp]\n", &plugins());
    steps(&mut agent, 2);
    drop(agent);
    assert_eq!(Watch::of(8).counts(), (1, 1));
}

#[test]
fn missing_service_is_reported_at_start() {
    let text = complaint("[modules.lamp]\n", &plugins());
    assert!(text.contains("`lamp` needs `light_meter 1`, which nothing provides"), "{text}");
}

#[test]
fn a_service_of_another_version_is_another_service() {
    let text = complaint("[modules.meter]\n[modules.new_lamp]\n", &plugins());
    assert!(text.contains("`new_lamp` needs `light_meter 2`"), "{text}");
    assert!(text.contains("there is `light_meter 1`: build both with the same version"), "{text}");
}

#[test]
fn a_service_has_one_provider() {
    let text = complaint("[modules.meter]\n[modules.spare]\nkind = \"meter\"\n[modules.lamp]\n", &plugins());
    assert!(text.contains("`light_meter 1`, which both `meter` and `spare` provide"), "{text}");
}

#[test]
fn a_service_is_not_linked() {
    let modules = "[modules.meter]\n[modules.lamp]\n[modules.relay]\n[links]\n";
    for link in ["\"lamp/light\" = \"meter/light\"", "\"relay/input\" = \"meter/light\""] {
        let text = complaint(&format!("{modules}{link}\n"), &plugins());
        assert!(text.contains("is a service") && text.contains("leave the link out"), "{link}: {text}");
    }
}
