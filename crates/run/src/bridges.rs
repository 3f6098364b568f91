//! Bridges of this program, by the schemes of the links that they carry.

use slate_network::NetworkSettings;
use slate_runtime::configuration::{Configuration, Diagnostic, ExternalDirection, Report, Span};

/// Bridge.
struct SchemeBridge {
    /// Scheme of its links.
    scheme: &'static str,
    /// Name of the middleware that it connects.
    name: &'static str,
    /// Feature that it needs, and whether this program has it.
    feature: (&'static str, bool),
}

const BRIDGES: [SchemeBridge; 4] = [
    SchemeBridge { scheme: "dds", name: "DDS", feature: ("dds", cfg!(feature = "dds")) },
    SchemeBridge { scheme: "ros1", name: "ROS 1", feature: ("ros1", cfg!(feature = "ros1")) },
    SchemeBridge { scheme: "ros2", name: "ROS 2", feature: ("ros2", cfg!(feature = "ros2")) },
    SchemeBridge {
        scheme: slate_network::SCHEME,
        name: "Zenoh",
        feature: ("zenoh", cfg!(feature = "zenoh")),
    },
];

/// Checks that this program has a bridge for each link to another program.
/// Such a program is not an agent. Also, each input must have one source.
///
/// # Errors
/// Schemes that are unknown or not built in, and inputs that two bridges would fill.
pub fn check_bridges(configuration: &Configuration) -> Result<(), Report> {
    let mut wrong = Vec::new();
    for link in configuration.external_links() {
        let url = &link.other.value;
        let bridge = BRIDGES.iter().find(|bridge| bridge.scheme == url.scheme);
        let (message, help) = match bridge {
            Some(SchemeBridge { feature: (_, true), .. }) => continue,
            Some(SchemeBridge { name, feature: (feature, false), .. }) => (
                format!("this program is built without {name}, which `{url}` needs"),
                format!(
                    "build it with the feature `{feature}`: cargo build --release --features {feature}; or remove the link"
                ),
            ),
            None => {
                let known: Vec<_> = BRIDGES.iter().map(|bridge| format!("{}:", bridge.scheme)).collect();
                (
                    format!("`{url}` has an unknown scheme"),
                    format!(
                        "available: {} and slate://; a property of this agent is module/property",
                        known.join(", ")
                    ),
                )
            }
        };
        wrong.push(configuration.diagnostic(link.other.span, message, Some(help)));
    }
    if wrong.is_empty() {
        wrong = two_bridges(configuration)?;
    }
    if wrong.is_empty() { Ok(()) } else { Err(Report::from(wrong)) }
}

/// Input, its source, and the place in the configuration.
type FilledInput = (String, String, Option<Span>);

/// Inputs that a bridge to ROS fills from topics, frames and responses of services.
#[cfg(any(feature = "ros1", feature = "ros2"))]
fn inputs_of_ros(
    name: &str,
    scheme: &str,
    topics: impl Iterator<Item = FilledInput>,
    frames: impl Iterator<Item = FilledInput>,
    services: impl Iterator<Item = FilledInput>,
) -> Vec<FilledInput> {
    let topics = topics.map(|(input, topic, place)| (input, format!("{scheme}:{topic}"), place));
    let frames = frames.map(|(input, frame, place)| (input, format!("frame {frame} of {name}"), place));
    let services =
        services.map(|(input, service, place)| (input, format!("the responses of {service}"), place));
    topics.chain(frames).chain(services).collect()
}

/// Inputs that a table and a link, or the tables of two bridges, would fill.
fn two_bridges(configuration: &Configuration) -> Result<Vec<Diagnostic>, Report> {
    let mut filled: Vec<FilledInput> = Vec::new();
    if let Some(network) = NetworkSettings::of(configuration)? {
        let inputs = network.read.into_iter();
        filled.extend(inputs.map(|(input, reading)| (input, reading.source.to_string(), reading.place)));
    }
    #[cfg(feature = "dds")]
    if let Some(dds) = slate_dds::DdsSettings::of(configuration)? {
        let source = |topic: &str| format!("{}:{topic}", slate_dds::TABLE);
        filled
            .extend(dds.topics.read.into_iter().map(|own| (own.input, source(&own.topic), Some(own.place))));
    }
    #[cfg(feature = "ros1")]
    if let Some(ros) = slate_ros1::Ros1Settings::of(configuration)? {
        let read = ros.topics.read.into_iter().map(|own| (own.input, own.topic, Some(own.place)));
        filled.extend(inputs_of_ros(
            "ROS 1",
            slate_ros1::SCHEME,
            read,
            ros.options.frames.into_iter().map(|own| (own.input, own.frame, own.place)),
            ros.call.into_iter().filter_map(|own| Some((own.response?, own.service, own.place))),
        ));
    }
    #[cfg(feature = "ros2")]
    if let Some(ros) = slate_ros2::RosSettings::of(configuration)? {
        let read = ros.topics.read.into_iter().map(|own| (own.input, own.topic, Some(own.place)));
        let actions = ros.called_actions.into_iter().flat_map(|own| {
            let inputs = [own.result, own.feedback].into_iter().flatten();
            inputs.map(move |input| (input, format!("the action {} of ROS 2", own.action), own.place))
        });
        filled.extend(actions);
        filled.extend(inputs_of_ros(
            "ROS 2",
            slate_ros2::TABLE,
            read,
            ros.options.frames.into_iter().map(|own| (own.input, own.frame, own.place)),
            ros.call.into_iter().filter_map(|own| Some((own.response?, own.service, own.place))),
        ));
    }
    let links = configuration.external_links().iter();
    for link in links.filter(|link| link.direction == ExternalDirection::In) {
        let is_there = filled
            .iter()
            .any(|(input, _, place)| *input == link.path.value && *place == Some(link.other.span));
        if !is_there {
            filled.push((link.path.value.clone(), link.other.value.to_string(), Some(link.path.span)));
        }
    }
    let mut wrong = Vec::new();
    for (at, (input, source, place)) in filled.iter().enumerate() {
        let meets = |(other, ..): &&FilledInput| {
            slate_blackboard::is_within(other, input) || slate_blackboard::is_within(input, other)
        };
        if let Some((_, other, _)) = filled[..at].iter().find(meets) {
            let message = format!("/{input} would be filled by `{other}` and by `{source}`");
            let help = Some("an input has one source: take one of the two away".to_owned());
            wrong.push(match place {
                Some(span) => configuration.diagnostic(*span, message, help),
                None => Diagnostic::without_place(message, help),
            });
        }
    }
    Ok(wrong)
}
