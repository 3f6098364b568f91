//! A service of modules, and modules that provide and need it.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use slate_module::Plugin;
use slate_module::aspect::{Aspect, Provider, Service, service};
use slate_module::blackboard::interface::Descriptor;
use slate_module::prelude::*;

use crate::aspects::common::Number;

/// Tells how bright it is.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct LightMeter {
    context: *const Light,
    read: unsafe extern "C" fn(*const Light) -> f64,
}

// SAFETY: plain C data; reading is possible from any thread.
unsafe impl Service for LightMeter {
    const DESCRIPTOR: &'static Descriptor = &service::<Self>("light_meter 1", "Tells how bright it is.");
}

impl LightMeter {
    /// Lux.
    pub fn read(&self) -> f64 {
        // SAFETY: the context lives as long as the service is provided.
        unsafe { (self.read)(self.context) }
    }
}

/// What a light meter reads.
#[repr(C)]
pub struct Light {
    lux: f64,
    /// How long a reading takes.
    hold: Duration,
    /// How many read it at this moment.
    reading: AtomicU64,
    watch: Arc<Watch>,
}

/// What became of the lights of a test.
#[derive(Default)]
pub struct Watch {
    pub provided: AtomicU64,
    pub dropped: AtomicU64,
    pub readings: AtomicU64,
    /// Lights that were dropped during a read.
    pub misused: AtomicU64,
}

impl Watch {
    /// The watch of that number; each test has one of its own.
    pub fn of(number: u64) -> Arc<Self> {
        static WATCHES: Mutex<BTreeMap<u64, Arc<Watch>>> = Mutex::new(BTreeMap::new());
        Arc::clone(WATCHES.lock().unwrap().entry(number).or_default())
    }

    /// How many were provided and how many dropped.
    pub fn counts(&self) -> (u64, u64) {
        (self.provided.load(Ordering::SeqCst), self.dropped.load(Ordering::SeqCst))
    }
}

impl Light {
    pub fn new(lux: f64, hold: Duration, watch: Arc<Watch>) -> Box<Self> {
        watch.provided.fetch_add(1, Ordering::SeqCst);
        Box::new(Self { lux, hold, reading: AtomicU64::new(0), watch })
    }

    pub fn meter(&self) -> LightMeter {
        unsafe extern "C" fn read(light: *const Light) -> f64 {
            // SAFETY: the owner of the service keeps it.
            let light = unsafe { &*light };
            light.reading.fetch_add(1, Ordering::SeqCst);
            std::thread::sleep(light.hold);
            light.watch.readings.fetch_add(1, Ordering::SeqCst);
            light.reading.fetch_sub(1, Ordering::SeqCst);
            light.lux
        }
        LightMeter { context: self, read }
    }
}

impl Drop for Light {
    fn drop(&mut self) {
        if self.reading.load(Ordering::SeqCst) > 0 {
            self.watch.misused.fetch_add(1, Ordering::SeqCst);
        }
        self.watch.dropped.fetch_add(1, Ordering::SeqCst);
        // A read from now on yields garbage.
        self.lux = f64::NAN;
    }
}

#[ports]
pub struct MeterIo {
    light: Provider<LightMeter>,
}

#[params]
pub struct MeterParams {
    #[param(default = 0, doc = "which watch counts its lights")]
    watch: u64,
    #[param(default = 1, doc = "provides from that tick on")]
    provide_at: u64,
    #[param(default = 0, doc = "withdraws in that tick; 0 for never")]
    withdraw_at: u64,
    #[param(default = 0, doc = "panics in that tick; 0 for never")]
    panic_at: u64,
    #[param(default = 0, doc = "panics in each tick from that one on; 0 for never")]
    panic_from: u64,
    #[param(default = 0, unit = "ms", doc = "how long a reading takes")]
    hold: u64,
    #[param(default = 0, doc = "the tick that hangs")]
    hang_at: u64,
    #[param(default = 0, unit = "ms", doc = "how long it hangs")]
    hang: u64,
    #[param(default = 0, doc = "provides and withdraws by turns, if not 0")]
    flap: u64,
}

