//! Servers of actions.

use std::collections::VecDeque;
use std::sync::Arc;
use std::task::Waker;
use std::time::Duration;

use serde_json::{Map, Value as Json, json};
use slate_blackboard::interface::{Descriptor, Kind};
use slate_control::ControlSurface;
use slate_module::Level;
use slate_topics::{
    ActionOffer, ActionType, AgentOperations, FieldPairs, FittingPort, MessageType, OfferedPorts,
    OutboundTopic, ReaderWaker, RosError, date, json as value_of,
};

use super::{FEEDBACK, GoalState, STATUS, goal_id, part, uuid};
use crate::services::{ServeContext, ServiceServer, wait_for_start};
use crate::settings::TABLE;
use crate::wire::{NodeWire, Responder, TopicWriter, WireType};

/// Sleep time of a thread while no messages arrive.
const IDLE_PERIOD: Duration = Duration::from_millis(100);

/// Goals that have ended, and whose results are kept.
const KEPT_GOALS: usize = 32;

/// Requests for the result of one goal that wait at a time.
const MAX_WAITING: usize = 64;

/// Codes of the response to a cancel request, as in `action_msgs/srv/CancelGoal`.
const CANCEL_NONE: i8 = 0;
const CANCEL_REJECTED: i8 = 1;
const CANCEL_UNKNOWN_GOAL: i8 = 2;
const CANCEL_TERMINATED: i8 = 3;

/// Server of an action, backed by an inbox.
/// It has one goal at a time; others are rejected meanwhile.
pub struct ActionServer {
    offer: ActionOffer,
    operations: AgentOperations,
    goals: ServiceServer,
    results: ServiceServer,
    cancels: ServiceServer,
    feedback: Arc<dyn TopicWriter>,
    status: Arc<dyn TopicWriter>,
    status_message: MessageType,
    goal_pairs: FieldPairs,
    result_output: ActionOutput,
    feedback_output: Option<ActionOutput>,
    /// Goals, the newest last; all others have ended.
    known: VecDeque<KnownGoal>,
}

/// Output whose values a goal has.
struct ActionOutput {
    topic: OutboundTopic,
    descriptor: &'static Descriptor,
    pairs: FieldPairs,
}

impl ActionOutput {
    fn new(path: &str, message: &str, (property, pairs): FittingPort) -> Self {
        let descriptor = property.descriptor();
        Self { topic: OutboundTopic::new(path, message, path, property), descriptor, pairs }
    }

    /// Skips earlier values.
    fn skip(&mut self, context: &ServeContext) {
        self.topic.follow(&context.composer);
        self.topic.skip();
        // Debug outputs are computed from now on.
        let _ = self.topic.take(&context.composer);
    }

    /// Takes the newest value, if it was not taken before.
    fn take(&mut self, context: &ServeContext) -> Result<Option<Json>, String> {
        let Some(value) = self.topic.take(&context.composer)? else { return Ok(None) };
        let tail = value.bytes.len().saturating_sub(self.descriptor.size);
        let items = tail / self.descriptor.tail().map_or(1, Kind::size).max(1);
        Ok(Some(value_of(self.descriptor, &value.bytes, items)))
    }
}

struct KnownGoal {
    id: [u8; 16],
    /// Time of acceptance.
    stamp: Json,
    state: GoalState,
    result: Json,
    /// Requests for the result.
    waiting: Vec<Box<dyn Responder>>,
}

impl KnownGoal {
    fn is_active(&self) -> bool {
        matches!(self.state, GoalState::Executing | GoalState::Canceling)
    }

    fn info(&self) -> Json {
        json!({ "goal_id": uuid(self.id), "stamp": self.stamp })
    }

    fn response(&self) -> Json {
        json!({ "status": self.state as u8, "result": self.result })
    }
}

