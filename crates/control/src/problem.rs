//! Problems as in RFC 9457.

use hyper::StatusCode;
use serde_json::{Value as Json, json};
use slate_blackboard::BoardError;
use slate_runtime::configuration::Report;
use slate_runtime::{ErrorCode, Message};

use crate::entries::Refusal;

/// Reason why an operation is not carried out.
#[derive(Debug)]
pub struct Problem {
    /// Status of HTTP.
    pub status: StatusCode,
    /// Message.
    detail: String,
    /// Advice.
    help: String,
    /// Error code.
    error_code: Option<ErrorCode>,
    /// File, line and caret of errors in a configuration.
    report: Option<String>,
    /// Headers that the status wants.
    pub headers: Vec<(&'static str, String)>,
}

impl Problem {
    /// Creates a problem with that status.
    pub fn new(status: StatusCode, detail: impl Into<String>, help: impl Into<String>) -> Self {
        let (detail, help) = (detail.into(), help.into());
        let error_code = match status {
            StatusCode::NOT_FOUND => Some(ErrorCode::Name),
            StatusCode::UNPROCESSABLE_ENTITY => Some(ErrorCode::Value),
            _ => None,
        };
        Self { status, detail, help, error_code, report: None, headers: Vec::new() }
    }

    /// Sets the error code.
    pub fn of(self, error_code: ErrorCode) -> Self {
        Self { error_code: Some(error_code), ..self }
    }

    /// Adds a header.
    pub fn with(mut self, name: &'static str, value: impl Into<String>) -> Self {
        self.headers.push((name, value.into()));
        self
    }

    /// Creates the problem of a malformed request.
    pub fn bad(detail: impl Into<String>, help: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, detail, help)
    }

    /// Creates the problem of an unknown name.
    pub fn not_found(detail: impl Into<String>, help: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, detail, help)
    }

    /// Creates the problem of a request that is understood, but invalid.
    pub fn unfit(detail: impl Into<String>, help: impl Into<String>) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, detail, help)
    }

    /// Creates the problem of a request beyond the limit of concurrent ones.
    pub fn too_many() -> Self {
        let message = "too many tools are at work with this agent";
        Self::new(StatusCode::SERVICE_UNAVAILABLE, message, "try again later").with("retry-after", "1")
    }

    /// A request to an agent whose run is over.
    pub fn run_over(agent: &str, how: &str, consequence: &str) -> Self {
        let message = format!("the run of agent `{agent}` is over ({how}), so {consequence}");
        let help = "end the agent with Ctrl-C and start it again, such as `slate run exp1`; `slate get` prints its last values";
        Self::new(StatusCode::CONFLICT, message, help).of(ErrorCode::RunOver)
    }

    /// Creates the problem of a refusal by the agent.
    pub fn refused(status: StatusCode, refusal: Refusal) -> Self {
        let error_code = refusal.code.as_deref().and_then(ErrorCode::from_code);
        let problem = Self::new(status, refusal.message, refusal.help);
        Self { error_code: error_code.or(problem.error_code), report: refusal.report, ..problem }
    }

    /// Returns the message.
    pub fn detail(&self) -> &str {
        &self.detail
    }

    /// Returns the body that reports it.
    pub fn json(&self) -> Json {
        let mut body = json!({
            "type": "about:blank",
            "title": self.status.canonical_reason().unwrap_or("Error"),
            "status": self.status.as_u16(),
            "detail": self.detail,
        });
        let code = self.error_code.map(|error_code| error_code.code().to_owned());
        for (name, text) in
            [("help", Some(&self.help)), ("code", code.as_ref()), ("report", self.report.as_ref())]
        {
            if let Some(text) = text.filter(|text| !text.is_empty()) {
                body[name] = json!(text);
            }
        }
        body
    }
}

impl std::fmt::Display for Problem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.detail)?;
        if self.help.is_empty() { Ok(()) } else { write!(f, " ({})", self.help) }
    }
}

impl From<Refusal> for Problem {
    fn from(refusal: Refusal) -> Self {
        Self::refused(StatusCode::UNPROCESSABLE_ENTITY, refusal)
    }
}

impl From<Report> for Problem {
    fn from(report: Report) -> Self {
        Refusal::from(report).into()
    }
}

impl From<BoardError> for Problem {
    fn from(error: BoardError) -> Self {
        let Message { text, error_code } = Message::from(&error);
        let problem = match error {
            BoardError::Unknown { .. } => {
                Self::not_found(text, "GET /api/v1/properties lists the properties")
            }
            BoardError::OtherAgent { .. } => Self::not_found(text, "ask that agent"),
            _ => Self::unfit(text, "GET /api/v1/interfaces/NAME returns the schema"),
        };
        Self { error_code: error_code.or(problem.error_code), ..problem }
    }
}
