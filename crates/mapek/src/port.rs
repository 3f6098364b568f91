//! Ports that carry a robot's flow of information.
//! Their roles make any other attachment an error.
#![allow(unsafe_code, reason = "binding a port is passed on to slate-module's ports")]

use std::ops::Deref;

use slate_module::blackboard::interface::Descriptor;
use slate_module::{
    Direction, Inbox, Input, Interface, Outbox, Output, Port, PortCursor, PortDescription, Queue, Received,
    Stamp, role,
};

use crate::in_place::InPlace;
use crate::{Planned, Reflex};

macro_rules! carrying {
    ($(#[$doc:meta])* $name:ident, $inner:ident, $role:expr) => {
        $(#[$doc])*
        #[derive(Debug)]
        pub struct $name<T: Interface + ?Sized>(pub(crate) $inner<T>);

        impl<T: Interface + ?Sized> Port for $name<T> {
            const CARRIES: (Direction, &'static Descriptor) = $inner::<T>::CARRIES;

            fn describe(name: &str, doc: &str) -> PortDescription {
                PortDescription { role: $role.into(), ..$inner::<T>::describe(name, doc) }
            }

            unsafe fn bind(cursor: &mut PortCursor) -> Self {
                // SAFETY: passed on to the caller.
                Self(unsafe { $inner::bind(cursor) })
            }

            fn stale_since(&self) -> Option<Stamp> {
                self.0.stale_since()
            }
        }
    };
}

carrying!(
    /// Measurement of a Sensor.
    /// The framework writes a small one, and a Sensor one of any size.
    Measurement,
    Output,
    role::MEASUREMENT
);
carrying!(
    /// Measurement of a Sensor at a Monitor or at Knowledge.
    /// An [`Input`] for Sensors only.
    ///
    /// Knowledge lists the Sensors that such inputs of it read in its [`RobotModel`](crate::RobotModel).
    Sensed,
    Input,
    role::MEASUREMENT
);
carrying!(
    /// Percept of a Monitor.
    /// The framework writes a small one, and a Monitor one of any size.
    ///
    /// ```
    /// use slate_interfaces::LaserScan;
    /// use slate_mapek::{prelude::*, InPlace};
    /// use slate_module::prelude::*;
    ///
    /// #[ports]
    /// pub struct Laser {
    ///     #[stale(after = "200ms")]
    ///     scan: Sensed<LaserScan>,
    ///     #[capacity(2048)]
    ///     percept: Percept<LaserScan>,
    /// }
    ///
    /// /// Leaves out the scans without a range.
    /// pub struct LaserMonitor;
    ///
    /// impl Monitor for LaserMonitor {
    ///     const NAME: &'static str = "laser_monitor";
    ///     type Sensors = Laser;
    ///     type Params = ();
    ///     type State = ();
    ///     type Value = InPlace<LaserScan>;
    ///
    ///     fn interpret(_: &mut (), laser: &Laser, _: &(), _: &Tick) -> Option<InPlace<LaserScan>> {
    ///         let is_there = laser.scan.fresh()?.ranges.iter().any(|range| range.is_finite());
    ///         is_there.then(|| laser.percept.copy(&laser.scan))
    ///     }
    /// }
    /// ```
    Percept,
    Output,
    role::PERCEPT
);
carrying!(
    /// Percept of a Monitor that passes each measurement of a Sensor on unchanged.
    /// It is its one port, `percept`.
    ///
    /// Analyzes read it at the Monitor's URL, and get the Sensor's value itself, in the same cycle and without a copy.
    /// The Monitor still reports when the Sensor stops.
    ///
    /// ```
    /// use slate_interfaces::LaserScan;
    /// use slate_mapek::{prelude::*, InPlace};
    /// use slate_module::prelude::*;
    ///
    /// #[ports]
    /// pub struct Laser {
    ///     #[stale(after = "200ms")]
    ///     percept: HandedOn<LaserScan>,
    /// }
    ///
    /// /// Hands on every scan of the laser.
    /// pub struct LaserMonitor;
    ///
    /// impl Monitor for LaserMonitor {
    ///     const NAME: &'static str = "laser_monitor";
    ///     type Sensors = Laser;
    ///     type Params = ();
    ///     type State = ();
    ///     type Value = InPlace<LaserScan>;
    ///
    ///     fn interpret(_: &mut (), laser: &Laser, _: &(), _: &Tick) -> Option<InPlace<LaserScan>> {
    ///         Some(laser.percept.as_it_is())
    ///     }
    /// }
    /// ```
    HandedOn,
    Input,
    role::HANDED_ON
);
carrying!(
    /// Percept of a Monitor at an Analyze: an [`Input`] for Monitors only.
    ///
    /// It is constant during a step, and belongs to the step's thread:
    ///
    /// ```compile_fail,E0277
    /// use slate_interfaces::Pose2;
    /// use slate_mapek::Observed;
    ///
    /// fn process(observed: &Observed<Pose2>) {
    ///     std::thread::scope(|scope| {
    ///         scope.spawn(|| observed.x);
    ///     });
    /// }
    /// ```
    Observed,
    Input,
    role::PERCEPT
);
carrying!(
    /// Change of an Analyze.
    /// The framework writes a small one, and an Analyze one of any size.
    Change,
    Output,
    role::CHANGE
);
carrying!(
    /// Changes of an Analyze at the Plan, in order.
    Noticed,
    Queue,
    role::CHANGE
);

carrying!(
    /// Command from the gate, at an Actuator.
    Commanded,
    Input,
    role::COMMAND
);
carrying!(
    /// Fact of the WorldModel, of any size, at Knowledge.
    ///
    /// Its link is its single origin, such as an Analyze's change. Every block but a ReactiveModel may read it at Knowledge's URL, such as
    /// `knowledge/map`: it then reads the origin's value, in the same cycle and without a copy. A fact without a link
    /// holds a value that the configuration or a person sets.
    Known,
    Input,
    role::FACT
);

macro_rules! reading {
    ($($name:ident),+) => {
        $(
            impl<T: Interface + ?Sized> Deref for $name<T> {
                type Target = Input<T>;

                fn deref(&self) -> &Input<T> {
                    &self.0
                }
            }
        )+
    };
}
reading!(Sensed, HandedOn, Observed, Commanded, Known);

macro_rules! writing {
    ($($name:ident),+) => {
        $(
            impl<T: Interface + ?Sized> $name<T> {
                /// Writes a value with `items` tail items in place; it begins all zero.
                pub fn write(&self, items: usize, write: impl FnOnce(&mut T)) -> InPlace<T> {
                    InPlace::new(self.0.write(items, write), items, self.0.capacity())
                }

                /// Writes the newest value of an input, copied once and straight into the property.
                pub fn copy(&self, input: &Input<T>) -> InPlace<T> {
                    InPlace::new(self.0.copy(input), input.items(), self.0.capacity())
                }

                /// Returns how many tail items fit.
                pub fn capacity(&self) -> usize {
                    self.0.capacity()
                }
            }
        )+
    };
}
writing!(Measurement, Percept, Change);

impl<T: Interface + ?Sized> HandedOn<T> {
    /// Returns the percept of a Monitor that changes nothing and writes nothing.
    pub fn as_it_is(&self) -> InPlace<T> {
        InPlace::new(true, 0, 0)
    }
}

impl<T: Interface + ?Sized> Noticed<T> {
    /// Iterates over changes since the previous run, oldest first.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Received<'_, T>> {
        self.0.iter()
    }

    /// Returns the newest change since the previous run, if any.
    pub fn newest(&self) -> Option<Received<'_, T>> {
        self.iter().last()
    }

    /// Returns the number of changes lost by lag.
    pub fn missed(&self) -> u64 {
        self.0.missed()
    }
}

macro_rules! fixed {
    ($(#[$doc:meta])* $name:ident, $inner:ty, $role:expr) => {
        $(#[$doc])*
        #[derive(Debug)]
        pub struct $name(pub(crate) $inner);

        impl Port for $name {
            const CARRIES: (Direction, &'static Descriptor) = <$inner>::CARRIES;

            fn describe(name: &str, doc: &str) -> PortDescription {
                PortDescription { role: $role.into(), ..<$inner>::describe(name, doc) }
            }

            unsafe fn bind(cursor: &mut PortCursor) -> Self {
                // SAFETY: passed on to the caller.
                Self(unsafe { <$inner>::bind(cursor) })
            }
        }
    };
}

fixed!(
    /// Output of a Plan for its actions.
    PlanOut,
    Outbox<Planned>,
    role::PLAN
);
fixed!(
    /// Input of Execute for the Plan's actions.
    PlanIn,
    Inbox<Planned>,
    role::PLAN
);
fixed!(
    /// Output of a ReactiveModel for its actions.
    ReflexOut,
    Outbox<Reflex>,
    role::REFLEX
);
fixed!(
    /// Input of Execute for reflexes.
    ReflexIn,
    Inbox<Reflex>,
    role::REFLEX
);
