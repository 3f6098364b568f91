//! Analyzes in a robot without blocks.
#![allow(unsafe_code, reason = "binding ports is passed on to those of the Analyze")]

use std::marker::PhantomData;

use slate_module::{
    Module, Outcome, PortCursor, PortDescription, PortList, Ports, Refusal, Setup, Spec, Stage, StaleInput,
    Tick,
};

use crate::{Analyze, AnalyzeBlock, Published};

/// An [`Analyze`] that is a kind of plain module, too.
pub trait PlainAnalyze: Analyze {
    /// Kind of the module in the configuration, in snake case.
    const KIND: &'static str;
}

/// [`Analyze`] as a plain module.
/// Its ports have no roles, so that links lead from and to anything.
///
/// It is for robots that are composed without the blocks of MAPE-K, such as those of OpenRDK.
///
/// ```
/// use slate_interfaces::Pose2;
/// use slate_mapek::{Observed, PlainAnalyze, PlainModule, prelude::*};
/// use slate_module::prelude::*;
/// use slate_module::testing::Fixture;
///
/// #[ports]
/// pub struct Seen {
///     pose: Observed<Pose2>,
/// }
///
/// /// Passes a pose on.
/// pub struct PassPose;
///
/// impl Analyze for PassPose {
///     const NAME: &'static str = "pass_pose";
///     type Observed = Seen;
///     type Params = ();
///     type State = ();
///     type Value = Pose2;
///
///     fn process(_: &mut (), seen: &Seen, _: &(), _: &Tick) -> Option<Pose2> {
///         seen.pose.updated().copied()
///     }
/// }
///
/// impl PlainAnalyze for PassPose {
///     const KIND: &'static str = "pose_relay";
/// }
///
/// let mut relay = Fixture::<PlainModule<PassPose>>::new();
/// relay.set("pose", Pose2 { x: 1.0, y: 2.0, theta: 0.0 });
/// relay.tick();
/// assert_eq!(relay.output::<Pose2>("change").map(|pose| pose.y), Some(2.0));
/// ```
pub struct PlainModule<A>(PhantomData<fn() -> A>);

/// Ports without the roles that they play in MAPE-K.
#[derive(Debug)]
pub struct PlainPorts<P>(P);

impl<P: Ports> Ports for PlainPorts<P> {
    const OUTLINE: PortList = P::OUTLINE;

    fn describe() -> Vec<PortDescription> {
        let mut ports = P::describe();
        ports.iter_mut().for_each(|port| port.role.clear());
        ports
    }

    unsafe fn bind(cursor: &mut PortCursor) -> Self {
        // SAFETY: passed on to the caller.
        Self(unsafe { P::bind(cursor) })
    }

    fn stale_input(&self) -> Option<StaleInput> {
        self.0.stale_input()
    }
}

impl<A: PlainAnalyze> Module for PlainModule<A> {
    type Io = PlainPorts<(A::Observed, <A::Value as Published>::Change)>;
    type Params = A::Params;
    type State = A::State;

    const NAME: &'static str = A::KIND;
    const DOC: &'static str = A::DOC;
    const STAGE: Stage = Stage::WorldState;

    fn spec() -> Spec {
        AnalyzeBlock::<A>::spec()
    }

    fn create(setup: &Setup<'_>, params: &A::Params) -> Result<A::State, Refusal> {
        AnalyzeBlock::<A>::create(setup, params)
    }

    fn tick(state: &mut A::State, io: &Self::Io, params: &A::Params, now: &Tick) -> Outcome {
        AnalyzeBlock::<A>::tick(state, &io.0, params, now)
    }
}
