//! Node: its two ports, and its registration at the master.

use std::future::Future;
use std::net::{IpAddr, Ipv4Addr};
use std::sync::Arc;
use std::time::Duration;

use slate_module::Level;
use slate_runtime::Composer;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};

use super::api::serve_api;
use super::context::NodeContext;
use super::header::ConnectionHeader;
use super::http::{HttpAddress, TIMEOUT};
use super::master::{CallError, MasterClient};
use super::parts::NodeParts;
use super::xml::XmlValue;
use crate::settings::{Ros1Settings, SCHEME};

/// Connections that a port has at a time.
const MAX_CONNECTIONS: usize = 128;

/// Period of the check whether the master still knows the node.
const POLL_PERIOD: Duration = Duration::from_secs(1);

/// Node of ROS 1.
pub struct RosNode {
    pub context: Arc<NodeContext>,
    parts: NodeParts,
}

impl RosNode {
    /// Opens the ports of a node and registers it.
    ///
    /// # Errors
    /// Why the master does not take it, in words.
    pub async fn open(
        settings: &Ros1Settings,
        composer: &Composer,
        parts: NodeParts,
    ) -> Result<Arc<Self>, String> {
        let master = HttpAddress::parse(&settings.master)?;
        let reach = timeout(TIMEOUT, TcpStream::connect(&master.authority));
        let reached =
            reach.await.map_err(|_| format!("it does not answer within {} s", TIMEOUT.as_secs()))?;
        let near = reached.and_then(|stream| stream.local_addr()).map_err(|error| error.to_string())?.ip();
        let local = IpAddr::V4(Ipv4Addr::LOCALHOST);
        let named = ["ROS_HOSTNAME", "ROS_IP"].into_iter().filter_map(|name| std::env::var(name).ok());
        let named = named.into_iter().find(|name| settings.trusted && !name.is_empty());
        let host = named.unwrap_or_else(|| if settings.trusted { near } else { local }.to_string());
        let is_local = host == "localhost" || host.parse().is_ok_and(|own: IpAddr| own.is_loopback());
        let bound = if is_local { local } else { IpAddr::V4(Ipv4Addr::UNSPECIFIED) };
        let listen = async || TcpListener::bind((bound, 0)).await.map_err(|error| error.to_string());
        let (calls, connections) = (listen().await?, listen().await?);
        let port = |listener: &TcpListener| listener.local_addr().map(|own| own.port());
        let [api_port, port] = [port(&calls), port(&connections)].map(|port| port.unwrap_or_default());
        let master = MasterClient { address: master, node: settings.node.clone() };
        let context = NodeContext::new(master, host, [api_port, port], composer.clone(), settings.trusted);
        let node = Arc::new(Self { context: Arc::new(context), parts });
        let own = Arc::clone(&node);
        tokio::spawn(accept(calls, move |stream| Arc::clone(&own).serve_call(stream)));
        let own = Arc::clone(&node);
        tokio::spawn(accept(connections, move |stream| Arc::clone(&own).serve(stream)));
        if let Err(error) = node.register().await {
            node.unregister().await;
            return Err(error.to_string());
        }
        Ok(node)
    }

    /// Reads topics and stays registered, until it is aborted.
    pub fn start(self: &Arc<Self>) {
        for own in &self.parts.subscriptions {
            tokio::spawn(Arc::clone(own).run(Arc::clone(&self.context)));
        }
        if self.parts.are_registered() {
            tokio::spawn(Arc::clone(self).watch());
        }
    }

    /// Tells the master all that the node has.
    async fn register(&self) -> Result<(), CallError> {
        let api = || XmlValue::from(self.context.api.as_str());
        for own in &self.parts.services {
            self.context
                .master
                .call("registerService", vec![own.service.as_str().into(), self.service_address(), api()])
                .await?;
        }
        for own in &self.parts.publications {
            let (topic, of) = (own.topic.as_str().into(), own.of.as_str().into());
            self.context.master.call("registerPublisher", vec![topic, of, api()]).await?;
        }
        for own in &self.parts.subscriptions {
            own.note_publishers(own.subscribe(&self.context).await?);
        }
        if self.parts.has_parameters {
            self.context
                .master
                .call("subscribeParam", vec![api(), self.context.master.node.as_str().into()])
                .await?;
        }
        self.context.registered();
        Ok(())
    }

