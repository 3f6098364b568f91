//! Answers of operations as HTTP responses.

use std::convert::Infallible;
use std::fs::File;
use std::io::Read;
use std::pin::Pin;
use std::task::{Context as Task, Poll};

use hyper::body::{Body as HttpBody, Bytes, Frame, SizeHint};
use hyper::header::{HeaderName, HeaderValue};
use hyper::{Response, StatusCode};
use serde_json::{Value as Json, json};
use tokio::sync::mpsc;

use crate::problem::Problem;
use crate::stream::ValueStream;

/// Answer of an operation.
pub enum OperationAnswer {
    /// JSON, with its version tag.
    Json(StatusCode, Json, Option<String>),
    /// Bytes of a media type.
    Bytes(&'static str, Vec<u8>),
    /// Beginning of a file: the open file and its length, bytes.
    File(File, u64),
    /// Stream, which continues until the client leaves.
    ValueStream(ValueStream),
    /// Empty answer.
    Nothing,
}

impl OperationAnswer {
    /// Creates an answer of JSON with status 200.
    pub fn json(value: Json) -> Self {
        Self::Json(StatusCode::OK, value, None)
    }

    /// Creates an answer of plain text.
    pub fn text(text: String) -> Self {
        Self::Bytes("text/plain; charset=utf-8", text.into_bytes())
    }
}

/// Body of an answer.
#[derive(Debug)]
pub enum ResponseBody {
    /// Whole content; `None` when it is empty or was sent.
    Whole(Option<Bytes>),
    /// Pieces as they come.
    Stream(mpsc::Receiver<Bytes>),
}

impl ResponseBody {
    /// Creates a body that is sent as a whole.
    pub fn of(bytes: impl Into<Bytes>) -> Self {
        Self::Whole(Some(bytes.into()).filter(|bytes: &Bytes| !bytes.is_empty()))
    }
}

impl HttpBody for ResponseBody {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        self: Pin<&mut Self>,
        task: &mut Task<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        match self.get_mut() {
            Self::Whole(bytes) => Poll::Ready(bytes.take().map(|bytes| Ok(Frame::data(bytes)))),
            Self::Stream(receiver) => {
                receiver.poll_recv(task).map(|bytes| bytes.map(|bytes| Ok(Frame::data(bytes))))
            }
        }
    }

    fn is_end_stream(&self) -> bool {
        matches!(self, Self::Whole(None))
    }

    fn size_hint(&self) -> SizeHint {
        match self {
            Self::Whole(bytes) => SizeHint::with_exact(bytes.as_ref().map_or(0, |bytes| bytes.len() as u64)),
            Self::Stream(_) => SizeHint::default(),
        }
    }
}

/// Security headers of every response to a browser.
/// They permit no other origins, no embedding in frames and no caching.
const SECURITY_HEADERS: [(&str, &str); 7] = [
    (
        "content-security-policy",
        "default-src 'self'; img-src 'self' data: blob:; object-src 'none'; base-uri 'none'; form-action 'none'; \
         frame-ancestors 'none'",
    ),
    ("x-content-type-options", "nosniff"),
    ("referrer-policy", "no-referrer"),
    ("cross-origin-opener-policy", "same-origin"),
    ("cross-origin-resource-policy", "same-origin"),
    ("cache-control", "no-store"),
    ("x-frame-options", "DENY"),
];

/// Creates a response with the common headers.
pub fn response(status: StatusCode, kind: &str, body: ResponseBody) -> Response<ResponseBody> {
    let mut response = Response::new(body);
    *response.status_mut() = status;
    let headers = response.headers_mut();
    for (name, value) in SECURITY_HEADERS {
        headers.insert(HeaderName::from_static(name), HeaderValue::from_static(value));
    }
    if let Ok(kind) = HeaderValue::from_str(kind) {
        headers.insert(hyper::header::CONTENT_TYPE, kind);
    }
    response
}

/// Creates a response of JSON.
pub fn json_response(status: StatusCode, value: &Json) -> Response<ResponseBody> {
    response(status, "application/json", ResponseBody::of(value.to_string()))
}

impl Problem {
    /// Returns the response that reports it.
    pub fn response(&self) -> Response<ResponseBody> {
        let body = ResponseBody::of(self.json().to_string());
        let mut response = response(self.status, "application/problem+json", body);
        for (name, value) in &self.headers {
            if let Ok(value) = HeaderValue::from_str(value) {
                response.headers_mut().insert(HeaderName::from_static(name), value);
            }
        }
        response
    }
}

/// Media type of bytes that are no text and that no browser shows.
pub const OCTET_STREAM: &str = "application/octet-stream";

/// Size of the chunks in which a file is sent, bytes.
const CHUNK_SIZE: u64 = 256 << 10;

/// Sends a file, piece by piece.
async fn send(mut file: File, mut left: u64, sender: mpsc::Sender<Bytes>) {
    while left > 0 {
        let length = left.min(CHUNK_SIZE);
        let read = tokio::task::spawn_blocking(move || {
            let mut piece = vec![0; length as usize];
            file.read_exact(&mut piece).map(|()| (file, piece))
        });
        // An unreadable part is missing in the answer, whose length is declared.
        let Ok(Ok((back, piece))) = read.await else { return };
        file = back;
        left -= length;
        if sender.send(piece.into()).await.is_err() {
            return;
        }
    }
}

/// Converts an answer that is sent as a whole.
pub fn whole(answer: OperationAnswer) -> Response<ResponseBody> {
    match answer {
        OperationAnswer::Json(status, value, version) => {
            let mut response = json_response(status, &value);
            if let Some(version) = version.and_then(|version| HeaderValue::from_str(&version).ok()) {
                response.headers_mut().insert(hyper::header::ETAG, version);
            }
            response
        }
        OperationAnswer::Bytes(kind, bytes) => response(StatusCode::OK, kind, ResponseBody::of(bytes)),
        OperationAnswer::File(file, length) => {
            // One piece that waits, and one on its way: a slow reader slows the production.
            let (sender, receiver) = mpsc::channel(1);
            tokio::spawn(send(file, length, sender));
            let mut response = response(StatusCode::OK, OCTET_STREAM, ResponseBody::Stream(receiver));
            // A client that receives fewer bytes detects the loss.
            response.headers_mut().insert(hyper::header::CONTENT_LENGTH, length.into());
            response
        }
        OperationAnswer::Nothing => json_response(StatusCode::OK, &json!({})),
        OperationAnswer::ValueStream(follow) => {
            let (kind, receiver) = follow.begin();
            response(StatusCode::OK, kind, ResponseBody::Stream(receiver))
        }
    }
}
