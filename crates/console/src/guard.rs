//! Access control: origin, host and token of a request.
//! A browser shows pages from anywhere, so a request from this machine proves nothing about its author.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use hyper::header::{AUTHORIZATION, HOST, HeaderMap, ORIGIN, SEC_WEBSOCKET_PROTOCOL};
use hyper::{Method, StatusCode, Uri};
use tokio::time::Instant;

use crate::token::Tokens;
use slate_control::Problem;
use slate_control::Query;
use slate_control::Role;

/// Prefix of a token among a WebSocket's subprotocols.
/// A browser can set no other header.
pub(crate) const TOKEN_PROTOCOL: &str = "slate.token.";

/// Rate of wrong tokens that are answered, Hz.
/// Beyond it, callers are only told to wait.
const MAX_FAILURE_RATE: f64 = 5.0;

/// Rate of requests of all callers together, Hz.
const MAX_REQUEST_RATE: f64 = 500.0;

/// State of access control: tokens, origins and rates.
pub(crate) struct Guard {
    tokens: Tokens,
    /// Names and addresses with the port, as `Host` has them.
    hosts: Vec<String>,
    /// Origins, as `Origin` has them: our own, and those that are listed.
    own: Vec<String>,
    listed: Vec<String>,
    failures: Bucket,
    requests: Bucket,
}

impl Guard {
    /// Creates the guard.
    /// `hosts` are names and addresses, each with the port.
    pub fn new(tokens: Tokens, scheme: &str, hosts: Vec<String>, listed: Vec<String>) -> Self {
        let hosts: Vec<_> = hosts.into_iter().map(|host| host.to_ascii_lowercase()).collect();
        let own = hosts.iter().map(|host| format!("{scheme}://{host}")).collect();
        let listed = listed.into_iter().map(|origin| origin.to_ascii_lowercase()).collect();
        Self {
            tokens,
            hosts,
            own,
            listed,
            failures: Bucket::new(MAX_FAILURE_RATE),
            requests: Bucket::new(MAX_REQUEST_RATE),
        }
    }

    /// Checks that a request is meant for this agent and from no foreign page.
    /// Listed pages may open WebSockets.
    pub fn check_place(&self, uri: &Uri, headers: &HeaderMap, is_socket: bool) -> Result<(), Problem> {
        let text = |value: &hyper::header::HeaderValue| value.to_str().unwrap_or("?").to_ascii_lowercase();
        let hosts: Vec<_> = headers.get_all(HOST).iter().map(text).collect();
        let authority = uri.authority().map(|authority| authority.as_str().to_ascii_lowercase());
        let named = hosts.iter().chain(&authority);
        if hosts.len() != 1 || named.clone().any(|host| !self.hosts.contains(host)) {
            let message = format!("this is not {}", named.cloned().collect::<Vec<_>>().join(", "));
            let help = "ask for the address that the agent prints, or list the name in `console.names`";
            return Err(Problem::new(StatusCode::MISDIRECTED_REQUEST, message, help));
        }
        let foreign = |what: &str| {
            let help = "open the page that the agent prints; other pages that may open WebSockets are listed in \
                        `console.origins`";
            Err(Problem::new(StatusCode::FORBIDDEN, format!("{what} may not ask this agent"), help))
        };
        let origins: Vec<_> = headers.get_all(ORIGIN).iter().map(text).collect();
        let is_listed =
            is_socket && !origins.is_empty() && origins.iter().all(|origin| self.listed.contains(origin));
        if let Some(origin) = origins.iter().find(|origin| !self.own.contains(origin))
            && !is_listed
        {
            return foreign(&format!("a page of {origin}"));
        }
        let site = headers.get("sec-fetch-site").map(text);
        match site.as_deref() {
            None | Some("same-origin" | "none") => Ok(()),
            Some(_) if is_listed => Ok(()),
            Some(site) => foreign(&format!("a page elsewhere ({site})")),
        }
    }

    /// Returns the role of a caller.
    /// A browser can set no header for images and WebSockets, so these have the token elsewhere.
    pub fn role(&self, method: &Method, headers: &HeaderMap, query: &mut Query) -> Result<Role, Problem> {
        let in_query = query.take("token").filter(|_| *method == Method::GET);
        let bearer = headers.get(AUTHORIZATION).and_then(|value| value.to_str().ok());
        let bearer = bearer.and_then(|text| {
            let (scheme, token) = text.split_once(' ')?;
            scheme.eq_ignore_ascii_case("bearer").then(|| token.trim().to_owned())
        });
        let among_protocols = protocols(headers)
            .into_iter()
            .find_map(|protocol| protocol.strip_prefix(TOKEN_PROTOCOL).map(ToOwned::to_owned));
        let given = bearer.or(among_protocols).or(in_query);
        let help = "send `Authorization: Bearer TOKEN`; the agent prints a token with its link";
        if let Some(role) = given.as_deref().and_then(|token| self.tokens.role(token)) {
            return Ok(role);
        }
        if !self.failures.takes() {
            let message = "too many wrong tokens";
            return Err(Problem::new(StatusCode::TOO_MANY_REQUESTS, message, "wait").with("retry-after", "1"));
        }
        let message = if given.is_some() { "the token is unknown" } else { "the request has no token" };
        Err(Problem::new(StatusCode::UNAUTHORIZED, message, help).with("www-authenticate", "Bearer"))
    }

    /// Checks that the request rate permits one more request.
    pub fn check_rate(&self) -> Result<(), Problem> {
        if self.requests.takes() {
            return Ok(());
        }
        let help = "open a WebSocket for repeated requests";
        let problem = Problem::new(StatusCode::TOO_MANY_REQUESTS, "too many requests", help);
        Err(problem.with("retry-after", "1"))
    }
}

/// Returns the subprotocols that a WebSocket offers.
pub(crate) fn protocols(headers: &HeaderMap) -> Vec<String> {
    let texts = headers.get_all(SEC_WEBSOCKET_PROTOCOL).iter().filter_map(|value| value.to_str().ok());
    texts.flat_map(|text| text.split(',').map(|protocol| protocol.trim().to_owned())).collect()
}

/// Token bucket with a rate per second and a burst of twice that.
pub(crate) struct Bucket {
    rate: f64,
    level: Mutex<(f64, Option<Instant>)>,
}

impl Bucket {
    pub fn new(rate: f64) -> Self {
        Self { rate, level: Mutex::new((2.0 * rate, None)) }
    }

    pub fn takes(&self) -> bool {
        let mut level = self.level.lock().unwrap_or_else(PoisonError::into_inner);
        let now = Instant::now();
        let passed = level.1.map_or(Duration::ZERO, |before| now.saturating_duration_since(before));
        let filled = level.0 + passed.as_secs_f64() * self.rate;
        let full = 2.0 * self.rate;
        let filled = if filled > full { full } else { filled };
        let takes = filled >= 1.0;
        *level = (if takes { filled - 1.0 } else { filled }, Some(now));
        takes
    }
}
