//! Ports of actions, checked.

use std::sync::Arc;

use serde_json::{Value as Json, json};
use slate_blackboard::Property;
use slate_ros_messages::WireFormat;
use slate_runtime::{ExternalPorts, PropertyFacts};

use super::fit::{FittingPort, NamedPort};
use crate::action_settings::{ActionCall, ActionOffer};
use crate::message_type::MessageType;
use crate::mismatch::TopicMismatch;

/// Field of an interface that says whether a goal was reached.
const SUCCESS_FIELD: &str = "success";

/// Ports of an action that an agent offers.
#[derive(Debug)]
pub struct OfferedPorts<P = Arc<Property>> {
    /// Inbox that receives goals, with its pairs of fields.
    pub inbox: FittingPort<P>,
    /// Output that ends a goal, with its pairs of fields.
    pub result: FittingPort<P>,
    /// Output of feedback.
    pub feedback: Option<FittingPort<P>>,
    /// Inbox that cancels.
    pub cancel: Option<P>,
}

impl<P: PropertyFacts> OfferedPorts<P> {
    /// Finds the ports of an action.
    ///
    /// # Errors
    /// The first that is missing or does not fit.
    pub fn new(
        ports: &impl ExternalPorts<Property = P>,
        offer: &ActionOffer,
    ) -> Result<Self, Box<TopicMismatch>> {
        let port = |path| NamedPort { path, topic: &offer.action, place: offer.place };
        let feedback = offer.feedback.as_ref();
        let cancel = offer.cancel.as_ref().map(|cancel| {
            let none = MessageType::parse(WireFormat::Cdr, "action_msgs/srv/CancelGoal", "");
            let wrong = |reason| TopicMismatch::new(&cancel.inbox, &offer.action, reason, "name an inbox");
            let fit = port(&cancel.inbox).inbox(ports, &none.map_err(wrong)?, &cancel.value);
            fit.map(|(property, _)| property)
        });
        Ok(Self {
            inbox: port(&offer.inbox).inbox(ports, offer.action_type.goal(), &offer.value)?,
            result: port(&offer.result).output(ports, offer.action_type.result())?,
            feedback: feedback
                .map(|path| port(path).output(ports, offer.action_type.feedback()))
                .transpose()?,
            cancel: cancel.transpose()?,
        })
    }
}

impl OfferedPorts {
    /// Returns whether a value of the result's output reports the goal as reached.
    pub fn is_success(value: &Json) -> bool {
        value.get(SUCCESS_FIELD).and_then(Json::as_bool) != Some(false)
    }
}

/// Ports of an action that an outbox calls.
#[derive(Debug)]
pub struct CallingPorts<P = Arc<Property>> {
    /// Outbox whose messages are goals, with its pairs of fields.
    pub outbox: FittingPort<P>,
    /// Input that is set to results.
    pub result: Option<FittingPort<P>>,
    /// Input that is set to feedback.
    pub feedback: Option<FittingPort<P>>,
}

impl<P: PropertyFacts> CallingPorts<P> {
    /// Finds the ports of an action.
    ///
    /// # Errors
    /// The first that is missing or does not fit.
    pub fn new(
        ports: &impl ExternalPorts<Property = P>,
        call: &ActionCall,
    ) -> Result<Self, Box<TopicMismatch>> {
        let port = |path| NamedPort { path, topic: &call.action, place: call.place };
        let (result, feedback) = (call.result.as_ref(), call.feedback.as_ref());
        if let Some(cancel) = &call.cancel {
            port(cancel).message_port(ports)?;
        }
        Ok(Self {
            outbox: port(&call.outbox).outbox(ports, call.action_type.goal())?,
            result: result.map(|path| port(path).input(ports, call.action_type.result())).transpose()?,
            feedback: feedback
                .map(|path| port(path).input(ports, call.action_type.feedback()))
                .transpose()?,
        })
    }
}

impl CallingPorts {
    /// Returns the value of an input for results.
    /// It has whether the goal was reached, if the input has a field for that.
    pub fn result_value((property, pairs): &FittingPort, result: &Json, is_success: bool) -> Json {
        let has_field =
            property.descriptor().field(SUCCESS_FIELD).is_some() && result.get(SUCCESS_FIELD).is_none();
        pairs.value(result, &if has_field { json!({ SUCCESS_FIELD: is_success }) } else { Json::Null })
    }
}

/// Checks that the ports of actions exist and fit; opens nothing.
///
/// # Errors
/// The first that does not fit.
pub fn check_actions(
    ports: &impl ExternalPorts,
    offers: &[ActionOffer],
    calls: &[ActionCall],
) -> Result<(), Box<TopicMismatch>> {
    offers.iter().try_for_each(|offer| OfferedPorts::new(ports, offer).map(drop))?;
    calls.iter().try_for_each(|call| CallingPorts::new(ports, call).map(drop))
}
