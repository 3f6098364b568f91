//! API of a node for the master and other nodes.

use slate_module::Level;
use tokio::net::TcpStream;

use super::context::NodeContext;
use super::http::{read_request, respond};
use super::parts::NodeParts;
use super::xml::{XmlValue, answer, read_call};

/// Answers the call that comes.
pub async fn serve_api(node: &NodeContext, parts: &NodeParts, mut stream: TcpStream) {
    let called = read_request(&mut stream).await.and_then(|text| read_call(&text));
    // The caller may be gone.
    let _ = match called {
        Ok((method, arguments)) => {
            respond(&mut stream, "200 OK", &answer(answer_call(node, parts, &method, &arguments))).await
        }
        Err(reason) => respond(&mut stream, "400 Bad Request", &reason).await,
    };
}

fn done(text: &str, value: XmlValue) -> XmlValue {
    XmlValue::List(vec![XmlValue::Integer(1), text.into(), value])
}

fn refused(text: &str) -> XmlValue {
    XmlValue::List(vec![XmlValue::Integer(-1), text.into(), XmlValue::Integer(0)])
}

fn pairs<'a>(pairs: impl Iterator<Item = (&'a str, &'a str)>) -> XmlValue {
    XmlValue::List(pairs.map(|(name, of)| XmlValue::List(vec![name.into(), of.into()])).collect())
}

/// Answers a call.
fn answer_call(node: &NodeContext, parts: &NodeParts, method: &str, arguments: &[XmlValue]) -> XmlValue {
    let text = |at: usize| arguments.get(at).and_then(XmlValue::as_text);
    match method {
        "getPid" => done("", XmlValue::Integer(std::process::id().cast_signed())),
        "getMasterUri" => done("", XmlValue::Text(format!("http://{}/", node.master.address.authority))),
        "getSubscriptions" => {
            done("", pairs(parts.subscriptions.iter().map(|own| (own.topic.as_str(), own.of.as_str()))))
        }
        "getPublications" => {
            done("", pairs(parts.publications.iter().map(|own| (own.topic.as_str(), own.of.as_str()))))
        }
        "getBusStats" => {
            let none = || XmlValue::List(Vec::new());
            done("", XmlValue::List(vec![none(), none(), none()]))
        }
        "getBusInfo" => done("", XmlValue::List(Vec::new())),
        "publisherUpdate" => {
            // Several inputs may read one topic.
            let topics = parts.subscriptions.iter().filter(|own| Some(own.topic.as_str()) == text(1));
            topics.for_each(|own| own.query_publishers());
            done("", XmlValue::Integer(0))
        }
        "paramUpdate" => {
            node.parameters_changed();
            done("", XmlValue::Integer(0))
        }
        "requestTopic" => answer_topic(node, parts, text(1), arguments.get(2)),
        "shutdown" => {
            node.log_once(
                Level::Warn,
                "a node asks this one to end, which it does not: end its program instead",
            );
            refused("this node is an agent of Slate: end its program instead")
        }
        _ => refused("nodes have no such method"),
    }
}

/// Answers with the address of a topic.
fn answer_topic(
    node: &NodeContext,
    parts: &NodeParts,
    topic: Option<&str>,
    protocols: Option<&XmlValue>,
) -> XmlValue {
    let Some(own) = parts.publications.iter().find(|own| Some(own.topic.as_str()) == topic) else {
        return refused("this node does not publish it");
    };
    let is_tcp = |own: &XmlValue| own.as_list().and_then(|own| own.first()?.as_text()) == Some("TCPROS");
    if !protocols.and_then(XmlValue::as_list).is_some_and(|all| all.iter().any(is_tcp)) {
        return refused("this node speaks TCPROS alone");
    }
    let port = XmlValue::Integer(node.port.into());
    done(
        &format!("ready for {}", own.topic),
        XmlValue::List(vec!["TCPROS".into(), node.host.as_str().into(), port]),
    )
}
