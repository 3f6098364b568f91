//! An agent that takes part in ROS 1.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use roslibrust_ros1::{NodeHandle, SubscriberAny};
use slate_blackboard::wake::Wake;
use slate_module::Level;
use slate_runtime::Composer;
use slate_topics::{InboundTopic, InboundTopics, OutboundStatus, OutboundTopic, TopicStatus};
use tokio::runtime::Runtime;
use tokio::time::timeout;

use crate::error::Ros1Error;
use crate::inbound::receive;
use crate::message::Ros1Message;
use crate::outbound::{PublishedTopic, PublishedTopics};
use crate::settings::{Ros1Settings, SCHEME};
use crate::topics::{input, output};

/// How long the master may take for an answer.
const MASTER: Duration = Duration::from_secs(5);

/// How long the end waits for threads.
const PATIENCE: Duration = Duration::from_secs(2);

/// An agent as a node of ROS 1, until this is dropped. All of it runs in threads of its own: no tick waits for ROS.
pub struct Ros1Bridge {
    composer: Composer,
    inbound: Arc<InboundTopics>,
    outbound: Vec<OutboundStatus>,
    wake: Arc<Wake>,
    ended: Arc<AtomicBool>,
    waiting: Option<Waiting>,
    threads: Vec<JoinHandle<()>>,
    /// Its tasks receive and send; nothing when it has ended.
    network: Option<Runtime>,
}

/// What is there before the start.
struct Waiting {
    node: NodeHandle,
    subscribers: Vec<(SubscriberAny, Ros1Message)>,
    topics: Vec<PublishedTopic>,
}

impl std::fmt::Debug for Ros1Bridge {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Ros1Bridge").field("agent", &self.composer.board().agent()).finish_non_exhaustive()
    }
}

impl Ros1Bridge {
    /// Registers with the master. Values go and come from [`start`](Ros1Bridge::start) on; recordings that begin after this know
    /// that the inputs are filled from outside.
    ///
    /// # Errors
    /// When a property does not fit its topic, or the master refuses or does not answer. The agent is as before then.
    pub fn open(composer: &Composer, settings: &Ros1Settings) -> Result<Self, Ros1Error> {
        let inputs = settings.read.iter().map(|own| input(composer, own).map(|found| (own, found)));
        let inputs = inputs.collect::<Result<Vec<_>, _>>()?;
        let outputs = settings.write.iter().map(|own| output(composer, own).map(|found| (own, found)));
        let outputs = outputs.collect::<Result<Vec<_>, _>>()?;
        let network = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
        let connect = async {
            let node = NodeHandle::new(&settings.master, &settings.node).await?;
            let (mut subscribers, mut publishers) = (Vec::new(), Vec::new());
            for (own, _) in &inputs {
                subscribers.push(node.subscribe_any(&own.topic, own.depth.into()).await?);
            }
            for (own, (_, message)) in &outputs {
                let (name, text) = (message.name(), message.definition());
                publishers
                    .push(node.advertise_any(&own.topic, name, text, own.depth.into(), own.latched).await?);
            }
            Ok::<_, roslibrust_ros1::NodeError>((node, subscribers, publishers))
        };
        let refused = |reason: String| Ros1Error::Master { master: settings.master.clone(), reason };
        let connected = network.block_on(async { timeout(MASTER, connect).await });
        let (node, subscribers, publishers) = connected
            .map_err(|_| refused(format!("it does not answer within {} s", MASTER.as_secs())))?
            .map_err(|error| refused(error.to_string()))?;
        let (mut inbound, mut reading) = (Vec::new(), Vec::new());
        for ((own, (property, message)), subscriber) in inputs.into_iter().zip(subscribers) {
            property.set_external(&format!("{SCHEME}:{}", own.topic));
            let depth = own.depth.into();
            inbound.push(InboundTopic::new(&own.topic, message.name(), &own.input, &property, depth));
            reading.push((subscriber, message));
        }
        let topics = outputs.into_iter().zip(publishers).map(|((own, (property, message)), publisher)| {
            let topic = OutboundTopic::new(&own.topic, message.name(), &own.property, property);
            PublishedTopic { topic, message, publisher, frame: own.frame.clone(), is_told: false }
        });
        let topics: Vec<_> = topics.collect();
        Ok(Self {
            composer: composer.clone(),
            inbound: Arc::new(InboundTopics::new(SCHEME, composer.clone(), inbound)),
            outbound: topics.iter().map(|own| own.topic.status()).collect(),
            wake: Arc::new(Wake::new()),
            ended: Arc::new(AtomicBool::new(false)),
            waiting: Some(Waiting { node, subscribers: reading, topics }),
            threads: Vec::new(),
            network: Some(network),
        })
    }

    /// Begins to send and to set inputs; once.
    ///
    /// # Errors
    /// When no thread is left.
    pub fn start(&mut self) -> Result<(), Ros1Error> {
        let (Some(Waiting { node, subscribers, topics }), Some(network)) =
            (self.waiting.take(), &self.network)
        else {
            return Ok(());
        };
        let wake = Arc::clone(&self.wake);
        if !self.composer.after_tick(Box::new(move || wake.notify(1))) {
            let text =
                "ros1: values are looked at now and then only, as the agent was connected often before";
            self.composer.log(Level::Warn, text);
        }
        for (place, (subscriber, message)) in subscribers.into_iter().enumerate() {
            let inbound = Arc::clone(&self.inbound);
            network.spawn(receive(node.clone(), subscriber, message, inbound, place));
        }
        let outbound = PublishedTopics {
            topics,
            composer: self.composer.clone(),
            wake: Arc::clone(&self.wake),
            ended: Arc::clone(&self.ended),
            network: network.handle().clone(),
        };
        let spawn = |name: &str| Builder::new().name(name.into());
        self.threads.push(spawn("ros1-send").spawn(move || outbound.run())?);
        let inbound = Arc::clone(&self.inbound);
        self.threads.push(spawn("ros1-set").spawn(move || inbound.deliver())?);
        Ok(())
    }

    /// How the topics stand: those that are read, then those that are written.
    pub fn topics(&self) -> Vec<TopicStatus> {
        let read = self.inbound.topics().iter().map(|topic| topic.status(None));
        read.chain(self.outbound.iter().map(|topic| topic.status(None))).collect()
    }
}

impl Drop for Ros1Bridge {
    #[allow(clippy::disallowed_methods, reason = "threads end by the machine's clock")]
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Release);
        self.wake.notify(1);
        self.inbound.end();
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
        self.waiting = None;
        if let Some(network) = self.network.take() {
            // Tells the master that the node is gone.
            network.shutdown_timeout(PATIENCE);
        }
        for topic in self.inbound.topics() {
            if let Some((property, _)) = self.composer.board().get(topic.input()) {
                property.set_external("");
            }
        }
    }
}
