//! Cost of a Monitor that only hands on.
//! A Sensor, the Monitor, and an Analyze that reads it.

use std::hint::black_box;

use slate_interfaces::{Echo, LaserScan, SonarPlacement, SonarScan};
use slate_mapek::prelude::*;
use slate_mapek::{analyze, monitor, sensor};
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{Database, Options as Layers};
use slate_runtime::{Agent, Options, Rate, RecordedTimes};

/// Ranges of a scan of the laser.
const RANGES: usize = 2000;

/// Ports of the sonars.
#[ports]
pub struct SonarIo {
    value: Measurement<SonarScan>,
}

/// Sixteen sonars.
pub struct Sonars;

impl Sensor for Sonars {
    const NAME: &'static str = "sonars";
    type Io = SonarIo;
    type Params = ();
    type State = ();
    type Value = InPlace<SonarScan>;

    fn get_data(_: &mut (), io: &SonarIo, _: &(), now: &Tick) -> Option<InPlace<SonarScan>> {
        Some(io.value.write(0, |scan| {
            scan.range_max = now.seconds();
            scan.placements = Sequence::new(&[SonarPlacement::default(); 16]);
            scan.echoes = Sequence::new(&[Echo::default(); 16]);
        }))
    }
}

/// Ports of the laser.
#[ports]
pub struct LaserIo {
    #[capacity(2000)]
    value: Measurement<LaserScan>,
}

/// A laser scanner.
pub struct Laser;

impl Sensor for Laser {
    const NAME: &'static str = "laser";
    type Io = LaserIo;
    type Params = ();
    type State = ();
    type Value = InPlace<LaserScan>;

    fn get_data(_: &mut (), io: &LaserIo, _: &(), now: &Tick) -> Option<InPlace<LaserScan>> {
        Some(io.value.write(RANGES, |scan| scan.ranges[0] = now.seconds() as f32))
    }
}

/// Sensors of a Monitor that returns its percept.
#[ports]
pub struct Returned {
    sonar: Sensed<SonarScan>,
}

/// Returns a scan of the sonars.
pub struct ReturnsSonars;

impl Monitor for ReturnsSonars {
    const NAME: &'static str = "returns_sonars";
    type Sensors = Returned;
    type Params = ();
    type State = ();
    type Value = SonarScan;

    fn interpret(_: &mut (), sensors: &Returned, _: &(), _: &Tick) -> Option<SonarScan> {
        sensors.sonar.updated().copied()
    }
}

/// Sensors of a Monitor that copies a scan of the laser.
#[ports]
pub struct Copied {
    laser: Sensed<LaserScan>,
    #[capacity(2000)]
    percept: Percept<LaserScan>,
}

/// Copies a scan of the laser from slot to slot.
pub struct CopiesLaser;

impl Monitor for CopiesLaser {
    const NAME: &'static str = "copies_laser";
    type Sensors = Copied;
    type Params = ();
    type State = ();
    type Value = InPlace<LaserScan>;

    fn interpret(_: &mut (), sensors: &Copied, _: &(), _: &Tick) -> Option<InPlace<LaserScan>> {
        sensors.laser.updated()?;
        Some(sensors.percept.copy(&sensors.laser))
    }
}

macro_rules! hands_on {
    ($($monitor:ident($kind:literal), $ports:ident, $analyze:ident($name:literal), $observed:ident: $value:ty;)+) => {$(
        /// Ports of the Monitor.
        #[ports]
        pub struct $ports {
            percept: HandedOn<$value>,
        }

        /// Hands on what its Sensor measures.
        pub struct $monitor;

        impl Monitor for $monitor {
            const NAME: &'static str = $kind;
            type Sensors = $ports;
            type Params = ();
            type State = ();
            type Value = InPlace<$value>;

            fn interpret(_: &mut (), sensors: &$ports, _: &(), _: &Tick) -> Option<InPlace<$value>> {
                Some(sensors.percept.as_it_is())
            }
        }

        /// Input of the Analyze.
        #[ports]
        pub struct $observed {
            percept: Observed<$value>,
            change: Change<$value>,
        }

        /// Reads the percept.
        pub struct $analyze;

        impl Analyze for $analyze {
            const NAME: &'static str = $name;
            type Observed = $observed;
            type Params = ();
            type State = ();
            type Value = InPlace<$value>;

            fn process(_: &mut (), observed: &$observed, _: &(), _: &Tick) -> Option<InPlace<$value>> {
                black_box((observed.percept.updated()?.range_max, observed.change.capacity()));
                None
            }
        }
    )+};
}
hands_on! {
    HandsOnSonars("hands_on_sonars"), SonarPercept, ReadsSonars("reads_sonars"), ObservedSonars: SonarScan;
    HandsOnLaser("hands_on_laser"), LaserPercept, ReadsLaser("reads_laser"), ObservedLaser: LaserScan;
}

/// Runs a robot with that Monitor.
/// An empty kind is the sonars alone, a dot the laser alone.
pub fn cycle(count: u32, monitor_kind: &str) -> Result<(), String> {
    let text = |error: &dyn std::fmt::Debug| format!("{error:?}");
    let has_laser = monitor_kind == "." || monitor_kind.ends_with("laser");
    let (sensor_kind, analyze_kind) =
        if has_laser { ("laser", "reads_laser") } else { ("sonars", "reads_sonars") };
    let mut robot = format!("[log.targets]\nconsole = false\n[robots.r2.modules]\n{sensor_kind} = {{}}\n");
    if monitor_kind.len() > 1 {
        robot += &format!("{monitor_kind} = {{}}\n{analyze_kind} = {{}}\n");
    }
    let database =
        Database::from_text("robot.toml", &robot, Layers::default()).map_err(|error| text(&error))?;
    let kinds = [
        sensor::<Sonars>(),
        sensor::<Laser>(),
        monitor::<ReturnsSonars>(),
        monitor::<CopiesLaser>(),
        monitor::<HandsOnSonars>(),
        monitor::<HandsOnLaser>(),
        analyze::<ReadsSonars>(),
        analyze::<ReadsLaser>(),
    ];
    let options = Options {
        rate: Rate::Max,
        time_source: Some(Box::new(RecordedTimes::new(Vec::new()))),
        ..Options::default()
    };
    let mut agent =
        Agent::load_with(&database, &kinds.map(Plugin::from), options).map_err(|error| text(&error))?;
    for _ in 0..count {
        black_box(agent.step());
    }
    Ok(())
}
