//! Answers to queries: newest values, the tree, schemas and changes.

use std::sync::Arc;
use std::thread::{Builder, JoinHandle};

use serde_json::{Value as Json, json};
use slate_blackboard::{Access, Property, nearest_paths};
use slate_control::operations::by_name;
use slate_control::{Caller, Connections, Dispatcher, OperationAnswer, Problem, Role, of_interface};
use slate_module::encode_interface;
use slate_ros_messages as ros;
use tokio::sync::mpsc::{Receiver, Sender, channel};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use zenoh::Wait;
use zenoh::bytes::Encoding;
use zenoh::key_expr::KeyExpr;
use zenoh::query::Query;

use crate::attachment::SampleAttachment;
use crate::error::NetworkError;
use crate::key::{property_key, schema_key, set_key, tree_key};
use crate::options::ReadOptions;
use crate::payload::{Decoded, Payload, encoding};
use crate::publishing::newest;
use crate::refusal::{QueryRefusal, refuse};
use crate::settings::NetworkOutput;
use crate::shared::{NetworkShared, locked};
use crate::streams::MAX_STREAMS;

/// Queries that wait for an answer.
const MAX_QUERIES: usize = 256;

/// Changes and messages at work at a time.
const MAX_CHANGES: usize = 16;

/// Handle of the thread that answers, and the queue to it.
pub struct QueryThread {
    thread: Option<JoinHandle<()>>,
    /// Queue to the thread; `None` ends it.
    queries: Sender<Option<Query>>,
}

impl QueryThread {
    /// Starts the thread.
    pub fn start(shared: Arc<NetworkShared>) -> Result<Self, NetworkError> {
        // Zenoh refuses to be used in a runtime of one thread.
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .enable_time()
            .worker_threads(1)
            .max_blocking_threads(MAX_CHANGES)
            .thread_name("network change")
            .build()?;
        let (sender, receiver) = channel(MAX_QUERIES);
        let thread = Builder::new().name("network queries".into()).spawn(move || {
            let answerer = Arc::new(Answerer::new(shared));
            runtime.block_on(answerer.run(receiver));
            // Changes that still run are not waited for.
            runtime.shutdown_background();
        })?;
        Ok(Self { thread: Some(thread), queries: sender })
    }

