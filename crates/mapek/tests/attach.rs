//! What may be attached to what is known to the compiler (RoCS, 5.1), and so is that ports are read only in a tick.

mod robot;

use robot::{PassRange, Planner, RangeMonitor, Ranger};
use slate_mapek::Robot;

// No case of trybuild: with one that passes, all cases are built, not only checked, with all that they depend on.
#[test]
fn sensor_monitor_analyze_and_plan_are_attached() {
    let _ = Robot::new("r2")
        .sensor::<Ranger>("sonar")
        .monitor::<RangeMonitor>("monitor")
        .sense::<Ranger>("sonar")
        .attach::<PassRange>("analyze")
        .analyze::<PassRange>("analyze")
        .attach::<Planner>("plan")
        .plan::<Planner>("plan");
}

#[test]
fn only_monitor_to_analyze_to_plan_can_be_attached() {
    trybuild::TestCases::new().compile_fail("tests/attach/refused/*.rs");
}
