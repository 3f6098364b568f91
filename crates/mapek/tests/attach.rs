//! What may be attached to what is known to the compiler (RoCS, 5.1), and so is that ports are read only in a tick.

#[test]
fn only_monitor_to_analyze_to_plan_can_be_attached() {
    let cases = trybuild::TestCases::new();
    cases.pass("tests/attach/allowed.rs");
    cases.compile_fail("tests/attach/refused/*.rs");
}
