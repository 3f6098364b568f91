use slate_module::{Bool, interface};

/// Status of a driver, for the Actuators in front of it.
#[interface]
#[derive(PartialEq)]
pub struct DriverStatus {
    /// Whether the device does not obey, such as without a connection or with motors that are switched off.
    pub fault: Bool,
}

impl DriverStatus {
    /// A device that does not obey; what others read of a driver that hangs or has failed.
    pub const FAULT: Self = Self { fault: Bool::TRUE };
}
