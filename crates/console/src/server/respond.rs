//! One request and its answer.

use std::net::SocketAddr;
use std::sync::Arc;

use http_body_util::{BodyExt, LengthLimitError, Limited};
use hyper::body::{Bytes, Incoming};
use hyper::header::{
    ACCEPT, ACCEPT_ENCODING, CACHE_CONTROL, CONTENT_ENCODING, CONTENT_TYPE, ETAG, HeaderMap, HeaderValue,
    IF_MATCH, IF_NONE_MATCH, UPGRADE, VARY,
};
use hyper::{Method, Request, Response, StatusCode};
use serde_json::{Value as Json, json};
use slate_module::Level;

use super::{Hall, REQUEST};
use crate::answer::{Body, json_response, response, whole};
use crate::api::{DRIVE, OPERATIONS, STOP};
use crate::connection::Place;
use crate::problem::Problem;
use crate::query::Query;
use crate::route::{Ask, BASE, Found, check_query, find};
use crate::socket;

/// The longest body, bytes.
const BODY: usize = 1 << 20;

/// What whoever asks says by `Prefer` to be told of a refusal as of anything else that comes of a request: with status 200, and
/// the real one in the problem. A browser writes each other status into its log as a failure of the page, and to be refused is
/// none.
const VERDICT: &str = "refusal=200";

/// What is understood, and refused.
const VERDICTS: [StatusCode; 3] =
    [StatusCode::CONFLICT, StatusCode::PRECONDITION_FAILED, StatusCode::UNPROCESSABLE_ENTITY];

/// Answers a request.
pub(super) async fn respond(
    hall: &Arc<Hall>,
    place: &Arc<Place>,
    from: SocketAddr,
    request: Request<Incoming>,
) -> Response<Body> {
    let _work = place.work();
    let is_get = *request.method() == Method::GET;
    let prefers_verdict = text(request.headers(), "prefer").is_some_and(|wish| wish.contains(VERDICT));
    match answer(hall, place, from, request).await {
        Ok(response) => response,
        Err(problem) => {
            let mut response = problem.response();
            if prefers_verdict && VERDICTS.contains(&problem.status) {
                *response.status_mut() = StatusCode::OK;
                response.headers_mut().insert("preference-applied", HeaderValue::from_static(VERDICT));
            }
            if !is_get && problem.status == StatusCode::PAYLOAD_TOO_LARGE {
                // What still comes is not read.
                response.headers_mut().insert("connection", HeaderValue::from_static("close"));
            }
            response
        }
    }
}

async fn answer(
    hall: &Arc<Hall>,
    place: &Arc<Place>,
    from: SocketAddr,
    request: Request<Incoming>,
) -> Result<Response<Body>, Problem> {
    let is_socket = request.headers().contains_key(UPGRADE);
    hall.guard.check_place(request.uri(), request.headers(), is_socket)?;
    if is_socket {
        return socket::open(&hall.context, &hall.guard, place, from, request);
    }
    let (head, body) = request.into_parts();
    let path = head.uri.path();
    if let Some(answer) = page(hall, &head.method, path, &head.headers) {
        return Ok(answer);
    }
    let mut query = Query::parse(head.uri.query().unwrap_or_default())?;
    let role = hall.guard.role(&head.method, &head.headers, &mut query)?;
    let (operation, captured): Found = find(OPERATIONS, head.method.as_str(), path)?;
    // A stop waits for nobody, and is never too much.
    let is_stop = operation.name == STOP;
    if !is_stop {
        hall.guard.check_rate()?;
    }
    if role < operation.role {
        let message = format!("{} may not do this", role.one());
        let help = format!("ask with the token of {}", operation.role.one());
        return Err(Problem::new(StatusCode::FORBIDDEN, message, help));
    }
    let body = if is_stop {
        // What can't be understood is no reason not to stop.
        read(&head.headers, body, true).await.unwrap_or_default()
    } else {
        check_query(operation, &query)?;
        read(&head.headers, body, operation.body.is_some()).await?
    };
    let who = format!("{role} at {from}");
    let ask = Ask {
        role,
        who: who.clone(),
        captured,
        query,
        accept: text(&head.headers, ACCEPT.as_str()).unwrap_or_default(),
        if_match: text(&head.headers, IF_MATCH.as_str()),
        last_event: text(&head.headers, "last-event-id").and_then(|text| text.parse().ok()),
        body,
    };
    let _permit = match is_stop {
        true => None,
        // It is closed by nobody.
        false => Arc::clone(&hall.work).acquire_owned().await.ok(),
    };
    let context = Arc::clone(&hall.context);
    let answer = if is_stop {
        // Here, as there may be no thread left.
        (operation.handler)(&context, &ask)
    } else {
        let worked = tokio::task::spawn_blocking(move || (operation.handler)(&context, &ask)).await;
        let broken =
            |_| Problem::new(StatusCode::INTERNAL_SERVER_ERROR, "the request has failed", "see the log");
        worked.map_err(broken)?
    };
    // Who drives says so many times a second, and who has the controls is in the log.
    if operation.method != "GET" && operation.name != DRIVE {
        let done = match &answer {
            Ok(_) => "is done".to_owned(),
            Err(problem) => format!("is refused with {}", problem.status.as_u16()),
        };
        let path = slate_runtime::printable_text(path);
        let text = format!("{who}: {} {path} {done}", operation.method);
        // A slider that is dragged asks for the same many times a second.
        let level = if hall.repeats.is_new(&format!("{role} {} {path} {done}", operation.method)) {
            Level::Info
        } else {
            Level::Debug
        };
        hall.context.log(level, &text);
    }
    Ok(whole(answer?))
}

