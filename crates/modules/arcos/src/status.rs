use slate_module::prelude::*;

/// State of the connection to a robot.
#[interface]
pub enum Connection {
    /// No connection; it is retried.
    Down,
    /// Connected: the robot reports.
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
    /// State of the connection.
    pub connection: Connection,
    /// Motor state: true if on.
    /// Each connection switches them on; anybody can switch them off at the robot.
    pub motors: Bool,
    /// Stop button state: true if pressed.
    pub stop_button: Bool,
    /// Stall of the left wheel: true if it can't turn though it should.
    pub left_stalled: Bool,
    /// Stall of the right wheel: true if it can't turn though it should.
    pub right_stalled: Bool,
    /// Robot's name for itself, or why there is no connection.
    pub text: Text<252>,
}
