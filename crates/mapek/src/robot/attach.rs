//! Attachments that the compiler checks.
//! They are Sensor to Monitor and ReactiveModel, Monitor to Analyze, Analyze to Plan.

use std::panic::Location;

use slate_module::{HasPort, Input, Interface, Module};

use super::Robot;
use super::content::{AttachedLink, Source};
use crate::published::Published;
use crate::{
    Analyze, AnalyzeBlock, Monitor, MonitorBlock, Noticed, Observed, Plan, PlanBlock, ReactiveBlock,
    ReactiveModel, Sensor,
};

type PublishedInterface<V> = <V as Published>::Interface;

/// Block that a Monitor of `T` can be attached to.
/// It is an Analyze with one port `Observed<T>`.
#[diagnostic::on_unimplemented(
    message = "a Monitor of `{T}` can't be attached to `{Self}`",
    label = "this is no Analyze with one port `Observed<{T}>`",
    note = "only Monitor -> Analyze -> Plan can be attached: a Monitor to an Analyze that observes its value"
)]
pub trait Observes<T: Interface + ?Sized>: Analyze {
    /// Port that observes.
    #[doc(hidden)]
    const OBSERVED: &'static str;
}

#[diagnostic::do_not_recommend]
impl<A: Analyze, T: Interface + ?Sized> Observes<T> for A
where
    A::Observed: HasPort<Observed<T>>,
{
    const OBSERVED: &'static str = <A::Observed as HasPort<Observed<T>>>::PORT;
}

/// Block that an Analyze of `T` can be attached to.
/// It is a Plan with one port `Noticed<T>`.
#[diagnostic::on_unimplemented(
    message = "an Analyze of `{T}` can't be attached to `{Self}`",
    label = "this is no Plan with one port `Noticed<{T}>`",
    note = "only Monitor -> Analyze -> Plan can be attached: an Analyze to a Plan that notices its value"
)]
pub trait Notices<T: Interface + ?Sized>: Plan {
    /// Port that notices.
    #[doc(hidden)]
    const NOTICED: &'static str;
}

#[diagnostic::do_not_recommend]
impl<P: Plan, T: Interface + ?Sized> Notices<T> for P
where
    P::Noticed: HasPort<Noticed<T>>,
{
    const NOTICED: &'static str = <P::Noticed as HasPort<Noticed<T>>>::PORT;
}

/// Block that can read a Sensor of `T`.
/// It is a Monitor or ReactiveModel with one port `Input<T>`.
#[diagnostic::on_unimplemented(
    message = "`{Self}` can't read a Sensor of `{T}`",
    label = "this is no Monitor or ReactiveModel with one port `Input<{T}>`",
    note = "only Monitors and ReactiveModels read sensors: those with a port for the sensor's value"
)]
pub trait Senses<T: Interface + ?Sized> {
    /// Port that reads.
    #[doc(hidden)]
    const SENSED: &'static str;
}

#[diagnostic::do_not_recommend]
impl<M: Monitor, T: Interface + ?Sized> Senses<T> for MonitorBlock<M>
where
    M::Sensors: HasPort<Input<T>>,
{
    const SENSED: &'static str = <M::Sensors as HasPort<Input<T>>>::PORT;
}

#[diagnostic::do_not_recommend]
impl<R: ReactiveModel, T: Interface + ?Sized> Senses<T> for ReactiveBlock<R>
where
    R::Sensors: HasPort<Input<T>>,
{
    const SENSED: &'static str = <R::Sensors as HasPort<Input<T>>>::PORT;
}

impl<M: Monitor> Robot<MonitorBlock<M>> {
    /// Attaches this Monitor to the Analyze that observes its percept (RoCS, 5.1).
    /// `analyze` is the name of the Analyze.
    #[track_caller]
    pub fn attach<A: Observes<PublishedInterface<M::Value>>>(self, analyze: &str) -> Self {
        self.attach_to::<AnalyzeBlock<A>>(analyze, A::OBSERVED, "percept", Location::caller())
    }
}

impl<A: Analyze> Robot<AnalyzeBlock<A>> {
    /// Attaches this Analyze to the Plan that notices its changes (RoCS, 5.1).
    /// `plan` is the name of the Plan.
    #[track_caller]
    pub fn attach<P: Notices<PublishedInterface<A::Value>>>(self, plan: &str) -> Self {
        self.attach_to::<PlanBlock<P>>(plan, P::NOTICED, "change", Location::caller())
    }
}

impl<B: Module> Robot<B> {
    fn attach_to<R: Module>(
        mut self,
        reader: &str,
        input: &str,
        output: &'static str,
        place: &'static Location<'static>,
    ) -> Self {
        let module = self.last().name.clone();
        let mut link = AttachedLink::new(reader, input, Source::Block { module, port: output }, place);
        link.expected = Some((reader.into(), R::NAME));
        self.own().links.push(link);
        self
    }

    /// Attaches the Sensor of that name to this Monitor or ReactiveModel.
    #[track_caller]
    pub fn sense<S: Sensor>(mut self, sensor: &str) -> Self
    where
        B: Senses<PublishedInterface<S::Value>>,
    {
        let source = Source::Block { module: sensor.into(), port: "value" };
        let mut link = AttachedLink::new(&self.last().name, B::SENSED, source, Location::caller());
        link.expected = Some((sensor.into(), S::NAME));
        self.own().links.push(link);
        self
    }
}
