//! Threads that serve and call services and actions.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Builder, JoinHandle};

use slate_blackboard::wake::Wake;
use slate_control::ControlSurface;
use slate_runtime::Composer;
use slate_topics::{AgentOperations, InboundTopic, InboundTopics, InboxHandler, answer_input, inbox};

use crate::actions::{ActionClient, ActionServer};
use crate::services::{CallContext, DEPTH, ServeContext, ServiceClient, ServiceGroup, ServiceServer, serve};
use crate::settings::{RosSettings, TABLE};
use crate::wire::NodeWire;
use slate_topics::RosError;

/// Services of an agent, with the threads that serve and call them.
#[derive(Default)]
pub struct ServiceThreads {
    groups: Vec<ServiceGroup>,
    clients: Vec<ServiceClient>,
    offered: Vec<(ActionServer, Arc<Wake>)>,
    called: Vec<ActionClient>,
    wakes: Vec<Arc<Wake>>,
    ended: Arc<AtomicBool>,
}

impl ServiceThreads {
    /// Offers inboxes as services, and finds the outboxes that call services.
    /// Inputs for responses are appended to `inputs`.
    ///
    /// # Errors
    /// When a port does not fit its service, or the middleware refuses.
    pub fn open(
        wire: &dyn NodeWire,
        surface: &Arc<ControlSurface>,
        settings: &RosSettings,
        inputs: &mut Vec<InboundTopic>,
    ) -> Result<Self, RosError> {
        let composer = surface.agent.composer();
        let mut threads = Self::default();
        for offer in &settings.serve {
            let (property, pairs) = inbox(composer, offer)?;
            property.set_external(&format!("ros2:{}", offer.service));
            let servers = vec![ServiceServer::open(wire, &offer.service, &offer.service_type)?];
            let operations = AgentOperations::new(surface, TABLE)?;
            let handler = Box::new(InboxHandler { offer: offer.clone(), pairs, operations });
            threads.groups.push(ServiceGroup { name: "ros2-serve", servers, handler });
        }
        for call in &settings.call {
            let response = match &call.response {
                None => None,
                Some(input) => {
                    let (property, pairs) = answer_input(composer, call, input)?;
                    property.set_external(&format!("ros2:{}", call.service));
                    inputs.push(InboundTopic::new(
                        &call.service,
                        call.service_type.name(),
                        input,
                        &property,
                        DEPTH,
                    ));
                    Some((inputs.len() - 1, pairs))
                }
            };
            threads.clients.push(ServiceClient::open(wire, composer, call, response)?);
        }
        for offer in &settings.offered_actions {
            let server = ActionServer::open(wire, surface, offer)?;
            threads.offered.push((server, Arc::new(Wake::new())));
        }
        for call in &settings.called_actions {
            threads.called.push(ActionClient::open(wire, composer, call, inputs)?);
        }
        Ok(threads)
    }

    /// Adds services that are answered in a thread of their own.
    pub fn add(&mut self, group: ServiceGroup) {
        self.groups.push(group);
    }

    /// Wakes of threads that look at values after each cycle.
    pub fn tick_wakes(&self) -> impl Iterator<Item = Arc<Wake>> {
        self.offered.iter().map(|(_, wake)| Arc::clone(wake))
    }

    /// Starts the threads; once.
    ///
    /// # Errors
    /// When no thread is left.
    pub fn start(
        &mut self,
        composer: &Composer,
        inbound: &Arc<InboundTopics>,
    ) -> Result<Vec<JoinHandle<()>>, RosError> {
        let mut threads = Vec::new();
        let spawn = |name: &str| Builder::new().name(name.into());
        let serving = |wake: Arc<Wake>| ServeContext {
            composer: composer.clone(),
            wake,
            ended: Arc::clone(&self.ended),
        };
        let calling = || CallContext {
            composer: composer.clone(),
            inbound: Arc::clone(inbound),
            ended: Arc::clone(&self.ended),
        };
        for ServiceGroup { name, servers, handler } in self.groups.drain(..) {
            let wake = Arc::new(Wake::new());
            self.wakes.push(Arc::clone(&wake));
            let context = serving(wake);
            threads.push(spawn(name).spawn(move || serve(servers, handler, &context))?);
        }
        for client in self.clients.drain(..) {
            let context = calling();
            threads.push(spawn("ros2-call").spawn(move || client.run(&context))?);
        }
        for (server, wake) in self.offered.drain(..) {
            self.wakes.push(Arc::clone(&wake));
            let context = serving(wake);
            threads.push(spawn("ros2-action").spawn(move || server.run(&context))?);
        }
        for client in self.called.drain(..) {
            let context = calling();
            threads.push(spawn("ros2-goals").spawn(move || client.run(&context))?);
        }
        Ok(threads)
    }

    /// Ends the threads.
    pub fn end(&self) {
        self.ended.store(true, Ordering::Release);
        self.wakes.iter().for_each(|wake| wake.notify(1));
    }
}