    /// Returns the handler of the queryables.
    /// It runs in threads of Zenoh and never waits.
    pub fn handler(&self) -> impl Fn(Query) + Send + Sync + 'static {
        let queries = self.queries.clone();
        move |query| {
            if let Err(error) = queries.try_send(Some(query))
                && let Some(query) = error.into_inner()
            {
                refuse(&query, &QueryRefusal::full(format!("{MAX_QUERIES} queries wait for an answer")));
            }
        }
    }

    /// Ends the thread.
    pub fn end(&mut self) {
        // If this fails, the thread has ended already.
        let _ = self.queries.blocking_send(None);
        // A thread that panicked has ended, too.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// Returns the network as a caller of the agent's operations.
pub fn caller() -> Caller {
    Caller {
        // The rights in the configuration limit the changes.
        role: Role::Developer,
        who: "network".into(),
        local: None,
        is_told: false,
        connection: Arc::new(Arc::new(Connections::default()).admit()),
    }
}

struct Answerer {
    shared: Arc<NetworkShared>,
    dispatcher: Dispatcher,
    caller: Caller,
    permits: Arc<Semaphore>,
}

impl Answerer {
    fn new(shared: Arc<NetworkShared>) -> Self {
        Self {
            dispatcher: Dispatcher::new(Arc::clone(&shared.surface), MAX_CHANGES, false),
            caller: caller(),
            permits: Arc::new(Semaphore::new(MAX_CHANGES)),
            shared,
        }
    }

    async fn run(self: &Arc<Self>, mut queries: Receiver<Option<Query>>) {
        while let Some(query) = queries.recv().await.flatten() {
            if query.payload().is_none() {
                self.read(&query);
                continue;
            }
            match Arc::clone(&self.permits).try_acquire_owned() {
                Ok(permit) => drop(tokio::spawn(Arc::clone(self).change(query, permit))),
                Err(_) => refuse(&query, &QueryRefusal::full(format!("{MAX_CHANGES} changes are at work"))),
            }
        }
    }

    fn agent(&self) -> &str {
        self.shared.board().agent()
    }

    /// Returns the path that a key of this agent names.
    fn path_of<'k>(&self, key: &'k str) -> Option<&'k str> {
        key.strip_prefix("slate/")?.strip_prefix(self.agent())?.strip_prefix('/')
    }

    fn read(&self, query: &Query) {
        let key = query.key_expr().as_str();
        if let Some(output) = self.shared.settings.write.iter().find(|output| output.key == key) {
            if let Err(refused) = self.output(query, output) {
                refuse(query, &refused);
            }
            return;
        }
        let path = self.path_of(key).unwrap_or_default();
        if path == "@alive" {
            return answer_json(query, query.key_expr().clone(), &json!({ "agent": self.agent() }));
        }
        if path == "@tree" || path.starts_with("@tree/") {
            let tree = self.tree(path.strip_prefix("@tree/"));
            return answer_json(query, query.key_expr().clone(), &tree);
        }
        if path.starts_with("@set/") {
            return refuse(query, &QueryRefusal::new(format!("{key} takes a payload"), "send what to set"));
        }
        if path.starts_with("@schema/") {
            return self.schemas(query);
        }
        if let Some(wanted) = path.strip_prefix("@read/") {
            if let Err(refused) = self.stream(query, wanted) {
                refuse(query, &refused);
            }
            return;
        }
        if key.contains(['*', '$']) {
            return self.values(query);
        }
        if let Err(refused) = self.value(query, path) {
            refuse(query, &refused);
        }
    }

    /// Answers with the newest values of all properties that match a wildcard key.
    fn values(&self, query: &Query) {
        for property in self.shared.published() {
            let Ok(key) = KeyExpr::try_from(property_key(self.agent(), property.path())) else { continue };
            if key.intersects(query.key_expr()) {
                // A property without a value has no answer.
                let _ = answer_value(query, key, &property);
            }
        }
    }

    /// Answers with the newest value of a property that a link publishes at a key.
    fn output(&self, query: &Query, output: &NetworkOutput) -> Result<(), QueryRefusal> {
        let (property, _) = self.shared.board().find(&output.property).map_err(Problem::from)?;
        answer_value(query, query.key_expr().clone(), &property)
    }

    fn value(&self, query: &Query, path: &str) -> Result<(), QueryRefusal> {
        let found = self.shared.board().get(path).filter(|(property, _)| self.shared.is_published(property));
        let Some((property, field)) = found else {
            // With access control, the help must not name properties without read access.
            let is_open = self.shared.settings.security.is_none();
            let published: Vec<_> = self.shared.published().filter(|_| is_open).collect();
            let near = nearest_paths(path, '/', published.iter().map(|property| property.path()));
            let help = match near.is_empty() {
                true => format!("{} lists the properties", tree_key(self.agent())),
                false => format!("did you mean {}?", near.join(" or ")),
            };
            return Err(QueryRefusal::new(format!("nothing is published at {}", query.key_expr()), help));
        };
        if property.channel().is_none() {
            return Err(QueryRefusal::new(
                format!("/{path} takes messages, and has no value"),
                "send one: a query with a payload",
            ));
        }
        let as_json = query.parameters().get("format") == Some("json");
        if field.is_empty() && !as_json {
            return answer_value(query, query.key_expr().clone(), &property);
        }
        let wrong = |error: slate_blackboard::BoardError| {
            QueryRefusal::new(error.to_string(), "@schema describes the fields")
        };
        let (value, _) =
            self.shared.board().read(path).map_err(wrong)?.ok_or_else(|| unwritten(&property))?;
        let json = serde_json::to_value(value).unwrap_or_default();
        answer_json(query, query.key_expr().clone(), &json);
        Ok(())
    }

    /// Opens a stream for readers with options, `OPTIONS/PATH`.
    /// Answers with the newest value.
    fn stream(&self, query: &Query, wanted: &str) -> Result<(), QueryRefusal> {
        let (options, path) = wanted.split_once('/').unwrap_or((wanted, ""));
        let options = ReadOptions::parse(options)
            .map_err(|reason| QueryRefusal::new(reason, "such as slate/AGENT/@read/rate=100ms/PATH"))?;
        let found = self.shared.board().get(path).filter(|(property, field)| {
            field.is_empty() && property.channel().is_some() && self.shared.is_published(property)
        });
        let Some((property, _)) = found else {
            let help = format!("{} lists the properties; a field has no options", tree_key(self.agent()));
            return Err(QueryRefusal::new(format!("nothing is published at {}", query.key_expr()), help));
        };
        {
            let open = *locked(&self.shared.streams);
            let mut wanted = locked(&self.shared.wanted);
            if open + wanted.len() >= MAX_STREAMS {
                return Err(QueryRefusal::full(format!("{MAX_STREAMS} streams are open")));
            }
            wanted.insert((property.path().to_owned(), options));
        }
        self.shared.wake.notify(1);
        answer_value(query, query.key_expr().clone(), &property)
    }

    /// Returns the properties that an agent, or a program without a name, may use.
    fn tree(&self, reader: Option<&str>) -> Json {
        let security = self.shared.settings.security.as_ref();
        let rights = security.map(|security| match reader {
            Some(reader) => security.rights(reader),
            None => security.unauthenticated.as_ref(),
        });
        let may_send =
            |path: &str| rights.is_none_or(|rights| rights.is_some_and(|found| found.may_send(path)));
        let may_read =
            |path: &str| rights.is_none_or(|rights| rights.is_some_and(|found| found.may_read(path)));
        let entry = |property: Arc<Property>| {
            let descriptor = property.descriptor();
            json!({
                "path": property.path(),
                "key": property_key(self.agent(), property.path()),
                "encoding": encoding(descriptor),
                "interface": descriptor.name,
                "schema": format!("{:016x}", descriptor.hash),
                "doc": property.doc(),
                "part": property.part(),
                "has_writer": property.has_writer(),
                "settable": self.is_settable(&property) && may_send(property.path()),
            })
        };
        let is_shown = |property: &Arc<Property>| {
            let may_read = property.access() != Access::Messages && may_read(property.path());
            may_read || may_send(property.path())
        };
        self.listed().filter(is_shown).map(entry).collect()
    }

    fn is_settable(&self, property: &Property) -> bool {
        property.access() != Access::Output && self.shared.settings.is_settable(property.path())
    }

    /// Returns the properties that others may read, and the inboxes.
    fn listed(&self) -> impl Iterator<Item = Arc<Property>> {
        let properties = self.shared.board().properties().into_iter();
        properties.filter(|property| match property.access() {
            Access::Messages => self.shared.settings.is_settable(property.path()),
            _ => self.shared.is_published(property),
        })
    }

    fn schemas(&self, query: &Query) {
        let mut answered = slate_sorted::SortedSet::new();
        for property in self.listed() {
            let descriptor = property.descriptor();
            let Ok(key) = KeyExpr::try_from(schema_key(self.agent(), descriptor.name)) else { continue };
            if !key.intersects(query.key_expr()) || !answered.insert(descriptor.hash) {
                continue;
            }
            let definition = ros::definition(descriptor);
            let portable = encode_interface(descriptor).unwrap_or_default();
            let portable: String = portable.iter().map(|byte| format!("{byte:02x}")).collect();
            let body = json!({
                "interface": descriptor.name,
                "schema": format!("{:016x}", descriptor.hash),
                "message": definition.name,
                "definition": definition.text,
                "ros": descriptor.ros,
                "json_schema": of_interface(descriptor),
                "cbor": portable,
            });
            answer_json(query, key, &body);
        }
        if answered.is_empty() && !query.key_expr().as_str().contains(['*', '$']) {
            let help = format!("{} lists them", schema_key(self.agent(), "*"));
            refuse(query, &QueryRefusal::new(format!("no interface at {}", query.key_expr()), help));
        }
    }

    /// Sets a property or sends a message, and answers with the outcome.
    async fn change(self: Arc<Self>, query: Query, _permit: OwnedSemaphorePermit) {
        match self.carry_out(&query).await {
            Ok(body) => answer_json(&query, query.key_expr().clone(), &body),
            Err(refused) => refuse(&query, &refused),
        }
    }

    async fn carry_out(self: &Arc<Self>, query: &Query) -> Result<Json, QueryRefusal> {
        let (name, path, body) = self.request(query)?;
        let unknown = || {
            QueryRefusal::new(
                format!("no operation is called `{name}`"),
                "both ends need the same version of Slate",
            )
        };
        let turn = self.dispatcher.turn(by_name(name).ok_or_else(unknown)?).await?;
        let own = Arc::clone(self);
        let work = move || {
            // Released at the end of the work, also when the query has timed out.
            let _turn = turn;
            own.dispatcher.carry_out(&own.caller, name, &[("path", &path)], body)
        };
        let done = tokio::task::spawn_blocking(work).await;
        match done.map_err(|_| QueryRefusal::new("the change has failed", "see the log of the agent"))?? {
            OperationAnswer::Json(_, body, _) if body.is_array() => {
                Ok(json!({ "status": "accepted", "changes": body }))
            }
            OperationAnswer::Json(_, body, _) => Ok(body),
            _ => Ok(json!({ "status": "accepted" })),
        }
    }

    /// Returns the operation of a query: its name, path and body.
    fn request(&self, query: &Query) -> Result<(&'static str, String, Json), QueryRefusal> {
        let key = query.key_expr().as_str();
        if key.contains(['*', '$']) {
            return Err(QueryRefusal::new(format!("{key} means several properties"), "set them one by one"));
        }
        let path = self.path_of(key).unwrap_or_default();
        let set = path.strip_prefix("@set/");
        let path = set.unwrap_or(path);
        if path.starts_with('@') || path.is_empty() {
            return Err(QueryRefusal::new(format!("{key} takes no payload"), "leave it out to read"));
        }
        if set.is_none() && self.shared.settings.security.is_some() {
            // Zenoh's access control goes by the key, and tells no payload.
            let help = format!("send it to {}", set_key(self.agent(), path));
            return Err(QueryRefusal::new(
                format!("{key} is read only, as this agent has access control"),
                help,
            ));
        }
        let (property, field) = self.shared.board().find(path).map_err(Problem::from)?;
        if !self.shared.settings.is_settable(property.path()) {
            let help = format!("let the agent allow it: set = [\"{}\"] in [network]", property.path());
            return Err(QueryRefusal::new(
                format!("/{} may not be set from the network", property.path()),
                help,
            ));
        }
        let encoding = query.encoding().map(Encoding::to_string).unwrap_or_default();
        let bytes = query.payload().map(|bytes| bytes.to_bytes()).unwrap_or_default();
        let attachment = query.attachment().map(|bytes| bytes.to_bytes()).unwrap_or_default();
        let payload = Payload { encoding: &encoding, bytes: &bytes, attachment: &attachment };
        let decoded = payload.decode(property.descriptor(), &field);
        let decoded =
            decoded.map_err(|error| QueryRefusal::new(error.to_string(), "@schema describes the value"))?;
        let body = decoded.json(property.descriptor());
        let body = body.map_err(|reason| QueryRefusal::new(reason, "@schema describes the value"))?;
        let is_patch = matches!(decoded, Decoded::Value(_)) && body.is_object();
        let name = match property.access() {
            Access::Messages => "send",
            _ if is_patch => "patch",
            _ => "write",
        };
        Ok((name, path.to_owned(), body))
    }
}

fn unwritten(property: &Property) -> QueryRefusal {
    QueryRefusal::new(
        format!("/{} has no value yet", property.path()),
        "subscribe, and it arrives with the first write",
    )
}

fn answer_value(query: &Query, key: KeyExpr<'static>, property: &Property) -> Result<(), QueryRefusal> {
    let mut message = Vec::new();
    let newest =
        newest(property, &mut message).map_err(|reason| QueryRefusal::new(reason, "ask again later"))?;
    let stamp = newest.ok_or_else(|| unwritten(property))?;
    let attachment = SampleAttachment { stamp, hash: property.descriptor().hash, number: 0 };
    let reply = query.reply(key, message).encoding(Encoding::from(encoding(property.descriptor())));
    // A session that has closed needs no answer.
    let _ = reply.attachment(&attachment.encode()[..]).wait();
    Ok(())
}

fn answer_json(query: &Query, key: KeyExpr<'static>, body: &Json) {
    let _ = query.reply(key, body.to_string()).encoding(Encoding::APPLICATION_JSON).wait();
}
