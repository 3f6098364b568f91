//! An agent with a driver, and bytes in pieces.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use slate_device_line::simulated::{DeviceFirmware, SimulatedDevice, SimulatedLine};
use slate_drivers::{DeviceFault, DeviceProtocol};
use slate_module::blackboard::Board;
use slate_module::blackboard::interface::Value;
use slate_runtime::configuration::{self, Configuration};
use slate_runtime::log::MemoryTarget;
use slate_runtime::{Agent, Control, Stopper};

/// How long a test waits for what must come, also on a busy machine.
const TIMEOUT: Duration = Duration::from_secs(20);

/// A path that no other test has.
pub fn unique(name: &str) -> PathBuf {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    std::env::temp_dir().join(format!("slate-drivers-{}-{count}-{name}", std::process::id()))
}

/// A device at a pseudo-terminal, under a path that stays when it is plugged in again.
pub fn at_terminal<F: DeviceFirmware>(firmware: F) -> SimulatedDevice<F> {
    SimulatedDevice::start(firmware, SimulatedLine::Terminal(Some(unique("device")))).unwrap()
}

pub fn load(text: &str, log: MemoryTarget) -> Result<Agent, String> {
    let configuration = Configuration::from_text("test.toml", text, &configuration::Options::default())
        .map_err(|error| format!("{error:?}"))?;
    let options = slate_runtime::Options { armed: true, log: vec![Box::new(log)], ..Default::default() };
    Agent::load(&configuration, &[slate_drivers::plugin()], options).map_err(|error| format!("{error:?}"))
}

/// Why an agent with that module is refused.
pub fn refusal(module: &str, params: &str) -> String {
    let text = format!("[modules.{module}]\n{params}");
    let error = load(&text, MemoryTarget::default()).err().unwrap_or_else(|| panic!("{text} is accepted"));
    // The report breaks lines anywhere.
    error
        .split(|sign: char| sign.is_whitespace() || sign == '│')
        .filter(|word| !word.is_empty())
        .collect::<Vec<_>>()
        .join(" ")
}

/// An agent with one driver, which runs until this is dropped.
pub struct Running {
    board: Arc<Board>,
    stopper: Stopper,
    thread: Option<JoinHandle<()>>,
    log: MemoryTarget,
    module: &'static str,
}

impl Running {
    /// A module of the agent or, as `robot/module`, of a robot; `more` are parameters, and tables after them.
    pub fn new(module: &'static str, device: &str, more: &str) -> Self {
        let log = MemoryTarget::default();
        let table = match module.split_once('/') {
            Some((robot, module)) => format!("robots.{robot}.modules.{module}"),
            None => format!("modules.{module}"),
        };
        let text = format!(
            "[loop]\nperiod = \"10ms\"\nhang = \"30s\"\n[{table}]\nparams.device = \"{device}\"\n{more}"
        );
        let mut agent = load(&text, log.clone()).unwrap_or_else(|error| panic!("{error}"));
        let (board, stopper) = (Arc::clone(agent.board()), agent.stopper());
        let run = move || drop(agent.run(Box::new(|_| Control::Continue)));
        Self { board, stopper, thread: Some(std::thread::spawn(run)), log, module }
    }

    /// With a device that measures.
    pub fn well(module: &'static str, device: &str, more: &str) -> Self {
        let running = Self::new(module, device, more);
        running.until("measurements", || running.is_well());
        running
    }

    /// The newest value of a property of the driver, or of another module after `../`.
    pub fn value(&self, path: &str) -> Option<Value> {
        let path = path.strip_prefix("../").map_or_else(|| format!("{}/{path}", self.module), str::to_owned);
        self.board.read(&path).unwrap().map(|(value, _)| value)
    }

    pub fn number(&self, path: &str) -> f64 {
        match self.value(path) {
            Some(Value::Bool(value)) => f64::from(u8::from(value)),
            value => value.and_then(|value| value.as_f64()).unwrap_or(f64::NAN),
        }
    }

    /// The numbers of a list.
    pub fn numbers(&self, path: &str) -> Vec<f64> {
        match self.value(path) {
            Some(Value::List(list)) => list.iter().map(|value| value.as_f64().unwrap_or(f64::NAN)).collect(),
            _ => Vec::new(),
        }
    }

    pub fn text(&self) -> String {
        self.value("status/text").as_ref().and_then(Value::as_str).unwrap_or_default().to_owned()
    }

    pub fn is_well(&self) -> bool {
        self.number("status/is_well") == 1.0
    }

    pub fn set(&self, parameter: &str, value: Value) {
        self.board.write(&format!("{}/params/{parameter}", self.module), &value, 0).unwrap();
    }

    pub fn until(&self, what: &str, mut is: impl FnMut() -> bool) {
        let start = Instant::now();
        while !is() {
            assert!(
                start.elapsed() < TIMEOUT,
                "never: {what}; {} {}; the log: {:#?}",
                self.text(),
                self.number("status/is_well"),
                self.log.lines().iter().map(|record| record.text.clone()).collect::<Vec<_>>()
            );
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    pub fn until_text(&self, part: &str) {
        self.until(part, || self.text().contains(part));
    }

    /// How many lines of the log have that part.
    pub fn logged(&self, part: &str) -> usize {
        self.log.lines().iter().filter(|record| record.text.contains(part)).count()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stopper.stop();
        let _ = self.thread.take().unwrap().join();
    }
}

/// A device is pulled out and plugged in again.
pub fn survives_a_pulled_cable<F: DeviceFirmware>(running: &Running, device: &SimulatedDevice<F>) {
    device.unplug();
    running.until("a loss", || !running.is_well());
    running.until_text("plugged in");
    running.until("degradation", || {
        running.value("state/condition").as_ref().and_then(Value::as_str) == Some("DEGRADED")
    });
    device.plug().unwrap();
    running.until("measurements", || running.is_well());
    assert_eq!(running.number("status/losses"), 1.0);
    assert_eq!(running.logged("plugged in"), 1, "each reason is logged once");
}

/// A conversation and its device, in virtual time.
pub struct Talk<C, F> {
    pub protocol: C,
    pub device: F,
    pub now: Duration,
}

impl<C: DeviceProtocol, F: DeviceFirmware> Talk<C, F>
where
    C::Value: Clone,
{
    pub fn new(protocol: C, device: F) -> Self {
        Self { protocol, device, now: Duration::ZERO }
    }

    /// Lets time pass in steps of a millisecond; what the device says comes in pieces of at most `piece` bytes.
    pub fn pass(&mut self, time: Duration, piece: usize) -> Result<Vec<C::Value>, DeviceFault> {
        let (mut values, mut outgoing) = (Vec::new(), Vec::new());
        if self.now.is_zero() {
            self.device.open();
            self.protocol.begin(self.now, &mut outgoing);
        }
        let end = self.now + time;
        while self.now < end {
            self.now += Duration::from_millis(1);
            self.device.receive(&outgoing);
            outgoing.clear();
            let mut incoming = Vec::new();
            self.device.advance(self.now, &mut incoming);
            for piece in incoming.chunks(piece) {
                self.protocol
                    .receive(piece, self.now, &mut outgoing, &mut |value| values.push(value.clone()));
            }
            self.protocol.poll(self.now, &mut outgoing)?;
        }
        Ok(values)
    }
}
