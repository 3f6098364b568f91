//! The ports that carry a robot's flow of information; their roles make any other attachment an error.
#![allow(unsafe_code, reason = "binding a port is passed on to slate-module's ports")]

use std::ops::Deref;

use slate_module::blackboard::interface::Descriptor;
use slate_module::{
    Direction, Inbox, Input, Interface, Outbox, Output, Port, PortCursor, PortDescription, Queue, Received,
};

use crate::{Planned, Reflex};

/// Roles of ports; both ends of a link have the same role.
pub mod role {
    /// Percepts, from Monitor to Analyze.
    pub const PERCEPT: &str = "percept";
    /// Changes, from Analyze to Plan.
    pub const CHANGE: &str = "change";
    /// Planned actions, from Plan to Execute.
    pub const PLAN: &str = "plan";
    /// Reflexes, from ReactiveModel to Execute.
    pub const REFLEX: &str = "reflex";
}

macro_rules! carrying {
    ($(#[$doc:meta])* $name:ident, $inner:ident, $role:expr) => {
        $(#[$doc])*
        #[derive(Debug)]
        pub struct $name<T: Interface>(pub(crate) $inner<T>);

        impl<T: Interface> Port for $name<T> {
            const CARRIES: (Direction, &'static Descriptor) = $inner::<T>::CARRIES;

            fn describe(name: &str, doc: &str) -> PortDescription {
                PortDescription { role: $role.into(), ..$inner::<T>::describe(name, doc) }
            }

            unsafe fn bind(cursor: &mut PortCursor) -> Self {
                // SAFETY: passed on to the caller.
                Self(unsafe { $inner::bind(cursor) })
            }
        }
    };
}

carrying!(
    /// Percept of a Monitor; the framework writes it.
    Percept,
    Output,
    role::PERCEPT
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
    /// Change of an Analyze; the framework writes it.
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

impl<T: Interface> Deref for Observed<T> {
    type Target = Input<T>;

    fn deref(&self) -> &Input<T> {
        &self.0
    }
}

impl<T: Interface> Noticed<T> {
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
    /// Where a Plan sends its actions.
    PlanOut,
    Outbox<Planned>,
    role::PLAN
);
fixed!(
    /// Where Execute receives the Plan's actions.
    PlanIn,
    Inbox<Planned>,
    role::PLAN
);
fixed!(
    /// Where a ReactiveModel sends its actions.
    ReflexOut,
    Outbox<Reflex>,
    role::REFLEX
);
fixed!(
    /// Where Execute receives reflexes.
    ReflexIn,
    Inbox<Reflex>,
    role::REFLEX
);
