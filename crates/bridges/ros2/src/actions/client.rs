//! Clients of actions: messages of outboxes as goals.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::task::Waker;
use std::time::{Duration, Instant};

use serde_json::{Value as Json, json};
use slate_blackboard::message::{ABANDONED, Answer, Receiver};
use slate_blackboard::wake::Wake;
use slate_module::Level;
use slate_runtime::Composer;
use slate_topics::{
    ActionCall, ActionType, CallingPorts, InboundTopic, ReaderWaker, RosError, json as value_of,
};

use super::{FEEDBACK, GoalState, goal_id, part, uuid};
use crate::services::{CallContext, ServiceCaller, receiver_of};
use crate::settings::TABLE;
use crate::wire::{NodeWire, RequestNumber, TopicReader, WireType};

/// Period of the check for messages.
const POLL_PERIOD: Duration = Duration::from_millis(5);

/// Refusal code of a goal that its server rejects.
const REJECTED: u16 = 1;

/// Refusal code of a cancel request without an active goal.
const NO_GOAL: u16 = 2;

/// Action that an outbox calls.
pub struct ActionClient {
    call: ActionCall,
    ports: CallingPorts,
    goals: ServiceCaller,
    results: ServiceCaller,
    cancels: ServiceCaller,
    feedback: Arc<dyn TopicReader>,
    /// Places of the inputs for result and feedback among those that the bridge sets.
    places: (Option<usize>, Option<usize>),
    /// Identity of the next goal: the node, then a number.
    next: ([u8; 12], u32),
    reported: Option<String>,
}

/// Ports of the agent while a client runs.
#[derive(Default)]
struct Outboxes {
    goals: Option<Receiver>,
    cancels: Option<Receiver>,
}

impl ActionClient {
    /// Opens a client of an action; its inputs are appended to `inputs`.
    ///
    /// # Errors
    /// When a port does not fit, or the middleware refuses.
    pub fn open(
        wire: &dyn NodeWire,
        composer: &Composer,
        call: &ActionCall,
        inputs: &mut Vec<InboundTopic>,
    ) -> Result<Self, RosError> {
        let ActionCall { action, action_type: of, .. } = call;
        let ports = CallingPorts::new(composer, call)?;
        let cancel = ActionType::cancel_goal().map_err(|reason| RosError::definition(action, reason))?;
        let mut place = |port: &Option<_>, path: &Option<String>| {
            let ((property, _), path): (&(Arc<slate_blackboard::Property>, _), _) =
                port.as_ref().zip(path.as_ref())?;
            property.set_external(&format!("{TABLE}:{action}"));
            inputs.push(InboundTopic::new(action, of.name(), path, property, FEEDBACK.depth.into()));
            Some(inputs.len() - 1)
        };
        let places = (place(&ports.result, &call.result), place(&ports.feedback, &call.feedback));
        let caller = |name, of| ServiceCaller::open(wire, &part(action, name), of);
        let message = WireType::from(of.feedback_message());
        let feedback = wire.reader(&part(action, "feedback"), &message, FEEDBACK)?;
        Ok(Self {
            call: call.clone(),
            ports,
            goals: caller("send_goal", of.send_goal())?,
            results: caller("get_result", of.get_result())?,
            cancels: caller("cancel_goal", &cancel)?,
            feedback,
            places,
            next: (wire.identity(), 0),
            reported: None,
        })
    }

    /// Sends the outbox's messages as goals, in sequence, until the end.
    pub fn run(mut self, context: &CallContext) {
        let wake = Arc::new(Wake::new());
        let waker = Waker::from(Arc::new(ReaderWaker(Arc::clone(&wake))));
        let mut outboxes = Outboxes::default();
        while !context.ended.load(Ordering::Acquire) {
            outboxes.goals = outboxes.goals.or_else(|| receiver_of(&context.composer, &self.call.outbox));
            if let Some(cancel) = &self.call.cancel {
                outboxes.cancels = outboxes.cancels.or_else(|| receiver_of(&context.composer, cancel));
            }
            answer_all(&mut outboxes.cancels, Answer::Refused(NO_GOAL));
            let Some(messages) = outboxes.goals.as_mut() else {
                wake.wait_timeout(POLL_PERIOD);
                continue;
            };
            if messages.collect() == 0 {
                wake.wait_timeout(POLL_PERIOD);
                continue;
            }
            let descriptor = self.ports.outbox.0.descriptor();
            let values = messages.messages().map(|own| value_of(descriptor, own.bytes(), own.items()));
            let values: Vec<_> = values.collect();
            for (place, value) in values.iter().enumerate() {
                let outcome = self.pursue(value, &mut outboxes.cancels, context, (&wake, &waker));
                let answer = outcome.unwrap_or_else(|reason| {
                    self.report(&context.composer, reason);
                    Answer::Refused(ABANDONED)
                });
                messages.answer(place, answer);
            }
            messages.release();
        }
    }

