use std::time::Duration;

/// Conversation with a device: a state machine without a line and without a clock.
///
/// Times are durations since any beginning, by a clock that never stands still. What is to be sent is appended to
/// `outgoing`.
pub trait DeviceProtocol: Send + 'static {
    /// Measurement of the device.
    type Value;

    /// Begins the conversation on a newly opened line.
    fn begin(&mut self, now: Duration, outgoing: &mut Vec<u8>);

    /// Decodes received bytes, and calls `take` with each complete measurement.
    fn receive(
        &mut self,
        bytes: &[u8],
        now: Duration,
        outgoing: &mut Vec<u8>,
        take: &mut dyn FnMut(&Self::Value),
    );

    /// Advances the time: sends what is due.
    ///
    /// # Errors
    /// Why the line has to be opened anew.
    fn poll(&mut self, now: Duration, outgoing: &mut Vec<u8>) -> Result<(), DeviceFault>;

    /// Ends it: the device may switch its laser or its motor off.
    fn end(&mut self, _outgoing: &mut Vec<u8>) {}

    /// Returns the name of the device for people, once it is known.
    fn identity(&self) -> &str;

    /// Returns the number of packets that came damaged.
    fn damaged(&self) -> u64;

    /// Returns the fault of a device that measures.
    /// For example, a receiver without satellites.
    fn device_error(&self) -> Option<&str> {
        None
    }

    /// Returns the time without a measurement after which the device is silent.
    /// `None` while it may be silent.
    fn allowed_silence(&self) -> Option<Duration>;

    /// Returns the nominal rate in measurements per second, if the device has one.
    fn nominal_rate(&self) -> Option<f64> {
        None
    }

    /// Returns the level of the line DTR while the device works.
    fn data_terminal_ready(&self) -> bool {
        true
    }
}

/// Reason why a device does not measure.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DeviceFault {
    /// No answer.
    #[error("the device does not answer: is it switched on, and connected?")]
    NoAnswer,
    /// Bytes came, but nothing that is known.
    #[error("only noise is on the line: is `baud` the speed of the device, and is it such a device?")]
    Noise,
    /// Silent after measurements.
    #[error("the device stopped responding")]
    Silent,
    /// Only noise after measurements.
    #[error("the device sends only noise: check line and baud rate")]
    Drowned,
    /// The device refuses to work; its reason.
    #[error("{0}")]
    Refused(String),
}
