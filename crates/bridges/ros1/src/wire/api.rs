//! The API that a node has for the master and other nodes.

use std::sync::Arc;

use slate_module::Level;
use tokio::net::TcpStream;

use super::http::{read_request, respond};
use super::node::RosNode;
use super::xml::{XmlValue, answer, read_call};

/// Answers the call that comes.
pub async fn serve_api(node: Arc<RosNode>, mut stream: TcpStream) {
    let called = read_request(&mut stream).await.and_then(|text| read_call(&text));
    // Who has called may be gone.
    let _ = match called {
        Ok((method, arguments)) => {
            respond(&mut stream, "200 OK", &answer(node.answer(&method, &arguments))).await
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

impl RosNode {
    fn answer(&self, method: &str, arguments: &[XmlValue]) -> XmlValue {
        let text = |at: usize| arguments.get(at).and_then(XmlValue::as_text);
        match method {
            "getPid" => done("", XmlValue::Integer(std::process::id().cast_signed())),
            "getMasterUri" => done("", XmlValue::Text(format!("http://{}/", self.master.address.authority))),
            "getSubscriptions" => done(
                "",
                pairs(self.parts.subscriptions.iter().map(|own| (own.topic.as_str(), own.of.as_str()))),
            ),
            "getPublications" => done(
                "",
                pairs(self.parts.publications.iter().map(|own| (own.topic.as_str(), own.of.as_str()))),
            ),
            "getBusStats" => {
                let none = || XmlValue::List(Vec::new());
                done("", XmlValue::List(vec![none(), none(), none()]))
            }
            "getBusInfo" => done("", XmlValue::List(Vec::new())),
            "publisherUpdate" => {
                if let Some(own) =
                    self.parts.subscriptions.iter().find(|own| Some(own.topic.as_str()) == text(1))
                {
                    own.ask_publishers();
                }
                done("", XmlValue::Integer(0))
            }
            "paramUpdate" => {
                self.parameters_changed();
                done("", XmlValue::Integer(0))
            }
            "requestTopic" => self.answer_topic(text(1), arguments.get(2)),
            "shutdown" => {
                let reason: String = text(1).unwrap_or_default().chars().take(100).collect();
                self.tell(
                    Level::Warn,
                    &format!("a node asks this one to end, which it does not: {reason:?}"),
                );
                refused("this node is an agent of Slate: end its program instead")
            }
            _ => refused("nodes have no such method"),
        }
    }

    fn answer_topic(&self, topic: Option<&str>, protocols: Option<&XmlValue>) -> XmlValue {
        let Some(own) = self.parts.publications.iter().find(|own| Some(own.topic.as_str()) == topic) else {
            return refused("this node does not publish it");
        };
        let is_tcp = |own: &XmlValue| own.as_list().and_then(|own| own.first()?.as_text()) == Some("TCPROS");
        if !protocols.and_then(XmlValue::as_list).is_some_and(|all| all.iter().any(is_tcp)) {
            return refused("this node speaks TCPROS alone");
        }
        let port = XmlValue::Integer(self.port.into());
        done(
            &format!("ready for {}", own.topic),
            XmlValue::List(vec!["TCPROS".into(), self.host.as_str().into(), port]),
        )
    }
}
