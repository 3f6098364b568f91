#[path = "../robot.rs"]
mod robot;
use robot::*;
use slate_mapek::Robot;

fn main() {
    let robot = Robot::new("r2");
    let monitor = robot.monitor::<OrientationMonitor>("monitor");
    let analyze = robot.analyze::<PassRange>("analyze");
    monitor.attach(&analyze);
}
