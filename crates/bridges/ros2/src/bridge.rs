//! An agent that takes part in ROS.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

use rustdds::{GUID, RTPSEntity};
use slate_blackboard::wake::Wake;
use slate_control::ControlSurface;
use slate_module::Level;
use slate_record::ros::WireFormat::Cdr as CDR;
use slate_runtime::Composer;
use slate_topics::{
    AwaitedInput, CLOCK, ConnectionCount, InboundTopic, InboundTopics, LockstepTopics, OutboundStatus,
    OutboundTopic, PublishedTopic, PublishedTopics, RosError, RosMessage, TopicStatus, WaitPer, check_clock,
    join_threads, publish, topic_input, topic_output,
};

use crate::frame_inputs::FrameInputs;
use crate::inbound::TopicReaders;
use crate::lifecycle::lifecycle_services;
use crate::name::{message_name, type_name, wire_topic};
use crate::node::{CLOCK_MESSAGE, NodeTopics};
use crate::outbound::WriterSink;
use crate::parameters::parameter_services;
use crate::participant::RosParticipant;
use crate::settings::{RosSettings, TABLE};
use crate::threads::ServiceThreads;
use slate_dds::wire::{MatchWords, Matches, OwnEndpoint};

/// ROS calls both ends so.
const WORDS: MatchWords = MatchWords {
    scheme: TABLE,
    roles: ["publisher", "subscription"],
    message_name,
    advice: "use another topic or interface",
};

