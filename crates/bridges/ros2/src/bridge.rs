//! An agent that takes part in ROS.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use rustdds::GUID;
use slate_blackboard::wake::Wake;
use slate_control::ControlSurface;
use slate_module::Level;
use slate_runtime::Composer;

use crate::check::{check_clock, input, output};
use crate::error::RosError;
use crate::frame_inputs::FrameInputs;
use crate::inbound::{InboundTopic, InboundTopics};
use crate::matches::{Matches, OwnEndpoint};
use crate::message::RosMessage;
use crate::name::wire_topic;
use crate::node::NodeTopics;
use crate::outbound::{OutboundCounts, OutboundTopic, OutboundTopics};
use crate::parameters::parameter_services;
use crate::participant::{RosParticipant, TopicReader};
use crate::services::ServiceThreads;
use crate::settings::{RosSettings, TABLE};

/// How long the end waits for a thread that sets inputs.
const PATIENCE: Duration = Duration::from_secs(2);

/// How a topic of an agent stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TopicStatus {
    /// As ROS calls it.
    pub topic: String,
    /// As ROS calls it, such as `sensor_msgs/msg/LaserScan`.
    pub message: String,
    /// Path of the property.
    pub property: String,
    /// Whether the agent reads it.
    pub is_read: bool,
    /// Publishers or subscriptions that it is connected with.
    pub others: usize,
    /// Values that were set or sent.
    pub count: u64,
    /// Messages that did not fit.
    pub refused: u64,
    /// Values that were replaced by newer ones before they were set or sent.
    pub dropped: u64,
    /// Why the last message did not fit; nothing when it did.
    pub error: Option<String>,
}

/// An agent as a node of ROS, until this is dropped. All of it runs in threads of its own: no tick waits for ROS.
pub struct RosBridge {
    composer: Composer,
    participant: Arc<RosParticipant>,
    matches: Arc<Matches>,
    inbound: Arc<InboundTopics>,
    /// By place among those that are read.
    readers: Vec<GUID>,
    outbound: Vec<OutboundStatus>,
    wake: Arc<Wake>,
    ended: Arc<AtomicBool>,
    waiting: Option<(Vec<TopicReader>, Vec<OutboundTopic>)>,
    services: ServiceThreads,
    surface: Arc<ControlSurface>,
    node: Option<NodeTopics>,
    frames: Option<FrameInputs>,
    /// Of threads that wait for something else than values.
    wakes: Vec<Arc<Wake>>,
    threads: Vec<JoinHandle<()>>,
}

