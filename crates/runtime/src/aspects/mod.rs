//! Dependencies of modules that can be missing.
//! These are services of the host, and those that modules provide to each other.

mod actuators;
mod blackboard;
mod calls;
mod logger;
mod main_loop;
mod network;
mod plugins;
mod requests;
mod settings;
mod synchronization;
mod threads;
mod time_source;
mod transforms;

use std::sync::Arc;

use slate_blackboard::Board;
use slate_module::aspect::{self, Actuators, BlackBoard, Network, ServiceDescription, Transforms};

pub(crate) use plugins::{PluginChanges, PluginControl};
pub(crate) use settings::{SettingsChanges, SettingsControl};
use slate_engine::actuators::ActuatorList;
use slate_engine::clock::Clock;
use slate_engine::log::Logger;
use slate_engine::main_loop::Takeovers;
pub(crate) use slate_engine::service::{AspectPort, HostService, ProviderPort, ServiceSlot};
use slate_engine::synchronization::Synchronization;
pub(crate) use threads::{AbandonedThread, Closed, ThreadRegistry};
pub(crate) use time_source::{PlaceTime, TimePlace};
pub(crate) use transforms::followed;

/// Means of the services.
pub(crate) struct ServiceContext {
    pub board: Arc<Board>,
    pub actuators: Arc<ActuatorList>,
    /// Takeovers of the loop by modules.
    pub takeovers: Arc<Takeovers>,
    /// Time that a module has set, for the loop.
    pub time: Arc<TimePlace>,
    pub logger: Arc<Logger>,
    pub clock: Arc<Clock>,
    pub synchronization: Arc<Synchronization>,
    pub threads: Arc<ThreadRegistry>,
    pub plugins: Arc<PluginControl>,
    pub settings: Arc<SettingsControl>,
}

/// Constructor of a service for a module.
type ServiceMaker = fn(&ServiceContext, &Arc<str>) -> Box<dyn HostService>;

/// The services of the host.
const SERVICES: &[(ServiceDescription, ServiceMaker)] = &[
    (ServiceDescription::of::<Actuators>(), actuators::make),
    (ServiceDescription::of::<BlackBoard>(), blackboard::make),
    (ServiceDescription::of::<Network>(), network::make),
    (ServiceDescription::of::<Transforms>(), transforms::make),
    (ServiceDescription::of::<aspect::MainLoop>(), main_loop::make),
    (ServiceDescription::of::<aspect::TimeSource>(), time_source::make),
    (ServiceDescription::of::<aspect::Logger>(), logger::make),
    (ServiceDescription::of::<aspect::Plugins>(), plugins::make),
    (ServiceDescription::of::<aspect::Settings>(), settings::make),
    (ServiceDescription::of::<aspect::Synchronization>(), synchronization::make),
    (ServiceDescription::of::<aspect::Threads>(), threads::make),
];

/// Returns the descriptions of the host's services.
pub(crate) fn services() -> impl Iterator<Item = ServiceDescription> {
    SERVICES.iter().map(|(description, _)| *description)
}

/// Makes the host's service of a schema for a module.
pub(crate) fn service(
    schema: u64,
    service_context: &ServiceContext,
    module: &Arc<str>,
) -> Option<Box<dyn HostService>> {
    let (_, make) = SERVICES.iter().find(|(description, _)| description.descriptor.hash == schema)?;
    Some(make(service_context, module))
}

/// Makes a service, whose table has the address of the service as its context.
fn in_place<S>(make: impl FnOnce(*mut ()) -> S) -> Box<S> {
    let mut place = Box::<S>::new_uninit();
    let context = place.as_mut_ptr().cast();
    Box::write(place, make(context))
}

/// Returns a hash of a path for the digest, in place of an output's number.
/// Properties opened at run time have no order.
fn hash(path: &str) -> u32 {
    let hash =
        path.bytes().fold(0x811c_9dc5_u32, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193));
    hash | 1 << 31
}
