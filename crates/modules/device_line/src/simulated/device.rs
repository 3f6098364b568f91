use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use slate_module::Random;

use super::faults::Faults;
use super::line_end::LineEnd;
use super::terminal::TerminalError;

/// Polling period of a simulated device's line.
const POLL_PERIOD: Duration = Duration::from_millis(1);
/// Bytes that wait for room on the line; more are lost.
const MAX_PENDING_BYTES: usize = 64 * 1024;

/// Firmware of a simulated device: a state machine without line and clock.
pub trait DeviceFirmware: Send + 'static {
    /// Notes that a driver has opened the line.
    fn open(&mut self) {}

    /// Decodes bytes of the driver.
    fn receive(&mut self, bytes: &[u8]);

    /// Advances the time to `now` since the device was created; appends sent bytes.
    fn advance(&mut self, now: Duration, outgoing: &mut Vec<u8>);
}

/// Line of a simulated device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SimulatedLine {
    /// Pseudo-terminal, with a path that leads to it.
    Terminal(Option<PathBuf>),
    /// Port of TCP of this machine; 0 for a free one.
    Tcp(u16),
}

/// Reason why no simulated device is available.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    /// No pseudo-terminal.
    #[error(transparent)]
    Terminal(#[from] TerminalError),
    /// No thread, or no port.
    #[error("no simulated device: {0}")]
    System(#[from] std::io::Error),
    /// Without a link, a driver can't find a new terminal.
    #[error("without a link, no driver finds the new terminal: start the device with one")]
    Unlinked,
}

/// Device at the end of a line, in a thread of its own, until it is dropped.
#[derive(Debug)]
pub struct SimulatedDevice<F: DeviceFirmware> {
    inner: Arc<Mutex<Inner<F>>>,
    thread: Option<JoinHandle<()>>,
    line: SimulatedLine,
    name: String,
}

#[derive(Debug)]
struct Inner<F> {
    firmware: F,
    faults: Faults,
    random: Random,
    end: Option<LineEnd>,
    is_open: bool,
    /// Bytes that the line had no room for.
    waiting: Vec<u8>,
    ends: bool,
}

impl<F: DeviceFirmware> SimulatedDevice<F> {
    /// Switches a device on.
    ///
    /// # Errors
    /// When there is no pseudo-terminal, no such port, or no thread.
    pub fn start(firmware: F, line: SimulatedLine) -> Result<Self, SimulationError> {
        let end = end(&line)?;
        let name = end.name();
        // It keeps its port when it is plugged in again.
        let line = if matches!(line, SimulatedLine::Tcp(_)) { SimulatedLine::Tcp(end.port()) } else { line };
        let inner = Arc::new(Mutex::new(Inner {
            firmware,
            faults: Faults::default(),
            random: Random::new(0, "line"),
            end: Some(end),
            is_open: false,
            waiting: Vec::new(),
            ends: false,
        }));
        let own = Arc::clone(&inner);
        let thread = std::thread::Builder::new().name("device".into()).spawn(move || live(&own))?;
        Ok(Self { inner, thread: Some(thread), line, name })
    }

    /// Returns the address for a driver: a path, or `tcp://HOST:PORT`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Uses the device, between two of its steps.
    pub fn with<R>(&self, work: impl FnOnce(&mut F) -> R) -> R {
        work(&mut locked(&self.inner).firmware)
    }

    /// Sets the faults of the line.
    pub fn set_faults(&self, faults: Faults) {
        locked(&self.inner).faults = faults;
    }

    /// Sends bytes that no device would send.
    pub fn babble(&self, bytes: &[u8]) {
        locked(&self.inner).waiting.extend_from_slice(bytes);
    }

    /// Returns true if a driver has the line open.
    pub fn is_open(&self) -> bool {
        locked(&self.inner).is_open
    }

    /// Unplugs the cable: the line disappears.
    /// The device continues.
    pub fn unplug(&self) {
        let inner = &mut *locked(&self.inner);
        inner.end = None;
        inner.is_open = false;
        inner.waiting.clear();
    }

    /// Plugs the cable in again.
    ///
    /// # Errors
    /// When there is no line, or no link was given under which the driver could find a new terminal.
    pub fn plug(&self) -> Result<(), SimulationError> {
        if self.line == SimulatedLine::Terminal(None) {
            return Err(SimulationError::Unlinked);
        }
        locked(&self.inner).end = Some(end(&self.line)?);
        Ok(())
    }
}

impl<F: DeviceFirmware> Drop for SimulatedDevice<F> {
    fn drop(&mut self) {
        locked(&self.inner).ends = true;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn end(line: &SimulatedLine) -> Result<LineEnd, SimulationError> {
    Ok(match line {
        SimulatedLine::Terminal(link) => LineEnd::terminal(link.as_deref())?,
        SimulatedLine::Tcp(port) => LineEnd::server(*port)?,
    })
}

fn locked<F>(inner: &Mutex<Inner<F>>) -> MutexGuard<'_, Inner<F>> {
    inner.lock().unwrap_or_else(PoisonError::into_inner)
}

#[allow(clippy::disallowed_methods, reason = "a device at the end of a line lives by the wall clock")]
fn live<F: DeviceFirmware>(inner: &Mutex<Inner<F>>) {
    let began = Instant::now();
    loop {
        {
            let mut inner = locked(inner);
            if inner.ends {
                return;
            }
            inner.work(began.elapsed());
        }
        std::thread::sleep(POLL_PERIOD);
    }
}

impl<F: DeviceFirmware> Inner<F> {
    fn work(&mut self, now: Duration) {
        let Self { firmware, faults, random, end, is_open, waiting, .. } = self;
        if let Some(end) = end {
            let (open, is_new) = end.poll(*is_open);
            *is_open = open;
            if is_new {
                waiting.clear();
                firmware.open();
            }
            let mut bytes = [0; 1024];
            let count = end.read(&mut bytes);
            firmware.receive(&faults.spoil(&bytes[..count], random));
        }
        let mut outgoing = Vec::new();
        firmware.advance(now, &mut outgoing);
        if *is_open && let Some(end) = end {
            waiting.extend(faults.spoil_reports(&outgoing, random));
            waiting.truncate(MAX_PENDING_BYTES);
            let count = end.write(waiting).min(waiting.len());
            waiting.drain(..count);
        } else {
            waiting.clear();
        }
    }
}
