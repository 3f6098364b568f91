use slate_module::blackboard::interface::Interface;

use crate::status::DeviceStatus;

/// Message from the thread to the tick: status and optional measurement.
pub(crate) trait DriverReading: Interface + Copy + Default {
    /// Measurement.
    type Value: Copy;

    /// Returns a status and a new measurement.
    fn measured(value: &Self::Value) -> Self;

    /// Returns the status, to be set.
    fn status_mut(&mut self) -> &mut DeviceStatus;

    /// Returns the status.
    fn status(&self) -> &DeviceStatus;

    /// Returns the measurement, if there is one.
    fn value(&self) -> Option<&Self::Value>;
}

/// Defines the message of a driver with a measurement of an interface.
macro_rules! reading {
    ($name:ident, $value:ident) => {
        /// Message from the thread to the tick.
        #[::slate_module::interface]
        pub struct $name {
            /// State of the line and of the device.
            pub status: $crate::status::DeviceStatus,
            /// True if the message carries a measurement.
            pub is_new: ::slate_module::Bool,
            /// Measurement.
            pub value: $value,
        }

        impl $crate::driver::DriverReading for $name {
            type Value = $value;

            fn measured(value: &$value) -> Self {
                Self { is_new: true.into(), value: *value, ..Self::default() }
            }

            fn status_mut(&mut self) -> &mut $crate::status::DeviceStatus {
                &mut self.status
            }

            fn status(&self) -> &$crate::status::DeviceStatus {
                &self.status
            }

            fn value(&self) -> Option<&$value> {
                self.is_new.get().then_some(&self.value)
            }
        }
    };
}
pub(crate) use reading;
