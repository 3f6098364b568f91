//! Agent that takes part in ROS.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

use slate_blackboard::wake::Wake;
use slate_control::ControlSurface;
use slate_dds::TopicQuality;
use slate_module::Level;
use slate_ros_messages::WireFormat::Cdr as CDR;
use slate_runtime::Composer;
use slate_topics::{
    AwaitedInput, CLOCK_TOPIC, ConnectionCount, InboundTopic, InboundTopics, LockstepTopics, OutboundStatus,
    OutboundTopic, PublishedTopic, PublishedTopics, RosError, RosMessage, TopicStatus, WaitPer, check_clock,
    join_threads, publish, topic_input, topic_output,
};

use crate::frame_inputs::FrameInputs;
use crate::inbound::TopicReaders;
use crate::lifecycle::lifecycle_services;
use crate::node::NodeTopics;
use crate::outbound::WriterSink;
use crate::parameters::parameter_services;
use crate::settings::{RosSettings, TABLE};
use crate::threads::ServiceThreads;
use crate::wire::{self, NodeWire, TopicReader, TopicWriter, WireType};

/// Maximum number of messages that a reader keeps.
const MAX_DEPTH: u16 = 10_000;

/// ROS node of an agent, until dropped.
/// All of it runs in threads of its own: no tick waits for ROS, but cycles in lockstep wait for messages that the
/// settings name.
pub struct RosBridge {
    composer: Composer,
    node_wire: Arc<dyn NodeWire>,
    inbound: Arc<InboundTopics>,
    /// Readers by index among the topics that are read.
    readers: Vec<Arc<dyn TopicReader>>,
    outbound: Vec<(Arc<dyn TopicWriter>, OutboundStatus)>,
    /// Inputs for whose messages cycles wait, until it is started.
    awaited: Vec<AwaitedInput>,
    /// Topics for which cycles wait.
    lockstep: Arc<Mutex<Option<LockstepTopics<WriterSink, RosMessage>>>>,
    wake: Arc<Wake>,
    ended: Arc<AtomicBool>,
    waiting: Option<(TopicReaders, Vec<PublishedTopic<WriterSink>>)>,
    services: ServiceThreads,
    surface: Arc<ControlSurface>,
    node: Option<NodeTopics>,
    frames: Option<FrameInputs>,
    /// Wakes of threads that do not wait for values.
    wakes: Vec<Arc<Wake>>,
    threads: Vec<JoinHandle<()>>,
}

impl std::fmt::Debug for RosBridge {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RosBridge").field("agent", &self.composer.board().agent()).finish_non_exhaustive()
    }
}

