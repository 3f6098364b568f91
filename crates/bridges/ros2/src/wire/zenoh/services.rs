//! Both ends of services on Zenoh: requests are queries.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::task::Waker;
use std::time::Duration;

use zenoh::query::{ConsolidationMode, Querier, Query, QueryTarget, Queryable, Reply};
use zenoh::{Result, Session, Wait};

use super::attachment::{Gid, MessageAttachment};
use super::queue::{ReceiveQueue, locked};
use super::session_endpoint::SessionEndpoint;
use crate::wire::{RequestNumber, RequestReader, RequestWriter, Responder, ServiceRequest};

/// Requests and responses that may wait for their thread.
const QUEUE_CAPACITY: usize = 64;

/// Time that the way of a response is kept open; clients time out by themselves.
const TIMEOUT: Duration = Duration::from_secs(600);

/// Suffix of the service with an action's result.
/// Its response takes as long as the action.
const GET_RESULT: &str = "/_action/get_result";
const RESULT_TIMEOUT: Duration = Duration::from_millis(u64::MAX);

/// Offered service.
pub struct ZenohServer {
    key: String,
    queue: Arc<ReceiveQueue<Query>>,
    queryable: Mutex<Option<Queryable<()>>>,
}

impl ZenohServer {
    pub fn new(key: String) -> Self {
        Self { key, queue: Arc::new(ReceiveQueue::new(QUEUE_CAPACITY)), queryable: Mutex::default() }
    }
}

impl SessionEndpoint for ZenohServer {
    fn declare(&self, session: &Session) -> Result<()> {
        let queue = Arc::clone(&self.queue);
        let queryable = session.declare_queryable(self.key.clone()).complete(true);
        let take = move |query: Query| {
            let size = query.payload().map_or(0, |payload| payload.len());
            queue.push(query, size);
        };
        *locked(&self.queryable) = Some(queryable.callback(take).wait()?);
        Ok(())
    }
}

impl RequestReader for Arc<ZenohServer> {
    fn set_waker(&self, waker: &Waker) {
        self.queue.set_waker(waker);
    }

    fn take(&self) -> std::result::Result<Option<ServiceRequest>, String> {
        let Some(query) = self.queue.take() else { return Ok(None) };
        let message = query.payload().map_or_else(Vec::new, |payload| payload.to_bytes().into_owned());
        Ok(Some(ServiceRequest {
            message,
            responder: Box::new(ZenohResponder { query, key: self.key.clone() }),
        }))
    }
}

/// Responder to the client of a request.
struct ZenohResponder {
    query: Query,
    key: String,
}

impl Responder for ZenohResponder {
    fn reply(self: Box<Self>, message: Vec<u8>, _: &dyn Fn() -> bool) -> std::result::Result<(), String> {
        let request = self.query.attachment().and_then(|bytes| MessageAttachment::decode(&bytes.to_bytes()));
        let mut reply = self.query.reply(self.key, message);
        if let Some(MessageAttachment { sequence_number, source, .. }) = request {
            reply = reply.attachment(MessageAttachment::now(sequence_number, source).encode());
        }
        reply.wait().map_err(|error| error.to_string())
    }
}

/// Client of a service.
pub struct ZenohCaller {
    key: String,
    gid: Gid,
    timeout: Duration,
    servers: Arc<AtomicUsize>,
    queue: Arc<ReceiveQueue<(RequestNumber, Vec<u8>)>>,
    state: Mutex<CallerState>,
}

#[derive(Default)]
struct CallerState {
    querier: Option<Querier<'static>>,
    sent: RequestNumber,
}

impl ZenohCaller {
    pub fn new(service: &str, key: String, gid: Gid, servers: Arc<AtomicUsize>) -> Self {
        let timeout = if service.ends_with(GET_RESULT) { RESULT_TIMEOUT } else { TIMEOUT };
        let queue = Arc::new(ReceiveQueue::new(QUEUE_CAPACITY));
        Self { key, gid, timeout, servers, queue, state: Mutex::default() }
    }
}

impl SessionEndpoint for ZenohCaller {
    fn declare(&self, session: &Session) -> Result<()> {
        let querier = session
            .declare_querier(self.key.clone())
            .target(QueryTarget::AllComplete)
            .consolidation(ConsolidationMode::None)
            .timeout(self.timeout);
        locked(&self.state).querier = Some(querier.wait()?);
        Ok(())
    }
}

impl RequestWriter for Arc<ZenohCaller> {
    fn has_server(&self) -> bool {
        self.servers.load(Ordering::Acquire) > 0
    }

    fn send(&self, request: Vec<u8>) -> std::result::Result<RequestNumber, String> {
        let mut state = locked(&self.state);
        state.sent += 1;
        let (number, queue) = (state.sent, Arc::clone(&self.queue));
        let querier = state.querier.as_ref().ok_or("no router is reached")?;
        let take = move |reply: Reply| {
            // An error means that no response has come in time; the client gives up by its own timeout.
            if let Ok(sample) = reply.result() {
                let response = sample.payload().to_bytes().into_owned();
                let size = response.len();
                queue.push((number, response), size);
            }
        };
        let attachment = MessageAttachment::now(number, self.gid).encode();
        let sent = querier.get().payload(request).attachment(attachment).callback(take).wait();
        sent.map(|()| number).map_err(|error| error.to_string())
    }

    fn set_waker(&self, waker: &Waker) {
        self.queue.set_waker(waker);
    }

    fn take(&self) -> std::result::Result<Option<(RequestNumber, Vec<u8>)>, String> {
        Ok(self.queue.take())
    }
}
