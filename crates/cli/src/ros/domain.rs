//! Looks at a domain of ROS 2.

use std::time::{Duration, Instant};

use serde_json::{Value as Json, json};
use slate_ros2::{FoundEndpoint, FoundTopic, RosExplorer, RosWireSettings, TopicStream, known_type_hash};

use super::{RosDomain, RosEchoOptions, RosInfoOptions, RosListOptions, RosRateOptions, RosWire, yaml};
use crate::clock::now;
use crate::failure::{ASSERTION_FALSE, Failure, NO_DATA, UNKNOWN};
use crate::{duration, interrupt, output};

/// Environment variable with the domain of ROS programs.
const DOMAIN_VARIABLE: &str = "ROS_DOMAIN_ID";

/// Maximum duration of one wait for a message, so that Ctrl-C ends it soon.
const POLL_PERIOD: Duration = Duration::from_millis(100);

fn failed(error: &slate_ros2::RosError) -> Failure {
    Failure::Ros { problem: error.to_string(), help: error.help().to_owned(), code: 2 }
}

/// Joins a domain, and looks around.
fn joined(options: &RosDomain) -> Result<RosExplorer, Failure> {
    let own = std::env::var(DOMAIN_VARIABLE).ok().filter(|text| !text.is_empty());
    let domain = match (options.domain, own) {
        (Some(domain), _) => domain,
        (None, None) => 0,
        (None, Some(text)) => {
            text.parse().ok().filter(|domain| *domain <= 232).ok_or_else(|| Failure::Ros {
                problem: format!("a domain is a number from 0 to 232, found {DOMAIN_VARIABLE}={text}"),
                help: "name it: --domain 7".into(),
                code: 2,
            })?
        }
    };
    let wire = wire(options)?;
    let mut explorer = RosExplorer::join(domain, &wire, options.trusted).map_err(|error| failed(&error))?;
    explorer.discover(options.wait);
    Ok(explorer)
}

/// Returns the middleware of the options.
fn wire(options: &RosDomain) -> Result<RosWireSettings, Failure> {
    let wrong = |problem: String, help: &str| Failure::Ros { problem, help: help.to_owned(), code: 2 };
    match (options.wire, &options.router) {
        (RosWire::Dds, None) => Ok(RosWireSettings::Dds),
        (RosWire::Dds, Some(_)) => {
            let problem = "DDS has no router, and --router names one".to_owned();
            Err(wrong(problem, "add --wire zenoh"))
        }
        (RosWire::Zenoh, None) => Ok(RosWireSettings::local_zenoh()),
        (RosWire::Zenoh, Some(router)) => {
            RosWireSettings::zenoh(router, options.trusted).map_err(|(problem, help)| wrong(problem, help))
        }
    }
}

/// Lists the nodes and topics of a domain.
pub fn list(options: &RosListOptions) -> Result<u8, Failure> {
    let explorer = joined(&options.domain)?;
    let (nodes, topics, services) = (explorer.nodes(), explorer.topics(), explorer.services());
    if options.json {
        let topics: Vec<_> = topics.iter().map(|(name, topic)| described(name, topic)).collect();
        let services: Vec<_> =
            services.iter().map(|(name, kind)| json!({ "service": name, "type": kind })).collect();
        let all =
            json!({ "schema": "slate.ros_list/1", "nodes": nodes, "topics": topics, "services": services });
        output::json(&all);
        return Ok(0);
    }
    for node in &nodes {
        output::line(format_args!("node     {node}"));
    }
    let rows = topics.iter().map(|(name, topic)| {
        let count = |found: &[FoundEndpoint], word| match found.len() {
            1 => format!("1 {word}"),
            count => format!("{count} {word}s"),
        };
        let kind = kind(topic).unwrap_or_default();
        let (publishers, subscriptions) =
            (count(&topic.publishers, "publisher"), count(&topic.subscriptions, "subscription"));
        ["topic  ".to_owned(), name.clone(), kind, publishers, subscriptions]
    });
    output::columns(rows);
    output::columns(services.iter().map(|(name, kind)| ["service".to_owned(), name.clone(), kind.clone()]));
    Ok(0)
}

fn kind(topic: &FoundTopic) -> Option<String> {
    topic.publishers.iter().chain(&topic.subscriptions).next().map(|own| own.message.clone())
}

fn described(name: &str, topic: &FoundTopic) -> Json {
    let endpoint = |own: &FoundEndpoint| {
        json!({
            "node": own.node,
            "type": own.message,
            "type_hash": own.type_hash,
            "reliability": reliability(own),
            "durability": durability(own),
        })
    };
    json!({
        "topic": name,
        "type": kind(topic),
        "publishers": topic.publishers.iter().map(endpoint).collect::<Vec<_>>(),
        "subscriptions": topic.subscriptions.iter().map(endpoint).collect::<Vec<_>>(),
    })
}

fn reliability(own: &FoundEndpoint) -> &'static str {
    if own.reliable { "RELIABLE" } else { "BEST_EFFORT" }
}

fn durability(own: &FoundEndpoint) -> &'static str {
    if own.transient_local { "TRANSIENT_LOCAL" } else { "VOLATILE" }
}