impl RosBridge {
    /// Joins a domain; values flow from [`start`](RosBridge::start) on.
    /// Recordings that begin after this know that the inputs are filled from outside.
    ///
    /// # Errors
    /// When a property does not fit its topic, or the middleware refuses. The agent is as before then.
    pub fn open(surface: &Arc<ControlSurface>, settings: &RosSettings) -> Result<Self, RosError> {
        let composer = surface.agent.composer();
        let inputs = settings.topics.read.iter().map(|own| Ok((own, topic_input(CDR, composer, own)?)));
        let inputs = inputs.collect::<Result<Vec<_>, RosError>>()?;
        let outputs = settings.topics.write.iter().map(|own| Ok((own, topic_output(CDR, composer, own)?)));
        let outputs = outputs.collect::<Result<Vec<_>, RosError>>()?;
        let node_wire = wire::open(settings, composer)?;
        let wire = &*node_wire;
        let (mut readers, mut topics) = (Vec::new(), Vec::new());
        for (settings, (property, message)) in inputs {
            // One that is dropped before it is counted would pair all later ones with another value.
            let depth = if settings.wait.is_some() { MAX_DEPTH } else { settings.quality.depth };
            let quality = TopicQuality { depth, ..settings.quality };
            let reader = wire.reader(&settings.topic, &WireType::from(&message), quality)?;
            property.set_external(&format!("{TABLE}:{}", settings.topic));
            let (topic, depth) = (&settings.topic, settings.quality.depth.into());
            let topic = InboundTopic::new(topic, message.name(), &settings.input, &property, depth);
            topics.push(if settings.wait.is_some() { topic.awaited() } else { topic });
            readers.push((reader, message));
        }
        let mut writers = Vec::new();
        for (settings, (property, message)) in outputs {
            let writer = wire.writer(&settings.topic, &WireType::from(&message), settings.quality)?;
            let topic = OutboundTopic::new(&settings.topic, message.name(), &settings.property, property);
            let sink = WriterSink { writer, is_transient_local: settings.quality.transient_local };
            writers.push(PublishedTopic::new(topic, message, &settings.frame, sink));
        }
        let mut services = ServiceThreads::open(wire, surface, settings, &mut topics)?;
        check_clock(composer, &settings.options)?;
        let frames = FrameInputs::open(wire, composer, settings, &mut topics)?;
        let node = NodeTopics::open(wire, surface, settings)?;
        let groups =
            [parameter_services(wire, surface, settings)?, lifecycle_services(wire, surface, settings)?];
        groups.into_iter().flatten().for_each(|group| services.add(group));
        wire.announce()?;
        let topic_readers: Vec<_> = readers.iter().map(|(reader, _)| Arc::clone(reader)).collect();
        let outbound: Vec<_> =
            writers.iter().map(|own| (Arc::clone(&own.sink().writer), own.topic().status())).collect();
        Ok(Self {
            composer: composer.clone(),
            inbound: Arc::new(InboundTopics::new(TABLE, composer.clone(), topics)),
            awaited: awaited_inputs(settings, &topic_readers, &outbound, node.clock()),
            lockstep: Arc::default(),
            readers: topic_readers,
            outbound,
            node_wire,
            wake: Arc::new(Wake::new()),
            ended: Arc::new(AtomicBool::new(false)),
            waiting: Some((TopicReaders(readers), writers)),
            services,
            surface: Arc::clone(surface),
            node: Some(node),
            frames,
            wakes: Vec::new(),
            threads: Vec::new(),
        })
    }

    /// Begins to send and to set inputs; once.
    ///
    /// # Errors
    /// When no thread is left.
    pub fn start(&mut self) -> Result<(), RosError> {
        let Some((readers, topics)) = self.waiting.take() else { return Ok(()) };
        let (wake, node_wake) = (Arc::clone(&self.wake), Arc::new(Wake::new()));
        let mut wakes = vec![wake, Arc::clone(&node_wake)];
        wakes.extend(self.services.tick_wakes());
        if !self.composer.after_tick(Box::new(move || wakes.iter().for_each(|wake| wake.notify(1)))) {
            let text =
                "ros2: values are looked at now and then only, as the agent was connected often before";
            self.composer.log(Level::Warn, text);
        }
        let spawn = |name: &str| Builder::new().name(name.into());
        let (composer, wake, ended) =
            (self.composer.clone(), Arc::clone(&self.wake), Arc::clone(&self.ended));
        if self.awaited.is_empty() {
            let send = move || publish(TABLE, topics, &composer, &wake, &ended);
            self.threads.push(spawn("ros2-send").spawn(send)?);
        } else {
            self.wait_for_nodes(topics);
        }
        let inbound = Arc::clone(&self.inbound);
        let (node_wire, composer) = (Arc::clone(&self.node_wire), self.composer.clone());
        let look = move || node_wire.check_matches(&composer);
        let (wake, ended) = (Arc::new(Wake::new()), Arc::clone(&self.ended));
        self.wakes.push(Arc::clone(&wake));
        let receive = move || readers.receive(&inbound, &wake, &ended, look);
        self.threads.push(spawn("ros2-receive").spawn(receive)?);
        let inbound = Arc::clone(&self.inbound);
        self.threads.push(spawn("ros2-set").spawn(move || inbound.deliver())?);
        if let Some(node) = self.node.take().filter(|node| !node.is_empty()) {
            let (surface, wake, ended) =
                (Arc::clone(&self.surface), Arc::clone(&node_wake), Arc::clone(&self.ended));
            self.threads.push(spawn("ros2-node").spawn(move || node.run(&surface, &wake, &ended))?);
        }
        if let Some(frames) = self.frames.take() {
            let (inbound, ended, wake) =
                (Arc::clone(&self.inbound), Arc::clone(&self.ended), Arc::new(Wake::new()));
            self.wakes.push(Arc::clone(&wake));
            self.threads.push(spawn("ros2-frames").spawn(move || frames.run(&inbound, &wake, &ended))?);
        }
        self.wakes.push(node_wake);
        self.threads.extend(self.services.start(&self.composer, &self.inbound)?);
        Ok(())
    }

