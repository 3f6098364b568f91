//! Agent in a domain of DDS.

use std::net::{IpAddr, Ipv4Addr};

use rustdds::no_key::{DataWriter, SimpleDataReader};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, DomainParticipantStatusEvent,
    DomainParticipantStatusListener, GUID, Publisher, QosPolicies, QosPolicyBuilder, RTPSEntity, Subscriber,
    Topic, TopicKind,
};

use super::graph;
use crate::name::{NodeName, type_name, wire_topic};
use crate::settings::RosSettings;
use slate_dds::wire::{DiscoveryProbe, RawAdapter, RawMessage};
use slate_dds::{Representation, TopicQuality};
use slate_topics::RosError;

/// Reads a topic.
pub type RosDataReader = SimpleDataReader<RawMessage, RawAdapter>;

/// Writes a topic.
pub type RosDataWriter = DataWriter<RawMessage, RawAdapter>;

/// Participant of DDS with the node of an agent.
pub struct RosParticipant {
    node: NodeName,
    domain: u16,
    participant: DomainParticipant,
    publisher: Publisher,
    subscriber: Subscriber,
    graph: RosDataWriter,
    status: DomainParticipantStatusListener,
    probe: DiscoveryProbe,
}

impl RosParticipant {
    /// Joins the domain: on this machine, and on others if they are trusted.
    ///
    /// # Errors
    /// When DDS refuses.
    pub fn open(settings: &RosSettings) -> Result<Self, RosError> {
        Self::join(settings.domain, settings.trusted, settings.node.clone())
    }

    /// Joins a domain; see [`open`](RosParticipant::open).
    ///
    /// # Errors
    /// When DDS refuses.
    pub fn join(domain: u16, trusted: bool, node: NodeName) -> Result<Self, RosError> {
        let mut builder = DomainParticipantBuilder::new(domain);
        if !trusted {
            builder = builder.with_only_networks([IpAddr::V4(Ipv4Addr::LOCALHOST)]);
        }
        let participant = builder.build().map_err(|error| refused(domain, &error))?;
        let any = QosPolicyBuilder::new().build();
        let publisher = participant.create_publisher(&any).map_err(|error| refused(domain, &error))?;
        let subscriber = participant.create_subscriber(&any).map_err(|error| refused(domain, &error))?;
        let quality = TopicQuality { reliable: true, transient_local: true, depth: 1 };
        let topic = create_topic(&participant, graph::TOPIC.into(), graph::MESSAGE, quality)?;
        let graph = publisher
            .create_datawriter_no_key(&topic, Some(policies(quality)))
            .map_err(|error| refused(domain, &error))?;
        let status = participant.status_listener();
        let probe = DiscoveryProbe::start(&participant).map_err(|error| refused(domain, &error))?;
        Ok(Self { node, domain, participant, publisher, subscriber, graph, status, probe })
    }

    /// Reads a topic of ROS.
    ///
    /// # Errors
    /// When DDS refuses.
    pub fn reader(
        &self,
        topic: &str,
        message: &str,
        quality: TopicQuality,
    ) -> Result<RosDataReader, RosError> {
        self.reader_at(wire_topic(topic), message, quality)
    }

    /// Reads a topic of DDS.
    ///
    /// # Errors
    /// When DDS refuses.
    pub fn reader_at(
        &self,
        topic: String,
        message: &str,
        quality: TopicQuality,
    ) -> Result<RosDataReader, RosError> {
        let topic = create_topic(&self.participant, topic, message, quality)?;
        let reader = self.subscriber.create_simple_datareader_no_key(&topic, Some(policies(quality)));
        reader.map_err(|error| refused(self.domain, &error))
    }

    /// Writes a topic of ROS.
    ///
    /// # Errors
    /// When DDS refuses.
    pub fn writer(
        &self,
        topic: &str,
        message: &str,
        quality: TopicQuality,
    ) -> Result<RosDataWriter, RosError> {
        self.writer_at(wire_topic(topic), message, quality)
    }

    /// Writes a topic of DDS.
    ///
    /// # Errors
    /// When DDS refuses.
    pub fn writer_at(
        &self,
        topic: String,
        message: &str,
        quality: TopicQuality,
    ) -> Result<RosDataWriter, RosError> {
        let topic = create_topic(&self.participant, topic, message, quality)?;
        let writer = self.publisher.create_datawriter_no_key(&topic, Some(policies(quality)));
        writer.map_err(|error| refused(self.domain, &error))
    }

    /// Returns its identity.
    pub fn guid(&self) -> GUID {
        self.participant.guid()
    }

    /// Announces the node to others, with its readers and writers.
    ///
    /// # Errors
    /// When DDS refuses.
    pub fn announce(&self, readers: &[GUID], writers: &[GUID]) -> Result<(), RosError> {
        let message = graph::entities(self.participant.guid(), &self.node, readers, writers);
        self.graph.write(message, None).map_err(|error| refused(self.domain, &error))
    }

    /// Returns the next event of the domain, if any.
    pub fn next_status(&self) -> Option<DomainParticipantStatusEvent> {
        self.probe.next_event(&self.status)
    }
}

fn create_topic(
    participant: &DomainParticipant,
    name: String,
    message: &str,
    quality: TopicQuality,
) -> Result<Topic, RosError> {
    participant
        .create_topic(name, type_name(message), &policies(quality), TopicKind::NoKey)
        .map_err(|error| refused(participant.domain_id(), &error))
}

fn refused(domain: u16, error: &dyn std::fmt::Display) -> RosError {
    let help = "take another domain, or end programs that have its UDP ports, 7400 + 250 x domain: ss -lunp";
    let network = format!("DDS can't be used in domain {domain}");
    RosError::Network { network, reason: error.to_string(), help }
}

fn policies(quality: TopicQuality) -> QosPolicies {
    slate_dds::wire::policies(quality, quality.depth.into(), &[Representation::Xcdr1])
}
