//! Request and its answer.

use std::net::SocketAddr;
use std::sync::Arc;

use hyper::body::Incoming;
use hyper::header::{
    ACCEPT, ACCEPT_ENCODING, CACHE_CONTROL, CONTENT_ENCODING, ETAG, HeaderMap, HeaderValue, IF_NONE_MATCH,
    UPGRADE, VARY,
};
use hyper::{Method, Request, Response, StatusCode};
use serde_json::json;
use slate_control::operations::{is_stop, of_request};
use slate_control::{
    BASE, Caller, ConnectionSlot, Problem, Query, ResponseBody, json_response, lower_role, response,
    with_caller_name,
};

use super::ConsoleHost;
use crate::socket;

/// Value of the header `Prefer` that requests refusals with status 200.
/// The problem then has the real status. A browser logs every other status as a failure of the page, and a refusal is
/// none.
const REFUSAL_PREFERENCE: &str = "refusal=200";

/// Statuses of requests that are understood and refused.
const REFUSAL_STATUSES: [StatusCode; 3] =
    [StatusCode::CONFLICT, StatusCode::PRECONDITION_FAILED, StatusCode::UNPROCESSABLE_ENTITY];

/// Answers a request.
pub(super) async fn respond(
    host: &Arc<ConsoleHost>,
    slot: &Arc<ConnectionSlot>,
    from: SocketAddr,
    request: Request<Incoming>,
) -> Response<ResponseBody> {
    let _work = slot.begin_request();
    let is_get = *request.method() == Method::GET;
    let prefers_verdict =
        text(request.headers(), "prefer").is_some_and(|wish| wish.contains(REFUSAL_PREFERENCE));
    match answer(host, slot, from, request).await {
        Ok(response) => response,
        Err(problem) => {
            let mut response = problem.response();
            if prefers_verdict && REFUSAL_STATUSES.contains(&problem.status) {
                *response.status_mut() = StatusCode::OK;
                response
                    .headers_mut()
                    .insert("preference-applied", HeaderValue::from_static(REFUSAL_PREFERENCE));
            }
            if !is_get && problem.status == StatusCode::PAYLOAD_TOO_LARGE {
                // The rest of the request is not read.
                response.headers_mut().insert("connection", HeaderValue::from_static("close"));
            }
            response
        }
    }
}

async fn answer(
    host: &Arc<ConsoleHost>,
    slot: &Arc<ConnectionSlot>,
    from: SocketAddr,
    request: Request<Incoming>,
) -> Result<Response<ResponseBody>, Problem> {
    let asks_for_stop =
        || of_request(request.method().as_str(), request.uri().path()).is_ok_and(|found| is_stop(&found));
    let is_stop = asks_for_stop();
    if slot.only_stops && !is_stop {
        return Err(Problem::too_many());
    }
    let is_socket = request.headers().contains_key(UPGRADE);
    host.guard.check_place(request.uri(), request.headers(), is_socket)?;
    if is_socket {
        return socket::open(&host.dispatcher, &host.guard, slot, from, request);
    }
    let (head, body) = request.into_parts();
    let path = head.uri.path();
    if let Some(answer) = page(host, &head.method, path, &head.headers) {
        return Ok(answer);
    }
    let query = head.uri.query().unwrap_or_default();
    let mut query = if is_stop { Query::parse_leniently(query) } else { Query::parse(query)? };
    let role = lower_role(host.guard.role(&head.method, &head.headers, &mut query)?, &head.headers);
    let found = of_request(head.method.as_str(), path)?;
    // A stop never waits, and is never rate-limited.
    if !is_stop {
        host.guard.check_rate()?;
    }
    let (who, is_told) = with_caller_name(format!("{role} at {from}"), &head.headers);
    let caller = Caller { role, who, local: None, is_told, connection: Arc::clone(slot) };
    host.dispatcher.answer(found, caller, (path, &head.headers), query, body).await
}

/// Returns content that needs no token: pages, and the directory of the rest.
fn page(
    host: &ConsoleHost,
    method: &Method,
    path: &str,
    headers: &HeaderMap,
) -> Option<Response<ResponseBody>> {
    if *method != Method::GET && *method != Method::HEAD {
        return None;
    }
    // A browser wants a page, a program wants to know where the rest is.
    let wants_index =
        path == "/" && !text(headers, ACCEPT.as_str()).unwrap_or_default().contains("text/html");
    let page = if wants_index { None } else { host.pages.find(path) };
    let Some(page) = page else {
        let index = json!({ "api": BASE, "openapi": format!("{BASE}/openapi.json") });
        return (path == "/").then(|| json_response(StatusCode::OK, &index));
    };
    let small = if takes_gzip(headers) { host.pages.smaller(&page) } else { None };
    let form = if small.is_some() { "-gzip" } else { "" };
    let version = format!("\"{:08x}-{:x}{form}\"", crc32fast::hash(&page.content), page.content.len());
    let is_known = text(headers, IF_NONE_MATCH.as_str()).is_some_and(|known| known.contains(&version));
    let is_small = small.is_some();
    let mut answer = match is_known {
        true => response(StatusCode::NOT_MODIFIED, &page.kind, ResponseBody::Whole(None)),
        false => response(StatusCode::OK, &page.kind, ResponseBody::of(small.unwrap_or(page.content))),
    };
    answer.headers_mut().insert(VARY, HeaderValue::from_static("accept-encoding"));
    if is_small && !is_known {
        answer.headers_mut().insert(CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    }
    // It may be cached, but must be revalidated.
    answer.headers_mut().insert(CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    if let Ok(version) = HeaderValue::from_str(&version) {
        answer.headers_mut().insert(ETAG, version);
    }
    Some(answer)
}

/// Returns whether a client accepts gzip.
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