impl ActionServer {
    /// Offers an action.
    ///
    /// # Errors
    /// When a port does not fit, or the middleware refuses.
    pub fn open(
        wire: &dyn NodeWire,
        surface: &Arc<ControlSurface>,
        offer: &ActionOffer,
    ) -> Result<Self, RosError> {
        let composer = surface.agent.composer();
        let ActionOffer { action, action_type: of, .. } = offer;
        let ports = OfferedPorts::new(composer, offer)?;
        let source = format!("{TABLE}:{action}");
        let inboxes = [Some(&ports.inbox.0), ports.cancel.as_ref()];
        inboxes.into_iter().flatten().for_each(|property| property.set_external(&source));
        let wrong = |reason| RosError::definition(action, reason);
        let cancel = ActionType::cancel_goal().map_err(wrong)?;
        let status_message = ActionType::status().map_err(wrong)?;
        let service = |name, of| ServiceServer::open(wire, &part(action, name), of);
        let writer = |name, message: &MessageType, quality| {
            wire.writer(&part(action, name), &WireType::from(message), quality)
        };
        let feedback_output = ports.feedback.zip(offer.feedback.as_ref());
        Ok(Self {
            offer: offer.clone(),
            operations: AgentOperations::new(surface, TABLE)?,
            goals: service("send_goal", of.send_goal())?,
            results: service("get_result", of.get_result())?,
            cancels: service("cancel_goal", &cancel)?,
            feedback: writer("feedback", of.feedback_message(), FEEDBACK)?,
            status: writer("status", &status_message, STATUS)?,
            status_message,
            goal_pairs: ports.inbox.1,
            result_output: ActionOutput::new(&offer.result, of.result().name(), ports.result),
            feedback_output: feedback_output
                .map(|(port, path)| ActionOutput::new(path, of.feedback().name(), port)),
            known: VecDeque::new(),
        })
    }

    /// Serves until the end.
    pub fn run(mut self, context: &ServeContext) {
        let waker = Waker::from(Arc::new(ReaderWaker(Arc::clone(&context.wake))));
        wait_for_start(context);
        self.publish_status(context);
        while !context.is_ended() {
            let mut is_idle = true;
            if let Some((client, request)) = self.goals.take(&waker, context) {
                is_idle = false;
                let response = self.accept(&request, context);
                self.goals.reply(client, &response, context);
                self.publish_status(context);
            }
            if let Some((client, request)) = self.cancels.take(&waker, context) {
                is_idle = false;
                let response = self.cancel(&request["goal_info"]);
                self.cancels.reply(client, &response, context);
                self.publish_status(context);
            }
            if let Some((client, request)) = self.results.take(&waker, context) {
                is_idle = false;
                self.request_result(client, goal_id(&request), context);
            }
            if self.known.back().is_some_and(KnownGoal::is_active) {
                self.pursue(context);
            }
            if is_idle {
                context.wake.wait_timeout(IDLE_PERIOD);
            }
        }
    }

    /// Sends a goal to the inbox; returns the response.
    fn accept(&mut self, request: &Json, context: &ServeContext) -> Json {
        let stamp = stamp(context);
        let rejected = json!({ "accepted": false, "stamp": stamp });
        let id = goal_id(request);
        let is_known = self.known.iter().any(|goal| goal.id == id);
        if is_known || self.known.back().is_some_and(KnownGoal::is_active) {
            return rejected;
        }
        // Before the module receives the goal, as it may end it in the same cycle.
        self.result_output.skip(context);
        self.feedback_output.iter_mut().for_each(|output| output.skip(context));
        let message = self.goal_pairs.value(&request["goal"], &self.offer.value);
        if self.operations.carry_out("send", &[("path", &self.offer.inbox)], message).is_err() {
            return rejected;
        }
        if self.known.len() >= KEPT_GOALS {
            self.known.pop_front();
        }
        let (state, result) = (GoalState::Executing, Json::Object(Map::new()));
        self.known.push_back(KnownGoal { id, stamp: stamp.clone(), state, result, waiting: Vec::new() });
        json!({ "accepted": true, "stamp": stamp })
    }

