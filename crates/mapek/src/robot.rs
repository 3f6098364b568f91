use std::cell::RefCell;
use std::marker::PhantomData;
use std::rc::Rc;

use slate_module::{HasPort, Input, Interface, ModuleKind};

use crate::{
    Actuator, Analyze, Knowledge, Monitor, Noticed, Observed, Plan, ReactiveModel, Repertoire, Sensor, kind,
};

/// Builder of a robot: its blocks and their attachments.
///
/// Only Monitors attach to an Analyze, and only Analyzes to the Plan; others do not compile. The result equals the links of a
/// configuration.
#[derive(Debug)]
pub struct Robot {
    parts: Rc<RefCell<Parts>>,
}

#[derive(Debug, Default)]
struct Parts {
    name: String,
    modules: Vec<(String, ModuleKind)>,
    links: Vec<(String, String)>,
    plan: Option<String>,
    execute: Option<String>,
    knowledge: Option<String>,
    reactive: Vec<String>,
    /// The first thing that can't be.
    error: Option<BuildError>,
}

/// A robot put together: its modules and its links, both with names in the robot.
#[derive(Clone, Debug)]
pub struct Wiring {
    /// The robot's name.
    pub name: String,
    /// Each module's name and kind.
    pub modules: Vec<(String, ModuleKind)>,
    /// Links: the port of the reader or sender, and its source or receiver, such as
    /// `("pass_range/range", "range_monitor/percept")`.
    pub links: Vec<(String, String)>,
}

/// Why a robot can't be built.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BuildError {
    /// A robot has one Plan, one Execute, one Knowledge.
    #[error("robot `{robot}` has one {part}, and `{first}` is it already; remove `{second}`")]
    Second {
        /// The robot.
        robot: String,
        /// Duplicate block.
        part: &'static str,
        /// The first one.
        first: String,
        /// The other one.
        second: String,
    },
    /// Two modules have the same name.
    #[error("robot `{robot}` has two modules `{name}`")]
    SameName {
        /// The robot.
        robot: String,
        /// The name.
        name: String,
    },
    /// An input reads one property.
    #[error("robot `{robot}`: `{port}` reads `{first}` already and can't read `{second}` too")]
    TwoSources {
        /// The robot.
        robot: String,
        /// The input.
        port: String,
        /// Present source.
        first: String,
        /// Second source.
        second: String,
    },
    /// A Plan or a ReactiveModel needs an Execute.
    #[error("robot `{robot}` has no Execute, which `{block}` needs")]
    NoExecute {
        /// The robot.
        robot: String,
        /// Block that sends actions.
        block: String,
    },
}

impl Parts {
    fn fail(&mut self, error: impl FnOnce(String) -> BuildError) {
        if self.error.is_none() {
            self.error = Some(error(self.name.clone()));
        }
    }

    fn only(&mut self, part: &'static str, slot: fn(&mut Self) -> &mut Option<String>, name: &str) {
        match slot(self) {
            Some(first) => {
                let (first, second) = (first.clone(), name.to_owned());
                self.fail(|robot| BuildError::Second { robot, part, first, second });
            }
            none => *none = Some(name.to_owned()),
        }
    }

    fn link(&mut self, port: String, source: String) {
        if let Some((_, first)) = self.links.iter().find(|(to, _)| *to == port) {
            let first = first.clone();
            self.fail(|robot| BuildError::TwoSources { robot, port, first, second: source });
        } else {
            self.links.push((port, source));
        }
    }
}

/// A block of a robot that is being put together.
#[derive(Clone, Debug)]
pub struct BlockHandle<B> {
    parts: Rc<RefCell<Parts>>,
    name: String,
    block: PhantomData<fn() -> B>,
}

impl<B> BlockHandle<B> {
    /// The module's name in the robot.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Links an input to a property of a sensor, of knowledge or of another block. The URL is relative to
    /// the robot, such as `sonar/value`, or absolute.
    pub fn watch(&self, port: &str, url: &str) {
        self.parts.borrow_mut().link(format!("{}/{port}", self.name), url.to_owned());
    }
}

