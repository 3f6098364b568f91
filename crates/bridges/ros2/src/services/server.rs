//! Servers of services.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Waker;
use std::time::Duration;

use serde_json::Value as Json;
use slate_blackboard::wake::Wake;
use slate_module::Level;
use slate_runtime::Composer;
use slate_topics::{InboxHandler, ReaderWaker, RosError, ServiceType};

use crate::wire::{NodeWire, RequestReader, Responder};

/// Sleep time of a thread while no messages arrive.
const IDLE_PERIOD: Duration = Duration::from_millis(100);

/// Period of the check whether the first cycle has ended.
const POLL_PERIOD: Duration = Duration::from_millis(2);

/// Responses that wait for a cycle.
pub const DEPTH: usize = 10;

/// Answers requests.
pub trait ServiceHandler: Send + Sync {
    /// Returns the response to a request.
    /// `service` is the index of the service among those of the handler.
    fn answer(&mut self, service: usize, request: &Json) -> Json;
}

impl ServiceHandler for InboxHandler {
    /// Answers a request.
    /// A service of ROS 2 always has a response, also one that can't report a failure.
    fn answer(&mut self, _: usize, request: &Json) -> Json {
        let (Ok(response) | Err((_, response))) = InboxHandler::answer(self, request);
        response
    }
}

/// Service that an agent offers.
pub struct ServiceServer {
    service: String,
    of: ServiceType,
    end: Box<dyn RequestReader>,
    reported: Option<String>,
}

impl ServiceServer {
    /// Offers a service.
    ///
    /// # Errors
    /// When the middleware refuses.
    pub fn open(wire: &dyn NodeWire, service: &str, of: &ServiceType) -> Result<Self, RosError> {
        Ok(Self { service: service.into(), of: of.clone(), end: wire.server(service, of)?, reported: None })
    }

    /// Takes the next request and the responder to its client, if one has come.
    /// Otherwise it registers the waker.
    pub fn take(&mut self, waker: &Waker, context: &ServeContext) -> Option<(Box<dyn Responder>, Json)> {
        // Set before the check, so that a later request wakes this thread.
        self.end.set_waker(waker);
        loop {
            let request = match self.end.take() {
                Ok(request) => request?,
                Err(reason) => {
                    self.report(&context.composer, reason);
                    continue;
                }
            };
            match self.of.request().decode(&request.message) {
                Ok(message) => return Some((request.responder, message)),
                Err(reason) => self.report(&context.composer, reason),
            }
        }
    }

    /// Responds to a request.
    pub fn reply(&mut self, client: Box<dyn Responder>, response: &Json, context: &ServeContext) {
        let message = self.of.response().encode(response);
        match message.and_then(|message| client.reply(message, &|| context.is_ended())) {
            Ok(()) => self.reported = None,
            Err(reason) => self.report(&context.composer, reason),
        }
    }

    /// Logs a reason unless it was logged before.
    fn report(&mut self, composer: &Composer, reason: String) {
        if self.reported.as_ref() != Some(&reason) {
            composer
                .log(Level::Warn, &format!("ros2: a request to {} is not answered: {reason}", self.service));
            self.reported = Some(reason);
        }
    }
}

/// Services that a thread answers, one request after the other.
pub struct ServiceGroup {
    pub name: &'static str,
    pub servers: Vec<ServiceServer>,
    pub handler: Box<dyn ServiceHandler>,
}

/// State that servers share.
pub struct ServeContext {
    pub composer: Composer,
    pub wake: Arc<Wake>,
    pub ended: Arc<AtomicBool>,
}

impl ServeContext {
    pub fn is_ended(&self) -> bool {
        self.ended.load(Ordering::Acquire)
    }
}

/// Waits for the first cycle in lockstep, so that a rerun can repeat messages.
/// A rerun sends them after the cycle in which they came.
pub fn wait_for_start(context: &ServeContext) {
    while !context.is_ended() && context.composer.is_lockstep() && context.composer.cycles() == 0 {
        context.wake.wait_timeout(POLL_PERIOD);
    }
}

/// Answers requests of services, one after the other, until the end.
pub fn serve(mut servers: Vec<ServiceServer>, mut handler: Box<dyn ServiceHandler>, context: &ServeContext) {
    let waker = Waker::from(Arc::new(ReaderWaker(Arc::clone(&context.wake))));
    wait_for_start(context);
    while !context.is_ended() {
        let mut is_idle = true;
        for (place, server) in servers.iter_mut().enumerate() {
            if let Some((client, request)) = server.take(&waker, context) {
                is_idle = false;
                server.reply(client, &handler.answer(place, &request), context);
            }
        }
        if is_idle {
            context.wake.wait_timeout(IDLE_PERIOD);
        }
    }
}