    /// Makes cycles send their written values, and wait for messages.
    fn wait_for_nodes(&mut self, topics: Vec<PublishedTopic<WriterSink>>) {
        let mut node = self.node.as_mut().map(NodeTopics::split_off_cycles).unwrap_or_default();
        let surface = Arc::clone(&self.surface);
        let lockstep = LockstepTopics::new(
            Arc::clone(&self.inbound),
            std::mem::take(&mut self.awaited),
            PublishedTopics::new(TABLE, topics),
            Box::new(move || node.publish(&surface)),
            Arc::clone(&self.ended),
        );
        *lock(&self.lockstep) = Some(lockstep);
        let lockstep = Arc::clone(&self.lockstep);
        self.composer.wait_after_cycles(Some(Box::new(move |cycle| {
            lock(&lockstep).as_mut().map_or(Ok(()), |topics| topics.end_cycle(cycle))
        })));
    }

    /// Returns the status of the topics: first those read, then those written.
    pub fn topics(&self) -> Vec<TopicStatus> {
        let read = self.inbound.topics().iter().zip(&self.readers);
        let read = read.map(|(topic, reader)| topic.status(Some(reader.publishers())));
        let written = self.outbound.iter().map(|(writer, topic)| topic.status(Some(writer.subscriptions())));
        read.chain(written).collect()
    }
}

/// Inputs for whose messages cycles wait, with the other ends of their topics.
fn awaited_inputs(
    settings: &RosSettings,
    readers: &[Arc<dyn TopicReader>],
    outbound: &[(Arc<dyn TopicWriter>, OutboundStatus)],
    clock: Option<&Arc<dyn TopicWriter>>,
) -> Vec<AwaitedInput> {
    let mut inputs = Vec::new();
    for (place, (input, reader)) in settings.topics.read.iter().zip(readers).enumerate() {
        let Some(wait) = input.wait.clone() else { continue };
        let written = |topic: &str| {
            let place = settings.topics.write.iter().position(|own| own.topic == topic)?;
            outbound.get(place).map(|(writer, _)| writer)
        };
        let writer = match &wait.per {
            WaitPer::Topic(topic) if topic != CLOCK_TOPIC => written(topic),
            WaitPer::Topic(_) | WaitPer::Period(_) => clock,
        };
        let reader = Arc::clone(reader);
        inputs.push(AwaitedInput {
            index: place,
            wait,
            publishers: Box::new(move || reader.publishers()),
            subscriptions: writer.map(|writer| -> ConnectionCount {
                let writer = Arc::clone(writer);
                Box::new(move || writer.subscriptions())
            }),
            is_late: AtomicBool::new(false),
        });
    }
    inputs
}

/// Locks data that stays intact when another thread panics with the lock.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Drop for RosBridge {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Release);
        *lock(&self.lockstep) = None;
        self.wake.notify(1);
        self.inbound.end();
        self.services.end();
        self.wakes.iter().for_each(|wake| wake.notify(1));
        join_threads(&mut self.threads);
        self.inbound.release();
    }
}
