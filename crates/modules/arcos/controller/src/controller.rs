use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use slate_device_line::simulated::{Faults, PseudoTerminal};
use slate_module::Random;
use slate_sim::geometry::Pose;

use crate::body::SimulatedPioneer;
use crate::error::ControllerError;
use crate::firmware::Firmware;

/// Timeout of a wait for bytes.
const POLL_PERIOD: Duration = Duration::from_millis(5);

/// Options of a controller.
#[derive(Clone, Debug)]
pub struct ControllerOptions {
    /// World that comes with the simulator, or a file's path.
    pub world: String,
    /// True pose: x and y in meters, theta in radians.
    pub at: [f64; 3],
    /// Seed of the random numbers.
    pub seed: u64,
    /// Link to the pseudo-terminal, whose own name changes each time.
    pub link: Option<PathBuf>,
    /// Initial faults of the line.
    pub faults: Faults,
}

impl Default for ControllerOptions {
    fn default() -> Self {
        Self {
            world: "rocs_arena".into(),
            at: [0.6, 0.8, 0.0],
            seed: 0,
            link: None,
            faults: Faults::default(),
        }
    }
}

/// Controller that runs in a thread of its own, until it is dropped.
#[derive(Debug)]
pub struct Controller {
    inner: Arc<Mutex<ControllerState>>,
    thread: Option<JoinHandle<()>>,
    path: PathBuf,
    link: Option<PathBuf>,
}

#[derive(Debug)]
struct ControllerState {
    body: SimulatedPioneer,
    firmware: Firmware,
    faults: Faults,
    random: Random,
    terminal: Option<Arc<PseudoTerminal>>,
    ends: bool,
}

impl Controller {
    /// Switches a robot on.
    ///
    /// # Errors
    /// When the robot does not fit into its world, or there is no pseudo-terminal.
    pub fn start(options: ControllerOptions) -> Result<Self, ControllerError> {
        let ControllerOptions { world, at: [x, y, theta], seed, link, faults } = options;
        let body = SimulatedPioneer::new(&world, Pose { x, y, theta }, seed)?;
        let terminal = PseudoTerminal::open(link.as_deref())?;
        let path = terminal.path().to_owned();
        let inner = Arc::new(Mutex::new(ControllerState {
            body,
            firmware: Firmware::new(),
            faults,
            random: Random::new(seed, "line"),
            terminal: Some(Arc::new(terminal)),
            ends: false,
        }));
        let own = Arc::clone(&inner);
        let thread = std::thread::Builder::new().name("controller".into()).spawn(move || live(&own))?;
        Ok(Self { inner, thread: Some(thread), path, link })
    }

    /// Returns the path for the driver: the link, if any.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Sets the faults of the line.
    pub fn set_faults(&self, faults: Faults) {
        locked(&self.inner).faults = faults;
    }

    /// Unplugs the cable: the terminal disappears.
    /// The robot continues.
    pub fn unplug(&self) {
        locked(&self.inner).terminal = None;
    }

    /// Plugs the cable in again.
    ///
    /// # Errors
    /// When there is no pseudo-terminal, or no link was given under which the driver could find the new one.
    pub fn plug(&self) -> Result<(), ControllerError> {
        let link = self.link.as_deref().ok_or(ControllerError::Unlinked)?;
        locked(&self.inner).terminal = Some(Arc::new(PseudoTerminal::open(Some(link))?));
        Ok(())
    }

    /// Switches the robot off and on: it forgets its connection and where it is.
    pub fn restart(&self) {
        let ControllerState { body, firmware, .. } = &mut *locked(&self.inner);
        firmware.restart(body);
    }

    /// Presses the motors button.
    pub fn press_motors_button(&self) {
        locked(&self.inner).firmware.press_motors_button();
    }

    /// Presses the stop button, or releases it.
    pub fn set_stop_button(&self, pressed: bool) {
        locked(&self.inner).firmware.set_stop_button(pressed);
    }

    /// Returns the true pose: x, y, theta.
    pub fn pose(&self) -> [f64; 3] {
        let Pose { x, y, theta } = locked(&self.inner).body.pose();
        [x, y, theta]
    }

    /// Returns the speeds of the left and the right wheel over the floor, m/s.
    pub fn wheels(&self) -> (f64, f64) {
        locked(&self.inner).body.wheels()
    }

    /// Returns true if a client is connected.
    pub fn is_open(&self) -> bool {
        locked(&self.inner).firmware.is_open()
    }

    /// Returns true if the motors are on.
    pub fn motors(&self) -> bool {
        locked(&self.inner).firmware.motors()
    }
}

impl Drop for Controller {
    fn drop(&mut self) {
        locked(&self.inner).ends = true;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn locked(inner: &Mutex<ControllerState>) -> MutexGuard<'_, ControllerState> {
    inner.lock().unwrap_or_else(PoisonError::into_inner)
}

#[allow(clippy::disallowed_methods, reason = "the robot at the end of a line lives by the wall clock")]
fn live(inner: &Mutex<ControllerState>) {
    let began = Instant::now();
    loop {
        // The lock is not held while it waits.
        let terminal = {
            let mut inner = locked(inner);
            if inner.ends {
                return;
            }
            inner.work(began.elapsed());
            inner.terminal.as_ref().map(Arc::downgrade)
        };
        match terminal.and_then(|terminal| terminal.upgrade()) {
            Some(terminal) => terminal.wait(POLL_PERIOD),
            None => std::thread::sleep(POLL_PERIOD),
        }
    }
}

impl ControllerState {
    fn work(&mut self, now: Duration) {
        let Self { body, firmware, faults, random, terminal, .. } = self;
        if let Some(terminal) = terminal {
            let mut bytes = [0; 1024];
            let count = terminal.read(&mut bytes);
            firmware.receive(&faults.spoil(&bytes[..count], random), body, now);
        }
        firmware.advance(body, now);
        let bytes = std::mem::take(firmware.outgoing());
        if let Some(terminal) = terminal {
            // Bytes without room are lost.
            let _ = terminal.write(&faults.spoil_reports(&bytes, random));
        }
    }
}
