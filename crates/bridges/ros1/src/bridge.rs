//! Agent that takes part in ROS 1.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Builder, JoinHandle};

use slate_blackboard::wake::Wake;
use slate_control::ControlSurface;
use slate_module::Level;
use slate_ros_messages::WireFormat;
use slate_runtime::Composer;
use slate_topics::{
    InboundTopics, NodeAccess, OutboundStatus, OutboundTopic, PublishedTopic, RosError, RosMessage,
    SHUTDOWN_TIMEOUT, TopicOutput, TopicStatus, check_clock, join_threads, publish, topic_input,
    topic_output,
};
use tokio::runtime::Runtime;
use tokio::time::timeout;

use crate::frame_inputs::FrameSubscriptions;
use crate::input_list::InputList;
use crate::node_topics::NodeTopics;
use crate::outbound::PublicationSink;
use crate::parameters::ParameterSync;
use crate::services::{OutboxClient, servers};
use crate::settings::{Ros1Settings, SCHEME, TopicQueue};
use crate::wire::{NodeParts, RosNode, TopicPublication, TopicSubscription};

/// ROS 1 node of an agent, until dropped.
/// All of it runs in threads of its own: no tick waits for ROS.
pub struct Ros1Bridge {
    composer: Composer,
    surface: Arc<ControlSurface>,
    node: Arc<RosNode>,
    inbound: Arc<InboundTopics>,
    /// Paths of ports that are filled from outside.
    filled: Vec<String>,
    /// Subscriptions by index among the topics that are read.
    reading: Vec<Arc<TopicSubscription>>,
    outbound: Vec<(OutboundStatus, Arc<TopicPublication>)>,
    waiting: Option<WaitingParts>,
    /// Wakes of waiting threads.
    wakes: Vec<Arc<Wake>>,
    ended: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
    /// Runtime of the tasks that receive and send; `None` once it has ended.
    network: Option<Runtime>,
}

type WrittenTopic = PublishedTopic<PublicationSink>;

/// Parts that wait for the start.
struct WaitingParts {
    topics: Vec<WrittenTopic>,
    clients: Vec<OutboxClient>,
    node_topics: NodeTopics,
    parameters: Option<ParameterSync>,
}

impl std::fmt::Debug for Ros1Bridge {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Ros1Bridge").field("agent", &self.composer.board().agent()).finish_non_exhaustive()
    }
}

impl Ros1Bridge {
    /// Registers with the master; values flow from [`start`](Ros1Bridge::start) on.
    /// Recordings that begin after this know that the inputs are filled from outside.
    ///
    /// # Errors
    /// When a property does not fit its topic, or the master refuses or does not answer. The agent is as before then.
    pub fn open(surface: &Arc<ControlSurface>, settings: &Ros1Settings) -> Result<Self, RosError> {
        let composer = surface.agent.composer();
        check_clock(composer, &settings.options)?;
        let mut list = InputList::default();
        let mut messages = Vec::new();
        for own in &settings.topics.read {
            let (property, message) = topic_input(WireFormat::Ros1, composer, own)?;
            list.add(&own.input, property, (&own.topic, message.name()), own.quality.depth);
            messages.push(message);
        }
        let topics = settings
            .topics
            .write
            .iter()
            .map(|own| published(composer, own))
            .collect::<Result<Vec<_>, _>>()?;
        let calls = settings.call.iter().map(|call| OutboxClient::new(composer, call, &mut list));
        let clients = calls.collect::<Result<Vec<_>, _>>()?;
        let frames = FrameSubscriptions::new(composer, settings, &mut list)?;
        let node_topics = NodeTopics::new(surface, settings)?;
        let inbound =
            Arc::new(InboundTopics::new(SCHEME, composer.clone(), std::mem::take(&mut list.topics)));
        let reading = messages.into_iter().enumerate().map(|(at, message)| reading(&inbound, at, message));
        let reading = reading.collect::<Result<Vec<_>, _>>()?;
        let mut subscriptions = reading.clone();
        if let Some(frames) = frames {
            subscriptions.extend(frames.subscriptions(&inbound)?);
        }
        let publications = topics.iter().map(|own| Arc::clone(&own.sink().0));
        let parts = NodeParts {
            publications: publications.chain(node_topics.publications()).collect(),
            subscriptions,
            services: servers(surface, settings, &mut list)?,
            has_parameters: settings.options.parameters != NodeAccess::None,
        };
        let network = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
        let node = network.block_on(RosNode::open(settings, composer, parts));
        let node = node.map_err(|reason| {
            let network = format!("the master of ROS at {}", settings.master);
            let help = "start it with roscore, or name another one: [ros1] master = \"http://HOST:11311\"";
            RosError::Network { network, reason, help }
        })?;
        let parameters = ParameterSync::new(surface, settings, &node.context)?;
        list.sources.iter().for_each(|(property, source)| property.set_external(source));
        Ok(Self {
            composer: composer.clone(),
            surface: Arc::clone(surface),
            node,
            inbound,
            reading,
            filled: list.sources.iter().map(|(property, _)| property.path().to_owned()).collect(),
            outbound: topics.iter().map(|own| (own.topic().status(), Arc::clone(&own.sink().0))).collect(),
            waiting: Some(WaitingParts { topics, clients, node_topics, parameters }),
            wakes: Vec::new(),
            ended: Arc::new(AtomicBool::new(false)),
            threads: Vec::new(),
            network: Some(network),
        })
    }

