//! Services by which a block would read or act past the rules of attachment.
#![allow(dead_code, reason = "ports are looked at and never read")]

use std::marker::PhantomData;

use serde::{Deserialize, Serialize};
use slate_composition::{Catalogue, LinkedConfiguration};
use slate_configuration::{Configuration, Options};
use slate_interfaces::Twist2;
use slate_mapek::prelude::*;
use slate_mapek::{actuator, analyze, execute, knowledge, monitor, plan, reactive, sensor};
use slate_module::aspect::{
    Actuators, Aspect, BlackBoard, Logger, Network, Plugins, Provider, Service, ServiceDescription, Settings,
    Synchronization, Threads, Transforms, service,
};
use slate_module::blackboard::interface::Descriptor;
use slate_module::prelude::*;
use slate_module::{ModuleKind, Plugin};

use crate::robot::Near;

/// The port for a service.
#[ports]
pub struct Uses<S: Service> {
    service: Aspect<S>,
}

/// Each of the blocks, with a service.
pub struct Curious<S>(PhantomData<fn() -> S>);

impl<S: Service> Sensor for Curious<S> {
    const NAME: &'static str = "curious";
    type Io = Uses<S>;
    type Params = ();
    type State = ();
    type Value = Near;

    fn get_data(_: &mut (), _: &Uses<S>, _: &(), _: &Tick) -> Option<Near> {
        None
    }
}

impl<S: Service> Monitor for Curious<S> {
    const NAME: &'static str = "curious";
    type Sensors = Uses<S>;
    type Params = ();
    type State = ();
    type Value = Near;

    fn interpret(_: &mut (), _: &Uses<S>, _: &(), _: &Tick) -> Option<Near> {
        None
    }
}

impl<S: Service> Analyze for Curious<S> {
    const NAME: &'static str = "curious";
    type Observed = Uses<S>;
    type Params = ();
    type State = ();
    type Value = Near;

    fn process(_: &mut (), _: &Uses<S>, _: &(), _: &Tick) -> Option<Near> {
        None
    }
}

impl<S: Service> Plan for Curious<S> {
    const NAME: &'static str = "curious";
    type Noticed = Uses<S>;
    type Params = ();
    type State = ();

    fn run(_: &mut (), _: &Uses<S>, _: &Situation<'_>, _: &(), _: &Tick, _: &mut Agenda<'_>) {}
}

impl<S: Service> ReactiveModel for Curious<S> {
    const NAME: &'static str = "curious";
    type Sensors = Uses<S>;
    type Params = ();
    type State = ();

    fn run(_: &mut (), _: &Uses<S>, _: &(), _: &Tick) -> Option<ActionRequest> {
        None
    }
}

impl<S: Service> Knowledge for Curious<S> {
    const NAME: &'static str = "curious";
    type Models = Uses<S>;
    type Params = ();
    type State = ();

    fn update(_: &mut (), _: &Uses<S>, _: &(), _: &Tick) {}
}

impl<S: Service> Actuator for Curious<S> {
    const NAME: &'static str = "curious";
    type Io = Uses<S>;
    type Params = ();
    type State = ();
    type Command = Twist2;
    const SAFE: Twist2 = Twist2::ZERO;