/// Shows a topic.
pub fn info(options: &RosInfoOptions) -> Result<u8, Failure> {
    let explorer = joined(&options.domain)?;
    let mut topics = explorer.topics();
    let topic = topics.remove(&options.topic).ok_or_else(|| unknown(&explorer, &options.topic))?;
    let own_hash = match (kind(&topic), &options.definition) {
        (Some(kind), Some(path)) => {
            let hash = known_type_hash(&kind, Some(path)).map_err(|problem| Failure::Ros {
                problem,
                help: "name the file that defines the type: --definition FILE.msg".into(),
                code: 2,
            });
            Some(hash?)
        }
        (Some(kind), None) => known_type_hash(&kind, None).ok(),
        (None, _) => None,
    };
    if options.json {
        let mut document = described(&options.topic, &topic);
        document["type_hash"] = own_hash.into();
        output::document("slate.ros_info/1", &document);
        return Ok(0);
    }
    if let (Some(kind), Some(hash)) = (kind(&topic), &own_hash) {
        output::line(format_args!("{kind} is {hash} here"));
    }
    let row = |what: &str, own: &FoundEndpoint| {
        let node = own.node.clone().unwrap_or_else(|| "?".into());
        let hash = own.type_hash.clone().unwrap_or_else(|| "no type hash".into());
        [what.to_owned(), node, own.message.clone(), reliability(own).into(), durability(own).into(), hash]
    };
    let publishers = topic.publishers.iter().map(|own| row("publisher", own));
    let subscriptions = topic.subscriptions.iter().map(|own| row("subscription", own));
    output::columns(publishers.chain(subscriptions));
    Ok(0)
}

fn unknown(explorer: &RosExplorer, topic: &str) -> Failure {
    let topics = explorer.topics();
    let near = slate::blackboard::nearest_names(topic, topics.keys().map(String::as_str));
    let help = match near.is_empty() {
        true => {
            "`slate ros list` shows the topics; --wait 5s looks longer, --domain looks elsewhere".to_owned()
        }
        false => format!("did you mean {}?", near.join(" or ")),
    };
    Failure::Ros { problem: format!("no node of the domain has a topic {topic}"), help, code: UNKNOWN }
}

fn subscribed(domain: &RosDomain, topic: &str) -> Result<(RosExplorer, TopicStream), Failure> {
    let explorer = joined(domain)?;
    if !explorer.topics().contains_key(topic) {
        return Err(unknown(&explorer, topic));
    }
    let stream = explorer.subscribe(topic).map_err(|error| Failure::Ros {
        problem: error.to_string(),
        help: "`slate ros info` shows its subscriptions".into(),
        code: UNKNOWN,
    })?;
    Ok((explorer, stream))
}

/// Prints messages until it is enough.
pub fn echo(options: &RosEchoOptions) -> Result<u8, Failure> {
    let (_explorer, stream) = subscribed(&options.domain, &options.topic)?;
    let schema = stream.schema(options.definition.as_deref()).map_err(|problem| Failure::Ros {
        problem,
        help: "name the file that defines it, with those of messages in it beside it: --definition FILE.msg; `slate ros hz` needs none".into(),
        code: 2,
    })?;
    interrupt::catch();
    let (mut count, mut last) = (0, now());
    while !interrupt::is_interrupted() && options.count.is_none_or(|most| count < most) {
        let Some(message) = stream.next(POLL_PERIOD) else {
            if options.timeout.is_some_and(|limit| last.elapsed() > limit) {
                return Ok(if count == 0 { NO_DATA } else { 0 });
            }
            continue;
        };
        (count, last) = (count + 1, now());
        match schema.decode(&message).map(|value| serde_json::to_value(value).unwrap_or_default()) {
            Ok(value) if options.json => output::line(&value),
            Ok(value) => {
                yaml::lines(&value).iter().for_each(output::line);
                output::line("---");
            }
            Err(error) => eprintln!("a message of {} is not shown: {error}", options.topic),
        }
        if output::is_unread() {
            break;
        }
    }
    Ok(0)
}

/// Measures the rate of messages.
pub fn rate(options: &RosRateOptions) -> Result<u8, Failure> {
    let (_explorer, stream) = subscribed(&options.domain, &options.topic)?;
    // The first may be one that was kept.
    let Some(_) = stream.next(options.time) else {
        return Err(Failure::NoValue(format!("no message of {} has come", options.topic)));
    };
    let (began, mut times) = (now(), Vec::new());
    let mut bytes = 0;
    while let Some(left) = options.time.checked_sub(began.elapsed()) {
        if let Some(message) = stream.next(left) {
            times.push(now());
            bytes += message.len();
        }
    }
    let seconds = options.time.as_secs_f64();
    let rate = times.len() as f64 / seconds;
    let mut gaps: Vec<f64> =
        times.windows(2).map(|pair: &[Instant]| pair[1].duration_since(pair[0]).as_nanos() as f64).collect();
    gaps.sort_by(f64::total_cmp);
    let (least, most) = (gaps.first().copied(), gaps.last().copied());
    let median = gaps.get(gaps.len() / 2).copied();
    if options.json {
        output::document(
            "slate.ros_hz/1",
            &json!({
                "topic": options.topic, "type": stream.message(), "seconds": seconds, "messages": times.len(),
                "rate": rate, "interval_min": least, "interval_p50": median, "interval_max": most,
                "bytes_per_second": bytes as f64 / seconds,
            }),
        );
    } else {
        let show = |gap: Option<f64>| gap.map_or_else(|| "-".to_owned(), duration::show);
        output::line(format_args!(
            "{}: {rate:.2} Hz, interval p50 {}, min {}, max {}, {}/s",
            options.topic,
            show(median),
            show(least),
            show(most),
            duration::bytes(bytes as f64 / seconds)
        ));
    }
    let is_outside = options.min.is_some_and(|min| rate < min) || options.max.is_some_and(|max| rate > max);
    Ok(if is_outside { ASSERTION_FALSE } else { 0 })
}