macro_rules! handle {
    ($(#[$doc:meta])* $name:ident, $block:ident) => {
        $(#[$doc])*
        #[derive(Clone, Debug)]
        pub struct $name<B>(BlockHandle<B>);

        impl<B> std::ops::Deref for $name<B> {
            type Target = BlockHandle<B>;

            fn deref(&self) -> &BlockHandle<B> {
                &self.0
            }
        }
    };
}
handle!(
    /// A [`Sensor`] of a robot.
    SensorHandle, Sensor
);
handle!(
    /// An [`Actuator`] of a robot.
    ActuatorHandle, Actuator
);
handle!(
    /// A [`Monitor`] of a robot.
    MonitorHandle, Monitor
);
handle!(
    /// An [`Analyze`] of a robot.
    AnalyzeHandle, Analyze
);
handle!(
    /// The [`Plan`] of a robot.
    PlanHandle, Plan
);
handle!(
    /// The Execute of a robot.
    ExecuteHandle, Repertoire
);
handle!(
    /// A [`ReactiveModel`] of a robot.
    ReactiveHandle, ReactiveModel
);
handle!(
    /// The [`Knowledge`] of a robot.
    KnowledgeHandle, Knowledge
);

/// A block that a Monitor of `T` can be attached to: an Analyze with one port `Observed<T>`.
#[diagnostic::on_unimplemented(
    message = "a Monitor of `{T}` can't be attached to `{Self}`",
    label = "this is no Analyze with one port `Observed<{T}>`",
    note = "only Monitor -> Analyze -> Plan can be attached: a Monitor to an Analyze that observes its value"
)]
pub trait Observes<T: Interface> {
    #[doc(hidden)]
    fn observed_port(&self) -> String;
}

#[diagnostic::do_not_recommend]
impl<A: Analyze, T: Interface> Observes<T> for AnalyzeHandle<A>
where
    A::Observed: HasPort<Observed<T>>,
{
    fn observed_port(&self) -> String {
        format!("{}/{}", self.name, <A::Observed as HasPort<Observed<T>>>::PORT)
    }
}

/// A block that an Analyze of `T` can be attached to: a Plan with one port `Noticed<T>`.
#[diagnostic::on_unimplemented(
    message = "an Analyze of `{T}` can't be attached to `{Self}`",
    label = "this is no Plan with one port `Noticed<{T}>`",
    note = "only Monitor -> Analyze -> Plan can be attached: an Analyze to a Plan that notices its value"
)]
pub trait Notices<T: Interface> {
    #[doc(hidden)]
    fn noticed_port(&self) -> String;
}

#[diagnostic::do_not_recommend]
impl<P: Plan, T: Interface> Notices<T> for PlanHandle<P>
where
    P::Noticed: HasPort<Noticed<T>>,
{
    fn noticed_port(&self) -> String {
        format!("{}/{}", self.name, <P::Noticed as HasPort<Noticed<T>>>::PORT)
    }
}

impl<M: Monitor> MonitorHandle<M> {
    /// Lets an Analyze observe this Monitor.
    pub fn attach(&self, analyze: &impl Observes<M::Value>) {
        self.parts.borrow_mut().link(analyze.observed_port(), format!("{}/percept", self.name));
    }

    /// Lets this Monitor watch a sensor.
    pub fn sense<S: Sensor>(&self, sensor: &SensorHandle<S>)
    where
        M::Sensors: HasPort<Input<S::Value>>,
    {
        self.watch(<M::Sensors as HasPort<Input<S::Value>>>::PORT, &format!("{}/value", sensor.name));
    }
}

impl<R: ReactiveModel> ReactiveHandle<R> {
    /// Lets this model react to a sensor.
    pub fn sense<S: Sensor>(&self, sensor: &SensorHandle<S>)
    where
        R::Sensors: HasPort<Input<S::Value>>,
    {
        self.watch(<R::Sensors as HasPort<Input<S::Value>>>::PORT, &format!("{}/value", sensor.name));
    }
}

