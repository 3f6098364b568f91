use slate_module::prelude::*;

/// Status of a driver's device and of the line to it.
#[interface]
#[derive(PartialEq)]
pub struct DeviceStatus {
    /// When the newest measurement arrived, by the agent's time.
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
    /// Whether the device measures.
    pub is_connected: Bool,
    /// Whether all is well: it measures, as often as it should, and reports no fault.
    pub is_well: Bool,
    /// What is wrong; the name of the device while all is well.
    pub text: Text<252>,
}
