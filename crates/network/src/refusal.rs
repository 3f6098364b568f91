//! Answers that refuse a query.

use serde_json::{Value as Json, json};
use slate_control::Problem;
use zenoh::Wait;
use zenoh::bytes::Encoding;
use zenoh::query::Query;

/// Answers that go back as an error.
pub struct QueryRefusal {
    /// `refused`, or `full` when the request may be repeated.
    status: &'static str,
    reason: String,
    help: String,
    code: Option<String>,
}

impl QueryRefusal {
    pub fn new(reason: impl Into<String>, help: impl Into<String>) -> Self {
        Self { status: "refused", reason: reason.into(), help: help.into(), code: None }
    }

    pub fn full(reason: impl Into<String>) -> Self {
        Self { status: "full", ..Self::new(reason, "ask again later") }
    }

    /// Returns the reason in words.
    pub fn into_reason(self) -> String {
        self.reason
    }

    fn json(&self) -> Json {
        let mut body = json!({ "status": self.status, "reason": self.reason, "help": self.help });
        if let Some(code) = &self.code {
            body["code"] = json!(code);
        }
        body
    }
}

impl From<Problem> for QueryRefusal {
    fn from(problem: Problem) -> Self {
        let body = problem.json();
        let text = |name: &str| body[name].as_str().map(ToOwned::to_owned);
        let status = if problem.status == 503 { "full" } else { "refused" };
        Self {
            status,
            reason: problem.detail().into(),
            help: text("help").unwrap_or_default(),
            code: text("code"),
        }
    }
}

/// Answers a query with a refusal.
pub fn refuse(query: &Query, refused: &QueryRefusal) {
    let _ = query.reply_err(refused.json().to_string()).encoding(Encoding::APPLICATION_JSON).wait();
}
