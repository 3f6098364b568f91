//! Connection header of TCPROS, and framed messages.
//! Both ends of a connection exchange the header first.

use std::io;

use slate_sorted::SortedMap;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};

/// Bytes that a header may have.
const MAX_HEADER_BYTES: u32 = 1 << 20;

/// Names and values, such as `topic` and `md5sum`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ConnectionHeader(SortedMap<String, String>);

impl ConnectionHeader {
    /// Creates a header of fields.
    pub fn of<'a>(fields: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        Self(fields.into_iter().map(|(name, value)| (name.to_owned(), value.to_owned())).collect())
    }

    /// Returns the value of a field; empty without it.
    pub fn get(&self, name: &str) -> &str {
        self.0.get(name).map_or("", String::as_str)
    }

    /// Returns the value of a field, safe for a log.
    pub fn shown(&self, name: &str) -> String {
        self.get(name).chars().filter(char::is_ascii_graphic).take(100).collect()
    }

    /// Returns whether the other end takes a type and its checksum; it may take any.
    pub fn takes(&self, of: &str, checksum: &str) -> bool {
        let is_any = |name: &str| matches!(self.get(name), "" | "*");
        (is_any("type") || self.get("type") == of)
            && (self.get("md5sum") == "*" || self.get("md5sum") == checksum)
    }

    /// Sends it.
    ///
    /// # Errors
    /// When the connection is lost.
    pub async fn write(&self, stream: &mut (impl AsyncWrite + Unpin)) -> io::Result<()> {
        let mut bytes = vec![0; 4];
        for (name, value) in &self.0 {
            bytes.extend(length(name.len() + 1 + value.len())?);
            bytes.extend_from_slice(format!("{name}={value}").as_bytes());
        }
        let whole = length(bytes.len() - 4)?;
        bytes[..4].copy_from_slice(&whole);
        stream.write_all(&bytes).await
    }

    /// Receives one.
    ///
    /// # Errors
    /// When the connection is lost, or the data are no header.
    pub async fn read(stream: &mut (impl AsyncRead + Unpin)) -> io::Result<Self> {
        let bytes = read_message(stream, MAX_HEADER_BYTES).await?;
        let mut rest = &bytes[..];
        let mut fields = SortedMap::new();
        while let Some((length, behind)) = rest.split_first_chunk::<4>() {
            let length = u32::from_le_bytes(*length) as usize;
            let field = behind.get(..length).ok_or_else(|| wrong("a field of a header is too long"))?;
            let field = String::from_utf8_lossy(field);
            let (name, value) =
                field.split_once('=').ok_or_else(|| wrong("a field of a header has no `=`"))?;
            fields.insert(name.to_owned(), value.to_owned());
            rest = &behind[length..];
        }
        if rest.is_empty() { Ok(Self(fields)) } else { Err(wrong("a header ends within a length")) }
    }
}

/// Encodes the length before a message.
///
/// # Errors
/// When it does not fit.
pub fn length(length: usize) -> io::Result<[u8; 4]> {
    u32::try_from(length).map(u32::to_le_bytes).map_err(|_| wrong("it is longer than a message can be"))
}

/// Receives a message, without the length before it.
/// Memory is allocated as the bytes arrive.
///
/// # Errors
/// When the connection is lost, or the message is longer than `most`.
pub async fn read_message(stream: &mut (impl AsyncRead + Unpin), most: u32) -> io::Result<Vec<u8>> {
    let length = stream.read_u32_le().await?;
    if length > most {
        return Err(wrong(&format!("a message would have {length} bytes, more than {most}")));
    }
    let mut message = Vec::new();
    stream.take(length.into()).read_to_end(&mut message).await?;
    if message.len() < length as usize {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    Ok(message)
}

/// Returns the text that the other end of a topic has another message type.
pub fn mismatch(topic: &str, role: &str, theirs: &ConnectionHeader, of: &str, checksum: &str) -> String {
    let [node, their_type, sum] = ["callerid", "type", "md5sum"].map(|name| theirs.shown(name));
    format!(
        "{topic}: a {role}, {node}, has type {their_type} ({sum}) and this agent {of} ({checksum}), so they exchange nothing: \
         use another topic or interface"
    )
}

/// Creates the error of invalid data from the other end.
pub fn wrong(reason: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, reason)
}
