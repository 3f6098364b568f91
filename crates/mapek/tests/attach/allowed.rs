#[path = "robot.rs"]
mod robot;
use robot::*;
use slate_mapek::Robot;

fn main() {
    let _ = Robot::new("r2")
        .sensor::<Ranger>("sonar")
        .monitor::<RangeMonitor>("monitor")
        .sense::<Ranger>("sonar")
        .attach::<PassRange>("analyze")
        .analyze::<PassRange>("analyze")
        .attach::<Planner>("plan")
        .plan::<Planner>("plan");
}
