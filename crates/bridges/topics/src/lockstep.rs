//! Cycles in lockstep that wait for the messages of other nodes.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use slate_module::Level;
use slate_runtime::{CycleEnd, ExternalContent, ExternalValue};

use crate::inbound::InboundTopics;
use crate::published::{PublishedTopics, TopicMessage, TopicSink};
use crate::topic_wait::{CLOCK_TOPIC, TopicWait, WaitPer};

/// Time for a found node to find the agent, too, before the first value is sent.
const SETTLING_TIME: Duration = Duration::from_millis(300);

/// Period of the check whether nodes are present.
const CHECK_PERIOD: Duration = Duration::from_millis(10);

const SECOND: f64 = 1e9;

/// Counts the other ends of a topic.
pub type ConnectionCount = Box<dyn Fn() -> usize + Send + Sync>;

/// Input for whose messages cycles wait.
pub struct AwaitedInput {
    /// Index among [`InboundTopics`].
    pub index: usize,
    /// Messages for which cycles wait.
    pub wait: TopicWait,
    /// Publishers of its topic.
    pub publishers: ConnectionCount,
    /// Subscriptions of the topic that is answered, if any is.
    pub subscriptions: Option<ConnectionCount>,
    /// Lateness: its last message did not come.
    pub is_late: AtomicBool,
}

/// Topics of an agent in lockstep whose cycles wait for messages.
/// Values written in a cycle are sent at its end, and then one message is taken for each value or period that requests
/// one. So a run depends on the messages and on no node's speed.
pub struct LockstepTopics<S, M> {
    inbound: Arc<InboundTopics>,
    inputs: Vec<AwaitedInput>,
    published: PublishedTopics<S, M>,
    /// Publisher of the time, and of the other topics of a cycle.
    publish_node: Box<dyn FnMut() + Send>,
    ended: Arc<AtomicBool>,
    is_connected: bool,
    /// Time of the last cycle, ns.
    last: Option<u64>,
}

impl<S: TopicSink, M: TopicMessage> LockstepTopics<S, M> {
    /// Waits for messages of the inputs until `ended`, and sends the values of cycles.
    pub fn new(
        inbound: Arc<InboundTopics>,
        inputs: Vec<AwaitedInput>,
        published: PublishedTopics<S, M>,
        publish_node: Box<dyn FnMut() + Send>,
        ended: Arc<AtomicBool>,
    ) -> Self {
        Self { inbound, inputs, published, publish_node, ended, is_connected: false, last: None }
    }

    /// Sends the values of a cycle, waits for requested messages, and sets the inputs.
    ///
    /// # Errors
    /// A message that the run needs does not come; the reason in words.
    pub fn end_cycle(&mut self, cycle: &CycleEnd<'_>) -> Result<(), String> {
        if !std::mem::replace(&mut self.is_connected, true) {
            self.connect(cycle)?;
        }
        // In each cycle: the wall clock must not decide when a new property is sent.
        self.published.follow(self.inbound.composer());
        let written = self.published.written();
        self.published.send(self.inbound.composer());
        (self.publish_node)();
        let last = self.last.replace(cycle.now);
        let due = self.inputs.iter().map(|own| (own, own.due(last, cycle.now, &written)));
        for (own, count) in due {
            for _ in 0..count {
                if self.wait(own, cycle)? {
                    self.set(own, cycle);
                }
            }
        }
        Ok(())
    }

    fn continues(&self, cycle: &CycleEnd<'_>) -> bool {
        cycle.is_running() && !self.ended.load(Ordering::Acquire)
    }

    /// Waits for the peers of all topics that are waited for or answered.
    #[allow(clippy::disallowed_methods, reason = "nodes are found by the machine's clock")]
    fn connect(&self, cycle: &CycleEnd<'_>) -> Result<(), String> {
        let began = Instant::now();
        for own in &self.inputs {
            while let Some(missing) = own.missing(&self.inbound) {
                if !self.continues(cycle) {
                    return Ok(());
                }
                if began.elapsed() > own.wait.timeout {
                    self.note_late(own, cycle, true, &missing)?;
                    break;
                }
                std::thread::sleep(CHECK_PERIOD);
            }
        }
        std::thread::sleep(SETTLING_TIME);
        Ok(())
    }