    /// Tells the master that the node is gone. It may be gone itself.
    pub async fn unregister(&self) {
        let api = || XmlValue::from(self.context.api.as_str());
        let mut calls = Vec::new();
        if self.parts.has_parameters {
            calls.push(("unsubscribeParam", vec![api(), self.context.master.node.as_str().into()]));
        }
        let services = self.parts.services.iter();
        calls.extend(
            services
                .map(|own| ("unregisterService", vec![own.service.as_str().into(), self.service_address()])),
        );
        let topics = self.parts.subscriptions.iter();
        calls.extend(topics.map(|own| ("unregisterSubscriber", vec![own.topic.as_str().into(), api()])));
        let topics = self.parts.publications.iter();
        calls.extend(topics.map(|own| ("unregisterPublisher", vec![own.topic.as_str().into(), api()])));
        for (method, arguments) in calls {
            if let Err(CallError::Unreachable(_)) = self.context.master.call(method, arguments).await {
                return;
            }
        }
    }

    fn service_address(&self) -> XmlValue {
        XmlValue::Text(format!("rosrpc://{}:{}", self.context.host, self.context.port))
    }

    /// Registers again at a master that has restarted.
    async fn watch(self: Arc<Self>) {
        let (mut is_lost, mut is_displaced) = (false, false);
        let name = &self.context.master.node;
        let master = format!("the master of ROS at http://{}", self.context.master.address.authority);
        let log = |level, text: String| self.context.composer.log(level, &format!("{SCHEME}: {text}"));
        loop {
            sleep(POLL_PERIOD).await;
            let found = self.context.master.call("lookupNode", vec![name.as_str().into()]).await;
            let found = found.map(|value| value.as_text() == Some(&self.context.api));
            if let Err(CallError::Unreachable(reason)) = &found {
                if !std::mem::replace(&mut is_lost, true) {
                    log(Level::Warn, format!("{master} is lost; connections to nodes remain: {reason}"));
                }
                continue;
            }
            let is_other = found == Ok(false);
            if is_other && !is_displaced {
                log(
                    Level::Error,
                    format!("{master} knows another node as {name} now: give one of them another name"),
                );
            }
            is_displaced = is_other;
            if found.is_err() && self.register().await.is_ok() {
                log(Level::Info, format!("{master} has restarted, and {name} is registered again"));
            } else if is_lost {
                log(Level::Info, format!("{master} answers again"));
            }
            is_lost = false;
        }
    }

    async fn serve_call(self: Arc<Self>, stream: TcpStream) {
        serve_api(&self.context, &self.parts, stream).await;
    }

    /// Serves a topic or a service to a node.
    async fn serve(self: Arc<Self>, mut stream: TcpStream) {
        let Ok(Ok(header)) = timeout(TIMEOUT, ConnectionHeader::read(&mut stream)).await else { return };
        let name = &self.context.master.node;
        let publication = self.parts.publications.iter().find(|own| own.topic == header.get("topic"));
        let server = self.parts.services.iter().find(|own| own.service == header.get("service"));
        let served = match (publication, server) {
            (Some(own), _) => own.serve(stream, &header, name).await,
            (None, Some(own)) => own.serve(stream, &header, &self.context).await,
            (None, None) => {
                let text = format!("{name} has no such topic or service");
                ConnectionHeader::of([("error", text.as_str())]).write(&mut stream).await.map(|()| None)
            }
        };
        // Others come and go.
        if let Ok(Some(text)) = served {
            self.context.log_once(Level::Warn, &text);
        }
    }
}

/// Serves all connections of a port.
async fn accept<S, F>(listener: TcpListener, serve: S)
where
    S: Fn(TcpStream) -> F,
    F: Future<Output = ()> + Send + 'static,
{
    let places = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            // File descriptors may be exhausted.
            sleep(Duration::from_millis(50)).await;
            continue;
        };
        // One too many is closed at once.
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else { continue };
        let served = serve(stream);
        tokio::spawn(async move {
            served.await;
            drop(place);
        });
    }
}