    /// Sends a goal, and waits until it has ended; returns the outcome of its message.
    #[allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]
    fn pursue(
        &mut self,
        value: &Json,
        cancels: &mut Option<Receiver>,
        context: &CallContext,
        (wake, waker): (&Wake, &Waker),
    ) -> Result<Answer, String> {
        let ActionCall { action, timeout, .. } = &self.call;
        let began = Instant::now();
        let is_ended = || context.ended.load(Ordering::Acquire);
        let is_late = || began.elapsed() > *timeout || is_ended();
        let has_server = || [&self.goals, &self.results].iter().all(|own| own.has_server());
        while !has_server() {
            if is_late() {
                return Err(format!("{action} has no server"));
            }
            wake.wait_timeout(POLL_PERIOD);
        }
        self.next.1 += 1;
        let mut id = [0; 16];
        id[..12].copy_from_slice(&self.next.0);
        id[12..].copy_from_slice(&self.next.1.to_be_bytes());
        let goal = self.ports.outbox.1.message(value);
        let sent = self.goals.send(&json!({ "goal_id": uuid(id), "goal": goal }))?;
        let response = loop {
            if let Some(response) = self.goals.take(sent, waker)? {
                break response;
            }
            if is_late() {
                return Err(format!("{action} has not answered within {timeout:?}"));
            }
            wake.wait_timeout(POLL_PERIOD);
        };
        if response["accepted"] != json!(true) {
            return Ok(Answer::Refused(REJECTED));
        }
        let request = self.results.send(&json!({ "goal_id": uuid(id) }))?;
        let mut canceling: Option<RequestNumber> = None;
        loop {
            self.forward_feedback(id, context, waker)?;
            if let Some(response) = self.results.take(request, waker)? {
                self.forward_feedback(id, context, waker)?;
                answer_all(cancels, Answer::Refused(NO_GOAL));
                return self.end(&response, context);
            }
            if canceling.is_none() && cancels.as_mut().is_some_and(|messages| messages.collect() > 0) {
                let info = json!({ "goal_id": uuid(id) });
                canceling = Some(self.cancels.send(&json!({ "goal_info": info }))?);
            }
            if let Some(sent) = canceling
                && let Some(response) = self.cancels.take(sent, waker)?
            {
                canceling = None;
                let code = response["return_code"].as_u64().and_then(|code| u16::try_from(code).ok());
                let answer =
                    if code == Some(0) { Answer::Done } else { Answer::Refused(code.unwrap_or(REJECTED)) };
                release(cancels, answer);
            }
            if is_ended() || !has_server() {
                release(cancels, Answer::Refused(ABANDONED));
                return Err(format!("the server of {action} has ended before its goal"));
            }
            wake.wait_timeout(POLL_PERIOD);
        }
    }

    /// Sets the input to the feedback of a goal.
    fn forward_feedback(&self, id: [u8; 16], context: &CallContext, waker: &Waker) -> Result<(), String> {
        self.feedback.set_waker(waker);
        while let Some(message) = self.feedback.take()? {
            let message = self.call.action_type.feedback_message().decode(&message)?;
            if goal_id(&message) == id
                && let (Some((_, pairs)), Some(place)) = (&self.ports.feedback, self.places.1)
            {
                context.inbound.push_json(place, &pairs.value(&message["feedback"], &Json::Null))?;
            }
        }
        Ok(())
    }

    /// Sets the input to a result; returns the outcome of the goal's message.
    fn end(&mut self, response: &Json, context: &CallContext) -> Result<Answer, String> {
        let state = response["status"].as_u64().unwrap_or_default();
        let is_success = state == GoalState::Succeeded as u64;
        if let (Some(port), Some(place)) = (&self.ports.result, self.places.0) {
            let value = CallingPorts::result_value(port, &response["result"], is_success);
            context.inbound.push_json(place, &value)?;
        }
        self.reported = None;
        Ok(if is_success { Answer::Done } else { Answer::Refused(u16::try_from(state).unwrap_or(REJECTED)) })
    }

    /// Logs a reason unless it was logged before.
    fn report(&mut self, composer: &Composer, reason: String) {
        if self.reported.as_ref() != Some(&reason) {
            let text = format!("ros2: a goal of /{} is lost: {reason}", self.call.outbox);
            composer.log(Level::Warn, &text);
            self.reported = Some(reason);
        }
    }
}

/// Answers all messages that wait.
fn answer_all(messages: &mut Option<Receiver>, answer: Answer) {
    if messages.as_mut().is_some_and(|own| own.collect() > 0) {
        release(messages, answer);
    }
}

/// Answers all messages that were collected.
fn release(messages: &mut Option<Receiver>, answer: Answer) {
    let Some(own) = messages else { return };
    let count = own.messages().len();
    (0..count).for_each(|place| own.answer(place, answer));
    own.release();
}
