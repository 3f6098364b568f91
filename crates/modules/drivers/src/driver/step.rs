use serde::{Deserialize, Serialize};
use slate_device_line::LineAddress;
use slate_module::aspect::{Aspect, Threads};
use slate_module::prelude::*;

use super::protocol::DeviceProtocol;
use super::reader;
use super::reading::DriverReading;
use crate::status::DeviceStatus;

/// Ports of a driver beside its measurement.
#[ports]
pub struct DriverIo {
    threads: Aspect<Threads>,
    /// Status of the device and of the line to it.
    #[safe(DeviceStatus::default())]
    status: Output<DeviceStatus>,
}

/// State of a driver. The connection is not saved, but opened again.
#[derive(Debug, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct DriverState<P> {
    #[serde(skip)]
    status: DeviceStatus,
    /// Parameters of the thread.
    #[serde(skip)]
    params: Option<P>,
}

impl<P> Default for DriverState<P> {
    fn default() -> Self {
        Self { status: DeviceStatus::default(), params: None }
    }
}

/// Start of a driver from its parameters: the line, and its conversation.
pub(crate) trait DriverStart: Copy + PartialEq {
    /// Message of the thread.
    type DriverReading: DriverReading;
    /// Conversation with the device.
    type DeviceProtocol: DeviceProtocol<Value = <Self::DriverReading as DriverReading>::Value>;

    /// True for a measurement that is valid until the next one, at any age.
    /// Such a device sends on changes alone.
    const LASTS: bool = false;

    /// Returns the line, and the conversation on it.
    ///
    /// # Errors
    /// When a parameter is wrong.
    fn start(&self) -> Result<(LineAddress, Self::DeviceProtocol), Refusal>;

    /// Checks the parameters, also those of a missing device.
    ///
    /// # Errors
    /// When a parameter is wrong.
    fn check(&self) -> Result<(), Refusal> {
        let (address, _) = self.start()?;
        address.check().map_err(|error| device(&error))
    }
}

/// Returns a refusal of the parameter `device`.
pub(crate) fn device(error: &slate_device_line::AddressError) -> Refusal {
    Refusal(format!("params.device: {error}"))
}

const DRIVER: &str = "driver";
/// Measurements that the ring between thread and tick has room for.
const RING_CAPACITY: usize = 16;
/// Age above which a measurement is discarded, nanoseconds.
const OLD: u64 = 500_000_000;

/// Runs a driver's tick: takes its thread's messages, starts a missing thread.
///
/// `take` is called with each measurement, oldest first.
pub(crate) fn step<P: DriverStart>(
    state: &mut DriverState<P>,
    io: &DriverIo,
    params: &P,
    now: &Tick,
    mut take: impl FnMut(&<P::DriverReading as DriverReading>::Value),
) -> Outcome {
    if !io.threads.is_running(DRIVER) {
        state.status = DeviceStatus::default();
        state.params = Some(*params);
        let spawned = params.start().and_then(|(address, protocol)| {
            let room = RING_CAPACITY * (size_of::<P::DriverReading>() + 16);
            io.threads.spawn_with_room(DRIVER, room.max(16 * 1024), move |stop| {
                reader::run::<P::DriverReading, P::DeviceProtocol>(stop, &address, protocol);
            })
        });
        if let Err(reason) = spawned {
            now.error(format_args!("{reason}"));
            return Outcome::Failed;
        }
    } else if state.params != Some(*params) {
        // The next tick that finds it ended begins another one.
        io.threads.stop(DRIVER);
    }
    while let Ok(Some(reading)) = io.threads.receive::<P::DriverReading>(DRIVER) {
        let status = reading.status();
        if *status != state.status {
            state.status = *status;
            io.status.set(*status);
        }
        let is_old = !P::LASTS && now.now().saturating_sub(status.arrival) > OLD;
        if let Some(value) = reading.value().filter(|_| !is_old) {
            take(value);
        }
    }
    if state.status.is_well.get() { Outcome::Ok } else { Outcome::Degraded }
}

impl<P> DriverState<P> {
    /// Returns true if the device measures.
    pub(crate) fn is_connected(&self) -> bool {
        self.status.is_connected.get()
    }
}
