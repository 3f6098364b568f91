//! Services in the fixture that tests a module alone.

use std::sync::Arc;
use std::time::Duration;

use slate_module::testing::Fixture;

use crate::aspects::common::Number;
use crate::aspects::light::{Filter, Filtered, Lamp, Light, LightMeter, LightMeter2, Meter, Watch};

#[test]
fn a_test_provides_what_a_module_needs() {
    let light = Light::new(7.0, Duration::ZERO, Watch::of(40));
    let mut lamp = Fixture::<Lamp>::new();
    lamp.provide("light", light.meter());
    lamp.tick();
    assert_eq!(lamp.output::<Number>("brightness"), Some(Number { value: 7.0 }));
}

#[test]
#[should_panic(expected = "port `light` needs light_meter 1: call `fixture.provide(\"light\", ...)`")]
fn a_tick_without_what_it_needs_says_what_to_do() {
    Fixture::<Lamp>::new().tick();
}

#[test]
#[should_panic(expected = "port `light` needs light_meter 1, not light_meter 2")]
fn another_service_is_not_provided() {
    let light = Light::new(7.0, Duration::ZERO, Watch::of(41));
    // SAFETY: the one is the other in the same memory.
    let other: LightMeter2 = unsafe { std::mem::transmute(light.meter()) };
    Fixture::<Lamp>::new().provide("light", other);
}

#[test]
#[should_panic(expected = "port `brightness` is no Aspect")]
fn an_output_is_no_service() {
    let light = Light::new(7.0, Duration::ZERO, Watch::of(42));
    Fixture::<Lamp>::new().provide("brightness", light.meter());
}

#[test]
fn a_test_uses_what_a_module_provides() {
    let watch = Watch::of(43);
    let mut params = <<Meter as slate_module::Module>::Params as Default>::default();
    params.withdraw(43, 3);
    let mut meter = Fixture::<Meter>::with(params).unwrap();
    assert!(meter.provided::<LightMeter>("light").is_none());
    meter.tick();
    assert_eq!(meter.provided::<LightMeter>("light").unwrap().read(), 1.0);
    meter.tick();
    assert_eq!(watch.counts(), (1, 0), "the module sees that it is provided");
    meter.tick();
    assert!(meter.provided::<LightMeter>("light").is_none());
    assert_eq!(watch.counts(), (1, 1));
    meter.tick();
    drop(meter);
    assert_eq!(watch.counts(), (2, 2));
    assert_eq!(Arc::strong_count(&watch), 2, "the test's and the list's");
}

#[test]
fn a_fixture_keeps_a_service_of_another_one() {
    let watch = Watch::of(45);
    let mut params = <<Meter as slate_module::Module>::Params as Default>::default();
    params.withdraw(45, 2);
    let mut meter = Fixture::<Meter>::with(params).unwrap();
    meter.tick();
    let mut lamp = Fixture::<Lamp>::new();
    lamp.provide_from::<LightMeter>("light", &meter, "light");
    meter.tick();
    drop(meter);
    assert_eq!(watch.counts(), (1, 0), "the lamp uses it");
    lamp.tick();
    assert_eq!(lamp.output::<Number>("brightness"), Some(Number { value: 1.0 }));
    drop(lamp);
    assert_eq!(watch.counts(), (1, 1));
}

#[test]
fn a_module_may_need_and_provide() {
    let light = Light::new(7.0, Duration::ZERO, Watch::of(44));
    let mut filter = Fixture::<Filter>::new();
    filter.provide("light", light.meter());
    filter.tick();
    assert!(filter.provided::<Filtered>("filtered").is_some());
}
