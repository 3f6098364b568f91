#[path = "../robot.rs"]
mod robot;
use robot::*;
use slate_mapek::Robot;

fn main() {
    let robot = Robot::new("r2");
    let analyze = robot.analyze::<PassRange>("analyze");
    analyze.attach(&analyze);
}