    /// Begins to send and to set inputs; once.
    ///
    /// # Errors
    /// When no thread is left.
    pub fn start(&mut self) -> Result<(), RosError> {
        let (Some(parts), Some(network)) = (self.waiting.take(), &self.network) else { return Ok(()) };
        let WaitingParts { topics, clients, node_topics, parameters } = parts;
        let (send, look) = (Arc::new(Wake::new()), Arc::new(Wake::new()));
        self.wakes = vec![Arc::clone(&send), Arc::clone(&look)];
        let wakes = self.wakes.clone();
        if !self.composer.after_tick(Box::new(move || wakes.iter().for_each(|wake| wake.notify(1)))) {
            let text =
                "ros1: values are looked at now and then only, as the agent was connected often before";
            self.composer.log(Level::Warn, text);
        }
        let handle = network.handle().clone();
        let entered = handle.enter();
        self.node.start();
        drop(entered);
        let spawn = |name: &str| Builder::new().name(name.into());
        let (composer, ended) = (self.composer.clone(), Arc::clone(&self.ended));
        let publish = move || publish(SCHEME, topics, &composer, &send, &ended);
        self.threads.push(spawn("ros1-send").spawn(publish)?);
        let inbound = Arc::clone(&self.inbound);
        self.threads.push(spawn("ros1-set").spawn(move || inbound.deliver())?);
        if !node_topics.is_empty() {
            let (surface, ended) = (Arc::clone(&self.surface), Arc::clone(&self.ended));
            self.threads.push(spawn("ros1-node").spawn(move || node_topics.run(&surface, &look, &ended))?);
        }
        if let Some(parameters) = parameters {
            let (network, ended) = (handle.clone(), Arc::clone(&self.ended));
            self.threads.push(spawn("ros1-parameters").spawn(move || parameters.run(&network, &ended))?);
        }
        for client in clients {
            let (node, inbound) = (Arc::clone(&self.node.context), Arc::clone(&self.inbound));
            let (network, ended) = (handle.clone(), Arc::clone(&self.ended));
            self.threads
                .push(spawn("ros1-call").spawn(move || client.run(&node, &inbound, &network, &ended))?);
        }
        Ok(())
    }

    /// Returns the status of the topics: first those read, then those written.
    pub fn topics(&self) -> Vec<TopicStatus> {
        let read = self.inbound.topics().iter().zip(&self.reading);
        let read = read.map(|(topic, own)| topic.status(Some(own.publishers())));
        let written = self.outbound.iter().map(|(topic, own)| {
            let status = topic.status(Some(own.subscribers()));
            TopicStatus { dropped: status.dropped + own.lost(), ..status }
        });
        read.chain(written).collect()
    }
}

/// Returns the subscription whose messages fill the input at a place.
fn reading(
    inbound: &Arc<InboundTopics>,
    place: usize,
    message: RosMessage,
) -> Result<Arc<TopicSubscription>, RosError> {
    let topic = inbound.topics()[place].topic().to_owned();
    let (name, definition) = (message.name().to_owned(), message.definition().to_owned());
    let inbound = Arc::clone(inbound);
    let sink = move |bytes: Result<&[u8], String>| {
        let value = bytes.and_then(|bytes| message.decode(bytes).map_err(|error| error.to_string()));
        inbound.push(place, value);
    };
    let own = TopicSubscription::new(&topic, (&name, &definition), Box::new(sink));
    own.map(Arc::new).map_err(|reason| RosError::definition(&topic, reason))
}

/// Returns the topic that has the values of a property.
fn published(composer: &Composer, own: &TopicOutput<TopicQueue>) -> Result<WrittenTopic, RosError> {
    let (property, message) = topic_output(WireFormat::Ros1, composer, own)?;
    let of = (message.name(), message.definition());
    let publication = TopicPublication::new(&own.topic, of, own.quality.depth.into(), own.quality.latched);
    let publication = publication.map_err(|reason| RosError::definition(&own.topic, reason))?;
    let topic = OutboundTopic::new(&own.topic, message.name(), &own.property, property);
    Ok(PublishedTopic::new(topic, message, &own.frame, PublicationSink(Arc::new(publication))))
}

impl Drop for Ros1Bridge {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Release);
        self.wakes.iter().for_each(|wake| wake.notify(1));
        self.node.context.parameter_wake.notify(1);
        self.inbound.end();
        join_threads(&mut self.threads);
        if let Some(network) = self.network.take() {
            // The master may be gone before.
            let _ = network.block_on(async { timeout(SHUTDOWN_TIMEOUT, self.node.unregister()).await });
            network.shutdown_timeout(SHUTDOWN_TIMEOUT);
        }
        for path in &self.filled {
            if let Some((property, _)) = self.composer.board().get(path) {
                property.set_external("");
            }
        }
    }
}
