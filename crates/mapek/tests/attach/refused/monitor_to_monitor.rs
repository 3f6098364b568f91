#[path = "../robot.rs"]
mod robot;
use robot::*;
use slate_mapek::Robot;

fn main() {
    let robot = Robot::new("r2");
    let monitor = robot.monitor::<RangeMonitor>("monitor");
    let other = robot.monitor::<RangeMonitor>("other");
    monitor.attach(&other);
}
