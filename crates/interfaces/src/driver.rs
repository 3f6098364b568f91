use slate_module::{Bool, interface};

/// Status of a driver, for the Actuators in front of it.
#[interface]
#[derive(PartialEq)]
pub struct DriverStatus {
    /// Fault: true if the device does not obey.
    /// For example, without a connection or with motors that are switched off.
    pub fault: Bool,
}

impl DriverStatus {
    /// Status of a device that does not obey.
    /// Readers of a driver that hangs or has failed get it.
    pub const FAULT: Self = Self { fault: Bool::TRUE };
}