impl<A: Analyze> AnalyzeHandle<A> {
    /// Lets the Plan notice this Analyze.
    pub fn attach(&self, plan: &impl Notices<A::Value>) {
        self.parts.borrow_mut().link(plan.noticed_port(), format!("{}/change", self.name));
    }
}

impl Robot {
    /// A robot without blocks.
    pub fn new(name: &str) -> Self {
        Self { parts: Rc::new(RefCell::new(Parts { name: name.to_owned(), ..Parts::default() })) }
    }

    fn add<B>(&self, name: &str, kind: ModuleKind) -> BlockHandle<B> {
        let mut parts = self.parts.borrow_mut();
        if parts.modules.iter().any(|(other, _)| other == name) {
            parts.fail(|robot| BuildError::SameName { robot, name: name.to_owned() });
        }
        parts.modules.push((name.to_owned(), kind));
        BlockHandle { parts: Rc::clone(&self.parts), name: name.to_owned(), block: PhantomData }
    }

    /// Adds a sensor.
    pub fn sensor<S: Sensor>(&self, name: &str) -> SensorHandle<S> {
        SensorHandle(self.add(name, kind::sensor::<S>()))
    }

    /// Adds an actuator.
    pub fn actuator<A: Actuator>(&self, name: &str) -> ActuatorHandle<A> {
        ActuatorHandle(self.add(name, kind::actuator::<A>()))
    }

    /// Adds a Monitor.
    pub fn monitor<M: Monitor>(&self, name: &str) -> MonitorHandle<M> {
        MonitorHandle(self.add(name, kind::monitor::<M>()))
    }

    /// Adds an Analyze.
    pub fn analyze<A: Analyze>(&self, name: &str) -> AnalyzeHandle<A> {
        AnalyzeHandle(self.add(name, kind::analyze::<A>()))
    }

    /// Adds the Plan; a second one is an error when the robot is built.
    pub fn plan<P: Plan>(&self, name: &str) -> PlanHandle<P> {
        self.parts.borrow_mut().only("Plan", |parts| &mut parts.plan, name);
        PlanHandle(self.add(name, kind::plan::<P>()))
    }

    /// Adds the Execute; a second one is an error when the robot is built.
    pub fn execute<R: Repertoire>(&self, name: &str) -> ExecuteHandle<R> {
        self.parts.borrow_mut().only("Execute", |parts| &mut parts.execute, name);
        ExecuteHandle(self.add(name, kind::execute::<R>()))
    }

    /// Adds a ReactiveModel.
    pub fn reactive<R: ReactiveModel>(&self, name: &str) -> ReactiveHandle<R> {
        self.parts.borrow_mut().reactive.push(name.to_owned());
        ReactiveHandle(self.add(name, kind::reactive::<R>()))
    }

    /// Adds the Knowledge; a second one is an error when the robot is built.
    pub fn knowledge<K: Knowledge>(&self, name: &str) -> KnowledgeHandle<K> {
        self.parts.borrow_mut().only("Knowledge", |parts| &mut parts.knowledge, name);
        KnowledgeHandle(self.add(name, kind::knowledge::<K>()))
    }

    /// The robot's modules and links, with those from Plan and ReactiveModels to Execute.
    ///
    /// # Errors
    /// The first thing that can't be.
    pub fn build(self) -> Result<Wiring, BuildError> {
        let parts = self.parts.borrow();
        if let Some(error) = &parts.error {
            return Err(error.clone());
        }
        let mut links = parts.links.clone();
        match &parts.execute {
            Some(execute) => {
                if let Some(plan) = &parts.plan {
                    links.push((format!("{execute}/plan"), format!("{plan}/plan")));
                    links.push((format!("{plan}/situation"), format!("{execute}/status")));
                }
                for model in &parts.reactive {
                    links.push((format!("{execute}/reflexes"), format!("{model}/reflex")));
                }
            }
            None => {
                if let Some(block) = parts.plan.iter().chain(&parts.reactive).next() {
                    return Err(BuildError::NoExecute { robot: parts.name.clone(), block: block.clone() });
                }
            }
        }
        Ok(Wiring { name: parts.name.clone(), modules: parts.modules.clone(), links })
    }
}
