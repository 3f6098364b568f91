//! Thread that has the line.

use std::time::{Duration, Instant};

use slate_device_line::{Backoff, DeviceLine, LineAddress};
use slate_module::Text;
use slate_module::aspect::Stop;

use super::protocol::DeviceProtocol;
use super::reading::DriverReading;
use super::watch::RateWatch;
use crate::status::DeviceStatus;

/// Maximum polling period of the line and the clock.
const POLL_PERIOD: Duration = Duration::from_millis(10);
/// Pauses before a line is opened again, the first one and the longest.
const PAUSES: (Duration, Duration) = (Duration::from_millis(100), Duration::from_secs(2));
/// Timeout of the last bytes at the end.
const FAREWELL: Duration = Duration::from_millis(100);

/// Runs the driver thread until it is stopped.
pub(super) fn run<R, C>(stop: &Stop, address: &LineAddress, protocol: C)
where
    R: DriverReading,
    C: DeviceProtocol<Value = R::Value>,
{
    let mut reader = LineReader {
        stop,
        began: wall(),
        address,
        protocol,
        outgoing: Vec::new(),
        watch: RateWatch::default(),
        status: DeviceStatus::default(),
        reported: String::new(),
        pending: None::<R>,
        backoff: Backoff::new(PAUSES.0, PAUSES.1),
    };
    while !stop.is_set() {
        let served = match DeviceLine::open(address) {
            Ok(line) => reader.serve(&line),
            Err(error) => Err(error.to_string()),
        };
        let Err(reason) = served else { continue };
        reader.lose(reason);
        let until = reader.now() + reader.backoff.fail();
        while !stop.is_set() && reader.now() < until {
            reader.deliver();
            stop.wait(POLL_PERIOD);
        }
    }
}

/// Returns the wall-clock time.
/// A device runs by the wall clock, also when the agent's time stands still.
#[allow(clippy::disallowed_methods, reason = "the device on the other end of the line has no other time")]
fn wall() -> Instant {
    Instant::now()
}

/// Returns a fault's text without numbers, to compare it with the last logged.
fn without_numbers(text: &str) -> String {
    text.chars().filter(|letter| !letter.is_ascii_digit()).collect()
}

struct LineReader<'a, R, C> {
    stop: &'a Stop,
    began: Instant,
    address: &'a LineAddress,
    protocol: C,
    outgoing: Vec<u8>,
    watch: RateWatch,
    status: DeviceStatus,
    /// Fault last logged; empty for none.
    reported: String,
    /// Message that the tick had no room for.
    pending: Option<R>,
    backoff: Backoff,
}

