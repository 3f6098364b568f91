#[path = "../robot.rs"]
mod robot;
use robot::*;
use slate_mapek::Robot;

fn main() {
    let robot = Robot::new("r2");
    let monitor = robot.monitor::<RangeMonitor>("monitor");
    let plan = robot.plan::<Planner>("plan");
    monitor.attach(&plan);
}
