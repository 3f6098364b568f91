//! An agent that takes part in ROS.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Builder, JoinHandle};

use slate_blackboard::wake::Wake;
use slate_control::ControlSurface;
use slate_module::Level;
use slate_record::ros::WireFormat::Cdr as CDR;
use slate_runtime::Composer;
use slate_topics::{
    InboundTopic, InboundTopics, OutboundStatus, OutboundTopic, PublishedTopic, RosError, TopicStatus,
    check_clock, join_threads, publish, topic_input, topic_output,
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

/// An agent as a node of ROS, until this is dropped. All of it runs in threads of its own: no tick waits for ROS.
pub struct RosBridge {
    composer: Composer,
    node_wire: Arc<dyn NodeWire>,
    inbound: Arc<InboundTopics>,
    /// By place among those that are read.
    readers: Vec<Arc<dyn TopicReader>>,
    outbound: Vec<(Arc<dyn TopicWriter>, OutboundStatus)>,
    wake: Arc<Wake>,
    ended: Arc<AtomicBool>,
    waiting: Option<(TopicReaders, Vec<PublishedTopic<WriterSink>>)>,
    services: ServiceThreads,
    surface: Arc<ControlSurface>,
    node: Option<NodeTopics>,
    frames: Option<FrameInputs>,
    /// Of threads that wait for something else than values.
    wakes: Vec<Arc<Wake>>,
    threads: Vec<JoinHandle<()>>,
}

impl std::fmt::Debug for RosBridge {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RosBridge").field("agent", &self.composer.board().agent()).finish_non_exhaustive()
    }
}

impl RosBridge {
    /// Joins a domain. Values go and come from [`start`](RosBridge::start) on; recordings that begin after this know that
    /// the inputs are filled from outside.
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
            let reader = wire.reader(&settings.topic, &WireType::from(&message), settings.quality)?;
            property.set_external(&format!("{TABLE}:{}", settings.topic));
            let (topic, depth) = (&settings.topic, settings.quality.depth.into());
            topics.push(InboundTopic::new(topic, message.name(), &settings.input, &property, depth));
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
        let outbound = writers.iter().map(|own| (Arc::clone(&own.sink().writer), own.topic().status()));
        Ok(Self {
            composer: composer.clone(),
            inbound: Arc::new(InboundTopics::new(TABLE, composer.clone(), topics)),
            readers: readers.iter().map(|(reader, _)| Arc::clone(reader)).collect(),
            outbound: outbound.collect(),
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
        let send = move || publish(TABLE, topics, &composer, &wake, &ended);
        self.threads.push(spawn("ros2-send").spawn(send)?);
        let inbound = Arc::clone(&self.inbound);
        let (node_wire, composer) = (Arc::clone(&self.node_wire), self.composer.clone());
        let look = move || node_wire.look(&composer);
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

    /// How the topics stand: those that are read, then those that are written.
    pub fn topics(&self) -> Vec<TopicStatus> {
        let read = self.inbound.topics().iter().zip(&self.readers);
        let read = read.map(|(topic, reader)| topic.status(Some(reader.publishers())));
        let written = self.outbound.iter().map(|(writer, topic)| topic.status(Some(writer.subscriptions())));
        read.chain(written).collect()
    }
}

impl Drop for RosBridge {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Release);
        self.wake.notify(1);
        self.inbound.end();
        self.services.end();
        self.wakes.iter().for_each(|wake| wake.notify(1));
        join_threads(&mut self.threads);
        self.inbound.release();
    }
}
