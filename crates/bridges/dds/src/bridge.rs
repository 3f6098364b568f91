//! Agent that takes part in DDS.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Builder, JoinHandle};

use rustdds::GUID;
use slate_blackboard::wake::Wake;
use slate_control::ControlSurface;
use slate_module::Level;
use slate_runtime::Composer;
use slate_sorted::SortedMap;
use slate_topics::{
    InboundTopic, InboundTopics, OutboundStatus, OutboundTopic, PublishedTopic, TopicMessage, TopicStatus,
    join_threads, publish,
};

use crate::check::{topic_input, topic_output};
use crate::error::DdsError;
use crate::inbound::receive;
use crate::message::DdsMessage;
use crate::participant::{DdsParticipant, DdsReader, DdsSink};
use crate::settings::{DdsSettings, TABLE};
use crate::wire::{MatchWords, Matches, OwnEndpoint};

/// DDS calls both ends so.
const WORDS: MatchWords = MatchWords {
    scheme: TABLE,
    roles: ["writer", "reader"],
    message_name: |type_name| type_name.into(),
    help: "give the topic that type",
};

/// Topic that is read, and its messages.
type ReceivedTopic = (DdsReader, DdsMessage);

/// Topic that is written.
type SentTopic = PublishedTopic<DdsSink, DdsMessage>;

/// DDS participant of an agent, until dropped.
/// All of it runs in threads of its own: no tick waits for DDS.
pub struct DdsBridge {
    composer: Composer,
    participant: Arc<DdsParticipant>,
    matches: Arc<Matches>,
    inbound: Arc<InboundTopics>,
    /// Readers by index among the topics that are read.
    readers: Vec<GUID>,
    outbound: Vec<(GUID, OutboundStatus)>,
    waiting: Option<(Vec<ReceivedTopic>, Vec<SentTopic>)>,
    ended: Arc<AtomicBool>,
    /// Wakes of the threads that send and receive.
    wakes: [Arc<Wake>; 2],
    threads: Vec<JoinHandle<()>>,
}

impl std::fmt::Debug for DdsBridge {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("DdsBridge").field("agent", &self.composer.board().agent()).finish_non_exhaustive()
    }
}

impl TopicMessage for DdsMessage {
    fn encode(&self, bytes: &[u8], stamp: u64, frame: &str, message: &mut Vec<u8>) -> Result<(), String> {
        Self::encode(self, bytes, stamp, frame, message)
    }
}

impl DdsBridge {
    /// Joins a domain; values flow from [`start`](DdsBridge::start) on.
    /// Recordings that begin after this know that the inputs are filled from outside.
    ///
    /// # Errors
    /// A property does not fit its topic, or DDS refuses. The agent is as before then.
    pub fn open(surface: &Arc<ControlSurface>, settings: &DdsSettings) -> Result<Self, DdsError> {
        let composer = surface.agent.composer();
        let inputs = settings.topics.read.iter().map(|own| Ok((own, topic_input(composer, own)?)));
        let inputs = inputs.collect::<Result<Vec<_>, DdsError>>()?;
        let outputs = settings.topics.write.iter().map(|own| Ok((own, topic_output(composer, own)?)));
        let outputs = outputs.collect::<Result<Vec<_>, DdsError>>()?;
        let participant = DdsParticipant::join(settings.domain, settings.trusted)?;
        let matches = Arc::new(Matches::new(WORDS));
        let mut own = SortedMap::new();
        let (mut readers, mut topics, mut external) = (Vec::new(), Vec::new(), Vec::new());
        for (settings, (property, message)) in inputs {
            let topic = &settings.topic;
            let reader = participant.reader(topic, &message, &settings.quality)?;
            own.insert(reader.guid(), endpoint(topic, &message, true));
            let depth = settings.quality.quality.depth.into();
            topics.push(InboundTopic::new(topic, message.type_name(), &settings.input, &property, depth));
            external.push((property, format!("{TABLE}:{topic}")));
            readers.push((reader, message));
        }
        let mut writers = Vec::new();
        for (settings, (property, message)) in outputs {
            let sink = participant.writer(&settings.topic, &message, &settings.quality, &matches)?;
            own.insert(sink.guid(), endpoint(&settings.topic, &message, false));
            let topic =
                OutboundTopic::new(&settings.topic, message.type_name(), &settings.property, property);
            writers.push(PublishedTopic::new(topic, message, &settings.frame, sink));
        }
        external.iter().for_each(|(property, source)| property.set_external(source));
        matches.set_own(own);
        let outbound = writers.iter().map(|own| (own.sink().guid(), own.topic().status()));
        Ok(Self {
            composer: composer.clone(),
            participant: Arc::new(participant),
            matches,
            inbound: Arc::new(InboundTopics::new(TABLE, composer.clone(), topics)),
            readers: readers.iter().map(|(reader, _)| reader.guid()).collect(),
            outbound: outbound.collect(),
            waiting: Some((readers, writers)),
            ended: Arc::new(AtomicBool::new(false)),
            wakes: [Arc::new(Wake::new()), Arc::new(Wake::new())],
            threads: Vec::new(),
        })
    }

    /// Begins to send and to set inputs; once.
    ///
    /// # Errors
    /// No thread is left.
    pub fn start(&mut self) -> Result<(), DdsError> {
        let Some((readers, topics)) = self.waiting.take() else { return Ok(()) };
        let [send_wake, receive_wake] = self.wakes.clone();
        let wake = Arc::clone(&send_wake);
        if !self.composer.after_tick(Box::new(move || wake.notify(1))) {
            let text = "dds: values are looked at now and then only, as the agent was connected often before";
            self.composer.log(Level::Warn, text);
        }
        let spawn = |name: &str| Builder::new().name(name.into());
        let (composer, ended) = (self.composer.clone(), Arc::clone(&self.ended));
        let send = move || publish(TABLE, topics, &composer, &send_wake, &ended);
        self.threads.push(spawn("dds-send").spawn(send)?);
        let (inbound, matches) = (Arc::clone(&self.inbound), Arc::clone(&self.matches));
        let (participant, composer) = (Arc::clone(&self.participant), self.composer.clone());
        let ended = Arc::clone(&self.ended);
        let receive = move || {
            receive(readers, &inbound, &receive_wake, &ended, || {
                while let Some(event) = participant.next_status() {
                    matches.note(&event, &composer);
                }
            });
        };
        self.threads.push(spawn("dds-receive").spawn(receive)?);
        let inbound = Arc::clone(&self.inbound);
        self.threads.push(spawn("dds-set").spawn(move || inbound.deliver())?);
        Ok(())
    }

    /// Returns the status of the topics: first those read, then those written.
    pub fn topics(&self) -> Vec<TopicStatus> {
        let read = self.inbound.topics().iter().zip(&self.readers);
        let read = read.map(|(topic, guid)| topic.status(Some(self.matches.count(*guid))));
        let written = self.outbound.iter().map(|(guid, topic)| topic.status(Some(self.matches.count(*guid))));
        read.chain(written).collect()
    }
}

fn endpoint(topic: &str, message: &DdsMessage, is_reader: bool) -> OwnEndpoint {
    OwnEndpoint {
        topic: topic.to_owned(),
        wire: (topic.to_owned(), message.type_name().to_owned()),
        message: message.type_name().to_owned(),
        is_reader,
        type_hash: None,
    }
}

impl Drop for DdsBridge {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Release);
        self.inbound.end();
        self.wakes.iter().for_each(|wake| wake.notify(1));
        join_threads(&mut self.threads);
        self.inbound.release();
    }
}