impl MeterParams {
    /// Counted by that watch, and withdrawn in that tick.
    pub fn withdraw(&mut self, watch: u64, tick: u64) {
        (self.watch, self.withdraw_at) = (watch, tick);
    }
}

/// Provides a light meter that reads the number of its tick.
pub struct Meter;

#[module(stage = SensorAcquire)]
impl Module for Meter {
    type Io = MeterIo;
    type Params = MeterParams;
    type State = ();

    fn tick(_: &mut (), io: &MeterIo, params: &MeterParams, now: &Tick) -> Outcome {
        let number = now.number();
        if number == params.panic_at || (params.panic_from > 0 && number >= params.panic_from) {
            panic!("as the test wants");
        }
        if number == params.hang_at {
            std::thread::sleep(Duration::from_millis(params.hang));
        }
        if number == params.withdraw_at || (params.flap > 0 && number.is_multiple_of(2)) {
            io.light.withdraw();
        } else if number >= params.provide_at && !io.light.is_provided() {
            let hold = Duration::from_millis(params.hold);
            let light = Light::new(number as f64, hold, Watch::of(params.watch));
            io.light.provide(light.meter(), light);
        }
        Outcome::Ok
    }
}

#[ports]
pub struct LampIo {
    light: Aspect<LightMeter>,
    #[safe(Number { value: -1.0 })]
    brightness: Output<Number>,
}

/// Shows what the light meter reads.
pub struct Lamp;

#[module(stage = Act)]
impl Module for Lamp {
    type Io = LampIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &LampIo, _: &(), _: &Tick) -> Outcome {
        io.brightness.set(Number { value: io.light.read() });
        Outcome::Ok
    }
}

#[ports]
pub struct FilterIo {
    light: Aspect<LightMeter>,
    filtered: Provider<Filtered>,
}

/// The same light, dimmed.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Filtered(LightMeter);

// SAFETY: as of the light meter.
unsafe impl Service for Filtered {
    const DESCRIPTOR: &'static Descriptor = &service::<Self>("filtered 1", "The same light, dimmed.");
}

/// Provides a service that uses another one.
pub struct Filter;

#[module(stage = SensorPrepare)]
impl Module for Filter {
    type Io = FilterIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &FilterIo, _: &(), _: &Tick) -> Outcome {
        if !io.filtered.is_provided() {
            io.filtered.provide(Filtered(*io.light), ());
        }
        Outcome::Ok
    }
}

#[ports]
pub struct CandleIo {
    light: Aspect<Filtered>,
    #[safe(Number { value: -1.0 })]
    brightness: Output<Number>,
}

/// Shows what the filter lets through.
pub struct Candle;

#[module(stage = Act)]
impl Module for Candle {
    type Io = CandleIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &CandleIo, _: &(), _: &Tick) -> Outcome {
        io.brightness.set(Number { value: io.light.0.read() });
        Outcome::Ok
    }
}

/// The next version of the light meter.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct LightMeter2(LightMeter);

// SAFETY: as of the light meter.
unsafe impl Service for LightMeter2 {
    const DESCRIPTOR: &'static Descriptor = &service::<Self>("light_meter 2", "Tells how bright it is.");
}

#[ports]
pub struct NewLampIo {
    light: Aspect<LightMeter2>,
}

/// Needs the next version.
pub struct NewLamp;

#[module(stage = Act)]
impl Module for NewLamp {
    type Io = NewLampIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &NewLampIo, _: &(), now: &Tick) -> Outcome {
        now.info(format_args!("{}", io.light.0.read()));
        Outcome::Ok
    }
}

pub fn plugins() -> Vec<Plugin> {
    vec![
        Plugin::linked::<Meter>(),
        Plugin::linked::<Lamp>(),
        Plugin::linked::<Filter>(),
        Plugin::linked::<Candle>(),
        Plugin::linked::<NewLamp>(),
    ]
}
