use slate_module::prelude::*;

/// Status of a driver's device and of the line to it.
#[interface]
#[derive(PartialEq)]
pub struct DeviceStatus {
    /// Arrival time of the newest measurement, by the agent's time.
    #[unit("ns")]
    pub arrival: u64,
    /// Packets that came damaged since the driver began.
    pub damaged: u64,
    /// Connections that were lost since the driver began.
    pub losses: u64,
    /// Measurements that no tick had room for.
    pub dropped: u64,
    /// Measurements in a second, over a second or five measurements; 0 before that.
    #[unit("Hz")]
    pub rate: f64,
    /// Connection state: true if the device measures.
    pub is_connected: Bool,
    /// Health: true if it measures at its rate and reports no fault.
    pub is_well: Bool,
    /// Fault of the device; its name while it is healthy.
    pub text: Text<252>,
}
