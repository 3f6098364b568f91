//! Carries out the operation of a request.

use std::sync::Arc;
use std::time::Duration;

use http_body_util::{BodyExt, LengthLimitError, Limited};
use hyper::body::{Bytes, Incoming};
use hyper::header::{ACCEPT, CONTENT_ENCODING, CONTENT_TYPE, HeaderMap, IF_MATCH};
use hyper::{Response, StatusCode};
use serde_json::Value as Json;
use slate_module::Level;
use tokio::sync::{OwnedMutexGuard, OwnedSemaphorePermit, Semaphore};

use crate::answer::{OperationAnswer, ResponseBody, whole};
use crate::operation::{
    BASE, Caller, MatchedOperation, Operation, OperationRequest, Pace, check_query, check_role,
};
use crate::operations::{DRIVE, STOP, by_name, carry_out};
use crate::problem::Problem;
use crate::query::Query;
use crate::route;
use crate::surface::ControlSurface;

/// Maximum size of a body, bytes.
const MAX_BODY_SIZE: usize = 1 << 20;

/// Timeout for the arrival of a request.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(10);

/// Time that a stop waits for its reason.
const REASON_TIMEOUT: Duration = Duration::from_millis(100);

/// Carries out requests of the table of operations, whichever way they come.
pub struct Dispatcher {
    surface: Arc<ControlSurface>,
    /// Places of requests that may take long.
    work: Arc<Semaphore>,
    /// Policy without a free permit: true to wait, false to refuse the request.
    waits: bool,
}

impl std::fmt::Debug for Dispatcher {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Dispatcher").field("surface", &self.surface).finish_non_exhaustive()
    }
}

/// Permits of an operation, held until its end.
#[derive(Default)]
pub struct OperationTurn {
    _place: Option<OwnedSemaphorePermit>,
    _change: Option<OwnedMutexGuard<()>>,
}

impl std::fmt::Debug for OperationTurn {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OperationTurn").finish_non_exhaustive()
    }
}

impl Dispatcher {
    /// Creates the dispatcher of an agent with `places` permits for slow requests.
    /// One more waits, or is refused.
    pub fn new(surface: Arc<ControlSurface>, places: usize, waits: bool) -> Self {
        let work = Arc::new(Semaphore::new(places));
        Self { surface, work, waits }
    }

    /// Returns the surface of the agent.
    pub fn surface(&self) -> &Arc<ControlSurface> {
        &self.surface
    }

    /// Stops the actuators before the body of the request is read.
    /// It depends on no thread, no descriptor and no other request.
    pub fn stop(
        &self,
        found: MatchedOperation,
        caller: Caller,
        query: Query,
        body: Option<Json>,
    ) -> Response<ResponseBody> {
        let path = found.operation.path;
        let request = OperationRequest {
            caller,
            captured: found.captured,
            query,
            accept: String::new(),
            if_match: None,
            last_event: None,
            body,
        };
        let answer = found.operation.carry_out(&self.surface, &request);
        self.log(found.operation, &request.caller, path, &answer);
        answer.map_or_else(|problem| problem.response(), whole)
    }

    /// Carries out a requested operation, if the role allows it.
    ///
    /// # Errors
    /// Why it is not done.
    pub async fn answer(
        &self,
        found: MatchedOperation,
        caller: Caller,
        (path, headers): (&str, &HeaderMap),
        query: Query,
        body: Incoming,
    ) -> Result<Response<ResponseBody>, Problem> {
        let MatchedOperation { operation, captured } = found;
        if let Err(problem) = check_role(operation.role, caller.role) {
            let refused = Err(problem);
            if caller.is_told {
                self.log(operation, &caller, path, &refused);
            }
            return refused.map(whole);
        }
        if operation.name == STOP {
            // An invalid or incomplete body never prevents a stop.
            let read = tokio::time::timeout(REASON_TIMEOUT, read(headers, body, true)).await;
            let body = read.ok().and_then(Result::ok).flatten();
            return Ok(self.stop(MatchedOperation { operation, captured }, caller, query, body));
        }
        check_query(operation, &query)?;
        let body = read(headers, body, operation.body.is_some()).await?;
        let request = OperationRequest {
            caller: caller.clone(),
            captured,
            query,
            accept: text(headers, ACCEPT.as_str()).unwrap_or_default(),
            if_match: text(headers, IF_MATCH.as_str()),
            last_event: text(headers, "last-event-id").and_then(|text| text.parse().ok()),
            body,
        };
        let turn = self.turn(operation).await?;
        let surface = Arc::clone(&self.surface);
        let worked = tokio::task::spawn_blocking(move || {
            // It ends with the work, also when the caller no longer waits for the answer.
            let _turn = turn;
            let answer = operation.carry_out(&surface, &request);
            if operation.method != "GET" {
                // A reported change is in the recording.
                surface.agent.settle();
            }
            answer
        });
        let broken =
            |_| Problem::new(StatusCode::INTERNAL_SERVER_ERROR, "the request has failed", "see the log");
        let answer = worked.await.map_err(broken)?;
        self.log(operation, &caller, path, &answer);
        Ok(whole(answer?))
    }

