//! Transforms of `/tf` and `/tf_static` as values of inputs.

use std::sync::Arc;

use slate_ros_messages::{WireFormat, transforms_definition_in};
use slate_runtime::Composer;
use slate_topics::{FrameReader, InboundTopics, frame_input};

use crate::input_list::InputList;
use crate::node_topics::{FIXED, MOVING};
use crate::settings::{Ros1Settings, SCHEME};
use crate::wire::TopicSubscription;
use slate_topics::RosError;

/// Queue size of the listeners, as in ROS.
const DEPTH: u16 = 100;

/// Inputs that read transforms.
pub struct FrameSubscriptions(FrameReader);

impl FrameSubscriptions {
    /// Creates the inputs of settings; they are added to a list.
    ///
    /// # Errors
    /// When an input does not hold a transform.
    pub fn new(
        composer: &Composer,
        settings: &Ros1Settings,
        list: &mut InputList,
    ) -> Result<Option<Self>, RosError> {
        let definition = transforms_definition_in(WireFormat::Ros1);
        let mut frames = Vec::new();
        for own in &settings.options.frames {
            let property = frame_input(composer, own)?;
            let place = list.add(&own.input, property, (MOVING, &definition.name), DEPTH);
            frames.push((own.frame.clone(), place));
        }
        if frames.is_empty() {
            return Ok(None);
        }
        let reader = FrameReader::new(WireFormat::Ros1, composer, frames);
        reader
            .map(|reader| Some(Self(reader)))
            .map_err(|reason| RosError::definition(&definition.name, reason))
    }

    /// Creates the subscriptions of both topics, which fill the inputs.
    ///
    /// # Errors
    /// When their message has no definition.
    pub fn subscriptions(
        self,
        inbound: &Arc<InboundTopics>,
    ) -> Result<Vec<Arc<TopicSubscription>>, RosError> {
        let definition = transforms_definition_in(WireFormat::Ros1);
        let reader = Arc::new(self.0);
        let subscription = |(topic, is_fixed): (&'static str, bool)| {
            let (reader, inbound) = (Arc::clone(&reader), Arc::clone(inbound));
            let sink = move |message: Result<&[u8], String>| {
                if let Err(reason) = message.and_then(|message| reader.take(message, is_fixed, &inbound)) {
                    inbound.log_once(&format!("{SCHEME}: a transform of {topic} does not fit: {reason}"));
                }
            };
            let own = TopicSubscription::new(topic, (&definition.name, &definition.text), Box::new(sink));
            own.map(Arc::new).map_err(|reason| RosError::definition(topic, reason))
        };
        [(MOVING, false), (FIXED, true)].into_iter().map(subscription).collect()
    }
}