/// An agent as a node of ROS, until this is dropped. All of it runs in threads of its own: no tick waits for ROS.
pub struct RosBridge {
    composer: Composer,
    participant: Arc<RosParticipant>,
    matches: Arc<Matches>,
    inbound: Arc<InboundTopics>,
    /// By place among those that are read.
    readers: Vec<GUID>,
    outbound: Vec<(GUID, OutboundStatus)>,
    /// Inputs whose messages cycles wait for, until it is started.
    awaited: Vec<AwaitedInput>,
    /// What waits for them.
    lockstep: Arc<Mutex<Option<LockstepTopics<WriterSink, RosMessage>>>>,
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
    /// When a property does not fit its topic, or DDS refuses. The agent is as before then.
    pub fn open(surface: &Arc<ControlSurface>, settings: &RosSettings) -> Result<Self, RosError> {
        let composer = surface.agent.composer();
        let inputs = settings.topics.read.iter().map(|own| Ok((own, topic_input(CDR, composer, own)?)));
        let inputs = inputs.collect::<Result<Vec<_>, RosError>>()?;
        let outputs = settings.topics.write.iter().map(|own| Ok((own, topic_output(CDR, composer, own)?)));
        let outputs = outputs.collect::<Result<Vec<_>, RosError>>()?;
        let participant = RosParticipant::open(settings)?;
        let matches = Arc::new(Matches::new(WORDS));
        let mut own = BTreeMap::new();
        let (mut readers, mut topics, mut guids) = (Vec::new(), Vec::new(), Vec::new());
        for (settings, (property, message)) in inputs {
            let reader = participant.reader(&settings.topic, message.name(), settings.quality)?;
            own.insert(reader.guid(), endpoint(&settings.topic, &message, true));
            guids.push(reader.guid());
            property.set_external(&format!("{TABLE}:{}", settings.topic));
            let (topic, depth) = (&settings.topic, settings.quality.depth.into());
            let topic = InboundTopic::new(topic, message.name(), &settings.input, &property, depth);
            topics.push(if settings.wait.is_some() { topic.awaited() } else { topic });
            readers.push((reader, message));
        }
        let mut writers = Vec::new();
        for (settings, (property, message)) in outputs {
            let writer = participant.writer(&settings.topic, message.name(), settings.quality)?;
            own.insert(writer.guid(), endpoint(&settings.topic, &message, false));
            let topic = OutboundTopic::new(&settings.topic, message.name(), &settings.property, property);
            let is_transient_local = settings.quality.transient_local;
            let sink = WriterSink { writer, is_transient_local, matches: Arc::clone(&matches) };
            writers.push(PublishedTopic::new(topic, message, &settings.frame, sink));
        }
        let mut services = ServiceThreads::open(&participant, surface, settings, &mut topics)?;
        check_clock(composer, &settings.options)?;
        let frames = FrameInputs::open(&participant, composer, settings, &mut topics)?;
        let node = NodeTopics::open(&participant, surface, settings)?;
        own.extend(node.clock().map(|guid| (guid, clock_endpoint())));
        let groups = [
            parameter_services(&participant, surface, settings)?,
            lifecycle_services(&participant, surface, settings)?,
        ];
        groups.into_iter().flatten().for_each(|group| services.add(group));
        own.extend(services.endpoints());
        own.extend(frames.iter().flat_map(FrameInputs::endpoints));
        let side = |is_reader: bool| {
            own.iter().filter(move |(_, own)| own.is_reader == is_reader).map(|(guid, _)| *guid)
        };
        let all_readers: Vec<_> = side(true).collect();
        let all_writers: BTreeSet<_> = side(false).chain(node.guids()).collect();
        let all_writers: Vec<_> = all_writers.into_iter().collect();
        let lockstep = awaited_inputs(settings, &guids, &own, &matches);
        matches.set_own(own);
        participant.announce(&all_readers, &all_writers)?;
        let outbound = writers.iter().map(|own| (own.sink().guid(), own.topic().status()));
        Ok(Self {
            composer: composer.clone(),
            participant: Arc::new(participant),
            matches,
            inbound: Arc::new(InboundTopics::new(TABLE, composer.clone(), topics)),
            readers: guids,
            awaited: lockstep,
            lockstep: Arc::default(),
            outbound: outbound.collect(),
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
        let (inbound, matches) = (Arc::clone(&self.inbound), Arc::clone(&self.matches));
        let (participant, composer) = (Arc::clone(&self.participant), self.composer.clone());
        let look = move || {
            while let Some(event) = participant.next_status() {
                matches.note(&event, &composer);
            }
        };
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
        self.threads.extend(self.services.start(&self.composer, &self.matches, &self.inbound)?);
        Ok(())
    }

    /// Has cycles send what they write, and wait for messages.
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

    /// How the topics stand: those that are read, then those that are written.
    pub fn topics(&self) -> Vec<TopicStatus> {
        let read = self.inbound.topics().iter().zip(&self.readers);
        let read = read.map(|(topic, guid)| topic.status(Some(self.matches.count(*guid))));
        let written = self.outbound.iter().map(|(guid, topic)| topic.status(Some(self.matches.count(*guid))));
        read.chain(written).collect()
    }
}

fn clock_endpoint() -> OwnEndpoint {
    OwnEndpoint {
        topic: CLOCK.to_owned(),
        wire: (wire_topic(CLOCK), type_name(CLOCK_MESSAGE)),
        message: CLOCK_MESSAGE.to_owned(),
        is_reader: false,
        type_hash: None,
    }
}

fn endpoint(topic: &str, message: &RosMessage, is_reader: bool) -> OwnEndpoint {
    OwnEndpoint {
        topic: topic.to_owned(),
        wire: (wire_topic(topic), type_name(message.name())),
        message: message.name().to_owned(),
        is_reader,
        type_hash: message.type_hash(),
    }
}

/// Inputs whose messages cycles wait for, with the other ends of their topics.
fn awaited_inputs(
    settings: &RosSettings,
    readers: &[GUID],
    own: &BTreeMap<GUID, OwnEndpoint>,
    matches: &Arc<Matches>,
) -> Vec<AwaitedInput> {
    let connections = |guid: GUID| -> ConnectionCount {
        let matches = Arc::clone(matches);
        Box::new(move || matches.count(guid))
    };
    let mut inputs = Vec::new();
    for (place, (input, reader)) in settings.topics.read.iter().zip(readers).enumerate() {
        let Some(wait) = input.wait.clone() else { continue };
        let answered = match &wait.per {
            WaitPer::Topic(topic) => topic,
            WaitPer::Period(_) => CLOCK,
        };
        let writer = own.iter().find(|(_, own)| !own.is_reader && own.topic == *answered);
        inputs.push(AwaitedInput {
            place,
            wait,
            publishers: connections(*reader),
            subscriptions: writer.map(|(guid, _)| connections(*guid)),
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