    /// Carries out an operation for another protocol, as [`carry_out`], and logs it.
    /// The caller must hold the [`turn`](Dispatcher::turn) of the operation.
    ///
    /// # Errors
    /// As [`carry_out`].
    pub fn carry_out(
        &self,
        caller: &Caller,
        name: &str,
        parts: &[(&str, &str)],
        body: Json,
    ) -> Result<OperationAnswer, Problem> {
        let answer = carry_out(&self.surface, caller, name, parts, body);
        if let Some(operation) = by_name(name) {
            let path = route::filled(operation.path, self.surface.name(), parts);
            self.log(operation, caller, &format!("{BASE}{path}"), &answer);
        }
        answer
    }

    /// Acquires the permits of an operation; dropping the future releases them.
    ///
    /// # Errors
    /// When no permit is free, or another change does not end in time.
    pub async fn turn(&self, operation: &'static Operation) -> Result<OperationTurn, Problem> {
        if operation.pace == Pace::Prompt {
            return Ok(OperationTurn::default());
        }
        // A change that waits for its turn holds no permit: reads need them.
        let change = if operation.pace == Pace::Change {
            Some(self.surface.changes.next(operation.name).await?)
        } else {
            None
        };
        let work = Arc::clone(&self.work);
        let place = match self.waits {
            // Nothing closes it.
            true => work.acquire_owned().await.ok(),
            false => Some(work.try_acquire_owned().map_err(|_| Problem::too_many())?),
        };
        Ok(OperationTurn { _place: place, _change: change })
    }

    /// Logs an operation; reads and repeated drive commands are left out.
    fn log(
        &self,
        operation: &Operation,
        caller: &Caller,
        path: &str,
        answer: &Result<OperationAnswer, Problem>,
    ) {
        let reads_only = operation.method == "GET" || matches!(operation.name, "watch" | "measure");
        let is_quiet = caller.who.is_empty() || operation.name == DRIVE || (reads_only && !caller.is_told);
        if is_quiet {
            return;
        }
        let done = match answer {
            Ok(_) => "is done".to_owned(),
            Err(problem) => format!("is refused with {}", problem.status.as_u16()),
        };
        let path = slate_runtime::printable_text(path);
        let request = format!("{} {path} {done}", operation.method);
        // A slider that is dragged requests the same many times a second.
        let is_new = caller.is_told || self.surface.repeats.is_new(&format!("{} {request}", caller.role));
        let level = if is_new { Level::Info } else { Level::Debug };
        self.surface.log(level, &format!("{}: {request}", caller.who));
    }
}

fn text(headers: &HeaderMap, name: &str) -> Option<String> {
    headers.get(name)?.to_str().ok().map(ToOwned::to_owned)
}

/// Reads the body as JSON; `None` when it is empty.
async fn read(headers: &HeaderMap, body: Incoming, is_taken: bool) -> Result<Option<Json>, Problem> {
    let collected = tokio::time::timeout(REQUEST_TIMEOUT, Limited::new(body, MAX_BODY_SIZE).collect()).await;
    let late =
        |_| Problem::new(StatusCode::REQUEST_TIMEOUT, "the body has not come in time", "send it at once");
    let bytes: Bytes = match collected.map_err(late)? {
        Ok(collected) => collected.to_bytes(),
        Err(error) if error.is::<LengthLimitError>() => {
            let message = format!("the body is longer than {MAX_BODY_SIZE} bytes");
            return Err(Problem::new(StatusCode::PAYLOAD_TOO_LARGE, message, "send less at once"));
        }
        Err(error) => return Err(Problem::bad(format!("the body can't be read: {error}"), "send it again")),
    };
    if bytes.is_empty() {
        return Ok(None);
    }
    if !is_taken {
        return Err(Problem::bad("this takes no body", "send none"));
    }
    if let Some(coding) = text(headers, CONTENT_ENCODING.as_str()).filter(|coding| coding != "identity") {
        let message = format!("the body is coded as `{coding}`");
        return Err(Problem::new(
            StatusCode::UNSUPPORTED_MEDIA_TYPE,
            message,
            "send it without a content encoding",
        ));
    }
    let kind = text(headers, CONTENT_TYPE.as_str()).unwrap_or_default();
    let kind = kind.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    if kind != "application/json" && kind != "application/merge-patch+json" {
        let message = format!("the body is `{kind}`");
        return Err(Problem::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, message, "send application/json"));
    }
    let wrong = |error| Problem::bad(format!("the body is no JSON: {error}"), "send one JSON value");
    serde_json::from_slice(&bytes).map(Some).map_err(wrong)
}
