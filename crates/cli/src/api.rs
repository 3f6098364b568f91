//! Any operation of an agent's API, at its socket or over TCP.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::Value;
use slate::control::client::Request;
use slate::control::{BASE, Role};

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;
use crate::role;

#[derive(Debug, Args)]
pub struct ApiOptions {
    /// Method, such as `GET` or `PUT` [default: list all operations]
    #[arg(value_parser = method, requires = "path")]
    method: Option<String>,

    /// Path, such as `/modules` or `/slate/exp1/loop/state?bare`
    #[arg(value_parser = path)]
    path: Option<String>,

    /// JSON, @FILE, or - for stdin
    body: Option<String>,

    /// Media type to accept, such as `text/event-stream`
    #[arg(long, value_name = "KIND", value_parser = header)]
    accept: Option<String>,

    /// Role of the request [default: the highest]
    #[arg(long, value_parser = role::parser())]
    role: Option<Role>,

    /// Write the response into a file
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,

    /// Print the list as JSON
    #[arg(long, conflicts_with = "method")]
    json: bool,

    #[command(flatten)]
    agent: AgentOption,
}

fn method(text: &str) -> Result<String, String> {
    match !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_alphabetic()) {
        true => Ok(text.to_ascii_uppercase()),
        false => Err("expected a method such as GET, PUT, POST, PATCH or DELETE".into()),
    }
}

fn path(text: &str) -> Result<String, String> {
    if let Some(wrong) = text.chars().find(|c| !c.is_ascii_graphic() || *c == '#') {
        return Err(format!("`{}` has to be written as % and its code", wrong.escape_default()));
    }
    let path = if text.starts_with('/') { text.to_owned() } else { format!("/{text}") };
    Ok(if path.starts_with("/api/") { path } else { format!("{BASE}{path}") })
}

fn header(text: &str) -> Result<String, String> {
    match text.chars().all(|c| c.is_ascii_graphic() || c == ' ') {
        true => Ok(text.into()),
        false => Err("expected a kind such as text/event-stream".into()),
    }
}

/// Asks, and prints the answer as it comes.
pub fn api(options: &ApiOptions) -> Result<bool, Failure> {
    let (Some(method), Some(path)) = (&options.method, &options.path) else {
        return list(options);
    };
    let body = options.body.as_deref().map(body).transpose()?;
    let accept = options.accept.as_deref();
    let request = Request { method, path, accept, body: body.as_deref() };
    let mut response = options.agent.request(options.role, &request)?;
    let lost = |source| Failure::File { path: place(options.out.as_deref()), source };
    let mut to: Box<dyn std::io::Write> = match &options.out {
        Some(file) => Box::new(std::fs::File::create(file).map_err(lost)?),
        None => Box::new(std::io::stdout()),
    };
    match std::io::copy(&mut response.body, &mut to) {
        Ok(_) => {}
        // The reader of the pipe has ended, as `head` does.
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => return Ok(true),
        Err(error) => return Err(lost(error)),
    }
    if options.out.is_none() {
        output::line("");
    }
    Ok(true)
}

fn place(file: Option<&Path>) -> PathBuf {
    file.map_or_else(|| "the answer".into(), Path::to_owned)
}

fn body(text: &str) -> Result<String, Failure> {
    let failed = |path: &str, source| Failure::File { path: path.into(), source };
    let content = match text.strip_prefix('@') {
        Some(file) => std::fs::read_to_string(file).map_err(|error| failed(file, error))?,
        None if text == "-" => {
            std::io::read_to_string(std::io::stdin()).map_err(|error| failed("stdin", error))?
        }
        None => text.to_owned(),
    };
    // An error of the caller, and not of the agent.
    serde_json::from_str::<Value>(&content).map_err(|_| Failure::Body { text: content.clone() })?;
    Ok(content)
}

/// Lists the operations.
fn list(options: &ApiOptions) -> Result<bool, Failure> {
    let request = Request { method: "GET", path: BASE, ..Request::default() };
    let response = options.agent.request(options.role, &request)?;
    let failed = |source| Failure::File { path: place(None), source };
    let index: Value = serde_json::from_reader(response.body).map_err(|error| failed(error.into()))?;
    if options.json {
        output::document("slate.api/1", &index);
        return Ok(true);
    }
    let operations = index.get("operations").and_then(Value::as_array).into_iter().flatten();
    let row = |operation: &Value| {
        ["method", "path", "role", "summary"].map(|name| {
            let text = operation.get(name).and_then(Value::as_str).unwrap_or_default();
            text.strip_prefix(BASE).filter(|rest| rest.starts_with('/')).unwrap_or(text).to_owned()
        })
    };
    let head = ["method", "path", "for", "summary"].map(String::from);
    output::columns([head].into_iter().chain(operations.map(row)));
    Ok(true)
}
