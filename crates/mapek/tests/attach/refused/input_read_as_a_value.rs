use slate_interfaces::Pose2;
use slate_module::prelude::*;

fn field(pose: &Input<Pose2>) -> f64 {
    pose.x
}

fn dereferenced(pose: &Input<Pose2>) -> &Pose2 {
    &**pose
}

fn main() {}
