#[path = "../robot.rs"]
mod robot;
use robot::*;
use slate_mapek::Robot;

fn main() {
    let _ = Robot::new("r2").monitor::<RangeMonitor>("monitor").attach::<Planner>("plan");
}