    /// Waits for the message of an input; returns whether it has arrived.
    #[allow(clippy::disallowed_methods, reason = "nodes answer by the machine's clock")]
    fn wait(&self, own: &AwaitedInput, cycle: &CycleEnd<'_>) -> Result<bool, String> {
        let topic = &self.inbound.topics()[own.index];
        let lost = self.inbound.awaited().take_lost(own.index);
        if lost > 0 && !own.wait.continue_when_late {
            return Err(format!(
                "{}: /{} takes one message of {} for {}; {lost} more were dropped: let the node publish one \
                 message for each, or raise depth",
                self.inbound.scheme(),
                topic.input(),
                topic.topic(),
                own.per(),
            ));
        }
        let until = Instant::now() + own.wait.timeout;
        // A run that continues without a node does not wait for it in each cycle.
        let is_useless = || own.wait.continue_when_late && (own.publishers)() == 0;
        let continues = || self.continues(cycle) && !is_useless();
        if self.inbound.awaited().wait(own.index, until, continues) || !self.continues(cycle) {
            return Ok(true);
        }
        let reason = own.missing(&self.inbound).unwrap_or_else(|| match topic.error() {
            Some(error) => format!("its messages don't fit: {error}"),
            None => "its publisher is there and has not published one".into(),
        });
        self.note_late(own, cycle, !is_useless(), &reason).map(|()| false)
    }

    /// Handles a missing message: it ends the run, or adds a line to the log.
    fn note_late(
        &self,
        own: &AwaitedInput,
        cycle: &CycleEnd<'_>,
        has_waited: bool,
        reason: &str,
    ) -> Result<(), String> {
        let topic = &self.inbound.topics()[own.index];
        let waits = match has_waited {
            true => format!("waited {:?}", own.wait.timeout),
            false => "does not wait".into(),
        };
        let text = format!(
            "{}: /{} {waits} for a message of {} for {} after the cycle at {} s: {reason}",
            self.inbound.scheme(),
            topic.input(),
            topic.topic(),
            own.per(),
            cycle.now as f64 / SECOND,
        );
        if !own.wait.continue_when_late {
            return Err(format!(
                "{text}; start the node in time, raise timeout, or write late = \"continue\""
            ));
        }
        if !own.is_late.swap(true, Ordering::Relaxed) {
            self.inbound.composer().log(Level::Warn, &text);
        }
        Ok(())
    }

    /// Sets an input to its oldest message.
    /// If the run continues without late messages, it is set to all of them in order.
    fn set(&self, own: &AwaitedInput, cycle: &CycleEnd<'_>) {
        own.is_late.store(false, Ordering::Relaxed);
        let input: Arc<str> = self.inbound.topics()[own.index].input().into();
        while let Some(bytes) = self.inbound.awaited().take(own.index) {
            let value = ExternalValue { input: Arc::clone(&input), content: ExternalContent::Bytes(bytes) };
            self.inbound.note(own.index, cycle.set(&value).map_err(|error| error.to_string()));
            if !own.wait.continue_when_late {
                break;
            }
        }
    }
}

impl AwaitedInput {
    /// Returns the number of messages that a cycle requests.
    fn due(&self, last: Option<u64>, now: u64, written: &[String]) -> u64 {
        match &self.wait.per {
            WaitPer::Period(period) => last.map_or(0, |last| (now / period).saturating_sub(last / period)),
            WaitPer::Topic(topic) if topic == CLOCK_TOPIC => u64::from(last != Some(now)),
            WaitPer::Topic(topic) => u64::from(written.contains(topic)),
        }
    }

    /// Returns the missing other end, if any.
    fn missing(&self, inbound: &InboundTopics) -> Option<String> {
        if (self.publishers)() == 0 {
            return Some(format!("{} has no publisher", inbound.topics()[self.index].topic()));
        }
        let answered = match &self.wait.per {
            WaitPer::Topic(topic) => topic,
            WaitPer::Period(_) => CLOCK_TOPIC,
        };
        let is_missing = self.subscriptions.as_ref().is_some_and(|count| count() == 0);
        is_missing.then(|| format!("{answered} has no subscription"))
    }

    /// Returns the value or period of a message in words.
    fn per(&self) -> String {
        match &self.wait.per {
            WaitPer::Topic(topic) => format!("each of {topic}"),
            WaitPer::Period(period) => format!("each {:?}", Duration::from_nanos(*period)),
        }
    }
}