/// What is shown without a token: pages, and where the rest is.
fn page(hall: &Hall, method: &Method, path: &str, headers: &HeaderMap) -> Option<Response<Body>> {
    if *method != Method::GET && *method != Method::HEAD {
        return None;
    }
    // A browser wants a page, a program wants to know where the rest is.
    let wants_index =
        path == "/" && !text(headers, ACCEPT.as_str()).unwrap_or_default().contains("text/html");
    let page = if wants_index { None } else { hall.pages.find(path) };
    let Some(page) = page else {
        let index = json!({ "api": BASE, "openapi": format!("{BASE}/openapi.json") });
        return (path == "/").then(|| json_response(StatusCode::OK, &index));
    };
    let small = if takes_gzip(headers) { hall.pages.smaller(&page) } else { None };
    let form = if small.is_some() { "-gzip" } else { "" };
    let version = format!("\"{:08x}-{:x}{form}\"", crc32fast::hash(&page.content), page.content.len());
    let is_known = text(headers, IF_NONE_MATCH.as_str()).is_some_and(|known| known.contains(&version));
    let is_small = small.is_some();
    let mut answer = match is_known {
        true => response(StatusCode::NOT_MODIFIED, &page.kind, Body::Whole(None)),
        false => response(StatusCode::OK, &page.kind, Body::of(small.unwrap_or(page.content))),
    };
    answer.headers_mut().insert(VARY, HeaderValue::from_static("accept-encoding"));
    if is_small && !is_known {
        answer.headers_mut().insert(CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    }
    // It may be kept, and is asked for again each time.
    answer.headers_mut().insert(CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    if let Ok(version) = HeaderValue::from_str(&version) {
        answer.headers_mut().insert(ETAG, version);
    }
    Some(answer)
}

/// Whether whoever asks can read gzip.
fn takes_gzip(headers: &HeaderMap) -> bool {
    let accepted = text(headers, ACCEPT_ENCODING.as_str()).unwrap_or_default();
    accepted.split(',').any(|coding| {
        let (name, weight) = coding.split_once(';').unwrap_or((coding, ""));
        let weight = weight.trim().strip_prefix("q=").map(str::trim);
        name.trim().eq_ignore_ascii_case("gzip")
            && weight.is_none_or(|weight| weight.parse::<f64>().ok() != Some(0.0))
    })
}

fn text(headers: &HeaderMap, name: &str) -> Option<String> {
    headers.get(name)?.to_str().ok().map(ToOwned::to_owned)
}

/// The body as JSON; nothing when it is empty.
async fn read(headers: &HeaderMap, body: Incoming, is_taken: bool) -> Result<Option<Json>, Problem> {
    let collected = tokio::time::timeout(REQUEST, Limited::new(body, BODY).collect()).await;
    let late =
        |_| Problem::new(StatusCode::REQUEST_TIMEOUT, "the body has not come in time", "send it at once");
    let bytes: Bytes = match collected.map_err(late)? {
        Ok(collected) => collected.to_bytes(),
        Err(error) if error.is::<LengthLimitError>() => {
            let message = format!("the body is longer than {BODY} bytes");
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
        return Err(Problem::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, message, "send it as it is"));
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
