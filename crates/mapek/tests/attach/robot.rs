//! Blocks for the cases beside this file.
#![allow(dead_code)]

use slate_mapek::prelude::*;
use slate_module::prelude::*;

/// A distance.
#[interface]
pub struct Near {
    /// Meters.
    pub distance: f64,
}

/// A heading.
#[interface]
pub struct Heading {
    /// Radians.
    pub theta: f64,
}

#[ports]
pub struct Sonar {
    range: Input<Near>,
}

pub struct Ranger;

impl Sensor for Ranger {
    const NAME: &'static str = "ranger";
    type Io = ();
    type Params = ();
    type State = ();
    type Value = Near;

    fn get_data(_: &mut (), _: &(), _: &(), _: &Tick) -> Option<Near> {
        None
    }
}

pub struct RangeMonitor;

impl Monitor for RangeMonitor {
    const NAME: &'static str = "range_monitor";
    type Sensors = Sonar;
    type Params = ();
    type State = ();
    type Value = Near;

    fn interpret(_: &mut (), sensors: &Sonar, _: &(), _: &Tick) -> Option<Near> {
        sensors.range.fresh().copied()
    }
}

#[ports]
pub struct Compass {
    heading: Input<Heading>,
}

pub struct OrientationMonitor;

impl Monitor for OrientationMonitor {
    const NAME: &'static str = "orientation_monitor";
    type Sensors = Compass;
    type Params = ();
    type State = ();
    type Value = Heading;

    fn interpret(_: &mut (), sensors: &Compass, _: &(), _: &Tick) -> Option<Heading> {
        sensors.heading.fresh().copied()
    }
}

#[ports]
pub struct ObservedRange {
    pub range: Observed<Near>,
}

pub struct PassRange;

impl Analyze for PassRange {
    const NAME: &'static str = "pass_range";
    type Observed = ObservedRange;
    type Params = ();
    type State = ();
    type Value = Near;

    fn process(_: &mut (), observed: &ObservedRange, _: &(), _: &Tick) -> Option<Near> {
        observed.range.updated().copied()
    }
}

#[ports]
pub struct NoticedRange {
    range: Noticed<Near>,
}

pub struct Planner;

impl Plan for Planner {
    const NAME: &'static str = "planner";
    type Noticed = NoticedRange;
    type Params = ();
    type State = ();

    fn run(_: &mut (), _: &NoticedRange, _: &Situation<'_>, _: &(), _: &Tick, _: &mut Agenda<'_>) {}
}