impl<R: DriverReading, C: DeviceProtocol<Value = R::Value>> LineReader<'_, R, C> {
    /// Returns the time since the start of the thread.
    fn now(&self) -> Duration {
        self.began.elapsed()
    }

    /// Talks to the device on an open line, until the thread is stopped.
    fn serve(&mut self, line: &DeviceLine) -> Result<(), String> {
        let now = self.now();
        line.set_data_terminal_ready(self.protocol.data_terminal_ready());
        self.outgoing.clear();
        self.watch.begin(now);
        self.protocol.begin(now, &mut self.outgoing);
        let mut bytes = [0; 4096];
        while !self.stop.is_set() {
            line.write(&mut self.outgoing).map_err(|error| error.to_string())?;
            line.wait(POLL_PERIOD).map_err(|error| error.to_string())?;
            let count = line.read(&mut bytes).map_err(|error| error.to_string())?;
            self.receive(&bytes[..count]);
            let now = self.now();
            if let Err(fault) = self.protocol.poll(now, &mut self.outgoing) {
                // It may have something to say to a device that refuses, such as a restart.
                let _ = line.write(&mut self.outgoing);
                return Err(self.named(&fault));
            }
            let silence = self.protocol.allowed_silence();
            let nominal = self.protocol.nominal_rate();
            self.watch.check(now, silence, nominal).map_err(|fault| self.named(&fault))?;
            self.judge();
            self.deliver();
        }
        self.close_session(line);
        Ok(())
    }

    fn named(&self, fault: &super::DeviceFault) -> String {
        format!("{}: {fault}", self.address)
    }

    fn receive(&mut self, bytes: &[u8]) {
        let (now, arrival) = (self.began.elapsed(), self.stop.now());
        let Self { protocol, outgoing, watch, status, pending, backoff, stop, .. } = self;
        if !bytes.is_empty() {
            watch.take_bytes(now);
        }
        protocol.receive(bytes, now, outgoing, &mut |value| {
            watch.take_measurement(now);
            backoff.succeed();
            status.arrival = arrival;
            status.is_connected = true.into();
            let mut message = R::measured(value);
            *message.status_mut() = *status;
            // One that waits is older than this one; a message without a measurement loses nothing.
            let full = pending
                .take()
                .is_some_and(|waiting| !matches!(stop.send(&waiting), Ok(true)) && waiting.value().is_some());
            status.dropped += u64::from(full);
            *pending = Some(message);
        });
    }

    /// Determines the status; reports a change to the tick and the log.
    fn judge(&mut self) {
        if !self.watch.measures() {
            return;
        }
        let text = match (self.protocol.device_error(), self.watch.lag(self.protocol.nominal_rate())) {
            (Some(device_error), _) => Err(device_error.to_owned()),
            (None, Some((rate, nominal))) => Err(format!(
                "only {rate:.1} of {nominal:.1} measurements a second come: is the line fast enough?"
            )),
            (None, None) => Ok(self.protocol.identity()),
        };
        let (damaged, rate) = (self.protocol.damaged(), self.watch.rate);
        let (is_well, shown) = match &text {
            Ok(identity) => (true, Text::new(identity)),
            Err(device_error) => (false, Text::new(device_error)),
        };
        let status = DeviceStatus {
            damaged,
            rate,
            is_connected: true.into(),
            is_well: is_well.into(),
            text: shown,
            ..self.status
        };
        let is_news =
            !self.status.is_connected.get() || self.status.text != shown || !self.reported.is_empty();
        if status != self.status && self.pending.is_none() {
            self.pending = Some(R::default());
        }
        self.status = status;
        if let Some(message) = &mut self.pending {
            *message.status_mut() = status;
        }
        match text {
            Ok(identity) if is_news => {
                self.stop.info(format_args!("{identity} measures at {}", self.address));
                self.reported.clear();
            }
            // The number of measurements is another one each time.
            Err(device_error) if without_numbers(&device_error) != self.reported => {
                self.stop.warn(format_args!("{}: {device_error}", self.address));
                self.reported = without_numbers(&device_error);
            }
            _ => {}
        }
    }

    /// Handles a lost line; logs each reason once.
    fn lose(&mut self, reason: String) {
        let losses = self.status.losses + u64::from(self.status.is_connected.get());
        if reason != self.reported {
            self.stop.warn(format_args!("no measurements, which is tried again: {reason}"));
        }
        self.status = DeviceStatus {
            losses,
            damaged: self.protocol.damaged(),
            rate: 0.0,
            is_connected: false.into(),
            is_well: false.into(),
            text: Text::new(&reason),
            ..self.status
        };
        self.reported = reason;
        let mut message = R::default();
        *message.status_mut() = self.status;
        self.pending = Some(message);
    }

    /// Passes the newest message to the tick, or later when there is no room.
    fn deliver(&mut self) {
        if let Some(message) = self.pending.take()
            && !matches!(self.stop.send(&message), Ok(true))
        {
            self.pending = Some(message);
        }
    }

    fn close_session(&mut self, line: &DeviceLine) {
        self.protocol.end(&mut self.outgoing);
        let until = self.now() + FAREWELL;
        while !self.outgoing.is_empty() && self.now() < until {
            if line.write(&mut self.outgoing).and_then(|()| line.wait(Duration::from_millis(1))).is_err() {
                return;
            }
        }
    }
}