    fn apply(_: &mut (), _: &Twist2, _: &Uses<S>, _: &(), _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

#[derive(Serialize, Deserialize)]
pub struct Halt;

impl ActionKind for Halt {
    const KIND: &'static str = "Halt";
    type Arguments = ();

    fn start((): ()) -> Self {
        Self
    }
}

impl<S: Service> Action<Uses<S>> for Halt {
    fn act(&mut self, _: &Acting<'_, Uses<S>>) -> Step {
        Step::Done
    }
}

macro_rules! repertoires {
    ($($name:ident: $service:ty),+) => {$(
        repertoire! {
            pub enum $name for Uses<$service> as "curious" { Halt }
        }
    )+};
}
repertoires!(Opens: BlackBoard, Frames: Transforms, Commands: Actuators, Sets: Settings, Loads: Plugins, Talks: Network, Logs: Logger,
    Emits: Synchronization, Waits: Threads);

/// All blocks with a service but Execute, by name.
fn blocks<S: Service>() -> [(&'static str, ModuleKind); 7] {
    [
        ("a Sensor", sensor::<Curious<S>>()),
        ("a Monitor", monitor::<Curious<S>>()),
        ("an Analyze", analyze::<Curious<S>>()),
        ("a Plan", plan::<Curious<S>>()),
        ("a ReactiveModel", reactive::<Curious<S>>()),
        ("Knowledge", knowledge::<Curious<S>>()),
        ("an Actuator", actuator::<Curious<S>>()),
    ]
}

/// A robot with that one block, and other modules.
fn check_with(kind: ModuleKind, others: &[(&str, Plugin)]) -> Result<(), String> {
    let services = [
        ServiceDescription::of::<BlackBoard>(),
        ServiceDescription::of::<Transforms>(),
        ServiceDescription::of::<Actuators>(),
        ServiceDescription::of::<Settings>(),
        ServiceDescription::of::<Plugins>(),
        ServiceDescription::of::<Network>(),
        ServiceDescription::of::<Logger>(),
        ServiceDescription::of::<Synchronization>(),
        ServiceDescription::of::<Threads>(),
    ];
    let mut catalogue = Catalogue { services: services.into(), ..Catalogue::default() };
    catalogue.add(kind.into());
    let mut text = "[robots.r2.modules]\nit = { kind = \"curious\" }\n".to_owned();
    for (module, plugin) in others {
        catalogue.add(plugin.clone());
        text += &format!("{module}\n");
    }
    let configuration = Configuration::from_text("robot.toml", &text, &Options::default()).unwrap();
    let linked = LinkedConfiguration::new(&configuration, &catalogue, &|_| false);
    linked.check(&catalogue).map(drop).map_err(|report| report.to_string())
}

fn check(kind: ModuleKind) -> Result<(), String> {
    check_with(kind, &[])
}

/// The blocks that may have a service.
fn permitted<S: Service>(execute: ModuleKind) -> Vec<&'static str> {
    let all = blocks::<S>().into_iter().chain([("Execute", execute)]);
    all.filter_map(|(block, kind)| match check(kind) {
        Ok(()) => Some(block),
        Err(refusal) => {
            let says = format!("`/r2/it` can't have the service `{}`", S::DESCRIPTOR.name);
            assert!(refusal.contains(&says), "{block}: {refusal}");
            let article = block.rsplit(' ').next().unwrap();
            assert!(refusal.contains(&format!("{article} ")), "it names the rule of {block}: {refusal}");
            None
        }
    })
    .collect()
}

#[test]
fn no_block_opens_properties_at_run_time() {
    assert_eq!(permitted::<BlackBoard>(execute::<Opens>()), <[&str; 0]>::default());
    assert_eq!(permitted::<Transforms>(execute::<Frames>()), <[&str; 0]>::default());
    // These carry no values from module to module.
    assert_eq!(permitted::<Logger>(execute::<Logs>()).len(), 8);
    assert_eq!(permitted::<Synchronization>(execute::<Emits>()).len(), 8);
    assert_eq!(permitted::<Threads>(execute::<Waits>()).len(), 8);
}

#[test]
fn execute_alone_acts_by_services() {
    assert_eq!(permitted::<Settings>(execute::<Sets>()), ["Execute"]);
    assert_eq!(permitted::<Plugins>(execute::<Loads>()), ["Execute"]);
    assert_eq!(permitted::<Actuators>(execute::<Commands>()), ["Execute"]);
    assert_eq!(permitted::<Network>(execute::<Talks>()), ["a Sensor", "an Actuator", "Execute"]);
}

/// A service of a module.
#[repr(C)]
pub struct Camera {
    picture: u64,
}

// SAFETY: plain data, and without calls.
#[allow(unsafe_code, reason = "a service is one by its author's word")]
unsafe impl Service for Camera {
    const DESCRIPTOR: &'static Descriptor = &service::<Self>("camera 1", "Has pictures.");
}

#[ports]
pub struct Offers {
    camera: Provider<Camera>,
}

pub struct CameraDriver;

#[module(stage = SensorAcquire)]
impl Module for CameraDriver {
    type Io = Offers;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), _: &Offers, _: &(), _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

#[test]
fn the_service_of_a_driver_is_for_sensors_and_actuators() {
    let driver = [("[modules.camera]\nkind = \"camera_driver\"", Plugin::linked::<CameraDriver>())];
    for (block, kind) in blocks::<Camera>() {
        let refusal = check_with(kind, &driver).err();
        if ["a Sensor", "an Actuator"].contains(&block) {
            assert_eq!(refusal, None, "{block}");
        } else {
            let refusal = refusal.unwrap_or_else(|| panic!("{block} past a Sensor"));
            assert!(refusal.contains("`/r2/it` can't have the service `camera 1`"), "{refusal}");
        }
    }
}
