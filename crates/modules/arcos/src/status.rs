use slate_module::prelude::*;

/// State of the connection to a robot.
#[interface]
pub enum Connection {
    /// No connection; it is tried again and again.
    Down,
    /// The robot reports.
    Up,
}

/// Status of a Pioneer, beside its sensors.
#[interface]
#[derive(PartialEq)]
pub struct PioneerStatus {
    /// Packets of the robot that came damaged.
    pub bad_checksums: u64,
    /// Connections that were lost.
    pub losses: u64,
    /// Whether there is a connection.
    pub connection: Connection,
    /// Whether the motors are on. They are switched on with each connection; at the robot anybody can switch them off.
    pub motors: Bool,
    /// Whether the robot's stop button is pressed.
    pub stop_button: Bool,
    /// Whether the left wheel can't turn though it should.
    pub left_stalled: Bool,
    /// Whether the right wheel can't turn though it should.
    pub right_stalled: Bool,
    /// The robot's name for itself, or why there is no connection.
    pub text: Text<252>,
}
