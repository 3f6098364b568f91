//! Client's end of a service.

use std::task::Waker;

use serde_json::Value as Json;
use slate_topics::{RosError, ServiceType};

use crate::wire::{NodeWire, RequestNumber, RequestWriter};

/// Sends requests of a service, and takes their responses.
pub struct ServiceCaller {
    of: ServiceType,
    end: Box<dyn RequestWriter>,
}

impl ServiceCaller {
    /// Opens a client of a service.
    ///
    /// # Errors
    /// When the middleware refuses.
    pub fn open(wire: &dyn NodeWire, service: &str, of: &ServiceType) -> Result<Self, RosError> {
        Ok(Self { of: of.clone(), end: wire.caller(service, of)? })
    }

    /// Returns whether a server is available.
    pub fn has_server(&self) -> bool {
        self.end.has_server()
    }

    /// Sends a request; its number identifies the response.
    ///
    /// # Errors
    /// The request does not fit, or the middleware refuses it; the reason in words.
    pub fn send(&self, request: &Json) -> Result<RequestNumber, String> {
        self.end.send(self.of.request().encode(request)?)
    }

    /// Takes the response to a request, if it has come; otherwise it wakes the waker.
    ///
    /// # Errors
    /// The response is invalid; the reason in words.
    pub fn take(&self, request: RequestNumber, waker: &Waker) -> Result<Option<Json>, String> {
        // Set before the check, so that a later response wakes this thread.
        self.end.set_waker(waker);
        while let Some((number, response)) = self.end.take()? {
            // Late responses to earlier requests come here, too.
            if number == request {
                return self.of.response().decode(&response).map(Some);
            }
        }
        Ok(None)
    }
}