struct OutboundStatus {
    guid: GUID,
    topic: String,
    message: String,
    property: String,
    counts: Arc<OutboundCounts>,
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
    /// When a property does not fit its topic, or DDS refuses. The agent is as before then.
    pub fn open(surface: &Arc<ControlSurface>, settings: &RosSettings) -> Result<Self, RosError> {
        let composer = surface.agent.composer();
        let inputs = settings.read.iter().map(|own| Ok((own, input(composer, own)?)));
        let inputs = inputs.collect::<Result<Vec<_>, RosError>>()?;
        let outputs = settings.write.iter().map(|own| Ok((own, output(composer, own)?)));
        let outputs = outputs.collect::<Result<Vec<_>, RosError>>()?;
        let participant = RosParticipant::open(settings)?;
        let mut own = BTreeMap::new();
        let (mut readers, mut topics, mut guids) = (Vec::new(), Vec::new(), Vec::new());
        for (settings, (property, message)) in inputs {
            let reader = participant.reader(&settings.topic, message.name(), settings.quality)?;
            own.insert(reader.guid(), endpoint(&settings.topic, &message, true));
            guids.push(reader.guid());
            readers.push(reader);
            let capacity = property.channel().map_or(0, |channel| channel.shape().capacity);
            property.set_external(&format!("{TABLE}:{}", settings.topic));
            topics.push(InboundTopic::new(settings.clone(), message, capacity));
        }
        let mut writers = Vec::new();
        for (settings, (property, message)) in outputs {
            let writer = participant.writer(&settings.topic, message.name(), settings.quality)?;
            let topic = OutboundTopic::new(settings.clone(), message, writer, property);
            own.insert(topic.guid(), endpoint(&settings.topic, &topic.message, false));
            writers.push(topic);
        }
        let mut services = ServiceThreads::open(&participant, surface, settings, &mut topics)?;
        check_clock(composer, settings)?;
        let frames = FrameInputs::open(&participant, composer, settings, &mut topics)?;
        let node = NodeTopics::open(&participant, surface, settings)?;
        if let Some(group) = parameter_services(&participant, surface, settings)? {
            services.add(group);
        }
        own.extend(services.endpoints());
        let (mut all_readers, mut all_writers): (Vec<_>, Vec<_>) = services.guids().unzip();
        own.extend(frames.iter().flat_map(FrameInputs::endpoints));
        all_readers.extend(frames.iter().flat_map(FrameInputs::guids));
        all_readers.extend(&guids);
        all_writers.extend(node.guids());
        all_writers.extend(writers.iter().map(OutboundTopic::guid));
        participant.announce(&all_readers, &all_writers)?;
        let outbound = writers.iter().map(|topic| OutboundStatus {
            guid: topic.guid(),
            topic: topic.settings.topic.clone(),
            message: topic.message.name().to_owned(),
            property: topic.settings.property.clone(),
            counts: Arc::clone(&topic.counts),
        });
        Ok(Self {
            composer: composer.clone(),
            participant: Arc::new(participant),
            matches: Arc::new(Matches::new(own)),
            inbound: Arc::new(InboundTopics::new(composer.clone(), topics)),
            readers: guids,
            outbound: outbound.collect(),
            wake: Arc::new(Wake::new()),
            ended: Arc::new(AtomicBool::new(false)),
            waiting: Some((readers, writers)),
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
        let wakes = [wake, Arc::clone(&node_wake)];
        if !self.composer.after_tick(Box::new(move || wakes.iter().for_each(|wake| wake.notify(1)))) {
            let text =
                "ros2: values are looked at now and then only, as the agent was connected often before";
            self.composer.log(Level::Warn, text);
        }
        let outbound = OutboundTopics {
            topics,
            composer: self.composer.clone(),
            matches: Arc::clone(&self.matches),
            wake: Arc::clone(&self.wake),
            ended: Arc::clone(&self.ended),
        };
        let spawn = |name: &str| Builder::new().name(name.into());
        self.threads.push(spawn("ros2-send").spawn(move || outbound.run())?);
        let (inbound, matches) = (Arc::clone(&self.inbound), Arc::clone(&self.matches));
        let (participant, composer) = (Arc::clone(&self.participant), self.composer.clone());
        let look = move || {
            while let Some(event) = participant.next_status() {
                matches.note(&event, &composer);
            }
        };
        self.threads.push(spawn("ros2-receive").spawn(move || inbound.receive(&readers, look))?);
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
        self.threads.extend(self.services.start(&self.composer, &self.matches, &self.inbound)?);
        Ok(())
    }

    /// How the topics stand: those that are read, then those that are written.
    pub fn topics(&self) -> Vec<TopicStatus> {
        let count = |own: &std::sync::atomic::AtomicU64| own.load(Ordering::Relaxed);
        let read = self.inbound.topics.iter().zip(&self.readers).map(|(topic, guid)| TopicStatus {
            topic: topic.settings.topic.clone(),
            message: topic.message.name().to_owned(),
            property: topic.settings.input.clone(),
            is_read: true,
            others: self.matches.count(*guid),
            count: count(&topic.received),
            refused: count(&topic.refused),
            dropped: count(&topic.dropped),
            error: topic.error(),
        });
        let written = self.outbound.iter().map(|topic| TopicStatus {
            topic: topic.topic.clone(),
            message: topic.message.clone(),
            property: topic.property.clone(),
            is_read: false,
            others: self.matches.count(topic.guid),
            count: count(&topic.counts.sent),
            refused: 0,
            dropped: count(&topic.counts.thinned),
            error: None,
        });
        read.chain(written).collect()
    }
}

fn endpoint(topic: &str, message: &RosMessage, is_reader: bool) -> OwnEndpoint {
    OwnEndpoint {
        topic: topic.to_owned(),
        wire: (wire_topic(topic), message.type_name()),
        message: message.name().to_owned(),
        is_reader,
    }
}

impl Drop for RosBridge {
    #[allow(clippy::disallowed_methods, reason = "threads end by the machine's clock")]
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Release);
        self.wake.notify(1);
        self.inbound.end();
        self.services.end();
        self.wakes.iter().for_each(|wake| wake.notify(1));
        let began = Instant::now();
        for thread in self.threads.drain(..) {
            // One that waits for a cycle which does not end is left alone.
            while !thread.is_finished() && began.elapsed() < PATIENCE {
                std::thread::sleep(Duration::from_millis(2));
            }
            if thread.is_finished() {
                // One that panicked has ended, too.
                let _ = thread.join();
            }
        }
        for topic in &self.inbound.topics {
            if let Some((property, _)) = self.composer.board().get(&topic.settings.input) {
                property.set_external("");
            }
        }
    }
}
