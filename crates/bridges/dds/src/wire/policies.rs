//! Quality of service as RustDDS has it.

use rustdds::policy::{
    DataRepresentation, Durability, History, Reliability, ResourceLimits, XCDR_DATA_REPRESENTATION,
    XCDR2_DATA_REPRESENTATION,
};
use rustdds::{Duration, QosPolicies, QosPolicyBuilder};

use crate::quality::{Representation, TopicQuality};

/// Maximum time that a reliable writer waits for room, in its own thread.
const BLOCKING: Duration = Duration::from_millis(100);

/// Minimum number of values kept for late readers.
/// RustDDS cleans its caches every 6 s, so for so long it keeps more than the depth; with fewer it would wait for each
/// acknowledgement.
const KEPT: i32 = 64;

/// Returns the QoS policies of an endpoint that keeps `depth` values.
/// It reads or writes the given representations of messages.
pub fn policies(quality: TopicQuality, depth: i32, representations: &[Representation]) -> QosPolicies {
    let reliability = match quality.reliable {
        true => Reliability::Reliable { max_blocking_time: BLOCKING },
        false => Reliability::BestEffort,
    };
    let durability = if quality.transient_local { Durability::TransientLocal } else { Durability::Volatile };
    let mut policies = QosPolicyBuilder::new()
        .reliability(reliability)
        .durability(durability)
        .history(History::KeepLast { depth });
    if quality.transient_local {
        let kept = depth.max(KEPT);
        let limits = ResourceLimits { max_samples: kept, max_instances: 1, max_samples_per_instance: kept };
        policies = policies.resource_limits(limits);
    }
    if representations == [Representation::Xcdr1] {
        // The default, which old programs know without a word.
        return policies.build();
    }
    let value = representations.iter().map(|own| match own {
        Representation::Xcdr1 => XCDR_DATA_REPRESENTATION,
        Representation::Xcdr2 => XCDR2_DATA_REPRESENTATION,
    });
    policies.build().with_data_representation(DataRepresentation { value: value.collect() })
}
