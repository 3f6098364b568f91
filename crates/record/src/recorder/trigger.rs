//! Events of a robot that save its last seconds.

use slate_blackboard::Stamp;
use slate_blackboard::interface::{Descriptor, FieldPath, Value, View, find};
use slate_runtime::configuration::FlightTrigger;

use super::channels::Channel;

/// Returns the watched fields of an interface if its values can fire the trigger.
fn fields(trigger: FlightTrigger, descriptor: &'static Descriptor) -> Option<Vec<FieldPath>> {
    let (name, fields): (_, &[&str]) = match trigger {
        FlightTrigger::Fault => ("ModuleState", &["panics", "condition"]),
        FlightTrigger::Stop => ("GateState", &["mode"]),
        FlightTrigger::Reflex => ("ExecuteStatus", &["reflexes"]),
    };
    // Others may have an interface of that name.
    let found = fields.iter().map(|field| find(descriptor, field).ok());
    (descriptor.name == name).then(|| found.collect::<Option<_>>()).flatten()
}

/// Detector of events that fire triggers.
pub(super) struct Triggers {
    wanted: Vec<FlightTrigger>,
    /// Watched fields by channel; `None` for a channel not looked at yet.
    watched: Vec<Option<Watched>>,
}

enum Watched {
    Not,
    For(WatchedFields),
}

/// Watched fields of a channel, and their last values.
struct WatchedFields {
    trigger: FlightTrigger,
    fields: Vec<FieldPath>,
    /// Last values of the fields, and their stamp.
    last: Vec<Value>,
    stamp: Stamp,
}

impl Triggers {
    pub fn new(wanted: &[FlightTrigger]) -> Self {
        Self { wanted: wanted.to_vec(), watched: Vec::new() }
    }

    /// Returns true if values of the channel can fire one of the triggers.
    pub fn uses_channel(wanted: &[FlightTrigger], channel: &Channel) -> bool {
        wanted.iter().any(|trigger| fields(*trigger, channel.descriptor).is_some())
    }

    /// Returns the trigger that a new value fires, if any.
    ///
    /// Values of several threads, such as those of a gate, may come in another order than they were written: an older one
    /// tells nothing.
    pub fn check(
        &mut self,
        channel: &Channel,
        id: u32,
        items: usize,
        stamp: Stamp,
        bytes: &[u8],
    ) -> Option<FlightTrigger> {
        let index = id as usize;
        if index >= self.watched.len() {
            self.watched.resize_with(index + 1, || None);
        }
        let wanted = &self.wanted;
        let watched = self.watched[index].get_or_insert_with(|| {
            let found = |trigger: &FlightTrigger| Some((*trigger, fields(*trigger, channel.descriptor)?));
            let found = wanted.iter().find_map(found);
            found.map_or(Watched::Not, |(trigger, fields)| {
                Watched::For(WatchedFields { trigger, fields, last: Vec::new(), stamp: Stamp::default() })
            })
        });
        let Watched::For(WatchedFields { trigger, fields, last, stamp: newest }) = watched else {
            return None;
        };
        if stamp.generation == newest.generation && stamp.sequence < newest.sequence {
            return None;
        }
        *newest = stamp;
        let view = View::new(channel.descriptor, bytes, items)?;
        let now: Vec<_> = fields.iter().filter_map(|field| view.at(field)).collect();
        let before = std::mem::replace(last, now);
        let number = |values: &[Value]| values.first().and_then(Value::as_integer).unwrap_or(0);
        let named = |values: &[Value], names: &[&str]| {
            values.last().and_then(Value::as_str).is_some_and(|own| names.contains(&own))
        };
        let has_grown = number(last) > number(&before);
        let happened = match trigger {
            FlightTrigger::Fault => {
                let is_faulty = |values| named(values, &["LATE", "FAULTED"]);
                has_grown || is_faulty(last) && !is_faulty(&before)
            }
            FlightTrigger::Stop => named(last, &["STOPPED"]) && !named(&before, &["STOPPED"]),
            FlightTrigger::Reflex => has_grown,
        };
        happened.then_some(*trigger)
    }
}
