//! Threads that serve and call services.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Builder, JoinHandle};

use rustdds::GUID;
use slate_blackboard::wake::Wake;
use slate_control::ControlSurface;
use slate_runtime::Composer;
use slate_topics::{AgentOperations, InboundTopic, InboundTopics, InboxHandler, answer_input, inbox};

use super::client::{CallContext, ServiceClient};
use super::server::{ServeContext, serve};
use super::{ServiceHandler, ServiceServer};
use crate::matches::{Matches, OwnEndpoint};
use crate::participant::RosParticipant;
use crate::settings::{RosSettings, TABLE};
use slate_topics::RosError;

/// Services that a thread answers, one request after the other.
pub struct ServiceGroup {
    pub name: &'static str,
    pub servers: Vec<ServiceServer>,
    pub handler: Box<dyn ServiceHandler>,
}

/// The services of an agent, and what serves and calls them.
#[derive(Default)]
pub struct ServiceThreads {
    groups: Vec<ServiceGroup>,
    clients: Vec<ServiceClient>,
    wakes: Vec<Arc<Wake>>,
    ended: Arc<AtomicBool>,
}

impl ServiceThreads {
    /// Offers inboxes, and finds the outboxes that call; inputs for responses are appended to `inputs`.
    ///
    /// # Errors
    /// When a port does not fit its service, or DDS refuses.
    pub fn open(
        participant: &RosParticipant,
        surface: &Arc<ControlSurface>,
        settings: &RosSettings,
        inputs: &mut Vec<InboundTopic>,
    ) -> Result<Self, RosError> {
        let composer = surface.agent.composer();
        let mut threads = Self::default();
        for offer in &settings.serve {
            let (property, pairs) = inbox(composer, offer)?;
            property.set_external(&format!("ros2:{}", offer.service));
            let servers = vec![ServiceServer::open(participant, &offer.service, &offer.of)?];
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
                    let depth = super::server::QUALITY.depth.into();
                    inputs.push(InboundTopic::new(&call.service, call.of.name(), input, &property, depth));
                    Some((inputs.len() - 1, pairs))
                }
            };
            threads.clients.push(ServiceClient::open(participant, composer, call, response)?);
        }
        Ok(threads)
    }

    /// Adds services that are answered in a thread of their own.
    pub fn add(&mut self, group: ServiceGroup) {
        self.groups.push(group);
    }

    /// Readers and writers of all services.
    pub fn guids(&self) -> impl Iterator<Item = (GUID, GUID)> {
        let servers = self.groups.iter().flat_map(|group| &group.servers).map(ServiceServer::guids);
        servers.chain(self.clients.iter().map(ServiceClient::guids))
    }

    /// GUIDs, topics and types of the same, for matching.
    pub fn endpoints(&self) -> impl Iterator<Item = (GUID, OwnEndpoint)> {
        let servers = self.groups.iter().flat_map(|group| &group.servers);
        let servers = servers.flat_map(ServiceServer::endpoints);
        servers.chain(self.clients.iter().flat_map(ServiceClient::endpoints))
    }

    /// Starts the threads; once.
    ///
    /// # Errors
    /// When no thread is left.
    pub fn start(
        &mut self,
        composer: &Composer,
        matches: &Arc<Matches>,
        inbound: &Arc<InboundTopics>,
    ) -> Result<Vec<JoinHandle<()>>, RosError> {
        let mut threads = Vec::new();
        for ServiceGroup { name, servers, handler } in self.groups.drain(..) {
            let wake = Arc::new(Wake::new());
            self.wakes.push(Arc::clone(&wake));
            let (composer, matches) = (composer.clone(), Arc::clone(matches));
            let context = ServeContext { composer, matches, wake, ended: Arc::clone(&self.ended) };
            threads.push(Builder::new().name(name.into()).spawn(move || serve(servers, handler, &context))?);
        }
        for client in self.clients.drain(..) {
            let context = CallContext {
                composer: composer.clone(),
                matches: Arc::clone(matches),
                inbound: Arc::clone(inbound),
                ended: Arc::clone(&self.ended),
            };
            threads.push(Builder::new().name("ros2-call".into()).spawn(move || client.run(&context))?);
        }
        Ok(threads)
    }

    /// Ends the threads.
    pub fn end(&self) {
        self.ended.store(true, Ordering::Release);
        self.wakes.iter().for_each(|wake| wake.notify(1));
    }
}