    /// Cancels the goal that a request means.
    /// That of its identity, or any that was accepted before its time; all with neither.
    fn cancel(&mut self, info: &Json) -> Json {
        let id = goal_id(info);
        let time = |stamp: &Json| (stamp["sec"].as_i64(), stamp["nanosec"].as_i64());
        let until = time(&info["stamp"]);
        let has_time = until != (Some(0), Some(0));
        let code = |code: i8| json!({ "return_code": code });
        let named = self.known.iter().position(|goal| goal.id == id);
        if id != [0; 16] && named.is_none() {
            return code(CANCEL_UNKNOWN_GOAL);
        }
        let is_meant = |goal: &KnownGoal| {
            goal.id == id || (id == [0; 16] && !has_time) || (has_time && time(&goal.stamp) <= until)
        };
        let Some(goal) = self.known.back_mut().filter(|goal| goal.is_active() && is_meant(goal)) else {
            return code(if named.is_some() { CANCEL_TERMINATED } else { CANCEL_NONE });
        };
        let Some(cancel) = &self.offer.cancel else { return code(CANCEL_REJECTED) };
        if goal.state == GoalState::Executing
            && self.operations.carry_out("send", &[("path", &cancel.inbox)], cancel.value.clone()).is_err()
        {
            return code(CANCEL_REJECTED);
        }
        goal.state = GoalState::Canceling;
        json!({ "return_code": CANCEL_NONE, "goals_canceling": [goal.info()] })
    }

    /// Responds with the result of a goal, or when it ends.
    fn request_result(&mut self, client: Box<dyn Responder>, id: [u8; 16], context: &ServeContext) {
        let response = match self.known.iter_mut().find(|goal| goal.id == id) {
            Some(goal) if goal.is_active() => {
                if goal.waiting.len() < MAX_WAITING {
                    goal.waiting.push(client);
                }
                return;
            }
            Some(goal) => goal.response(),
            // Unknown, with an empty result.
            None => json!({ "status": 0 }),
        };
        self.results.reply(client, &response, context);
    }

    /// Publishes feedback of the active goal, and ends it when it has a result.
    fn pursue(&mut self, context: &ServeContext) {
        // The result first: feedback of the same cycle is published before it.
        let result = self.result_output.take(context);
        let feedback = self.feedback_output.as_mut().map_or(Ok(None), |output| output.take(context));
        let Some(goal) = self.known.back_mut() else { return };
        match feedback {
            Ok(None) => {}
            Ok(Some(value)) => {
                let pairs = self.feedback_output.as_ref().map(|output| output.pairs.message(&value));
                let message = json!({ "goal_id": uuid(goal.id), "feedback": pairs });
                let message = self.offer.action_type.feedback_message().encode(&message);
                let sent = message.and_then(|message| self.feedback.write(message));
                if let Err(reason) = sent {
                    report(context, &self.offer.action, &reason);
                }
            }
            Err(reason) => report(context, &self.offer.action, &reason),
        }
        match result {
            Ok(None) => {}
            Ok(Some(value)) => {
                goal.state = match goal.state {
                    GoalState::Canceling => GoalState::Canceled,
                    _ if OfferedPorts::is_success(&value) => GoalState::Succeeded,
                    _ => GoalState::Aborted,
                };
                goal.result = self.result_output.pairs.message(&value);
                let (response, waiting) = (goal.response(), std::mem::take(&mut goal.waiting));
                for client in waiting {
                    self.results.reply(client, &response, context);
                }
                self.publish_status(context);
            }
            Err(reason) => report(context, &self.offer.action, &reason),
        }
    }

    fn publish_status(&self, context: &ServeContext) {
        let state = |goal: &KnownGoal| json!({ "goal_info": goal.info(), "status": goal.state as u8 });
        let list: Vec<_> = self.known.iter().map(state).collect();
        let message = self.status_message.encode(&json!({ "status_list": list }));
        let sent = message.and_then(|message| self.status.write(message));
        if let Err(reason) = sent {
            report(context, &self.offer.action, &reason);
        }
    }
}

/// Returns the present time as a message.
/// That of the simulation in lockstep, else the date.
fn stamp(context: &ServeContext) -> Json {
    const SECOND: u64 = 1_000_000_000;
    let time = date(&context.composer, context.composer.now());
    json!({ "sec": time / SECOND, "nanosec": time % SECOND })
}

fn report(context: &ServeContext, action: &str, reason: &str) {
    context.composer.log(Level::Warn, &format!("ros2: the action {action}: {reason}"));
}
