use slate_module::blackboard::interface::Interface;

use crate::status::DeviceStatus;

/// Message from the thread to the tick: a status, with a measurement or without one.
pub(crate) trait DriverReading: Interface + Copy + Default {
    /// The measurement.
    type Value: Copy;

    /// A status and a new measurement.
    fn measured(value: &Self::Value) -> Self;

    /// The status, to be set.
    fn status_mut(&mut self) -> &mut DeviceStatus;

    /// The status.
    fn status(&self) -> &DeviceStatus;

    /// The measurement, if there is one.
    fn value(&self) -> Option<&Self::Value>;
}

/// Makes the message of a driver whose measurement is of an interface.
macro_rules! reading {
    ($name:ident, $value:ident) => {
        /// Message from the thread to the tick.
        #[::slate_module::interface]
        pub struct $name {
            /// State of the line and of the device.
            pub status: $crate::status::DeviceStatus,
            /// Whether there is a measurement.
            pub is_new: ::slate_module::Bool,
            /// The measurement.
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
